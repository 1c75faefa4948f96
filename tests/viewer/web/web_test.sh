#!/usr/bin/env bash
# The viewer for browsers against the program: web_test.sh NODE WEB_FOLDER VCP MAKE_SCAN HOSTILE_FILES FOLDER
set -euo pipefail
node=$1 web=$2 vcp=$3 make_scan=$4 hostile_files=$5 folder=$6
if [ ! -e "$web/vcp.wasm" ]; then
    echo "The target web was not built: skipped"
    exit 77
fi
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
mkdir -p "$folder"
cd "$folder"
"$make_scan" --triangles 60000 --colour -o scan.ply
"$vcp" build scan.ply -o scan.vcp --overwrite --progress none
cp "$web"/*.js "$web/vcp.wasm" .
echo '{ "type": "module" }' >package.json
echo '{ "position": [3.5, 4, 7], "target": [0, 0.86, 0], "fov_degrees": 34 }' >whole.json
echo '{ "position": [0.8, 1.9, 1.6], "target": [0, 1.1, 0], "fov_degrees": 34 }' >close.json
echo '{ "position": [35, 40, 70], "target": [0, 0.86, 0], "fov_degrees": 34 }' >far.json
cp far.json tolerant.json
for view in whole close far tolerant; do
    colours=6
    [ $view != tolerant ] || colours=10
    "$vcp" render scan.vcp --device host --camera $view.json --size 320x200 --colour-error $colours --depth $view.pfm -o $view.png \
        --overwrite --progress none --json >$view.said
done
"$make_scan" --triangles 10000 --colour -o small.ply
"$vcp" build small.ply -o small.vcp --overwrite --progress none
mkdir -p small textured channels
"$node" "$here/textured_scene.mjs" small 20 96
"$node" "$here/textured_scene.mjs" textured 200 1024
"$node" "$here/textured_scene.mjs" channels 60 512 channels
"$vcp" build channels/textured.obj -o textured/channels.vcp --overwrite --progress none --colour-quality lossless
echo '{ "position": [2, 2.2, 5], "target": [2, 0.4, 0.5], "fov_degrees": 34 }' >textured/whole.json
echo '{ "position": [1.2, 0.6, 1.6], "target": [1.6, 0.1, 0.2], "fov_degrees": 34 }' >textured/close.json
for in in small textured; do
    for kind in lossless=lossless jpeg=85; do
        "$vcp" build $in/textured.obj -o $in/${kind%=*}.vcp --colour-quality ${kind#*=} --overwrite --progress none
    done
done
for view in whole close; do
    "$vcp" render textured/lossless.vcp --device host --camera textured/$view.json --size 320x200 --samples 1 --shading unlit \
        --depth textured/$view.pfm -o textured/$view.png --overwrite --progress none
done
"$vcp" render textured/channels.vcp --device host --camera textured/close.json --size 320x200 --samples 1 \
    --depth textured/channels.pfm -o textured/channels.png --overwrite --progress none
"$make_scan" --triangles 300000 --colour -o large.ply
"$vcp" build large.ply -o large.vcp --overwrite --progress none
rm -rf shards
"$vcp" shard large.vcp -o shards --size 64K --progress none
"$hostile_files" hostile.bin 2000 "$here"/../../fuzz/seeds/fuzz_file/* small.vcp small/lossless.vcp small/jpeg.vcp \
    textured/channels.vcp
"$node" "$here/module_test.mjs" "$folder" scan.vcp hostile.bin whole close far tolerant
"$node" "$here/image_test.mjs" "$folder" textured
"$node" "$here/settle_test.mjs" "$folder" 30 1 large.vcp textured/lossless.vcp textured/jpeg.vcp
# The folder is a package for npm that needs no other one.
if command -v npm >/dev/null; then
    (cd "$web" && npm pack --dry-run --json --offline 2>/dev/null) >package_files.json
    "$node" -e '
        const files = JSON.parse(require("fs").readFileSync("package_files.json"))[0].files.map(file => file.path).sort();
        const expected = ["README.md", "camera.js", "caster.js", "choice.js", "fzstd.LICENSE", "fzstd.js", "gpu.js", "markup.js", "module.js", "package.json",
            "ranges.js", "shaders.js", "share.js", "vcp-viewer.d.ts", "vcp-viewer.js", "vcp.wasm", "worker.js"];
        require("assert").deepEqual(files, expected);
        require("assert").equal(JSON.parse(require("fs").readFileSync(process.argv[1])).dependencies, undefined);
    ' "$web/package.json"
fi
