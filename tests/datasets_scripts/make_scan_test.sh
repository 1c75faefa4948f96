#!/usr/bin/env bash
# make_scan from the outside: file and pipe agree, errors are one clear line, nothing half-written stays.
#   make_scan_test.sh MAKE_SCAN WORK_DIR
set -euo pipefail
make_scan=$1 work=$2
rm -rf "$work"
mkdir -p "$work"
cd "$work"

fail() { echo "FAILED: $*"; exit 1; }

# Runs make_scan; checks the exit status, and that stderr is one line that contains the text.
refuses() {
    local status=$1 text=$2
    shift 2
    local got=0
    "$make_scan" "$@" >out.txt 2>err.txt || got=$?
    [ "$got" -eq "$status" ] || fail "$*: exit status $got, not $status"
    [ "$(wc -l <err.txt)" -eq 1 ] || fail "$*: $(wc -l <err.txt) lines on stderr"
    grep -q -- "$text" err.txt || fail "$*: '$(cat err.txt)' does not say '$text'"
}

"$make_scan" --triangles 30000 --seed 9 --colour -o file.ply
"$make_scan" --triangles 30000 --seed 9 --colour -o - | cat >pipe.ply
cmp file.ply pipe.ply || fail "a pipe gives other bytes than a file"
head -c 400 file.ply | grep -aq '^element face 30000$' || fail "the header does not say 30000 faces"
"$make_scan" --help | grep -- --triangles >/dev/null || fail "--help"

"$make_scan" --shape dog --triangles 20000 -o dog.obj
"$make_scan" --shape dog --triangles 20000 -o - | cmp - dog.obj || fail "a dog through a pipe is another one"
faces=$(grep -c '^f ' dog.obj)
[ "$faces" -gt 18000 ] && [ "$faces" -lt 22000 ] || fail "a dog of $faces triangles"
[ "$(grep -c '^vt ' dog.obj)" -eq $((3 * faces)) ] || fail "a dog without all texture coordinates"

# A scan with a picture: as many triangles, each with places inside the picture; the picture is as large as asked for.
"$make_scan" --triangles 12000 --texture 300 -o textured.obj
[ "$(grep -c '^f ' textured.obj)" -eq 12000 ] || fail "$(grep -c '^f ' textured.obj) faces with texture"
[ "$(grep -c '^vt ' textured.obj)" -eq 36000 ] || fail "$(grep -c '^vt ' textured.obj) places"
grep '^vt ' textured.obj | awk '$2 < 0 || $2 > 1 || $3 < 0 || $3 > 1 { exit 1 }' || fail "places beyond the picture"
grep -q '^mtllib textured.mtl$' textured.obj && grep -q '^map_Kd textured.png$' textured.mtl || fail "textured.mtl"
[ "$(od -An -tx1 -j16 -N8 textured.png | tr -d ' ')" = 0000012c0000012c ] || fail "a picture of another size"
"$make_scan" --triangles 12000 --texture 300 --jpeg -o textured.obj
"$make_scan" --triangles 12000 --texture 300 --jpeg -o textured.obj || fail "a JPEG is not replaced by a JPEG"
[ "$(od -An -tx1 -N2 textured.jpg | tr -d ' ')" = ffd8 ] || fail "textured.jpg is no JPEG"
grep -q '^map_Kd textured.jpg$' textured.mtl || fail "textured.mtl does not name the JPEG"
echo "a user's own" >mine.jpg
refuses 1 "mine.jpg: is there" --texture 300 --jpeg -o mine.obj
refuses 2 "must end in .obj" --texture 300 -o x.ply
refuses 2 "without --colour" --texture 300 --utm -o x.obj
refuses 2 "a pipe" --texture 300 -o -
refuses 2 "wants --texture" --jpeg -o x.obj
refuses 2 "256 to 32768" --texture 40000 -o x.obj
refuses 2 "of the statue" --shape dog --texture 300 -o x.obj

refuses 2 "statue or dog" --shape cat -o x.obj
refuses 2 "of the statue" --shape dog --seed 3 -o x.obj
refuses 2 "at most 200000" --shape dog --triangles 1M -o x.obj
refuses 2 "-o FILE is missing" --triangles 10000
refuses 2 "10000 to 1000000000" --triangles 9999 -o x.ply
refuses 2 "10000 to 1000000000" --triangles 1000000001 -o x.ply
refuses 2 "10000 to 1000000000" --triangles 1e5 -o x.ply
refuses 2 "--seed wants" --seed -1 -o x.ply
refuses 2 "wants a value" -o
refuses 2 "unknown option '--colors'" --colors -o x.ply
refuses 1 "missing/x.ply: cannot write here" -o missing/x.ply
refuses 2 "must end in .ply" -o x.vcp
echo "a user's own" >notes.ply
refuses 1 "notes.ply: is there and is not a PLY mesh" -o notes.ply
refuses 1 "No space left" -o /dev/full
[ -e /dev/full ] || fail "/dev/full was removed"

# A file size limit stands in for a full disk; the old file must survive.
printf "ply\ncomment procedural\nold\n" >kept.ply
status=0
(trap '' XFSZ; ulimit -f 100; exec "$make_scan" --triangles 100000 -o kept.ply) 2>err.txt || status=$?
[ "$status" -eq 1 ] || fail "full disk: exit status $status"
grep -q "kept.ply: write failed" err.txt || fail "full disk: $(cat err.txt)"
[ "$(tail -n 1 kept.ply)" = old ] || fail "full disk: the old file was touched"
[ ! -e kept.ply.partial ] || fail "full disk: kept.ply.partial was left"

# A reader that goes away is an error, not a signal.
status=0
{ "$make_scan" --triangles 1000000 -o - 2>err.txt || echo $? >status.txt; } | head -c 10 >/dev/null
[ "$(cat status.txt)" = 1 ] || fail "closed pipe: exit status $(cat status.txt)"
grep -q "Broken pipe" err.txt || fail "closed pipe: $(cat err.txt)"

# The same memory for a hundred times the triangles: both fit a limit that neither mesh would.
(ulimit -v 65536; exec "$make_scan" --triangles 10000 -o - >/dev/null) || fail "10 thousand in 64 MiB"
(ulimit -v 65536; exec "$make_scan" --triangles 4000000 -o - >/dev/null) || fail "4 million in 64 MiB"
echo passed
