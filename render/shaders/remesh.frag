// Writes where the nearest of the remeshed triangles is, for the merge pass.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "render/shaders/remesh_view.glsl"

layout(location = 0) in vec3 at;
layout(location = 1) in vec3 pointing;
layout(location = 2) in vec2 place;

layout(location = 0) out vec4 hit;      // depth along the unit ray, place in tile units, 1
layout(location = 1) out vec4 surface;  // unit normal in the world, edge of the pixel's footprint in tile units

void main() {
    bool isParallel = projection.depth.z == 0.0;
    vec3 d = isParallel ? vec3(0.0, 0.0, 1.0) : normalize(at), n = normalize(pointing);
    // A normal that points away from the eye is turned until it does not.
    if (dot(n, d) > 0.0) n = dot(n, d) > 0.99 ? -d : normalize(n - dot(n, d) * d);
    hit = vec4(isParallel ? at.z : length(at), place, 1.0);
    vec2 x = dFdx(place), y = dFdy(place);
    surface = vec4(mat3(projection.axes) * n, max(length(x), length(y)));
}
