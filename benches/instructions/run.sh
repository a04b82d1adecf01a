#!/bin/sh
# Counts the instructions that each filter spends on a candidate, with valgrind's callgrind on `benches/filters.rs`, and
# says by how many percent they differ from the recorded ones (`filters.tsv`). Counts hardly depend on the machine and
# not at all on its load. Ends with 1 if something costs more than MOST_PERCENT (5) more than recorded.
#
#   run.sh           compare
#   run.sh --record  compare, then record the new counts and write the table in docs/performance.md anew
#
# Needs cargo, valgrind, and the recorded scenes in ../shared/golden/bench (SELECTOR_SHARED names another folder).
# PROGRAM names a built `filters` benchmark; without it, it is built.
set -eu

cd "$(dirname "$0")/../.."
here=benches/instructions
scenes="${SELECTOR_SHARED:-../shared}/golden/bench"
filters="crosswalk_filter traffic_light_filter uncrossable_boundary_departure_filter vehicle_constraint_filter
    collision_check_filter out_of_lane_filter data_validity all"
[ -d "$scenes" ] || { echo "the recorded scenes are missing: $scenes" >&2; exit 1; }
command -v valgrind >/dev/null || { echo "valgrind is missing: install it" >&2; exit 1; }

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
if [ -z "${PROGRAM:-}" ]; then
    cargo bench --no-run --bench filters > "$work/build" 2>&1 || { cat "$work/build" >&2; exit 1; }
    PROGRAM="$(sed -n 's/.*(\(.*filters-[0-9a-f]*\)).*/\1/p' "$work/build")"
fi
program="$PROGRAM"
[ -x "$program" ] || { echo "no program that can be run: $program" >&2; exit 1; }

for scene in "$scenes"/*.json; do
    name="$(basename "$scene" .json)"
    for filter in $filters; do
        valgrind --tool=callgrind --toggle-collect='filters::counted_cycle*' --callgrind-out-file=/dev/null \
            "$program" count "$scene" "$filter" > "$work/out" 2> "$work/err" || { cat "$work/err" >&2; exit 1; }
        awk -v scene="$name" -v filter="$filter" '
            FILENAME ~ /out$/ && $1 == "candidates" { candidates = $2; feasible = $4 }
            / Collected : / { instructions = $NF }
            END { printf "%s\t%s\t%d\t%d\t%d\n", scene, filter, instructions / candidates, feasible, candidates - feasible }
        ' "$work/out" "$work/err" | tee -a "$work/new.tsv" >&2
    done
done

status=0
awk -F '\t' -v most="${MOST_PERCENT:-5}" '
    FNR == NR { recorded[$1, $2] = $3; next }
    ($1, $2) in recorded {
        drift = 100 * ($3 / recorded[$1, $2] - 1)
        printf "%-26s %-40s %9d recorded %9d %+7.2f %%\n", $1, $2, $3, recorded[$1, $2], drift
        worse += drift > most
        next
    }
    { printf "%-26s %-40s %9d not recorded\n", $1, $2, $3 }
    END { exit worse > 0 }
' "$here/filters.tsv" "$work/new.tsv" || status=1

[ "${1:-}" = --record ] || exit $status
cp "$work/new.tsv" "$here/filters.tsv"
awk -F '\t' -f "$here/table.awk" "$here/upstream.tsv" "$here/filters.tsv" > "$work/table.md"
awk -v table="$work/table.md" '
    /^<!-- filters: / { print; while ((getline line < table) > 0) print line; skip = 1 }
    /^<!-- end of filters -->/ { skip = 0 }
    !skip
' docs/performance.md > "$work/performance.md"
cp "$work/performance.md" docs/performance.md
