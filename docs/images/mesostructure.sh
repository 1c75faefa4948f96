#!/usr/bin/env bash
# Makes the pictures of docs/mesostructure.md anew: docs/images/mesostructure.sh build/release
set -euo pipefail
build=$1
images=$(cd "$(dirname "$0")" && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

draw() {
    local name=$1
    shift
    "$build/vcp" meso render "$@" -o "$images/meso_$name.png"
}

for surface in quad cylinder teapot box; do
    zoom=1.05
    if [ $surface = teapot ]; then zoom=1.6; fi
    draw beads_$surface beads --surface $surface --shadows --size 360x270 --view 30,30,$zoom
done
draw weave_torus weave --surface torus --tiles 2 --shadows --size 360x270 --view 30,35,1.4
draw hemispheres_sphere hemispheres --surface sphere --tiles 2 --shadows --size 360x270 --view 30,35,1.4
draw kitten_wall kitten --tiles 3 --shadows --light=0.6,-0.3,0.5 --size 360x270 --view=-70,50,1.15
draw grazing beads --tiles 2 --shadows --light=0.3,-1,0.25 --size 360x180 --view 25,6,1.3

"$build/vcp" render "$images/../scenes/beads_gallery.json" -o "$images/scene_beads.png" --size 480x240 --shadows --progress none

# One marched ray a pixel, and the mean light of the tiles.
draw far_marched hemispheres --surface torus --tiles 80 --height 0.6 --shadows --error-pixels 0 --size 360x220 --view 30,35,1.2
draw far hemispheres --surface torus --tiles 80 --height 0.6 --shadows --size 360x220 --view 30,35,1.2

# Beads on a dog of 40 000 triangles.
"$build/make_scan" --shape dog --triangles 40k -o "$scratch/dog.obj"
cp "$images/../scenes/beads_dog.json" "$scratch"
"$build/vcp" render "$scratch/beads_dog.json" -o "$images/scene_dog.png" --size 480x400 --shadows --progress none

# Iterations of five methods on the same rays.
draw heat hemispheres --tiles 2 --method relief-binary,dm,ddm,ddm-quadric,boxes --heat --size 200x110 --view 30,12,1.5

# The ball goes through the maze.
n=0
for place in 0.11,0.11 0.11,0.36 -0.14,0.36 -0.39,0.36; do
    n=$((n + 1))
    draw ball_$n maze ball --tiles 1 --at 0,0,0 --at "$place,-0.053" --scale 1 --scale 0.667 --shadows --size 240x200 --view=-75,45,2
done

# A scan stands in a field of beads.
"$build/make_scan" --triangles 200k -o "$scratch/statue.ply"
"$build/vcp" build "$scratch/statue.ply" -o "$scratch/statue.vcp"
draw scan beads --up y --scale 1.6 --tiles 5 --at 0,-0.6,0 --colour 0.95,0.74,0.22 --scan "$scratch/statue.vcp" --shadows --size 480x420 --view=-60,18,1.8
