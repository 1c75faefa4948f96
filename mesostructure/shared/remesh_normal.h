// The normal of a displaced surface at a place of its map, for a footprint on it, in C++ (mesostructure/remesh/
// remesh_math.h) and GLSL (render/shaders/remesh_merge.comp): what a pixel of a remeshed surface is shaded with,
// however large the triangle is that it shows. After remesh_heights.h.

// What a base triangle's places and directions are over the map.
struct RemeshFrame {
    Real3 byU, byV, directionByU, directionByV;  // derivatives by the texture coordinates
    Real3 direction;                             // at `at`, which is a corner
    Real2 at;
    Real3 facet;  // the triangle's own normal
    Real turned;  // sign of a product of derivatives that points outwards; 0 where the map has no area
};

// Returns the unit normal at a place in tile units. `texels`: the edge of the footprint, in texels.
INLINE Real3 remeshNormal(CONST_REF(RemeshFrame) frame, Real texels, Real2 at) {
    if (frame.turned == Real(0)) return frame.facet;
    // A map without coarser levels is that of an atlas: a wider look would go beyond the chart.
    Real step = (remeshLevels() == 1 ? Real(1) : max(texels, Real(1))) / Real(remeshLevel(0).size.x);
    RemeshFootprint footprint = remeshFootprint(texels);
    Real reach = Real(0.5) * step;
    Real alongU = remeshHeight(footprint, at + Real2(reach, 0)) - remeshHeight(footprint, at - Real2(reach, 0));
    Real alongV = remeshHeight(footprint, at + Real2(0, reach)) - remeshHeight(footprint, at - Real2(0, reach));
    Real height = remeshHeight(footprint, at);
    Real2 off = at - frame.at;
    Real3 direction = frame.direction + off.x * frame.directionByU + off.y * frame.directionByV;
    Real3 u = frame.byU + alongU / step * direction + height * frame.directionByU;
    Real3 v = frame.byV + alongV / step * direction + height * frame.directionByV;
    Real3 normal = cross(u, v);
    Real square = dot(normal, normal);
    return square > Real(0) ? normal * (frame.turned / sqrt(square)) : frame.facet;
}
