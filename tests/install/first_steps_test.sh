#!/usr/bin/env bash
# Does what docs/first_steps.md says, command by command, in an empty folder with a scan.ply; the program `vcp` is on the
# path. Where there is Xvfb, xdotool measures in the window, as a person would; where there is no Qt, no program is made.
# usage: first_steps_test.sh DOCUMENT SCAN.ply WORK PREFIX
set -euo pipefail
document=$(realpath "$1") scan=$(realpath "$2") work=$3 prefix=$4
rm -rf "$work"
mkdir -p "$work"
cp "$scan" "$work/scan.ply"
cd "$work"
export XDG_CACHE_HOME=$work/cache XDG_CONFIG_HOME=$work/config CMAKE_PREFIX_PATH=$prefix
unset GTK_THEME

fail() {
    echo "first steps: $*"
    exit 1
}
# block LANGUAGE: what stands in the document's blocks of a language.
block() { awk -v begin="\`\`\`$1" '$0 == begin { inside = 1; next } /^```/ { inside = 0 } inside' "$document"; }

block cpp >main.cpp
block cmake >CMakeLists.txt
mapfile -t commands < <(block sh)
[ "${#commands[@]}" -ge 10 ] || fail "the document has lost its commands"
if [ -z "${DISPLAY:-}" ] && command -v Xvfb >/dev/null; then
    exec 3>display
    Xvfb -noreset -displayfd 3 -screen 0 1000x800x24 >/dev/null 2>&1 &
    trap 'kill '$!' 2>/dev/null || true' EXIT
    for _ in $(seq 100); do [ -s display ] && break; sleep 0.1; done
    export DISPLAY=:$(cat display)
fi
hasQt=$([ -n "${DISPLAY:-}" ] && pkg-config --exists Qt6Widgets 2>/dev/null && echo 1 || true)

# measures: two clicks in the window make a line, which is written.
measures() {
    vcp view scan.vcp --size 640x480 --samples 1 >log 2>&1 &
    local viewer=$! window=
    for _ in $(seq 300); do
        window=$(xdotool search --name scan.vcp 2>/dev/null | head -1) && [ -n "$window" ] && break
        kill -0 $viewer 2>/dev/null || { cat log; fail "the window ended"; }
        sleep 0.1
    done
    # Keys before the first picture find no surface, so all is done again until the line is there.
    for _ in $(seq 60); do
        sleep 1
        xdotool key --window "$window" d
        xdotool mousemove --window "$window" 300 240 click 1
        sleep 0.5
        xdotool mousemove --window "$window" 330 250 click 1
        sleep 0.5
        xdotool key --window "$window" ctrl+e
        sleep 0.5
        [ ! -s measurement-1.json ] || break
        xdotool key --window "$window" d
    done
    # The window may be gone before the keys are released.
    xdotool key --window "$window" ctrl+q 2>/dev/null || true
    wait $viewer || { cat log; fail "the window ended with an error"; }
    [ -s measurement-1.json ] || fail "nothing was measured"
}

for line in "${commands[@]}"; do
    echo "\$ $line"
    case $line in
        sudo*) ;; # the packages are installed already
        'vcp view'*)
            if [ -n "${DISPLAY:-}" ] && command -v xdotool >/dev/null; then measures; else echo "skipped"; fi ;;
        *--measurement*)
            [ ! -e measurement-1.json ] || eval "$line" ;;
        *.mp4*)
            if command -v ffmpeg >/dev/null; then eval "$line"; else echo "skipped: no ffmpeg"; fi ;;
        cmake*)
            if [ -n "$hasQt" ]; then eval "$line" >said 2>&1 || { cat said; fail "$line"; }; else echo "skipped: no Qt"; fi ;;
        QT_*)
            [ -z "$hasQt" ] || eval "timeout 120 env $line --once" || fail "the program does not end" ;;
        *) eval "$line" ;;
    esac
done
[ ! -e measurement-1.json ] || [ -s measured.png ] || fail "what was measured was not drawn"
! command -v ffmpeg >/dev/null || [ -s turn.mp4 ] || fail "no video"
grep '<svg' cut.svg >/dev/null && grep 'mm' cut.svg >/dev/null || fail "no drawing in millimetres"
[ -s cut.png ] || fail "no picture of the section"
[ -z "$hasQt" ] || [ -x build/look ] || fail "no program"
echo "first steps: done"
