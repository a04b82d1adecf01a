#!/usr/bin/env bash
# Loads the same map files with Lanelet2's C++ reader (from the PyPI wheel) and with ours, and prints both times.
#
#   benches/peers/map/run.sh [MAP.osm]        environment: RUNS (default 15), COPIES (default 16)
#
# MAP.osm defaults to the largest test map, found below $SELECTOR_SHARED or ../shared.
# The Python environment and the prepared maps live in ${XDG_CACHE_HOME:-~/.cache}/trajectory-selector.
set -euo pipefail

root=$(cd "$(dirname "$0")/../../.." && pwd)
shared=${SELECTOR_SHARED:-$root/../shared}
map=${1:-$shared/data/maps/autoware_universe/bidirectional_traffic.osm}
cache=${XDG_CACHE_HOME:-$HOME/.cache}/trajectory-selector
python=$cache/venv-map/bin/python

[ -f "$map" ] || { echo "no map at $map: give the path of an .osm file" >&2; exit 2; }
if ! "$python" -c 'import lanelet2' 2>/dev/null; then
    mkdir -p "$cache"
    python3 -m venv "$cache/venv-map"
    "$python" -m pip install --quiet "lanelet2==1.2.3"
fi
(cd "$root" && cargo build --quiet --release -p lanelet-map --example time_map_load --example write_archive)
target=${CARGO_TARGET_DIR:-$root/target}
exec "$python" "$root/benches/peers/map/compare.py" --ours "$target/release/examples/time_map_load" \
    --writer "$target/release/examples/write_archive" --work "$cache/map-bench" --runs "${RUNS:-15}" --copies "${COPIES:-16}" "$map"
