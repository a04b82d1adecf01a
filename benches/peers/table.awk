# Lines of the table of run.sh, from what one peer's script printed: peer, outcome, what, its figure, ours, ratio.
function line(what, theirs, ours, ratio) {
    printf "%s\t%s\t%s\t%s\t%s\t%.1f\n", peer, outcome, what, theirs, ours, ratio
    lines++
}
# collision: a heading with the agreement, then the peer, then ours for each number of threads
/first hits agree/ { split($1, path, "/"); scene = path[length(path)]; sub(/\.bin:$/, "", scene); agree = $6 "/" $8; sub(/;$/, "", agree) }
/peer, 1 thread:/ { prebuilt = $4; whole = $7 }
/ours, 1 thread/ {
    line(scene ", prebuilt, agree " agree, prebuilt " ms", $4 " ms", prebuilt / $4)
    line(scene ", end to end", whole " ms", $9 " ms", whole / $9)
}
# What the peer is given it need not decode, so its time is that of end to end.
/ours, from messages:/ { line(scene ", end to end, ours decoding", whole " ms", $4 " ms", whole / $4) }
# map: one line for each file
peer == "map" && NF == 7 && $1 ~ /\.(bin|osm)$/ { line($1, $5 " s", $6 " s", $7) }
# frenetix
peer == "frenetix" && /^  peer:/ { whole = $2; checks = $NF }
peer == "frenetix" && /^  ours:/ {
    line("one candidate, points and checks", whole " us", $2 " us", whole / $2)
    line("one candidate, its checks alone", checks " us", $2 " us", checks / $2)
}
END { if (!lines) printf "%s\t%s\tnothing was compared\t\t\t\n", peer, outcome }
