#!/bin/sh
# Times the checks of Frenetix (its C++ core, from PyPI) for what a vehicle can do, beside ours. Needs cargo, python3 with
# venv, the recorded scenes in ../shared/golden/bench (SELECTOR_SHARED names another folder), and the network once.
set -eu

cd "$(dirname "$0")/../../.."
cache="${XDG_CACHE_HOME:-$HOME/.cache}/trajectory-selector"
python="$cache/venv-frenetix/bin/python"

if ! "$python" -c 'import frenetix' 2>/dev/null; then
    mkdir -p "$cache"
    python3 -m venv "$cache/venv-frenetix"
    "$python" -m pip install --quiet "frenetix==0.4.0"
fi
cargo bench --quiet --bench filters > "$cache/filters.txt"
exec "$python" benches/peers/frenetix/compare.py "$cache/filters.txt"
