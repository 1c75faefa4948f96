// Projects what was remeshed (mesostructure/remesh/remesher.h) onto the picture.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/remesh_view.glsl"

layout(location = 0) in vec3 position;  // eye space
layout(location = 1) in vec2 uv;        // tile units
layout(location = 2) in uint number;    // of the base triangle

layout(location = 0) out vec3 at;
layout(location = 1) out vec2 place;
layout(location = 2) flat out uint triangle;

void main() {
    float w = projection.depth.z * position.z + projection.depth.w;
    gl_Position = vec4(position.xy * projection.plane.xy + projection.plane.zw * w,
                       projection.depth.x * position.z + projection.depth.y, w);
    at = position;
    place = uv;
    triangle = number;
}
