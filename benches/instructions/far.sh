#!/bin/sh
# Counts the instructions of a whole cycle of 64 candidates with valgrind's callgrind, where 50 road users are near and
# 0, 500 or 5,000 more are kilometres away. Prints one line for each scene: the counts in millions.
#
# Needs what run.sh needs. PROGRAM names a built `filters` benchmark; without it, it is built. FILTER is `all` by default.
set -eu

cd "$(dirname "$0")/../.."
scenes="${SELECTOR_SHARED:-../shared}/golden/bench"
[ -d "$scenes" ] || { echo "the recorded scenes are missing: $scenes" >&2; exit 1; }
command -v valgrind >/dev/null || { echo "valgrind is missing: install it" >&2; exit 1; }

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
if [ -z "${PROGRAM:-}" ]; then
    cargo bench --no-run --bench filters > "$work/build" 2>&1 || { cat "$work/build" >&2; exit 1; }
    PROGRAM="$(sed -n 's/.*(\(.*filters-[0-9a-f]*\)).*/\1/p' "$work/build")"
fi
[ -x "$PROGRAM" ] || { echo "no program that can be run: $PROGRAM" >&2; exit 1; }

printf '| scene | 0 far | 500 far | 5,000 far |\n|---|---|---|---|\n'
for scene in "$scenes"/*.json; do
    printf '| %s |' "$(basename "$scene" .json | sed 's/^bench_//')"
    for far in 0 500 5000; do
        valgrind --tool=callgrind --toggle-collect='filters::counted_cycle*' --callgrind-out-file=/dev/null \
            "$PROGRAM" count "$scene" "${FILTER:-all}" "$far" > "$work/out" 2>&1 || { cat "$work/out" >&2; exit 1; }
        awk '/ Collected : / { printf " %.1f |", $NF / 1e6 }' "$work/out"
    done
    printf '\n'
done
