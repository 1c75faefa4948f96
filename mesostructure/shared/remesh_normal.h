// A displaced surface at a place of its map, in C++ (mesostructure/remesh/remesh_math.h) and GLSL (render/shaders/
// remesh_merge.comp): the normal, for a footprint, that a pixel of a remeshed surface is shaded with, and the point
// from which rays of light start there, however large the triangle is that the pixel shows. After remesh_heights.h.

// What a base triangle's places and directions are over the map. The first corner is that of the lowest number, the
// last that of the highest.
struct RemeshFrame {
    Real3 byU, byV, directionByU, directionByV;  // derivatives by the texture coordinates
    Real3 place, direction;                      // of the first corner, which is at `at`
    Real2 at;
    Real2 toSecond, toLast;  // from there to the other corners
    Real3 facet;             // the triangle's own normal
    Real turned;             // sign of a product of derivatives that points outwards; 0 where the map has no area
};

// Whether a place in tile units is one of the base triangle.
INLINE bool remeshIsWithin(CONST_REF(RemeshFrame) frame, Real2 at) {
    Real2 off = at - frame.at, b = frame.toSecond, c = frame.toLast;
    Real area = b.x * c.y - b.y * c.x, second = (off.x * c.y - off.y * c.x) / area,
         last = (b.x * off.y - b.y * off.x) / area;
    return second >= Real(0) && last >= Real(0) && second + last <= Real(1);
}

// Returns the heights' derivative along an axis of the map, from what lies `reach` ahead and behind. Where the base
// triangle goes on the other way, it does not look over an edge: there the heights may bend as sharply as the base
// does.
INLINE Real remeshSlope(CONST_REF(RemeshFrame) frame, CONST_REF(RemeshFootprint) footprint, Real2 at, Real2 reach) {
    Real2 far = Real(4) * reach;
    bool looksAhead = remeshIsWithin(frame, at + reach) || !remeshIsWithin(frame, at - far);
    bool looksBehind = remeshIsWithin(frame, at - reach) || !remeshIsWithin(frame, at + far);
    Real ahead = looksAhead ? Real(1) : Real(0), behind = looksBehind ? Real(1) : Real(0);
    Real rise = remeshHeight(footprint, at + ahead * reach) - remeshHeight(footprint, at - behind * reach);
    return rise / ((ahead + behind) * (reach.x + reach.y));
}

// Returns the unit normal at a place in tile units. `texels`: the edge of the footprint, in texels.
INLINE Real3 remeshNormal(CONST_REF(RemeshFrame) frame, Real texels, Real2 at) {
    if (frame.turned == Real(0)) return frame.facet;
    // A map without coarser levels is that of an atlas: a wider look would go beyond the chart.
    Real step = (remeshLevels() == 1 ? Real(1) : max(texels, Real(1))) / Real(remeshLevel(0).size.x);
    RemeshFootprint footprint = remeshFootprint(texels);
    Real reach = Real(0.5) * step;
    Real alongU = remeshSlope(frame, footprint, at, Real2(reach, 0));
    Real alongV = remeshSlope(frame, footprint, at, Real2(0, reach));
    Real height = remeshHeight(footprint, at);
    Real2 off = at - frame.at;
    Real3 direction = frame.direction + off.x * frame.directionByU + off.y * frame.directionByV;
    Real3 u = frame.byU + alongU * direction + height * frame.directionByU;
    Real3 v = frame.byV + alongV * direction + height * frame.directionByV;
    Real3 normal = cross(u, v);
    Real square = dot(normal, normal);
    return square > Real(0) ? normal * (frame.turned / sqrt(square)) : frame.facet;
}

// Returns the point of the surface at a place in tile units, as rays that march the map meet it: a shell is linear in
// each of a prism's three pieces (mesostructure/shell.h), where what is remeshed is linear along each direction. At a
// height of the map, the pieces have the last corner's column first, then the second's, then the first's.
INLINE Real3 remeshShellPoint(CONST_REF(RemeshFrame) frame, Real2 at) {
    Real2 off = at - frame.at, b = frame.toSecond, c = frame.toLast;
    Real area = b.x * c.y - b.y * c.x, height = remeshLevelHeight(remeshLevel(0), at);
    Real second = (off.x * c.y - off.y * c.x) / area, last = (b.x * off.y - b.y * off.x) / area;
    Real ofLast = min(height, max(last, Real(0)));
    Real ofSecond = min(height - ofLast, max(second, Real(0)));
    Real2 turn = ofSecond * b + ofLast * c;
    return frame.place + off.x * frame.byU + off.y * frame.byV + height * frame.direction +
           turn.x * frame.directionByU + turn.y * frame.directionByV;
}
