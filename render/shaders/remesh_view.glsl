// What a remeshed surface is projected with (render/passes/remesh_raster.h): of eye space z, depth.z z + depth.w is
// what x and y are divided by, depth.x z + depth.y the depth before that; it is greater where it is nearer.
layout(push_constant) uniform ProjectionBlock {
    vec4 plane;  // scale and offset of x and y
    vec4 depth;
}
projection;
