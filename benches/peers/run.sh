#!/bin/sh
# Sets up every program that does a part of the same job, runs it side by side with ours on the same machine, and ends with
# a table: what was compared, whether the answers agree, how many times as fast.
#
#   benches/peers/run.sh                 all of them
#   benches/peers/run.sh collision map   only these
#   benches/peers/run.sh --record        all of them; writes the table in docs/performance.md anew
#
# Times mean something on an otherwise idle machine only: it says so when the load is high. Ends with 1 if a peer could not
# be run or its answers differ from ours; nothing is recorded then. Needs cargo, python3 with venv, the folder ../shared
# (SELECTOR_SHARED names another one), and the network once.
set -eu

cd "$(dirname "$0")/../.."
record=''
[ "${1:-}" != --record ] || { record=yes; shift; }
[ $# -gt 0 ] || set -- collision map frenetix
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

load="$(cut -d ' ' -f 1 /proc/loadavg 2>/dev/null || echo 0)"
if awk -v load="$load" 'BEGIN { exit !(load > 0.5) }'; then
    echo "the load is $load: take the times below for no more than an order of magnitude" >&2
fi
status=0
for peer in "$@"; do
    [ -x "benches/peers/$peer/run.sh" ] || { echo "no such peer: $peer" >&2; exit 2; }
    echo "== $peer" >&2
    if "benches/peers/$peer/run.sh" > "$work/$peer" 2> "$work/$peer.err"; then
        outcome=ran
    else
        outcome=failed
        status=1
        cat "$work/$peer.err" >&2
    fi
    cat "$work/$peer" >&2
    awk -v peer="$peer" -v outcome="$outcome" -f benches/peers/table.awk "$work/$peer" >> "$work/table.tsv"
done
awk -F '\t' '
    BEGIN { printf "%-10s %-7s %-36s %14s %14s %10s\n", "peer", "outcome", "what", "peer", "ours", "times fast" }
    { printf "%-10s %-7s %-36s %14s %14s %10s\n", $1, $2, $3, $4, $5, $6 }
' "$work/table.tsv"

[ -n "$record" ] && [ $status = 0 ] || exit $status
{
    echo "Run on $(date -I), $(nproc) cores, load $load when it began. Peers and ours on one thread."
    echo
    echo '| peer | what | peer | ours | times as fast |'
    echo '|---|---|---|---|---|'
    awk -F '\t' '{ printf "| %s | %s | %s | %s | %s |\n", $1, $3, $4, $5, $6 }' "$work/table.tsv"
} > "$work/table.md"
awk -v table="$work/table.md" '
    /^<!-- peers: / { print; while ((getline line < table) > 0) print line; skip = 1 }
    /^<!-- end of peers -->/ { skip = 0 }
    !skip
' docs/performance.md > "$work/performance.md"
cp "$work/performance.md" docs/performance.md
