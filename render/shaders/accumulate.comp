// Adds a part of a sample of a picture to the sums of those before it, as light, and shows the mean. A pixel without a
// hit before a transparent background adds nothing: the colour is the mean of what is seen, and alpha its part of the
// pixel. Reads constants and the part's picture; reads and writes the sums and the picture that is shown, which is
// sample 0 before sample 1 is added.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/bindings.glsl"
#include "render/shaders/tiles.glsl"
#include "render/shaders/sums.glsl"
#include "render/shared/hit_light.h"

layout(local_size_x = 8, local_size_y = 8) in;

vec4 seenLight(uint word) {
    vec4 colour = unpackUnorm4x8(word);
    return vec4(lightOfColour(colour.rgb) * colour.a, colour.a);
}

void main() {
    uvec2 pixel = ownPlace();
    if (pixel.x >= frame.width || pixel.y >= frame.partRows) return;
    uint at = (pixel.y + frame.partRow) * frame.width + pixel.x;
    vec4 before = frame.sampleNumber == 1u ? seenLight(fetchShown(at)) : fetchSum(at);
    vec4 sum = before + seenLight(fetchPart((pixel.y + frame.skippedRows) * frame.width + pixel.x));
    storeSum(at, sum);
    storeShown(at,
               packUnorm4x8(vec4(colourOfLight(sum.rgb / max(sum.a, 1.0)), sum.a / float(frame.sampleNumber + 1u))));
}
