# To be sourced, with `here` the folder of a requirements.txt and `name` the name of what it is for: makes a virtual
# environment in the user's cache on first use and whenever the requirements change, and sets `python`.
# Ends with exit code 77 where python3 or the packages cannot be had.
cache=${XDG_CACHE_HOME:-$HOME/.cache}/trajectory-selector
venv=$cache/venv-$name
python=$venv/bin/python
unavailable() { echo "$name: $1" >&2; exit 77; }

command -v python3 >/dev/null || unavailable "python3 is not installed"
wanted=$(cat "$here/requirements.txt" <(python3 --version) | sha256sum | cut -d' ' -f1)

mkdir -p "$cache"
# Two runs at once must not build the same environment.
exec 9>"$cache/venv-$name.lock"
if command -v flock >/dev/null; then flock 9; fi
if [ "$(cat "$venv/requirements.sha256" 2>/dev/null)" != "$wanted" ]; then
  rm -rf "$venv"
  python3 -m venv "$venv" >&2 || unavailable "python3 cannot make a virtual environment"
  "$python" -m pip install --quiet --disable-pip-version-check \
    --requirement "$here/requirements.txt" >&2 || unavailable "the packages cannot be installed"
  echo "$wanted" >"$venv/requirements.sha256"
fi
exec 9>&-
