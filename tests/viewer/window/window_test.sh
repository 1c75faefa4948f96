#!/bin/bash
# The real window under Xvfb, driven by xdotool as a person would. Usage: window_test.sh VCP FOLDER [DROP_FILE.so].
# Ends with 77 (skipped) where Xvfb or xdotool is missing.
set -euo pipefail
vcp=$1 folder=$2 drop=${3:-}
for tool in Xvfb xdotool import convert; do
    command -v $tool >/dev/null || { echo "skipped: no $tool"; exit 77; }
done
rm -rf "$folder"; mkdir -p "$folder"; cd "$folder"
export XDG_CACHE_HOME=$folder/cache XDG_CONFIG_HOME=$folder/config
# The dark theme, in which letters are lighter than what they stand on.
unset GTK_THEME DBUS_SESSION_BUS_ADDRESS XDG_RUNTIME_DIR

fail() { echo "window_test: $*" >&2; cat log 2>/dev/null >&2; exit 1; }

# A bumpy ball, 9400 triangles.
awk 'BEGIN { R=48; S=100; pi=atan2(0,-1)
    print "ply\nformat ascii 1.0\nelement vertex " (R+1)*S "\nproperty float x\nproperty float y\nproperty float z"
    print "element face " 2*R*S "\nproperty list uchar int vertex_indices\nend_header"
    for (r=0; r<=R; r++) for (s=0; s<S; s++) { p=pi*r/R; a=2*pi*s/S; q=1+0.1*sin(3*p)*sin(4*a)
        print q*sin(p)*cos(a), q*cos(p), q*sin(p)*sin(a) }
    for (r=0; r<R; r++) for (s=0; s<S; s++) { t=(s+1)%S
        print 3, r*S+s, r*S+t, (r+1)*S+s; print 3, r*S+t, (r+1)*S+t, (r+1)*S+s } }' >ball.ply

exec 3>display
Xvfb -displayfd 3 -screen 0 1000x800x24 >xvfb.log 2>&1 &
xvfb=$!
trap 'kill $xvfb 2>/dev/null || true' EXIT
for _ in $(seq 100); do [ -s display ] && break; sleep 0.1; done
[ -s display ] || fail "Xvfb does not start"
export DISPLAY=:$(cat display)

# ended: says how vcp view ended when nobody ended it.
ended() {
    local status=0
    wait $viewer || status=$?
    fail "vcp view ended by itself with $status"
}

# starts NAME ARGUMENT...: opens a window whose title has NAME; sets viewer and window.
starts() {
    local name=$1; shift
    # When the last program has left a display, that begins anew, and lets nobody in meanwhile.
    sleep 1
    "$vcp" view "$@" --json >report.json 2>log &
    viewer=$!
    window=
    for _ in $(seq 200); do
        window=$(xdotool search --name "$name" 2>/dev/null | head -1) && [ -n "$window" ] && break
        kill -0 $viewer 2>/dev/null || ended
        sleep 0.1
    done
    [ -n "$window" ] || fail "no window"
}
# ends STATUS: Esc closes the window, which then ends with STATUS.
ends() {
    # The window may be gone before the key is released.
    xdotool key --window $window Escape 2>/dev/null || true
    for _ in $(seq 100); do kill -0 $viewer 2>/dev/null || break; sleep 0.1; done
    kill -0 $viewer 2>/dev/null && { kill $viewer; fail "Esc does not close the window"; }
    local status=0
    wait $viewer || status=$?
    [ $status = "$1" ] || fail "vcp view ended with $status"
}
key() { local k; for k; do xdotool key --window $window "$k"; done; }

shot() { import -silent -window "$window" "$1.png"; }
# The picture without the status bar.
scene() { convert "$1.png" -crop 640x440+0+0 +repage rgba:- | md5sum; }
colours() { convert "$1.png" -unique-colors -format %w info:; }
# waits_for WHAT CONDITION...: shots of the window until one fulfils the condition; machines may be slow, so up to a minute.
waits_for() {
    local what=$1; shift
    for _ in $(seq 120); do
        kill -0 $viewer 2>/dev/null || ended
        "$@" && return
        sleep 0.5
    done
    fail "$what"
}
# At rest: two shots in a row are the same picture.
is_at_rest() { shot "$1"; sleep 0.5; shot again; [ "$(scene "$1")" = "$(scene again)" ]; }
is_other() { is_at_rest "$2" && [ "$(scene "$1")" != "$(scene "$2")" ]; }
is_same() { is_at_rest "$2" && [ "$(scene "$1")" = "$(scene "$2")" ]; }
is_picture() { is_at_rest "$1" && [ "$(colours "$1")" -gt 50 ]; }
differs() { waits_for "$1 and $2 are the same picture" is_other "$1" "$2"; }
equals() { waits_for "$1 and $2 differ" is_same "$1" "$2"; }

# Pictures of one sample are at rest at once.
starts ball.ply ball.ply --size 640x480 --samples 1
# The window shows its background and the build's progress first: wait for clay in the middle.
is_first() { is_picture "$1" && [ "$(convert "$1.png" -format '%[fx:p{320,240}.r>0.6&&p{300,220}.r>0.6&&p{340,260}.r>0.6]' info:)" = 1 ]; }
waits_for "the first picture is empty" is_first start
xdotool mousemove --window $window 320 240 mousedown 1 mousemove --window $window 380 260 mousemove --window $window 440 280 mouseup 1
differs start orbit
xdotool key --window $window r
equals start reset
xdotool mousemove --window $window 320 240 click 4 click 4 click 4
differs reset zoom
# As fast as a hand never is: press, move and release may come in one batch.
xdotool mousedown 3 mousemove --window $window 250 200 mouseup 3
differs zoom pan
xdotool key --window $window f
differs pan fit
xdotool key --window $window l key --window $window 9
differs fit light
key ctrl+1
differs light bookmarked
key 7
differs light top
key shift+1
equals light back
key ctrl+c
waits_for "nothing says that the camera was copied" is_other back copied
key 7
differs copied top
key ctrl+v
equals back pasted
xdotool mousemove --window $window 330 250 click --repeat 2 --delay 50 1
differs pasted centred
key g
xdotool keydown --window $window w sleep 0.2 keyup --window $window w
differs centred flown
key g F1
differs flown help
# What is typed searches the keys, and is none: x would cut, Escape would close the window.
key x
differs help searched
key BackSpace
equals help unsearched
key Escape
differs unsearched unhelped
key Tab
differs unhelped panel
xdotool mousemove --window $window 320 240
# What is fitted keeps clear of the panel: its left side is where the background was.
key 1
is_beside_panel() { is_at_rest beside && [ "$(convert beside.png -format '%[fx:abs(p{80,230}.r-p{2,230}.r)>0.05]' info:)" = 1 ]; }
waits_for "what is fitted is not beside the panel" is_beside_panel
key Tab 1
differs beside front
# What is saved is what is shown; toolbar and scale bar are not.
key ctrl+s
is_saved() { [ -s picture-1.png ]; }
waits_for "no picture is saved" is_saved
[ "$(convert front.png -crop 640x360+0+40 +repage shown.png; convert picture-1.png -crop 640x360+0+40 +repage saved.png
    compare -metric AE -fuzz 2% shown.png saved.png null: 2>&1 || true)" -lt 100 ] || fail "what is saved is not what was shown"
differs front noted
# A turntable is saved between frames of the window; Esc ends it and keeps what is finished, whole.
key ctrl+t
has_begun() { [ -s turntable-1/picture-0002.png ]; }
waits_for "no turntable is saved" has_begun
key Escape
is_ended() { kill -0 $viewer && local first=$(ls turntable-1 | wc -l) && sleep 1 && [ "$(ls turntable-1 | wc -l)" = "$first" ]; }
waits_for "Esc does not end the turntable" is_ended
[ "$(ls turntable-1 | wc -l)" -lt 120 ] || fail "the turntable was not ended"
ls turntable-1 | grep -v '^picture-0[0-9]*\.png$' && fail "something half-written is left of the turntable"
[ "$(identify -format '%w ' turntable-1/*.png | tr ' ' '\n' | sort -u | grep -c .)" = 1 ] || fail "pictures of the turntable cannot be read"
[ "$(convert picture-1.png turntable-1/picture-0001.png -metric AE -compare -format '%[distortion]' info:)" = 0 ] || fail "the turntable does not begin with the view as it was"
shot noted
key x
# The section's handle is in the middle of what the bars leave; Esc puts the plane back, and the window stays.
waits_for "no section" is_other noted section
xdotool mousemove --window $window 320 248 mousedown 1 mousemove --window $window 320 198
waits_for "the section does not move" is_other section moved
key Escape
xdotool mousemove --window $window 320 248
waits_for "Esc does not put the section back" is_same section unmoved
xdotool mouseup 1 mousemove --window $window 320 240
key x d
waits_for "the section stays" is_other section panel
xdotool mousemove --window $window 320 240 click 1
waits_for "a point is not shown" is_other panel point
xdotool mousemove --window $window 330 200 click 1
waits_for "a second point is not shown" is_other point line
key ctrl+e
is_exported() { [ -s measurement-1.json ]; }
waits_for "what is measured is not written" is_exported
# The ball's radius is between 0.9 and 1.1; both points are on it, and their distance is the segment.
awk -F, 'NR>1 { n++; r=sqrt($3*$3+$4*$4+$5*$5); if (r<0.88 || r>1.12 || $6<=0) exit 1
    if (n==2) { d=sqrt(($3-x)^2+($4-y)^2+($5-z)^2); if (d<0.01 || (d-$8)^2>1e-18) exit 1 } x=$3; y=$4; z=$5 }
    END { if (n!=2) exit 1 }' measurement-1.csv || { cat measurement-1.csv; fail "what was measured is wrong"; }
xdotool key --window $window Escape
xdotool windowsize $window 500 300
is_resized() { is_picture resized && [ "$(convert resized.png -format '%wx%h:%[fx:p{210,150}.r>0.6]' info:)" = 500x300:1 ]; }
waits_for "no picture of the size asked for after a resize" is_resized
# At rest the window sleeps: how often its thread was woken in two seconds.
wakes() { awk '/ctxt_switches/ { n += $2 } END { print n }' /proc/$viewer/status; }
sleeps() { local before after; before=$(wakes); sleep 2; after=$(wakes); [ $((after - before)) -le 20 ]; }
waits_for "the window is woken often at rest" sleeps
ends 0
grep -q '"settled": true' report.json || fail "not settled at the end"
grep -q '"first_picture_seconds": [0-9]' report.json || fail "no picture was ever shown"
frames=$(grep '"frames"' report.json)

# A picture that stays gets all its samples, and then the window sleeps.
"$vcp" build ball.ply -o gone.vcp --progress none >/dev/null
starts gone.vcp gone.vcp
waits_for "no picture that gets samples" is_resized
waits_for "the window is woken often when its picture has all samples" sleeps
ends 0
grep -q '"samples": 64' report.json || fail "the picture did not get all its samples"

# Settings are remembered: the size it was left with. A file whose disk is gone ends nothing.
starts gone.vcp gone.vcp --samples 1
waits_for "no picture of the size it was left with" is_resized
: >gone.vcp
xdotool mousemove --window $window 250 150 click --repeat 9 --delay 20 4
differs resized unplugged
ends 0

# A file is opened from the list: the first one that holds what is typed.
starts vcp --size 640x480 --samples 1
key ctrl+o
waits_for "the file list is not shown" is_at_rest listed
key b a l l period p Return
waits_for "what was chosen is not shown" is_first chosen_picture
ends 0

# A file is dropped into an empty window. Without a dataset the size is the one it was left with.
if [ -n "$drop" ]; then
    export VCP_TEST_DROP=$folder/dropped
    LD_PRELOAD=$drop starts vcp --size 640x480 --samples 1
    echo "$folder/ball.ply" >dropped.part
    mv dropped.part dropped
    waits_for "what was dropped is not shown" is_first dropped_picture
    ends 0
fi

# The desktop's portal says whether the window is light, also when that changes while it is open.
mkdir programs
printf '#!/bin/sh\n[ "$*" = "$(cat "%s/question")" ] && cat "%s/answer"\n' "$folder" "$folder" >programs/busctl
echo "--user --timeout=1 call org.freedesktop.portal.Desktop /org/freedesktop/portal/desktop org.freedesktop.portal.Settings Read ss org.freedesktop.appearance color-scheme" >question
chmod +x programs/busctl
echo "v v u 2" >answer
PATH=$folder/programs:$PATH DBUS_SESSION_BUS_ADDRESS=unix:path=/nowhere starts vcp --size 640x480 --samples 1
bar_is() { is_at_rest bar && [ "$(convert bar.png -format "%[fx:p{200,8}.r$1]" info:)" = 1 ]; }
waits_for "the bar is not light" bar_is '>0.9'
echo "v v u 1" >answer
# Without a window manager a window has the focus until it is gone.
xdotool windowunmap --sync $window windowmap --sync $window windowfocus $window
waits_for "the bar is not dark" bar_is '<0.2'
ends 0

# What cannot be opened is said in the window, which stays.
head -c 3000 ball.ply >broken.ply
starts broken.ply broken.ply
is_said() { shot said; [ "$(convert said.png -fuzz 10% -fill black +opaque '#ff6b5e' -format '%[fx:maxima>0]' info:)" = 1 ]; }
waits_for "what went wrong is not said" is_said
ends 1
grep -q broken.ply log || fail "the error does not name the file"
# Of several files the others are shown; what leaves nothing to show is said before there is a window.
"$vcp" build ball.ply -o one.vcp --progress none >/dev/null
starts '^one.vcp$' missing.vcp one.vcp --size 640x480 --samples 1
waits_for "what is missing is not said" is_said
waits_for "what is not missing is not shown" is_picture beside_missing
# What is typed replaces the number that a new annotation is called by.
key n
xdotool mousemove --window $window 320 240 click 1 sleep 0.5
key S e a m Return Return
xdotool mousemove --window $window 5 100
ends 0
grep -q '"Seam"' "$XDG_CONFIG_HOME/vcp/view.json" || fail "the title of an annotation is not what was typed"
status=0
"$vcp" view missing.vcp broken.vcp 2>log || status=$?
[ $status = 1 ] && [ "$(wc -l <log)" = 1 ] && grep -q '^vcp: missing.vcp: ' log || fail "nothing to show ends with $status"
echo "window_test: passed, $frames"
