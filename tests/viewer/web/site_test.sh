#!/usr/bin/env bash
# `vcp publish` and `vcp serve`: site_test.sh NODE SOURCE_FOLDER VCP MAKE_SCAN FOLDER
set -euo pipefail
node=$1 source=$2 vcp=$3 make_scan=$4 folder=$5
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
rm -rf "$folder"
mkdir -p "$folder/viewer"
cd "$folder"

fail() {
    echo "site_test: $*" >&2
    exit 1
}
# expect STATUS TEXT COMMAND...: one line on stderr with the text, and that status.
expect() {
    local status=$1 text=$2 got=0
    shift 2
    "$@" >out.txt 2>err.txt || got=$?
    [ "$got" = "$status" ] || fail "status $got instead of $status: $* ($(cat err.txt))"
    grep -qF -- "$text" err.txt || fail "no '$text' in: $(cat err.txt)"
    [ "$(wc -l <err.txt)" = 1 ] || fail "more than one line: $(cat err.txt)"
}

# The folders are what is tested here, so the module itself, the decoder and the shaders may be anything.
cp "$source"/viewer/web/*.js "$source"/viewer/web/vcp-viewer.d.ts "$source"/viewer/web/index.html viewer/
echo "export function decompress() {}" >viewer/fzstd.js
echo "export function shader() {}" >viewer/shaders.js
echo licence >viewer/fzstd.LICENSE
"$make_scan" --triangles 10000 -o scan.ply
"$vcp" build scan.ply -o scan.vcp --progress none >/dev/null

expect 1 "has no vcp.wasm" "$vcp" publish scan.vcp -o site --viewer viewer
[ ! -e site ] || fail "a folder although the viewer is missing"
printf '\0asm\1\0\0\0' >viewer/vcp.wasm
head -c 9000 scan.vcp >short.vcp
expect 1 "short.vcp" "$vcp" publish short.vcp -o site --viewer viewer
[ ! -e site ] || fail "a folder although the scan is broken"

"$vcp" publish scan.vcp -o site/ --viewer viewer >/dev/null
cmp scan.vcp site/scan.vcp
for file in viewer/*; do cmp "$file" "site/$(basename "$file")"; done
[ "$(ls -A site | wc -l)" = 17 ] || fail "site holds $(ls -A site)"
grep -q 'src="scan.vcp"' site/index.html || fail "the page shows another file"

expect 2 "--overwrite" "$vcp" publish scan.vcp -o site --viewer viewer
echo "<!-- mine -->" >>site/index.html
cp site/index.html mine.html
"$make_scan" --triangles 14000 -o larger.ply
"$vcp" build larger.ply -o larger.vcp --progress none >/dev/null
"$vcp" publish larger.vcp -o site --viewer viewer --overwrite >/dev/null
cmp larger.vcp site/scan.vcp
cmp mine.html site/index.html
mkdir other
echo precious >other/thesis.txt
expect 2 "thesis.txt" "$vcp" publish scan.vcp -o other --viewer viewer --overwrite
[ "$(ls -A other)" = thesis.txt ] || fail "other was touched"
expect 2 "no folder" "$vcp" publish scan.vcp -o scan.ply --viewer viewer --overwrite
mkdir empty
"$vcp" publish scan.vcp -o empty --viewer viewer >/dev/null
cmp scan.vcp empty/scan.vcp
# Nothing may be left of what was not finished.
[ -z "$(find . -name '*unfinished*')" ] || fail "left: $(find . -name '*unfinished*')"

"$vcp" shard scan.vcp -o shards --size 64K --progress none >/dev/null
"$vcp" build scan.ply -o built --shards 64K --progress none >/dev/null
diff -r shards built
[ ! -e built.whole.vcp ] || fail "the file that was cut is left"
echo precious >built.whole.vcp
for more in "" --overwrite --resume; do
    expect 2 "is there" "$vcp" build scan.ply -o built --shards 64K --progress none $more
done
grep -q precious built.whole.vcp || fail "a file that is not ours was replaced"
"$vcp" publish shards -o parted --viewer viewer >/dev/null
cmp shards/manifest.vcps parted/scan.vcp
for shard in shards/*.vcp; do cmp "$shard" "parted/$(basename "$shard")"; done
"$vcp" pack parted/scan.vcp -o packed.vcp --progress none >/dev/null
cmp scan.vcp packed.vcp
"$vcp" publish scan.vcp -o parted --viewer viewer --overwrite >/dev/null
[ "$(ls -A parted | wc -l)" = 17 ] || fail "shards are left: $(ls -A parted)"

expect 2 "no IPv4 address" "$vcp" serve site --address nowhere
expect 1 "nothing_here" "$vcp" serve nothing_here
expect 2 "is no folder" "$vcp" serve scan.ply
ln -s ../mine.html site/outside.html
mkdir site_twin
echo secret >site_twin/secret.txt
"$node" "$here/up_axis_test.mjs" "$source/viewer/web/camera.js" "$source/tests/viewer/camera/up_axis.json"
"$node" "$here/site_test.mjs" "$vcp" site "$source/viewer/web/ranges.js"
