#!/usr/bin/env bash
# Embeds the installed widget as a stranger would: builds and runs viewer/examples, and the code in docs/embedding.md.
# usage: embedding_test.sh PREFIX SOURCE WORK CC CXX LIBDIR
set -euo pipefail
prefix=$1 source=$2 work=$3 cc=$4 cxx=$5 libdir=$6
here=$(realpath "$(dirname "$0")")
rm -rf "$work"
mkdir -p "$work/docs"

cp "$here/octahedron.off" "$work"
tree=$work/octahedron.vcp
"$prefix/bin/vcp" build "$work/octahedron.off" -o "$tree" --cell 0.05 --progress none

run() {
    echo "== $*"
    "$@"
}

# shows COMMAND...: runs a host; most of its pixels must show the surface, but not all.
shows() {
    local output
    output=$(run "$@") || { echo "$output"; exit 1; }
    echo "$output"
    local pixels
    pixels=$(grep -o '[0-9]* pixels show the surface' <<<"$output" | cut -d ' ' -f 1)
    [ "${pixels:-0}" -gt 5000 ] || { echo "too few pixels show the surface"; exit 1; }
}

run cmake -S "$source/viewer/examples" -B "$work/build" -G Ninja -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_C_COMPILER="$cc" -DCMAKE_CXX_COMPILER="$cxx" \
    -DCMAKE_CXX_COMPILER_LAUNCHER="$(command -v ccache || true)" >"$work/configure.log" || { cat "$work/configure.log"; exit 1; }
run cmake --build "$work/build"
cd "$work"
offscreen=$(run "$work/build/offscreen" "$tree" "$work/offscreen.ppm")
echo "$offscreen"
grep "in the middle: " <<<"$offscreen" >/dev/null
[ "$(head -c 15 offscreen.ppm | tr '\n' ' ')" = "P6 640 480 255 " ] && [ "$(stat -c %s offscreen.ppm)" -eq 921615 ]
# The C library exports its functions and nothing else.
if nm -D --defined-only "$prefix/$libdir/libvcp.so" | grep -v ' vcp_[a-z_]*$'; then
    echo "libvcp.so exports more than its functions"
    exit 1
fi
# What installed headers include is installed, too. That of Qt is for programs with Qt, and those in shared/ are parts
# of others.
(cd "$prefix/include/vcp" && find . -name '*.h' -o -name '*.hpp' | sort | sed -n '/vcp_qt/d; \,/shared/,d; s|^\./\(.*\)|#include "\1"|p') >headers.cpp
[ "$(wc -l <headers.cpp)" -gt 15 ]
run "$cxx" -std=c++20 -fsyntax-only -I "$prefix/include/vcp" headers.cpp
[ ! -x build/host_device ] || shows build/host_device "$tree"
if command -v xvfb-run >/dev/null; then
    display=(xvfb-run -a -s "-screen 0 1280x1024x24")
    [ ! -x build/glfw_host ] || shows "${display[@]}" build/glfw_host "$tree" --frames 5
    [ ! -x build/qt_widget ] || QT_QPA_PLATFORM=xcb shows "${display[@]}" build/qt_widget "$tree" --frames 3
else
    echo "no xvfb-run: the windows are not opened"
fi

# With pkg-config, and no CMake.
export PKG_CONFIG_PATH=$prefix/$libdir/pkgconfig LD_LIBRARY_PATH=$prefix/$libdir
read -r -a flags <<<"$(pkg-config --cflags --libs vcp)"
run "$cc" -std=c99 -pedantic -Wall -Wextra -Werror "$source/viewer/examples/offscreen.c" "${flags[@]}" -o offscreen
run ./offscreen "$tree" >/dev/null

# Python, where the module was built and there is NumPy.
export PYTHONPATH=$prefix/lib/python3/dist-packages
if [ -d "$PYTHONPATH" ]; then
    for python in python3 /usr/bin/python3; do
        "$python" -c 'import numpy' 2>/dev/null || continue
        run "$python" "$source/viewer/examples/notebook.py" octahedron.off "$work"
        # The page's own, with a mesh of the name that it says: every stage arrives as the text that it is.
        { printf 'ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nelement face 8\nproperty list uchar int vertex_indices\nend_header\n'
          tail -n +3 octahedron.off; } >statue.ply
        awk '/^```python$/ { inside = 1; next } /^```/ { inside = 0 } inside' "$source/docs/embedding.md" >snippet.py
        run "$python" snippet.py >snippet.txt || { cat snippet.txt; exit 1; }
        for stage in reading sorting "level 1 of" writing "done 1.0"; do
            grep "^$stage" snippet.txt >/dev/null || { cat snippet.txt; echo "the stage $stage did not arrive"; exit 1; }
        done
        break
    done
fi

# Each program of the page: a block that begins with ```c or ```cpp and has a main.
awk -v folder="$work/docs" '/^```(c|cpp)$/ { file = sprintf("%s/program%d.%s", folder, ++n, substr($0, 4)); next } /^```/ { file = "" } file { print > file }' "$source/docs/embedding.md"
[ "$(ls docs | wc -l)" -ge 2 ]
for program in docs/program*.c docs/program*.cpp; do
    if [ "${program##*.}" = c ]; then run "$cc" -std=c99 "$program" "${flags[@]}" -o "$program.out"; else run "$cxx" -std=c++20 "$program" "${flags[@]}" -o "$program.out"; fi
    run "./$program.out" "$tree"
done
