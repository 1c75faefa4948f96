// What the passes of every API share: words, constants, and texels that are words.
#define INLINE
#define ROOT_RESIDUAL 1e-5
#define Real float
#define Real2 vec2
#define Real3 vec3
#define Real4 vec4
#define uint4 uvec4
#include "octree/shared/page_layout.h"
#include "render/shared/frame_layout.h"

// 1: vertices and cells have some; 2: triangles may have images, too; 3: and channels of their materials are shown
layout(constant_id = 3) const uint kColour = 0u;
layout(constant_id = 4) const uint kCountSteps = 0u;
layout(constant_id = 5) const uint kFalseColour = 0u;
// 1: pages of different levels may leave gaps between them; 0: the surface of each page covers the mesh's within it
layout(constant_id = 6) const uint kSeams = 0u;

// Word `i` of a texel.
uint texelWord(uvec4 texel, uint i) {
    uint lo = (i & 1u) == 0u ? texel.x : texel.y;
    uint hi = (i & 1u) == 0u ? texel.z : texel.w;
    return (i & 2u) == 0u ? lo : hi;
}
