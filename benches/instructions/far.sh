#!/bin/sh
# Counts the instructions that a candidate costs with all filters, and with the collision check alone, when 0, 50, 500 and
# 5,000 road users more are in the scene, kilometres away from every candidate. What a cycle does once, whatever the number
# of candidates, is in it: it is divided by the 64 candidates of the scene.
#
#   far.sh [SCENE]     a name in ../shared/golden/bench (SELECTOR_SHARED names another folder), default bench_large_clear
#
# Needs cargo and valgrind. PROGRAM names a built `filters` benchmark; without it, it is built.
set -eu

cd "$(dirname "$0")/../.."
scene="${SELECTOR_SHARED:-../shared}/golden/bench/${1:-bench_large_clear}.json"
[ -f "$scene" ] || { echo "the recorded scene is missing: $scene" >&2; exit 1; }
command -v valgrind >/dev/null || { echo "valgrind is missing: install it" >&2; exit 1; }
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
if [ -z "${PROGRAM:-}" ]; then
    cargo bench --no-run --bench filters > "$work/build" 2>&1 || { cat "$work/build" >&2; exit 1; }
    PROGRAM="$(sed -n 's/.*(\(.*filters-[0-9a-f]*\)).*/\1/p' "$work/build")"
fi
program="$PROGRAM"
[ -x "$program" ] || { echo "no program that can be run: $program" >&2; exit 1; }

# Instructions of the functions whose name is $3 for each candidate, with $2 more road users.
counted() {
    valgrind --tool=callgrind --toggle-collect="$3" --callgrind-out-file=/dev/null \
        "$program" count "$scene" "$1" "$2" > "$work/out" 2> "$work/err" || { cat "$work/err" >&2; exit 1; }
    awk 'FILENAME ~ /out$/ && $1 == "candidates" { candidates = $2 }
         / Collected : / { printf "%d", $NF / candidates }' "$work/out" "$work/err"
}

printf '%-24s %10s %16s %16s\n' filter "far away" "whole cycle" "each of them"
for filter in collision_check_filter all; do
    for far in 0 50 500 5000; do
        whole="$(counted "$filter" "$far" 'filters::counted_cycle*')"
        [ "$far" -gt 0 ] || none="$whole"
        awk -v filter="$filter" -v far="$far" -v whole="$whole" -v none="$none" 'BEGIN {
            printf "%-24s %10d %16d %16s\n", filter, far, whole, far ? sprintf("%.0f", (whole - none) / far) : "-"
        }'
    done
done
