// Writes where the nearest of the remeshed triangles is, for the merge pass.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/remesh_view.glsl"

layout(location = 0) in vec3 at;
layout(location = 1) in vec2 place;
layout(location = 2) flat in uint triangle;

layout(location = 0) out vec4 hit;  // depth along the unit ray, place in tile units, 1 + number of the base triangle

void main() { hit = vec4(projection.depth.z == 0.0 ? at.z : length(at), place, float(triangle + 1u)); }
