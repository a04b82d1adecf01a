#!/usr/bin/env bash
# Runs peer.py, a node of another DDS implementation, with the arguments given: see there. Without arguments it only
# makes sure that it could.
# Makes a virtual environment in the user's cache on first use and whenever the requirements change.
# Exit code 77: python3 or the packages cannot be had here.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cache=${XDG_CACHE_HOME:-$HOME/.cache}/trajectory-selector
venv=$cache/venv-interop
unavailable() { echo "interop: $1" >&2; exit 77; }

command -v python3 >/dev/null || unavailable "python3 is not installed"
wanted=$(cat "$here/requirements.txt" <(python3 --version) | sha256sum | cut -d' ' -f1)

mkdir -p "$cache"
# Two runs at once must not build the same environment.
exec 9>"$cache/venv-interop.lock"
if command -v flock >/dev/null; then flock 9; fi
if [ "$(cat "$venv/requirements.sha256" 2>/dev/null)" != "$wanted" ]; then
  rm -rf "$venv"
  python3 -m venv "$venv" >&2 || unavailable "python3 cannot make a virtual environment"
  "$venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    --requirement "$here/requirements.txt" >&2 || unavailable "the packages cannot be installed"
  echo "$wanted" >"$venv/requirements.sha256"
fi
exec 9>&-

[ $# -gt 0 ] || exit 0
export PYTHONDONTWRITEBYTECODE=1
exec "$venv/bin/python" "$here/peer.py" "$@"
