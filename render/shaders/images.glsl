// What the images of a file show on triangles: octree/imaged_triangle.h and octree/image/image_filter.h as shaders read
// them. The words of the images (render/passes/image_words.h):
//
//   4 words            the number of materials; 0
//   4 words a material where its image begins, 0 where no level of it is here; RGBA8 that multiplies what the image
//                      shows; how it goes on beyond its edges, along u and, from bit 8 on, along v; 0
//   4 words an image   width and height of its level 0; number of its finest level here, and how many there are from
//                      that one on; then 4 words a level: width, height, its first texel, 0
//   1 word a texel     RGBA8, row by row
#include "octree/shared/image_lookup.h"

uvec4 imageRecord(uint word) {
    return uvec4(imageWords[word], imageWords[word + 1u], imageWords[word + 2u], imageWords[word + 3u]);
}

// A vertex of a triangle in an image: coordinates in steps, 2^kLog2TextureSteps across it, and the material plus 1; 0:
// there is none.
struct ImagePoint {
    ivec2 at;
    uint material;
};

// Word `i` of the texels of the colour pool from `texel` on.
uint fetchColourWord(uint texel, uint i) { return texelWord(fetchColour(texel + (i >> 2)), i & 3u); }

ImagePoint fetchImagePoint(uint colourVertices, uint vertices, uint vertex) {
    // Points follow the colours of the vertices without a gap.
    uint word = vertices + 3u * vertex;
    return ImagePoint(ivec2(fetchColourWord(colourVertices, word), fetchColourWord(colourVertices, word + 1u)),
                      fetchColourWord(colourVertices, word + 2u));
}

// A triangle in an image, as ImagedTriangle.
struct ImagedTriangle {
    uint image;  // word of its record
    uint wrapU, wrapV;
    vec4 factor;
    vec2 place, toB, toC;
};

// Returns b - a, where whole numbers would overflow.
vec2 exactDifference(ivec2 b, ivec2 a) { return vec2((b >> 1) - (a >> 1)) * 2.0 + vec2((b & 1) - (a & 1)); }

ImagedTriangle imagedTriangle(ImagePoint a, ImagePoint b, ImagePoint c) {
    uvec4 material = imageRecord(4u * a.material);
    ImagedTriangle t;
    t.image = material.x;
    t.factor = unpackUnorm4x8(material.y);
    t.wrapU = material.z & 255u;
    t.wrapV = material.z >> 8 & 255u;
    // Where images repeat, they may be mirrored, so whole numbers are left out in pairs; then single precision
    // suffices.
    int inPair = (2 << kLog2TextureSteps) - 1;
    ivec2 kept =
        ivec2(t.wrapU == kWrapClamp ? a.at.x : a.at.x & inPair, t.wrapV == kWrapClamp ? a.at.y : a.at.y & inPair);
    float unit = 1.0 / float(1 << kLog2TextureSteps);
    t.place = vec2(kept) * unit;
    t.toB = exactDifference(b.at, a.at) * unit;
    t.toC = exactDifference(c.at, a.at) * unit;
    return t;
}

float lightOfStored(float stored) { return stored <= 0.04045 ? stored / 12.92 : pow((stored + 0.055) / 1.055, 2.4); }
float storedOfLight(float light) { return light <= 0.0031308 ? light * 12.92 : 1.055 * pow(light, 1.0 / 2.4) - 0.055; }

// Returns the light of a texel times its alpha, and that, both times a weight.
vec4 weightedTexel(uint word, float weight) {
    vec4 texel = unpackUnorm4x8(imageWords[word]);
    weight *= texel.w;
    return vec4(lightOfStored(texel.x), lightOfStored(texel.y), lightOfStored(texel.z), 1.0) * weight;
}

// Returns what a level shows at a point, between four texels, times a weight.
vec4 bilinearLight(uvec4 level, ImagedTriangle t, vec2 at, float weight) {
    ivec2 size = ivec2(level.xy);
    vec2 p = vec2(boundedPlace(at.x * float(size.x) - 0.5), boundedPlace(at.y * float(size.y) - 0.5));
    vec2 below = floor(p), f = p - below;
    ivec2 low = ivec2(wrappedTexel(int(below.x), size.x, t.wrapU), wrappedTexel(int(below.y), size.y, t.wrapV));
    ivec2 high =
        ivec2(wrappedTexel(int(below.x) + 1, size.x, t.wrapU), wrappedTexel(int(below.y) + 1, size.y, t.wrapV));
    uint upper = level.z + uint(low.y * size.x), lower = level.z + uint(high.y * size.x);
    return weightedTexel(upper + uint(low.x), weight * (1.0 - f.y) * (1.0 - f.x)) +
           weightedTexel(upper + uint(high.x), weight * (1.0 - f.y) * f.x) +
           weightedTexel(lower + uint(low.x), weight * f.y * (1.0 - f.x)) +
           weightedTexel(lower + uint(high.x), weight * f.y * f.x);
}

// Returns the colour of a triangle at a point, encoded and with alpha, as filteredColour() times the material's factor.
vec4 imageColour(ImagedTriangle t, vec2 at, TextureSlope slope, vec3 n, vec3 direction, float pixelEdge) {
    uvec4 image = imageRecord(t.image);
    ImageFootprint footprint = imageFootprint(slope, n, direction, pixelEdge, vec2(image.xy));
    ImagePlaces places = imagePlaces(footprint, int(image.z), int(image.w));
    uint finer = t.image + 4u + 4u * uint(places.finer);
    uvec4 first = imageRecord(finer), second = imageRecord(places.coarser > 0.0 ? finer + 4u : finer);
    float part = 1.0 / float(places.count);
    vec4 sum = vec4(0.0);
    DONT_UNROLL for (int i = 0; i < places.count; i++) {
        vec2 place = at + ((float(i) + 0.5) * part - 0.5) * places.along;
        sum += bilinearLight(first, t, place, (1.0 - places.coarser) * part);
        if (places.coarser > 0.0) sum += bilinearLight(second, t, place, places.coarser * part);
    }
    // What is transparent lends no colour.
    if (!(sum.w > 0.0)) return vec4(0.0);
    vec3 light = sum.xyz / sum.w;
    return t.factor * vec4(storedOfLight(light.x), storedOfLight(light.y), storedOfLight(light.z), sum.w);
}
