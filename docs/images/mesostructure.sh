#!/usr/bin/env bash
# Makes the pictures of docs/mesostructure.md anew: docs/images/mesostructure.sh build/release
set -euo pipefail
build=$1
images=$(cd "$(dirname "$0")" && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# draw NAME SURFACES OPTIONS: a picture of surfaces on which the light $light of the world falls.
draw() {
    local name=$1 surfaces=$2
    shift 2
    echo "{\"mesostructure\": [$surfaces], ${rest:-\"lights\": []}}" >"$scratch/scene.json"
    "$build/vcp" render "$scratch/scene.json" -o "$images/meso_$name.png" --up "${up:-z}" --progress none \
        --light fixed --light-direction="${light:-0.5,-0.4,0.75}" "$@"
}

clay='"colour": [0.78, 0.76, 0.72]' gold='"colour": [0.95, 0.74, 0.22]'
for surface in quad cylinder teapot box; do
    zoom=1.05
    if [ $surface = teapot ]; then zoom=1.6; fi
    draw beads_$surface '{"asset": "beads", "surface": "'$surface'", '"$clay}" --shadows --size 360x270 --camera 30,30,$zoom
done
draw weave_torus '{"asset": "weave", "surface": "torus", "tiles": 2, '"$clay}" --shadows --size 360x270 --camera 30,35,1.4
draw hemispheres_sphere '{"asset": "hemispheres", "surface": "sphere", "tiles": 2, '"$clay}" --shadows --size 360x270 --camera 30,35,1.4
light=0.6,-0.3,0.5 draw kitten_wall '{"asset": "kitten", "tiles": 3, '"$clay}" --shadows --size 360x270 --camera=-70,50,1.15
light=0.3,-1,0.25 draw grazing '{"asset": "beads", "tiles": 2, '"$clay}" --shadows --size 360x180 --camera 25,6,1.3

"$build/vcp" render "$images/../scenes/beads_gallery.json" -o "$images/scene_beads.png" --size 480x240 --shadows --progress none

# One marched ray a pixel, and the mean light of the tiles.
torus='"asset": "hemispheres", "surface": "torus", "tiles": 80, "height": 0.6, '$clay
draw far_marched "{$torus, \"far\": false}" --shadows --size 360x220 --camera 30,35,1.2
draw far "{$torus}" --shadows --size 360x220 --camera 30,35,1.2

# Beads in the light of a studio: as if nothing stood beside them, and with what they do to it.
"$build/vcp" meso build beads -o "$scratch/beads.meso" --transfer 48 --albedo 0.7 --progress none
for way in open transfer; do
    keys=
    if [ $way = transfer ]; then keys='"transfer": true, '; fi
    rest='"environment": {"source": "studio"}' \
        draw light_$way '{"asset": "beads.meso", "tiles": 2, '"$keys$clay}" --size 360x270 --camera 30,35,1.6
done

# Beads on a dog of 40 000 triangles.
"$build/make_scan" --shape dog --triangles 40k -o "$scratch/dog.obj"
cp "$images/../scenes/beads_dog.json" "$scratch"
"$build/vcp" render "$scratch/beads_dog.json" -o "$images/scene_dog.png" --size 480x400 --shadows --progress none

# Figures 8, 9 and 10 of Wang et al. 2004.
figure() { "$build/vcp" render "$1/gdm_$2.json" -o "$images/meso_gdm_$2.png" --methods "$3" --size 300x240 --shadows --progress none; }
for name in sheet vase; do figure "$images/../scenes" $name gdm-visibility,vdm,boxes; done
for name in torus bird dinosaur; do figure "$images/../scenes" $name gdm-visibility,boxes; done
"$build/vcp" meso build bark -o "$scratch/bark.meso" --transfer 32 --paths 256 --progress none
cp "$images/../scenes/gdm_tree.json" "$scratch"
figure "$scratch" tree gdm-visibility,boxes

# Iterations of five methods on the same rays.
draw heat '{"asset": "hemispheres", "tiles": 2}' --methods relief-binary,dm,ddm,ddm-quadric,boxes --shading steps --size 200x110 --camera 30,12,1.5

# Beads of 3.2 cells at grid 16: fitted quadrics, quadrics through crossings, exact cells.
draw quadrics '{"asset": "beads", "tiles": 1, "grid": 16, "far": false, '"$clay}" \
    --methods ddm-quadric-fitted,ddm-quadric,boxes --size 240x180 --camera 30,35,1.6

# Two refinements after five steps: binary search, secant; and what is there.
draw two_refinements '{"asset": "hemispheres", "tiles": 2, "steps": 5, "refinements": 2, "far": false, '"$clay}" \
    --methods relief-binary,relief-secant,pyramid --size 240x180 --camera 30,25,2

# The ball goes through the maze.
n=0
for place in "0.11, 0.11" "0.11, 0.36" "-0.14, 0.36" "-0.39, 0.36"; do
    n=$((n + 1))
    draw ball_$n '{"asset": "maze", "tiles": 1, '"$clay}, "'{"asset": "ball", "tiles": 1, "scale": 0.667, "base": false, "translate": ['"$place, -0.053], $gold}" \
        --shadows --size 240x200 --camera=-75,45,2
done

# A scan stands in a field of beads.
"$build/make_scan" --triangles 200k -o "$scratch/statue.ply"
"$build/vcp" build "$scratch/statue.ply" -o "$scratch/statue.vcp"
up=y light=0.5,0.75,0.4 rest='"datasets": [{"file": "statue.vcp"}]' \
    draw scan '{"asset": "beads", "up": "y", "scale": 1.6, "tiles": 5, "translate": [0, -0.6, 0], '"$gold}" --shadows --size 480x420 --camera=-60,18,1.8
