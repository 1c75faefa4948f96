#!/usr/bin/env bash
# A published page in a browser: page_test.sh chromium|firefox NODE WEB_FOLDER VCP MAKE_SCAN FOLDER
# Chromium does everything; Firefox what browsers may do otherwise.
set -euo pipefail
browser=$1 node=$2 web=$3 vcp=$4 make_scan=$5 folder=$6
if [ ! -e "$web/vcp.wasm" ] || ! command -v "${browser/firefox/firefox-esr}" >/dev/null; then
    echo "The target web was not built, or there is no $browser: skipped"
    exit 77
fi
if [ "$browser" = chromium ] && ! timeout 120 chromium --headless=new --no-sandbox --disable-gpu --disable-dev-shm-usage \
    --dump-dom about:blank >/dev/null 2>&1; then
    echo "Chromium does not start here: skipped"
    exit 77
fi
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
# page TRIANGLES KIND: the page of a scan.
page() {
    "$make_scan" --triangles "$1" --colour -o scan.ply
    "$vcp" build scan.ply -o scan.vcp --overwrite --progress none
    "$vcp" publish scan.vcp -o "site$1" --viewer "$web" >/dev/null
    mkdir "pictures$1"
    "$node" "$here/page_test.mjs" "$browser" "$vcp" "site$1" "pictures$1" $2
}
if [ "$browser" = firefox ]; then
    page 60000 short
    exit
fi
for triangles in 10000 60000 300000; do page $triangles ""; done
# The package for npm, as it is unpacked, and a page written by hand.
if command -v npm >/dev/null; then
    package=sitepackage/node_modules/vcp-viewer
    mkdir -p "$package" picturespackage
    npm pack "$(cd "$web" && pwd)" --offline --silent >/dev/null
    tar -xzf vcp-viewer-*.tgz -C "$package" --strip-components 1
    cp site60000/scan.vcp sitepackage
    cat >sitepackage/index.html <<'PAGE'
<!doctype html>
<title>By hand</title>
<link rel="icon" href="data:,">
<script type="module" src="node_modules/vcp-viewer/vcp-viewer.js"></script>
<h1>A scan</h1>
<vcp-viewer src="scan.vcp" style="height: 480px"></vcp-viewer>
PAGE
    "$node" "$here/page_test.mjs" "$browser" "$vcp" sitepackage picturespackage package
fi
"$vcp" shard scan.vcp -o shards --size 64K --progress none >/dev/null
"$vcp" publish shards -o siteshards --viewer "$web" >/dev/null
cp scan.vcp siteshards/whole.vcp
mkdir picturesshards
"$node" "$here/page_test.mjs" "$browser" "$vcp" siteshards picturesshards shards
"$node" "$here/textured_scene.mjs" . 200 1024
"$vcp" build textured.obj -o scan.vcp --colour-quality lossless --overwrite --progress none
"$vcp" publish scan.vcp -o siteimages --viewer "$web" >/dev/null
"$vcp" build textured.obj -o siteimages/jpeg.vcp --colour-quality 85 --overwrite --progress none
mkdir picturesimages
"$node" "$here/page_test.mjs" "$browser" "$vcp" siteimages picturesimages images
