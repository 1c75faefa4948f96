#!/usr/bin/env bash
# neon_test.sh COMPILER SOURCES FOLDER: what Highway compiles for each instruction set compiles for Arm's as well.
set -euo pipefail
compiler=$1 sources=$2 folder=$3
rm -rf "$folder"
mkdir -p "$folder/include"
# Headers that are the same on every machine; the others are the compiler's own.
for name in hwy glm tbb oneapi; do ln -s "/usr/include/$name" "$folder/include/$name"; done

files=$(grep -l HWY_DYNAMIC_DISPATCH "$sources"/render/host/*.cpp)
[ "$(wc -l <<<"$files")" -ge 4 ] || { echo "the files with lanes are not where they were"; exit 1; }
for file in $files; do
    object=$folder/$(basename "$file").o
    "$compiler" -std=c++20 -O1 -ffp-contract=off -I"$sources" -isystem "$folder/include" -c "$file" -o "$object"
    nm "$object" | grep N_NEON >"$object.names" || { echo "$file has nothing for NEON"; exit 1; }
done
echo "passed"
