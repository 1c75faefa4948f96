#!/usr/bin/env bash
# no_vulkan_test.sh VCP MAKE_SCAN NO_VULKAN FOLDER: what works, and what is said, where no Vulkan loader is installed.
set -euo pipefail
vcp=$1 make_scan=$2 preload=$3 folder=$4
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"

fail() { echo "$*" >&2; exit 1; }
without() { LD_PRELOAD=$preload "$@"; }

! readelf -d "$vcp" | grep 'NEEDED.*libvulkan' || fail "vcp does not start without the Vulkan loader"

"$make_scan" --triangles 20000 -o scan.ply >/dev/null
without "$vcp" build scan.ply -o scan.vcp --progress none
without "$vcp" devices >devices.txt
grep -q '^.*host' devices.txt || fail "host is not listed: $(cat devices.txt)"
without "$vcp" render scan.vcp -o without.png --size 320x200 --progress none
"$vcp" render scan.vcp -o with.png --size 320x200 --device host --progress none
cmp with.png without.png || fail "the picture is another one without the loader"

lines=("render scan.vcp -o other.png --device llvmpipe")
[ -z "${DISPLAY:-}" ] || lines+=("view scan.vcp")
for arguments in "${lines[@]}"; do
    status=0
    without "$vcp" $arguments --progress none >out.txt 2>error.txt || status=$?
    [ "$status" -eq 1 ] || fail "vcp $arguments ended with $status: $(cat error.txt)"
    [ "$(wc -l <error.txt)" -eq 1 ] || fail "vcp $arguments does not say it in one line: $(cat error.txt)"
    grep -q libvulkan error.txt || fail "vcp $arguments does not say what is missing: $(cat error.txt)"
done
[ ! -e other.png ] || fail "a picture was left behind"
echo "passed"
