// What GLSL of WebGL lacks.
precision highp float;
precision highp int;
precision highp usampler2D;
precision highp usampler2DArray;

uint bitCount(uint x) {
    x -= x >> 1 & 0x55555555u;
    x = (x & 0x33333333u) + (x >> 2 & 0x33333333u);
    return (x + (x >> 4) & 0x0f0f0f0fu) * 0x01010101u >> 24;
}

// The highest bit alone decides: without the bits below it and its neighbour, floats do not round up.
int findMSB(uint x) { return x == 0u ? -1 : int(floatBitsToUint(float(x & ~(x >> 1))) >> 23) - 127; }
int findLSB(uint x) { return findMSB(x & ~x + 1u); }

vec4 unpackUnorm4x8(uint x) { return vec4(x & 255u, x >> 8 & 255u, x >> 16 & 255u, x >> 24) / 255.0; }
uint packUnorm4x8(vec4 v) {
    uvec4 x = uvec4(clamp(v, 0.0, 1.0) * 255.0 + 0.5);
    return x.x | x.y << 8 | x.z << 16 | x.w << 24;
}

// mix() of whole numbers; built-in functions cannot be overloaded.
ivec3 mixed(ivec3 a, ivec3 b, bvec3 c) { return ivec3(c.x ? b.x : a.x, c.y ? b.y : a.y, c.z ? b.z : a.z); }
uvec3 mixed(uvec3 a, uvec3 b, bvec3 c) { return uvec3(c.x ? b.x : a.x, c.y ? b.y : a.y, c.z ? b.z : a.z); }
vec2 mixed(vec2 a, vec2 b, bvec2 c) { return mix(a, b, c); }
vec3 mixed(vec3 a, vec3 b, bvec3 c) { return mix(a, b, c); }
vec3 mixed(vec3 a, vec3 b, float c) { return mix(a, b, c); }
vec4 mixed(vec4 a, vec4 b, float c) { return mix(a, b, c); }
#define mix mixed
