// The descriptor set of the mesostructure passes (render/passes/meso_bindings.h).
#define INLINE
#define CONST_REF(T) T
#define INOUT(T) inout T
#define OUT(T) out T
#define Real float
#define Real2 vec2
#define Real3 vec3
#define Real4 vec4
#define Real3x3 mat3
#define REAL_EPSILON 1.1920929e-7
#include "mesostructure/shared/march_layout.h"
#include "mesostructure/shared/shell_layout.h"
#include "mesostructure/shared/transfer_layout.h"
#include "render/shared/meso_layout.h"
#include "render/shared/shell_records.h"

layout(constant_id = 0) const uint kWalk = 0u;
layout(constant_id = 1) const uint kSkip = 0u;
layout(constant_id = 2) const uint kSurface = 0u;
layout(constant_id = 3) const uint kRefinement = 0u;

layout(set = 0, binding = 0, std140) uniform MesoBlock {
    MesoRecord meso;
    MesoView view;
};
layout(set = 0, binding = 1) uniform utextureBuffer wordTexels;
layout(set = 0, binding = 2) uniform utextureBuffer quadTexels;
layout(set = 0, binding = 3) uniform textureBuffer inputTexels;  // rays, or the shell
layout(set = 0, binding = 4, std430) buffer HitBlock { uint hits[]; };
layout(set = 0, binding = 5, std430) buffer PictureBlock { uint picturePixels[]; };
// Unresolved rays; hits from far; pixels that anything is hit in.
layout(set = 0, binding = 6, std430) buffer CounterBlock { uint counters[]; };
layout(set = 0, binding = 7) uniform textureBuffer lookTexels;  // what is seen from far, textures
// Of pictures in which surfaces and datasets shade each other: planes of light (scene_planes.glsl), and depths of all.
layout(set = 0, binding = 8, std430) buffer SceneLightBlock { uint sceneLight[]; };
layout(set = 0, binding = 9, std430) buffer TargetDepthBlock { uint targetDepths[]; };
layout(set = 0, binding = 10) uniform textureBuffer baseLightTexels;
// The number of the picture; at entries of tiles of heights (remesh_levels.glsl), that of the last picture to read
// them.
layout(set = 0, binding = 11, std430) buffer HeightMarkBlock { uint heightMarks[]; };
layout(push_constant) uniform RayBlock { MesoLightRay ray; };

uint fetchWord(uint i) { return texelFetch(wordTexels, int(i)).x; }
uvec4 fetchQuad(uint i) { return texelFetch(quadTexels, int(i)); }
vec4 fetchInput(int i) { return texelFetch(inputTexels, i); }
vec4 fetchLook(int i) { return texelFetch(lookTexels, i); }
vec4 fetchBaseLight(int i) { return texelFetch(baseLightTexels, i); }
