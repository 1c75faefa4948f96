#!/usr/bin/env bash
# A published page in Chromium: page_test.sh NODE WEB_FOLDER VCP MAKE_SCAN FOLDER
set -euo pipefail
node=$1 web=$2 vcp=$3 make_scan=$4 folder=$5
if [ ! -e "$web/vcp.wasm" ] || ! command -v chromium >/dev/null; then
    echo "The target web was not built, or there is no Chromium: skipped"
    exit 77
fi
if ! timeout 120 chromium --headless=new --no-sandbox --disable-gpu --disable-dev-shm-usage --dump-dom about:blank \
    >/dev/null 2>&1; then
    echo "Chromium does not start here: skipped"
    exit 77
fi
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
for triangles in 10000 60000 300000; do
    "$make_scan" --triangles "$triangles" --colour -o scan.ply
    "$vcp" build scan.ply -o scan.vcp --overwrite --progress none
    "$vcp" publish scan.vcp -o "site$triangles" --viewer "$web" >/dev/null
    mkdir "pictures$triangles"
    "$node" "$here/page_test.mjs" "$vcp" "site$triangles" "pictures$triangles"
done
"$vcp" shard scan.vcp -o shards --size 64K --progress none >/dev/null
"$vcp" publish shards -o siteshards --viewer "$web" >/dev/null
cp scan.vcp siteshards/whole.vcp
mkdir picturesshards
"$node" "$here/page_test.mjs" "$vcp" siteshards picturesshards shards
"$node" "$here/textured_scene.mjs" . 200 1024
"$vcp" build textured.obj -o scan.vcp --colour-quality lossless --overwrite --progress none
"$vcp" publish scan.vcp -o siteimages --viewer "$web" >/dev/null
"$vcp" build textured.obj -o siteimages/jpeg.vcp --colour-quality 85 --overwrite --progress none
mkdir picturesimages
"$node" "$here/page_test.mjs" "$vcp" siteimages picturesimages images
