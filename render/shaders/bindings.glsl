// The one descriptor set of all passes, and the one way to read pages and tables: fetchTexel and its like.
// Read-only data is bound twice, as texel buffers (the fast path of software devices, whose storage
// buffer loads are scalar loops) and as storage buffers; kTexelAccess chooses. Browsers have a file of this name of
// their own (viewer/web/shaders).
#extension GL_EXT_control_flow_attributes : require
#define DONT_UNROLL [[dont_unroll]]
#include "render/shaders/words.glsl"

layout(constant_id = 0) const uint kTexelAccess = 1u;
layout(constant_id = 1) const uint kPoolChunks = 1u;
layout(constant_id = 2) const uint kChunkShift = 26u;  // log2 of 16-byte texels a chunk
// clang-format off
layout(set = 0, binding = 0, std140) uniform FrameBlock { FrameConstants frame; };
layout(set = 0, binding = 1) uniform utextureBuffer poolTexels[kMaxPoolChunks];
layout(set = 0, binding = 2, std430) readonly buffer PoolBlock { uvec4 texels[]; } poolBlock[kMaxPoolChunks];
layout(set = 0, binding = 2, std430) readonly buffer PoolWordBlock { uint words[]; } poolWordBlock[kMaxPoolChunks];
layout(set = 0, binding = 3) uniform utextureBuffer colourTexels[kMaxPoolChunks];
layout(set = 0, binding = 4, std430) readonly buffer ColourBlock { uvec4 texels[]; } colourBlock[kMaxPoolChunks];
layout(set = 0, binding = 5) uniform utextureBuffer tableTexels;
layout(set = 0, binding = 6, std430) readonly buffer TableBlock { uvec4 texels[]; } tableBlock;
layout(set = 0, binding = 7, std430) buffer TileStartBlock { uint tileStarts[]; };
layout(set = 0, binding = 8) uniform utextureBuffer tileStartTexels;
layout(set = 0, binding = 9, std430) buffer TileListBlock { uint tileList[]; };
layout(set = 0, binding = 10) uniform utextureBuffer tileListTexels;
// A pixel's record: depth (float bits; negative on the cap of a section), normal (octahedral, 16 + 16 bits),
// colour (RGBA8), and at frame.lightPlane light (8 bits sun, 8 bits sky; of several lights each has a bit of the sun's) or the value of a false colour (float bits,
// 0 to 1); planes of width * height words. With kColour 3 three more follow the plane at frame.lightPlane: the normal by
// the channels of the material, roughness and metalness (packHitSurface), and emission (RGB8).
layout(set = 0, binding = 11, std430) buffer HitBlock { uint hits[]; };
layout(set = 0, binding = 12) uniform utextureBuffer hitTexels;
layout(set = 0, binding = 13, std430) writeonly buffer PictureBlock { uint picturePixels[]; };
layout(set = 0, binding = 14, std430) buffer CounterBlock { FrameCounters counters; };
layout(set = 0, binding = 15, std430) buffer FeedbackBlock { uint feedback[]; };
layout(set = 0, binding = 21, std430) readonly buffer ImageBlock { uint imageWords[]; };  // images.glsl
// clang-format on

// Chunks are few and their number is known to the compiler: with one there is no choice to make.
#define FETCH_CHUNK(texelsName, blockName, i) \
    (kTexelAccess == 1u ? texelFetch(texelsName[i], int(offset)) : blockName[i].texels[offset])

uvec4 fetchTexel(uint texel) {
    uint offset = texel & ((1u << kChunkShift) - 1u);
    uint chunk = texel >> kChunkShift;
    if (kPoolChunks == 1u || chunk == 0u) return FETCH_CHUNK(poolTexels, poolBlock, 0);
    if (chunk == 1u) return FETCH_CHUNK(poolTexels, poolBlock, 1);
    if (chunk == 2u) return FETCH_CHUNK(poolTexels, poolBlock, 2);
    if (chunk == 3u) return FETCH_CHUNK(poolTexels, poolBlock, 3);
    if (chunk == 4u) return FETCH_CHUNK(poolTexels, poolBlock, 4);
    if (chunk == 5u) return FETCH_CHUNK(poolTexels, poolBlock, 5);
    if (chunk == 6u) return FETCH_CHUNK(poolTexels, poolBlock, 6);
    return FETCH_CHUNK(poolTexels, poolBlock, 7);
}

uvec4 fetchColour(uint texel) {
    uint offset = texel & ((1u << kChunkShift) - 1u);
    uint chunk = texel >> kChunkShift;
    if (kPoolChunks == 1u || chunk == 0u) return FETCH_CHUNK(colourTexels, colourBlock, 0);
    if (chunk == 1u) return FETCH_CHUNK(colourTexels, colourBlock, 1);
    if (chunk == 2u) return FETCH_CHUNK(colourTexels, colourBlock, 2);
    if (chunk == 3u) return FETCH_CHUNK(colourTexels, colourBlock, 3);
    if (chunk == 4u) return FETCH_CHUNK(colourTexels, colourBlock, 4);
    if (chunk == 5u) return FETCH_CHUNK(colourTexels, colourBlock, 5);
    if (chunk == 6u) return FETCH_CHUNK(colourTexels, colourBlock, 6);
    return FETCH_CHUNK(colourTexels, colourBlock, 7);
}

uvec4 fetchTable(uint texel) {
    return kTexelAccess == 1u ? texelFetch(tableTexels, int(texel)) : tableBlock.texels[texel];
}

float fetchTileStart(uint tile) {
    return uintBitsToFloat(kTexelAccess == 1u ? texelFetch(tileStartTexels, int(tile)).x : tileStarts[tile]);
}

uint fetchTileList(uint i) { return kTexelAccess == 1u ? texelFetch(tileListTexels, int(i)).x : tileList[i]; }

uint fetchHit(uint i) { return kTexelAccess == 1u ? texelFetch(hitTexels, int(i)).x : hits[i]; }

// One word of the pool: word `i` of the texels from `texel` on. Storage buffers need not read the other three.
uint fetchWord(uint texel, uint i) {
    if (kTexelAccess == 1u) return texelWord(fetchTexel(texel + (i >> 2)), i & 3u);
    uint offset = ((texel & ((1u << kChunkShift) - 1u)) << 2) + i;
    uint chunk = texel >> kChunkShift;
    if (kPoolChunks == 1u || chunk == 0u) return poolWordBlock[0].words[offset];
    if (chunk == 1u) return poolWordBlock[1].words[offset];
    if (chunk == 2u) return poolWordBlock[2].words[offset];
    if (chunk == 3u) return poolWordBlock[3].words[offset];
    if (chunk == 4u) return poolWordBlock[4].words[offset];
    if (chunk == 5u) return poolWordBlock[5].words[offset];
    if (chunk == 6u) return poolWordBlock[6].words[offset];
    return poolWordBlock[7].words[offset];
}

uint fetchImageWord(uint i) { return imageWords[i]; }

// Word `i` of the planes of hits.
void storeHit(uint i, uint word) { hits[i] = word; }

void storePicture(uint pixel, uint colour) { picturePixels[pixel] = colour; }

// The start of a tile, which is listed where it is not empty.
void storeTileStart(uvec2 tile, float start) {
    tileStarts[tile.y * frame.tilesX + tile.x] = floatBitsToUint(start);
    if (start >= kTileEmpty) return;
    uint at = atomicAdd(tileList[3], 1u);
    tileList[kTileListHeader + at] = tile.y << 16 | tile.x;
    if (at % kTileRow == 0u) atomicAdd(tileList[1], 1u);
}

// Notes that rays of a kind hit a page, or begin in it. Precondition: marks are asked for.
void storeMark(uint record, uint kind) { feedback[frame.firstHitMark + 2u * record + kind] = 1u; }

// Notes the page of a pixel's hit, for bindings that have no marks.
void storeHitPage(uint record, bool found) {}

#include "render/shaders/frame_reads.glsl"
