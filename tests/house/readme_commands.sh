#!/usr/bin/env bash
# Runs README.md's "in five lines" verbatim, in an empty folder, with this build as build/release.
#   readme_commands.sh README BUILD_DIR WORK_DIR
set -euo pipefail
readme=$1 build=$2 work=$3

rm -rf "$work"
mkdir -p "$work/build"
ln -s "$build" "$work/build/release"
cd "$work"

commands=$(sed -n '/^build\/release\//p' "$readme")
[ "$(grep -c . <<<"$commands")" -ge 4 ] || { echo "README.md has lost its commands"; exit 1; }

while IFS= read -r line; do
    echo "\$ $line"
    read -ra command <<<"$line"
    case $line in
        *' view '*)
            if [ -z "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then echo "no display: skipped"; continue; fi
            # A window stays until it is closed: being stopped by timeout is success.
            status=0
            timeout 10 "${command[@]}" || status=$?
            [ "$status" -eq 124 ] || { echo "exit status $status instead of a window"; exit 1; }
            ;;
        *) "${command[@]}" ;;
    esac
done <<<"$commands"
[ -s statue.png ] || { echo "statue.png was not written"; exit 1; }
