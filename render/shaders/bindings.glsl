// The one descriptor set of all passes, and the one way to read pages and tables: fetchTexel and its like.
// Read-only data is bound twice, as texel buffers (the fast path of software devices, whose storage
// buffer loads are scalar loops) and as storage buffers; kTexelAccess chooses.
#extension GL_EXT_control_flow_attributes : require
#define INLINE
#define DONT_UNROLL [[dont_unroll]]
#define ROOT_RESIDUAL 1e-5
#define Real float
#define Real2 vec2
#define Real3 vec3
#define Real4 vec4
#define uint4 uvec4
#include "octree/shared/page_layout.h"
#include "render/shared/frame_layout.h"

layout(constant_id = 0) const uint kTexelAccess = 1u;
layout(constant_id = 1) const uint kPoolChunks = 1u;
layout(constant_id = 2) const uint kChunkShift = 26u;  // log2 of 16-byte texels a chunk
// 1: vertices and cells have some; 2: triangles may have images, too; 3: and channels of their materials are shown
layout(constant_id = 3) const uint kColour = 0u;
layout(constant_id = 4) const uint kCountSteps = 0u;
layout(constant_id = 5) const uint kFalseColour = 0u;
// 1: pages of different levels may leave gaps between them; 0: the surface of each page covers the mesh's within it
layout(constant_id = 6) const uint kSeams = 0u;

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

// A light as FrameConstants::lightDirection has it, and its bits of the part of the light that is seen: the one light
// has all eight.
vec4 lightNumbered(uint number) { return number == 0u ? frame.lightDirection : frame.moreLights[number - 1u]; }
uint bitsOfLight(uint number) { return frame.lightCount == 1u ? 255u : 1u << number; }

uvec2 pictureSize() { return uvec2(frame.width, frame.height); }

// Returns a pixel's edge at a depth, in finest cells.
float pixelEdgeAt(float depth) { return frame.pixelEdge + frame.pixelEdgePerDepth * depth; }

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

// The parts of record `number` of the page table.
TableNode fetchTableNode(uint number) {
    uvec4 t = fetchTable(number * kRecordTexels);
    return TableNode(t.x, t.y, t.z, t.w);
}

TableSections fetchTableSections(uint number) {
    uvec4 t = fetchTable(number * kRecordTexels + 1u);
    return TableSections(t.x, t.y, t.z, t.w);
}

TableColours fetchTableColours(uint number) {
    uvec4 t = fetchTable(number * kRecordTexels + 2u);
    return TableColours(t.x, t.y, t.z, t.w);
}

bool hasOctant(TableNode record, uint octant) { return (record.flags >> octant & 1u) != 0u; }

// Number in the table of the child in an octant that has one.
uint childIn(TableNode record, uint octant) {
    return record.firstChild + bitCount(record.flags & ((1u << octant) - 1u));
}

float fetchTileStart(uint tile) {
    return uintBitsToFloat(kTexelAccess == 1u ? texelFetch(tileStartTexels, int(tile)).x : tileStarts[tile]);
}

uint fetchTileList(uint i) { return kTexelAccess == 1u ? texelFetch(tileListTexels, int(i)).x : tileList[i]; }

uint fetchHit(uint i) { return kTexelAccess == 1u ? texelFetch(hitTexels, int(i)).x : hits[i]; }

// Word `i` of a texel.
uint texelWord(uvec4 texel, uint i) {
    uint lo = (i & 1u) == 0u ? texel.x : texel.y;
    uint hi = (i & 1u) == 0u ? texel.z : texel.w;
    return (i & 2u) == 0u ? lo : hi;
}

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

// The two words of a record of 8 bytes.
uvec2 fetchPair(uint sectionTexel, uint i) {
    uvec4 texel = fetchTexel(sectionTexel + (i >> 1));
    return (i & 1u) == 0u ? texel.xy : texel.zw;
}
