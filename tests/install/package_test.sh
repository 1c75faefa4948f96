#!/usr/bin/env bash
# Makes the Debian packages, installs them under a folder, uses them as a stranger would, and removes them.
# usage: package_test.sh BUILD SOURCE WORK CC
# Exit status 77: there is no dpkg, and nothing was tested.
set -euo pipefail
build=$1 source=$2 work=$3 cc=$4
command -v dpkg >/dev/null && command -v dpkg-deb >/dev/null || { echo "no dpkg"; exit 77; }
here=$(realpath "$(dirname "$0")")
rm -rf "$work"
mkdir -p "$work"

fail() {
    echo "$*"
    exit 1
}

# quietly COMMAND...: what it says is shown where it fails.
quietly() {
    "$@" >"$work/said" 2>&1 || { cat "$work/said"; fail "failed: $*"; }
}

cd "$work"
quietly cpack --config "$build/CPackConfig.cmake" -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip -B "$work/packages"
mapfile -t packages < <(find packages -maxdepth 1 -name '*.deb' | sort)
names=()
for package in "${packages[@]}"; do
    name=$(dpkg-deb -f "$package" Package)
    names+=("$name")
    for field in Version Architecture Maintainer Section Description; do
        [ -n "$(dpkg-deb -f "$package" "$field")" ] || fail "$package has no $field"
    done
    if dpkg-deb -f "$package" Depends | grep -E '[(][<>=]* *[)]|[.][),]' ; then fail "$package depends on half a version"; fi
    dpkg-deb -c "$package" >listing
    if grep -Ev ' \./(usr/.*)?$| \./usr/.* -> ' listing; then fail "$package has files outside /usr"; fi
    if grep -Ev ' root/root ' listing; then fail "files of $package are not root's"; fi
    grep "usr/share/doc/$name/copyright" listing >/dev/null || fail "$package has no licence"
    if command -v dpkg-shlibdeps >/dev/null && [[ $name != *-dev ]]; then
        dpkg-deb -f "$package" Depends | grep 'libc6' >/dev/null || fail "$package does not say which libraries it needs"
    fi
done
echo "${names[*]}"

# The machine's own database of packages is not touched: all is under this folder.
root=$work/root
mkdir -p "$root/var/lib/dpkg/info" "$root/var/lib/dpkg/updates" "$root/var/lib/dpkg/triggers"
touch "$root/var/lib/dpkg/status" "$root/var/lib/dpkg/available"
# Scripts of packages run in the machine itself, so what they call is replaced.
mkdir stubs
printf '#!/bin/sh\necho "$0 $*" >>"%s/called"\n' "$work" >stubs/ldconfig
chmod +x stubs/ldconfig
under() { PATH=$work/stubs:$PATH quietly dpkg --root="$root" --log="$work/dpkg.log" --force-depends --force-not-root --force-script-chrootless "$@"; }
under --install "${packages[@]}"
for name in "${names[@]}"; do
    dpkg-query --admindir="$root/var/lib/dpkg" -W -f '${db:Status-Status}\n' "$name" | grep -x installed >/dev/null || fail "$name is not installed"
done
[[ " ${names[*]} " != *" libvcp0 "* ]] || grep '/stubs/ldconfig' called >/dev/null || fail "the linker does not hear of the library"
usr=$root/usr

# The headers of others' programs, and no others.
headers=$(find "$usr/include" -name '*.h' -o -name '*.hpp' | wc -l)
[ "$headers" -le 40 ] || fail "$headers headers are installed"

if [[ " ${names[*]} " != *" vcp "* ]]; then
    under --purge "${names[@]}"
    exit 0
fi

# The program, out of the folder: a mesh, its octree, a picture.
export PATH=$usr/bin:$PATH
cp "$here/octahedron.off" .
[ "$(command -v vcp)" = "$usr/bin/vcp" ]
quietly vcp build octahedron.off -o "of eight.vcp" --cell 0.05 --progress none
quietly vcp verify "of eight.vcp"
if [ -e "$build/web/vcp.wasm" ]; then
    quietly vcp publish "of eight.vcp" -o site
    cmp "of eight.vcp" site/scan.vcp
fi

# What a desktop does: it knows the file by its first bytes, and asks for a small picture of it.
share=$usr/share
python3 - "$share/mime/packages/vcp.xml" "of eight.vcp" <<'PYTHON'
import sys, xml.etree.ElementTree as tree
match = next(tree.parse(sys.argv[1]).iter("{http://www.freedesktop.org/standards/shared-mime-info}match"))
magic = match.get("value").encode().decode("unicode_escape").encode("latin-1")
assert match.get("offset") == "0" and len(magic) >= 7
assert open(sys.argv[2], "rb").read(len(magic)) == magic, "the file does not begin as its MIME type says"
PYTHON
! command -v update-mime-database >/dev/null || { cp -r "$share/mime" mime && quietly update-mime-database mime && grep -a "VCP" mime/magic >/dev/null; }
! command -v desktop-file-validate >/dev/null || quietly desktop-file-validate "$share/applications/vcp.desktop"
for entry in applications/vcp.desktop thumbnailers/vcp.thumbnailer; do
    grep '^MimeType=model/x-vcp;' "$share/$entry" >/dev/null || fail "$entry does not name the MIME type"
    [ "$(sed -n 's/^TryExec=//p' "$share/$entry")" = vcp ]
done
[ -s "$share/icons/hicolor/scalable/apps/$(sed -n 's/^Icon=//p' "$share/applications/vcp.desktop").svg" ]
# Some hand over a file that is there, is empty, and has no extension.
for picture in thumbnail.png thumbnail-Xx0; do
    : >"$picture"
    read -ra call <<<"$(sed -n 's/^Exec=//p' "$share/thumbnailers/vcp.thumbnailer")"
    for i in "${!call[@]}"; do
        word=${call[i]}
        word=${word//%i/"$work/of eight.vcp"} word=${word//%o/"$work/$picture"} word=${word//%s/128}
        call[i]=$word
    done
    VK_DRIVER_FILES=/nowhere quietly "${call[@]}"
    python3 -c 'import struct, sys
png = open(sys.argv[1], "rb").read()
assert png[:8] == b"\x89PNG\r\n\x1a\n" and struct.unpack(">II", png[16:24]) == (128, 128) and len(png) > 500' "$picture" || fail "no picture of 128 x 128 pixels"
done

# Each command has its page, and man finds nothing wrong in it.
pages=$(find "$share/man/man1" -name 'vcp*.1*' | wc -l)
[ "$pages" -ge 15 ] || fail "$pages manual pages"
if command -v man >/dev/null && command -v groff >/dev/null; then
    for page in "$share"/man/man1/*; do
        LC_ALL=C.UTF-8 MANWIDTH=100 man --warnings -E UTF-8 -l -Tutf8 "$page" >shown 2>problems || { cat problems; fail "$page"; }
        [ ! -s problems ] || { cat problems; fail "$page"; }
        grep 'wrong usage' shown >/dev/null || fail "$page is cut off"
    done
fi

# A C program, and Python, where they are.
if command -v pkg-config >/dev/null; then
    read -ra flags <<<"$(PKG_CONFIG_PATH=$(dirname "$(find "$usr/lib" -name vcp.pc)") pkg-config --cflags --libs vcp)"
    quietly "$cc" -std=c99 "$source/viewer/examples/offscreen.c" "${flags[@]}" -o offscreen
    library=$(dirname "$(find "$usr/lib" -name 'libvcp.so.?')")
    LD_LIBRARY_PATH=$library quietly ./offscreen "of eight.vcp" offscreen.ppm
fi
if [ -d "$usr/lib/python3/dist-packages/vcp" ]; then
    for python in python3 /usr/bin/python3; do
        "$python" -c 'import numpy' 2>/dev/null || continue
        PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$usr/lib/python3/dist-packages quietly "$python" -c 'import sys, vcp
view = vcp.open(sys.argv[1], width=64, height=64)
assert view.settle() and view.render()[0].shape == (64, 64, 4)' "of eight.vcp"
        break
    done
fi

# The first steps of the documentation, with a mesh that was made of the octahedron.
quietly vcp export "of eight.vcp" -o scan.ply
LD_LIBRARY_PATH=$(dirname "$(find "$usr/lib" -name 'libvcp.so.?')") bash "$here/first_steps_test.sh" "$source/docs/first_steps.md" scan.ply \
    "$work/steps" "$usr"

# Removed, nothing is left.
under --purge "${names[@]}"
left=$(find "$root" -mindepth 1 -not -path "$root/var*")
[ -z "$left" ] || fail "left behind: $left"
