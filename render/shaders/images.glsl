// What the images of a file show on triangles: octree/imaged_triangle.h and octree/image/image_filter.h as shaders read
// them. The words of the images (render/pages/image_words.h):
//
//   4 words            the number of materials; 0
//   4 words a material where its image begins, 0 where it is not shown; RGBA8 that multiplies what the image shows; how
//                      it goes on beyond its edges, along u and, from bit 8 on, along v; where its channels begin, 0
//                      where none are shown
//   12 words for each of these: where its images of normals, of roughness and metalness, and of emission begin, 0 where
//                      there is none; how much right and up of normals count; roughness; metalness; 0; 0; light of the
//                      emission, red, green and blue; 0
//   4 words an image   width and height of its level 0; number of the finest level of which something is here, and how
//                      many levels it has; then 4 words a level: width, height, the word of its first tile, log2 of the
//                      edge of its tiles
//   1 word a tile      where its texels begin, 0 where it is not here; row by row
//   1 word a texel     RGBA8, row by row of a tile
#define SELECT(condition, yes, no) ((condition) ? (yes) : (no))
#include "octree/shared/image_lookup.h"
#include "octree/shared/mapped_normal.h"
#undef SELECT

uvec4 imageRecord(uint word) {
    return uvec4(fetchImageWord(word), fetchImageWord(word + 1u), fetchImageWord(word + 2u), fetchImageWord(word + 3u));
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

// Returns the light of a texel times its alpha, and that, both times a weight. `ofNumbers`: it is no colour, and stays
// as it is.
vec4 weightedTexel(uint word, float weight, bool ofNumbers) {
    vec4 texel = unpackUnorm4x8(word);
    if (ofNumbers) return texel * weight;
    weight *= texel.w;
    return vec4(lightOfStored(texel.x), lightOfStored(texel.y), lightOfStored(texel.z), 1.0) * weight;
}

// Returns the word of the texels of the tile that has a texel of a level; 0 where it is not here.
uint tileOf(uvec4 level, ivec2 texel) {
    uint tilesX = (level.x + (1u << level.w) - 1u) >> level.w;
    return fetchImageWord(level.z + (uint(texel.y) >> level.w) * tilesX + (uint(texel.x) >> level.w));
}

// Returns a texel that is in such a tile.
uint texelOf(uvec4 level, uint tile, ivec2 texel) {
    uint edge = 1u << level.w;
    uint before = uint(texel.x) & ~(edge - 1u);
    uint width = min(edge, level.x - before);
    return fetchImageWord(tile + (uint(texel.y) & (edge - 1u)) * width + uint(texel.x) - before);
}

// Returns what a level shows at a point, between four texels, times a weight; nothing where not all of them are here.
vec4 bilinearLight(uvec4 level, ImagedTriangle t, vec2 at, float weight, bool ofNumbers, out bool isHere) {
    ivec2 size = ivec2(level.xy);
    vec2 p = vec2(boundedPlace(at.x * float(size.x) - 0.5), boundedPlace(at.y * float(size.y) - 0.5));
    vec2 below = floor(p), f = p - below;
    ivec2 low = ivec2(wrappedTexel(int(below.x), size.x, t.wrapU), wrappedTexel(int(below.y), size.y, t.wrapV));
    ivec2 high =
        ivec2(wrappedTexel(int(below.x) + 1, size.x, t.wrapU), wrappedTexel(int(below.y) + 1, size.y, t.wrapV));
    uint first = tileOf(level, low);
    uvec4 tiles = uvec4(first);
    if (low >> int(level.w) != high >> int(level.w))
        tiles =
            uvec4(first, tileOf(level, ivec2(high.x, low.y)), tileOf(level, ivec2(low.x, high.y)), tileOf(level, high));
    isHere = all(notEqual(tiles, uvec4(0u)));
    if (!isHere) return vec4(0.0);
    return weightedTexel(texelOf(level, tiles.x, low), weight * (1.0 - f.y) * (1.0 - f.x), ofNumbers) +
           weightedTexel(texelOf(level, tiles.y, ivec2(high.x, low.y)), weight * (1.0 - f.y) * f.x, ofNumbers) +
           weightedTexel(texelOf(level, tiles.z, ivec2(low.x, high.y)), weight * f.y * (1.0 - f.x), ofNumbers) +
           weightedTexel(texelOf(level, tiles.w, high), weight * f.y * f.x, ofNumbers);
}

// Returns what a level shows, or the next coarser one that is here; the coarsest is. `level`: word of its record;
// `end`: after those of the image.
vec4 levelLight(uint level, uint end, ImagedTriangle t, vec2 at, float weight, bool ofNumbers) {
    bool isHere = false;
    vec4 light = vec4(0.0);
    DONT_UNROLL
    for (; !isHere && level < end; level += 4u) {
        light = bilinearLight(imageRecord(level), t, at, weight, ofNumbers, isHere);
    }
    return light;
}

// Where a footprint lies on a triangle.
struct ImagedPoint {
    vec2 at;
    TextureSlope slope;
    vec3 n, direction;  // of the triangle and of the ray, unit
    float pixelEdge;    // in the units of the slope
};

// Returns the mean of an image over a footprint: of light times alpha, and of alpha; or of numbers.
vec4 imageMean(ImagedTriangle t, ImagedPoint p, bool ofNumbers) {
    uvec4 image = imageRecord(t.image);
    ImageFootprint footprint = imageFootprint(p.slope, p.n, p.direction, p.pixelEdge, vec2(image.xy));
    ImagePlaces places = imagePlaces(footprint, float(image.z), float(image.w - 1u));
    uint finer = t.image + 4u + 4u * uint(places.level), end = t.image + 4u + 4u * image.w;
    float part = 1.0 / places.count, coarser = fract(places.level);
    vec4 sum = vec4(0.0);
    DONT_UNROLL for (int i = 0; i < int(places.count); i++) {
        vec2 place = p.at + ((float(i) + 0.5) * part - 0.5) * places.along;
        sum += levelLight(finer, end, t, place, (1.0 - coarser) * part, ofNumbers);
        if (coarser > 0.0) sum += levelLight(finer + 4u, end, t, place, coarser * part, ofNumbers);
    }
    return sum;
}

// Returns the colour of a triangle at a point, encoded and with alpha, as filteredColour() times the material's factor.
vec4 imageColour(ImagedTriangle t, ImagedPoint p) {
    vec4 sum = imageMean(t, p, false);
    // What is transparent lends no colour.
    if (!(sum.w > 0.0)) return vec4(0.0);
    vec3 light = sum.xyz / sum.w;
    return t.factor * vec4(storedOfLight(light.x), storedOfLight(light.y), storedOfLight(light.z), sum.w);
}
