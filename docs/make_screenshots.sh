#!/bin/bash
# The pictures of docs/window.md, from a statue that make_scan makes, in a window under Xvfb that xdotool drives.
# Usage: make_screenshots.sh VCP MAKE_SCAN. Writes images/window-*.jpg beside itself. Takes some minutes without a GPU.
set -euo pipefail
vcp=$(realpath "$1") makeScan=$(realpath "$2") images=$(dirname "$(realpath "$0")")/images
folder=$(mktemp -d)
trap 'kill ${viewer:-} ${xvfb:-} 2>/dev/null || true; rm -rf "$folder"' EXIT
cd "$folder"
export XDG_CACHE_HOME=$folder/cache XDG_CONFIG_HOME=$folder/config

"$makeScan" --triangles 1000000 --colour -o statue.ply
"$vcp" build statue.ply -o statue.vcp --progress none >/dev/null
# A closed ball with a hollow: what is cut open can be filled.
awk 'BEGIN { R=192; S=384; pi=atan2(0,-1)
    print "ply\nformat ascii 1.0\nelement vertex " 2*(R+1)*S "\nproperty float x\nproperty float y\nproperty float z"
    print "element face " 4*R*S "\nproperty list uchar int vertex_indices\nend_header"
    for (k=0; k<2; k++) for (r=0; r<=R; r++) for (s=0; s<S; s++) { p=pi*r/R; a=2*pi*s/S
        q=k ? 0.55+0.06*sin(5*p)*sin(6*a)*sin(p) : 1+0.08*sin(3*p)*sin(4*a)+0.015*sin(18*p)*sin(20*a)*sin(p)
        print q*sin(p)*cos(a), q*cos(p), q*sin(p)*sin(a) }
    for (k=0; k<2; k++) for (r=0; r<R; r++) for (s=0; s<S; s++) { t=(s+1)%S; o=k*(R+1)*S; u=k?t:s; v=k?s:t
        print 3, o+r*S+u, o+r*S+v, o+(r+1)*S+u; print 3, o+r*S+v, o+(r+1)*S+v, o+(r+1)*S+u } }' >ball.ply
"$vcp" build ball.ply -o ball.vcp --progress none >/dev/null
# A ball as it was drawn, and as it was cast: larger here, smaller there, and with a grain.
ball() {
    awk -v E="$1" 'BEGIN { R=192; S=384; pi=atan2(0,-1)
        print "ply\nformat ascii 1.0\nelement vertex " (R+1)*S "\nproperty float x\nproperty float y"
        print "property float z\nelement face " 2*R*S "\nproperty list uchar int vertex_indices\nend_header"
        for (r=0; r<=R; r++) for (s=0; s<S; s++) { p=pi*r/R; a=2*pi*s/S
            q=1+0.08*sin(3*p)*sin(4*a)*sin(p)+E*(0.006*sin(2*p)*cos(a)+0.001*sin(18*p)*sin(20*a)*sin(p))
            print q*sin(p)*cos(a), q*cos(p), q*sin(p)*sin(a) }
        for (r=0; r<R; r++) for (s=0; s<S; s++) { t=(s+1)%S
            print 3, r*S+s, r*S+t, (r+1)*S+s; print 3, r*S+t, (r+1)*S+t, (r+1)*S+s } }'
}
ball 0 >plan.ply
ball 1 >cast.ply
"$vcp" build cast.ply -o cast.vcp --progress none >/dev/null
exec 3>display
Xvfb -noreset -displayfd 3 -screen 0 1600x1000x24 >/dev/null 2>&1 &
xvfb=$!
for _ in $(seq 100); do [ -s display ] && break; sleep 0.1; done
export DISPLAY=:$(cat display)

# opens THEME SIZE NAME ARGUMENT...: a window with that name in its title.
opens() {
    local theme=$1 size=$2 name=$3; shift 3
    GTK_THEME=Adwaita:$theme "$vcp" view "$@" --size "$size" --samples 4 >/dev/null 2>log &
    viewer=$! window=
    for _ in $(seq 200); do
        window=$(xdotool search --name "$name" 2>/dev/null | head -1) && [ -n "$window" ] && break
        kill -0 $viewer 2>/dev/null || { cat log >&2; exit 1; }
        sleep 0.1
    done
    away
    sleep 3
}
# closes: as by hand, so that thumbnails are kept.
closes() { key ctrl+q 2>/dev/null || true; wait "$viewer" || true; }
at() { xdotool mousemove --window "$window" "$@"; }
away() { at 5 300; }
key() { local k; for k; do xdotool key --window "$window" "$k"; sleep 0.3; done; }
busy() { awk '{ print $14 + $15 }' "/proc/$viewer/stat"; }
# rests: waits until the window has been at rest for two seconds.
rests() {
    local before
    for _ in $(seq 150); do
        before=$(busy); sleep 2
        [ $(($(busy) - before)) -le 5 ] && return
    done
}
# takes NAME: the picture, settled, with its samples.
takes() {
    rests
    import -silent -window "$window" now.png
    convert now.png -quality 90 "$images/window-$1.jpg"
}

opens dark 1600x1000 statue statue.vcp --shadows --occlusion 8
takes whole
key Tab d
for point in "795 400" "800 520" "770 680"; do rests; at $point click 1; done
away
takes measuring
key F1
takes keys
key Escape d Tab
closes

opens dark 800x600 statue statue.vcp --shadows --occlusion 8
key Tab f
takes small
key Tab
for _ in $(seq 6); do at 410 150 click 4; sleep 0.5; done
away
takes close
closes

opens light 1600x1000 ball ball.vcp --camera iso --section 'z<50%' --caps --shadows --occlusion 8
key Tab f
takes light
key Tab
closes
opens dark 800x600 ball ball.vcp --camera iso --section 'z<50%' --caps --shadows
at 400 300
for _ in 1 2; do xdotool click 4; sleep 0.5; done
away
takes section
closes

opens light 1600x1000 cast cast.vcp --camera iso --unit mm
key Tab f k p l a n Return
takes compare
key Tab
closes

opens dark 800x600 statue statue.vcp --shading steps
takes steps
closes

# A budget that is too small, and views that miss pages: what the rays of the last one asked for stays in the inset.
opens dark 800x600 statue statue.vcp --budget 6M --error-pixels 0.25
key i b
for view in 7 9 1; do key $view; sleep 2; done
for _ in 1 2 3; do at 400 200 click 4; sleep 0.5; done
away
takes streaming
closes

opens light 800x600 vcp
takes welcome
closes
