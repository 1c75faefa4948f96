// How WebGL binds what the passes read, and keeps what they write until the end of main (expand.mjs): in place of the
// file of this name that other APIs have. A unit of 16 KiB of the pool is a row of 1024 texels.
#define DONT_UNROLL
#include "render/shaders/words.glsl"

layout(std140) uniform FrameBlock { FrameConstants frame; };
uniform usampler2DArray poolTexels;
uniform usampler2DArray imageTexels;
uniform usampler2D tableTexels;
uniform usampler2D tileStartTexels;
uniform usampler2D hitTexels;      // depth, normal, colour, and the value of a false colour or the page's record plus 1
uniform usampler2D lightTexels;    // light
uniform usampler2D channelTexels;  // normal, roughness and metalness, emission

// What a pass writes of its pixel.
uvec4 storedHit = uvec4(0u), storedChannels = uvec4(0u);
uint storedMark = 0u, storedPicture = 0u, storedStart = 0u;

ivec3 inRows(uint texel) { return ivec3(texel & 1023u, texel >> 10 & 1023u, texel >> 20); }

uvec4 fetchTexel(uint texel) { return texelFetch(poolTexels, inRows(texel), 0); }

uvec4 fetchColour(uint texel) { return texelFetch(poolTexels, inRows(texel), 0); }

uint fetchWord(uint texel, uint i) { return texelWord(fetchTexel(texel + (i >> 2)), i & 3u); }

uint fetchImageWord(uint i) { return texelWord(texelFetch(imageTexels, inRows(i >> 2), 0), i & 3u); }

uvec4 fetchTable(uint texel) { return texelFetch(tableTexels, ivec2(texel & 1023u, texel >> 10), 0); }

float fetchTileStart(uint tile) {
    return uintBitsToFloat(texelFetch(tileStartTexels, ivec2(tile % frame.tilesX, tile / frame.tilesX), 0).x);
}

uint fetchHit(uint i) {
    uint size = frame.width * frame.height, plane = i / size, at = i - plane * size;
    ivec2 pixel = ivec2(at % frame.width, at / frame.width);
    if (plane > frame.lightPlane) return texelWord(texelFetch(channelTexels, pixel, 0), plane - frame.lightPlane - 1u);
    if (plane < 2u || (kColour != 0u && plane == 2u)) return texelWord(texelFetch(hitTexels, pixel, 0), plane);
    return kFalseColour != 0u ? texelFetch(hitTexels, pixel, 0).w : texelFetch(lightTexels, pixel, 0).x;
}

void storeHit(uint i, uint word) {
    uint plane = i / (frame.width * frame.height);
    if (plane > frame.lightPlane) {
        uint at = plane - frame.lightPlane - 1u;
        if (at == 0u) storedChannels.x = word;
        if (at == 1u) storedChannels.y = word;
        if (at == 2u) storedChannels.z = word;
        return;
    }
    if (plane == 0u)
        storedHit.x = word;
    else if (plane == 1u)
        storedHit.y = word;
    else if (kColour != 0u && plane == 2u)
        storedHit.z = word;
    else
        storedHit.w = word;
}

void storePicture(uint pixel, uint colour) { storedPicture = colour; }

void storeTileStart(uvec2 tile, float start) { storedStart = floatBitsToUint(start); }

// Pages that are hit are marked from the records of pixels.
void storeMark(uint record, uint kind) {}

void storeHitPage(uint record, bool found) { storedMark = found ? record + 1u : 0u; }

#include "render/shaders/frame_reads.glsl"
