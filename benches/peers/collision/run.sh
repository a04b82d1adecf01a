#!/bin/sh
# Compares the batched box test with commonroad-drivability-checker on the same workloads: first hits and times.
# Needs cargo, python3 with venv, and the network once. Targets: 4 times as fast with everything prebuilt, 20 times
# end to end, from positions and from serialised messages. Run it on an otherwise idle machine.
set -eu

cd "$(dirname "$0")/../../.."
cache="${XDG_CACHE_HOME:-$HOME/.cache}/trajectory-selector"
venv="$cache/venv-collision"
work="$cache/collision"
peer="commonroad-drivability-checker==2025.4.0"

mkdir -p "$work"
if ! "$venv/bin/python" -c 'import commonroad_dc' 2>/dev/null; then
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet "$peer"
fi
cargo build --quiet --release -p motion --example first_collision
ours="${CARGO_TARGET_DIR:-target}/release/examples/first_collision"
"$ours" write "$work"
status=0
for density in sparse mixed near; do
    "$ours" run "$work/$density.bin" > "$work/$density.txt" 2>> "$work/ours.log"
    # The peer reports thousands of leaked objects when it ends; they say nothing here.
    "$venv/bin/python" benches/peers/collision/compare.py "$work/$density.bin" "$work/$density.txt" \
        2> "$work/peer.log" || status=1
done
exit $status
