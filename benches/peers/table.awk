# Lines of the table of run.sh, from what one peer's script printed.
function line(what, theirs, ours, ratio) {
    printf "%-10s %-7s %-34s %14s %14s %10.1f\n", peer, outcome, what, theirs, ours, ratio
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
/ours, from messages:/ { line(scene ", end to end, decoding", whole " ms", $4 " ms", whole / $4) }
# map: one line for each file
peer == "map" && NF == 7 && $1 ~ /\.(bin|osm)$/ { line($1, $5 " s", $6 " s", $7) }
END { if (!lines) printf "%-10s %-7s nothing was compared\n", peer, outcome }
