#!/usr/bin/env bash
# Pictures of WebGL beside the processor's: gpu_test.sh NODE WEB_FOLDER VCP MAKE_SCAN FOLDER
set -euo pipefail
node=$1 web=$2 vcp=$3 make_scan=$4 folder=$5
if [ ! -e "$web/vcp.wasm" ] || ! command -v chromium >/dev/null; then
    echo "The target web was not built, or there is no Chromium: skipped"
    exit 77
fi
if ! timeout 120 chromium --headless=new --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader \
    --disable-dev-shm-usage --dump-dom "data:text/html,<script>document.write('webgl2 '+
    Boolean(document.createElement('canvas').getContext('webgl2')))</script>" 2>/dev/null | grep -q "webgl2 true"; then
    echo "Chromium has no WebGL here: skipped"
    exit 77
fi
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
rm -rf "$folder"
mkdir -p "$folder/pictures"
cd "$folder"
"$node" "$here/textured_scene.mjs" . 200 1024 channels
"$vcp" build textured.obj -o scan.vcp --colour-quality lossless --progress none
"$vcp" publish scan.vcp -o site --viewer "$web" >/dev/null
"$make_scan" --triangles 10000 -o plain.ply
"$vcp" build plain.ply -o site/plain.vcp --progress none
"$node" "$here/gpu_test.mjs" chromium site pictures
