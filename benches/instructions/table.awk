# upstream.tsv and filters.tsv to the table of docs/performance.md.
function thousands(n,    text) {
    text = sprintf("%d", n)
    while (match(text, /[0-9][0-9][0-9][0-9](,|$)/)) text = substr(text, 1, RSTART) "," substr(text, RSTART + 1)
    return text
}
function row(scene, name, upstream, ours, said) {
    if (upstream) printf "| %s | %s | %s | %s | %s | %.1f |\n", scene, name, said, thousands(upstream), thousands(ours), upstream / ours
    else printf "| %s | %s | %s | | %s | |\n", scene, name, said, thousands(ours)
}
/^#/ { next }
FNR == NR { upstream[$1, $2] = $3; next }
FNR == 1 {
    print "| scene | filter | accepted, rejected | upstream | ours | times fewer |"
    print "|---|---|---|---|---|---|"
}
{
    scene = $1
    sub(/^bench_/, "", scene)
    if (($1, $2) in upstream) {
        row(scene, "`" $2 "`", upstream[$1, $2], $3, $4 ", " $5)
        theirs[$1] += upstream[$1, $2]
        four[$1] += $3
        if (++count[$1] == 4) row(scene, "**these four**", theirs[$1], four[$1], "")
    } else if ($2 == "all") {
        row(scene, "**all, beside upstream's four**", theirs[$1], $3, $4 ", " $5)
    } else {
        row(scene, "`" $2 "`", 0, $3, $4 ", " $5)
    }
}
