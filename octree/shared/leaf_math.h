// The surface inside a leaf: decoding, evaluation, intersection. Compiles as GLSL (Real = float) and as
// C++ in float and double (octree/surface/leaf_math.h), so that the tests of the C++ cover the shader.
// Only the common subset of GLSL and GLM is used: no swizzles, no in/out arguments.
//
// Source: Demir and Westermann 2015, section 2.2, replaced by the half-gradient surface of
// docs/surface.md: f(x) = sum w_i(x) [ D_i + 1/2 N_i . (x - p_i) ] with signed distances D_i, oriented
// directions N_i and trilinear weights w_i; exact where the surface is a quadric's level set.

// The triangles of hard leaves are widened by so many cells of the page's level.
const Real kTriangleSlack = Real(1e-4);
// How far outside of its leaf a hit with a triangle may lie along the ray, in cells of the page's level.
const Real kIntervalSlack = Real(1e-4);

// Returns the unit vector at a point of [-1, 1]^2, the unfolded octahedron.
INLINE Real3 unfoldOctahedron(Real x, Real y) {
    Real z = Real(1.0) - abs(x) - abs(y);
    Real fold = max(-z, Real(0.0));
    x += x >= Real(0.0) ? -fold : fold;
    y += y >= Real(0.0) ? -fold : fold;
    Real scale = inversesqrt(x * x + y * y + z * z);
    return Real3(x * scale, y * scale, z * scale);
}

// Octahedral direction, 10 + 10 bits (Meyer et al. 2010). Unit length.
INLINE Real3 decodeDirection(uint code) {
    Real x = Real(code & 1023u) * Real(2.0 / 1023.0) - Real(1.0);
    Real y = Real((code >> 10) & 1023u) * Real(2.0 / 1023.0) - Real(1.0);
    return unfoldOctahedron(x, y);
}

// Octahedral normal, 16 + 16 bits; the lowest bit is the crease flag and costs no visible accuracy.
INLINE Real3 decodeNormal(uint code) {
    Real x = Real(code & 0xfffeu) * Real(2.0 / 65534.0) - Real(1.0);
    Real y = Real(code >> 16) * Real(2.0 / 65535.0) - Real(1.0);
    return unfoldOctahedron(x, y);
}

// Distance of a packed vector, in leaf edges, and the side of the surface its corner is on.
INLINE Real decodeDistance(uint code) {
    return Real(code & kPackedDistanceMax) * (Real(kPackedDistanceRange) / Real(kPackedDistanceMax));
}
INLINE Real decodeSide(uint code) { return (code >> 31) != 0u ? Real(-1.0) : Real(1.0); }

// Position of a packed vertex in page space (cells).
INLINE Real3 decodeVertex(uint lo, uint hi) {
    uint y = (lo >> 21) | ((hi & 0x3ffu) << 11);
    int ix = int(lo & kField21Mask) - kLatticeBias;
    int iy = int(y) - kLatticeBias;
    int iz = int((hi >> 10) & kField21Mask) - kLatticeBias;
    return Real3(Real(ix), Real(iy), Real(iz)) * (Real(1.0) / Real(kLatticePerCell));
}

// Rotates leaf space so that the leaf's axis is x and the next axes, cyclically, are y and z: for the weights only.
INLINE Real3 rotateToAxis(Real3 x, uint axis) {
    return axis == 0u ? x : axis == 1u ? Real3(x.y, x.z, x.x) : Real3(x.z, x.x, x.y);
}

// A soft leaf, decoded. Members ending in 0 hold the corners of the axis' lower face, those ending in 1 its upper face.
// f(x) = sum w_i (a_i + g_i . x); g is half the oriented direction.
struct LeafField {
    Real4 a0, a1;
    Real4 gx0, gx1;
    Real4 gy0, gy1;
    Real4 gz0, gz1;
    uint axis;
};

INLINE LeafField decodeLeaf(uint4 face0, uint4 face1, uint axis) {
    Real3 n0 = decodeDirection(face0.x >> 11), n1 = decodeDirection(face0.y >> 11);
    Real3 n2 = decodeDirection(face0.z >> 11), n3 = decodeDirection(face0.w >> 11);
    Real3 m0 = decodeDirection(face1.x >> 11), m1 = decodeDirection(face1.y >> 11);
    Real3 m2 = decodeDirection(face1.z >> 11), m3 = decodeDirection(face1.w >> 11);
    Real4 s0 = Real4(decodeSide(face0.x), decodeSide(face0.y), decodeSide(face0.z), decodeSide(face0.w));
    Real4 s1 = Real4(decodeSide(face1.x), decodeSide(face1.y), decodeSide(face1.z), decodeSide(face1.w));
    Real4 d0 =
        Real4(decodeDistance(face0.x), decodeDistance(face0.y), decodeDistance(face0.z), decodeDistance(face0.w));
    Real4 d1 =
        Real4(decodeDistance(face1.x), decodeDistance(face1.y), decodeDistance(face1.z), decodeDistance(face1.w));
    Real4 h0 = s0 * Real(0.5), h1 = s1 * Real(0.5);
    LeafField leaf;
    leaf.axis = axis;
    leaf.gx0 = Real4(n0.x, n1.x, n2.x, n3.x) * h0;
    leaf.gy0 = Real4(n0.y, n1.y, n2.y, n3.y) * h0;
    leaf.gz0 = Real4(n0.z, n1.z, n2.z, n3.z) * h0;
    leaf.gx1 = Real4(m0.x, m1.x, m2.x, m3.x) * h1;
    leaf.gy1 = Real4(m0.y, m1.y, m2.y, m3.y) * h1;
    leaf.gz1 = Real4(m0.z, m1.z, m2.z, m3.z) * h1;
    // a_i = D_i - 1/2 N_i . p_i. Corner p_i is at 0 or 1 along the axis, at `next` and `last` along the other two.
    Real4 next = Real4(0.0, 1.0, 0.0, 1.0), last = Real4(0.0, 0.0, 1.0, 1.0);
    Real4 along0 = axis == 0u   ? leaf.gy0 * next + leaf.gz0 * last
                   : axis == 1u ? leaf.gz0 * next + leaf.gx0 * last
                                : leaf.gx0 * next + leaf.gy0 * last;
    Real4 along1 = axis == 0u   ? leaf.gx1 + leaf.gy1 * next + leaf.gz1 * last
                   : axis == 1u ? leaf.gy1 + leaf.gz1 * next + leaf.gx1 * last
                                : leaf.gz1 + leaf.gx1 * next + leaf.gy1 * last;
    leaf.a0 = d0 * s0 - along0;
    leaf.a1 = d1 * s1 - along1;
    return leaf;
}

#include "octree/shared/ray_field.h"

INLINE Real leafValue(LeafField leaf, Real3 x) {
    Real3 r = rotateToAxis(x, leaf.axis);
    Real4 w = faceWeights(r.y, r.z);
    Real4 l0 = leaf.a0 + leaf.gx0 * x.x + leaf.gy0 * x.y + leaf.gz0 * x.z;
    Real4 l1 = leaf.a1 + leaf.gx1 * x.x + leaf.gy1 * x.y + leaf.gz1 * x.z;
    return dot(w, l0) * (Real(1.0) - r.x) + dot(w, l1) * r.x;
}

// Blended direction (not normalized): continuous over faces, unlike the gradient of f.
INLINE Real3 leafNormal(LeafField leaf, Real3 x) {
    Real3 r = rotateToAxis(x, leaf.axis);
    Real4 w = faceWeights(r.y, r.z);
    Real4 w0 = w * (Real(1.0) - r.x);
    Real4 w1 = w * r.x;
    return Real3(dot(w0, leaf.gx0) + dot(w1, leaf.gx1), dot(w0, leaf.gy0) + dot(w1, leaf.gy1),
                 dot(w0, leaf.gz0) + dot(w1, leaf.gz1));
}

// Returns n or -n, whichever is on the side of `reference`.
INLINE Real3 turnedTo(Real3 n, Real3 reference) { return dot(n, reference) < Real(0.0) ? -n : n; }

// Returns what a vertex adds to the normal within a triangle, on the side of the triangle's own normal: that one itself
// at a crease, else the vertex'. `code`: the vertex' packed normal.
INLINE Real3 cornerNormal(uint code, Real3 ofTriangle) {
    return (code & kNormalCreaseBit) != 0u ? ofTriangle : turnedTo(decodeNormal(code), ofTriangle);
}

// Turns a soft leaf's normal (leafNormal) to the side that a ray along d comes from. Where the ray grazes the surface,
// `side` decides (sideBefore): a normal a little past the silhouette must not turn over.
INLINE Real3 facingNormal(Real3 n, Real3 d, Real side) {
    Real along = dot(n, d);
    bool grazing = along * along < Real(0.09) * dot(n, n) * dot(d, d);
    bool away = grazing ? side < Real(0.0) : along > Real(0.0);
    return away ? -n : n;
}

// A corner's plane on the segment: returns its value at the segment's start, given from the corner, and its slope.
INLINE Real2 cornerOnRay(uint code, Real3 fromCorner, Real3 d) {
    Real3 n = decodeDirection(code >> 11);
    return Real2(decodeDistance(code) + Real(0.5) * dot(n, fromCorner), Real(0.5) * dot(n, d)) * decodeSide(code);
}

INLINE RayField restrictToRay(uint4 face0, uint4 face1, uint axis, Real3 p, Real3 d) {
    // Corners are named by their bits along the axis and the next two.
    bvec3 along = bvec3(axis == 0u, axis == 1u, axis == 2u);
    bvec3 next = bvec3(along.z, along.x, along.y), last = bvec3(along.y, along.z, along.x);
    Real3 q = p - Real3(1.0);
    Real2 v000 = cornerOnRay(face0.x, p, d), v010 = cornerOnRay(face0.y, mix(p, q, next), d);
    Real2 v001 = cornerOnRay(face0.z, mix(p, q, last), d), v011 = cornerOnRay(face0.w, mix(q, p, along), d);
    Real2 v100 = cornerOnRay(face1.x, mix(p, q, along), d), v110 = cornerOnRay(face1.y, mix(q, p, last), d);
    Real2 v101 = cornerOnRay(face1.z, mix(q, p, next), d), v111 = cornerOnRay(face1.w, q, d);
    return blendOnRay(Real4(v000.x, v010.x, v001.x, v011.x), Real4(v000.y, v010.y, v001.y, v011.y),
                      Real4(v100.x, v110.x, v101.x, v111.x), Real4(v100.y, v110.y, v101.y, v111.y),
                      rotateToAxis(p, axis), rotateToAxis(d, axis));
}

// Returns a number with the sign of f on the side that the ray comes from to its hit at u: that of its first point in
// the leaf. A hit on the wall by which the ray enters may lie a little before or behind the surface: there f an eighth
// of a leaf edge before the wall decides. d: the segment's extent in leaf space.
INLINE Real sideBefore(RayField ray, Real u, Real3 d) {
    if (u > Real(0.0)) return ray.c.x;
    return rayValue(ray, Real(-0.125) * inversesqrt(max(dot(d, d), Real(1e-12))));
}

INLINE Real wallTolerance(uint node) {
    Real code = Real((node >> kSoftWallShift) & kSoftWallMask);
    return max(Real(kWallRounding), Real(kWallUnit) * code * code);
}

INLINE Real dipBound(uint node) {
    uint code = node >> kSoftDipShift & 3u;
    return code == 0u ? Real(0.004) : code == 1u ? Real(0.02) : code == 2u ? Real(0.1) : Real(1e30);
}

// Returns the first crossing of the segment with f = 0, as u in [0, 1], or -1.
// wallIn, wallOut: |f| that counts as a hit at u = 0 and u = 1 (0 where that end is not a wall);
// dip: how far f can swing between two ends on the same side (see page_layout.h).
// The bracket is refined by the Illinois variant of false position, at most `steps` times, and until f is
// within ROOT_RESIDUAL leaf edges of zero.
INLINE Real firstCrossing(RayField ray, Real wallIn, Real wallOut, Real dip, int steps) {
    Real fa = ray.c.x;
    if (abs(fa) <= wallIn) return Real(0.0);
    Real fb = ray.last;
    Real a = Real(0.0), b = Real(1.0);
    bool below = fa < Real(0.0);
    if ((fb < Real(0.0)) == below) {
        Real end = abs(fb) <= wallOut ? Real(1.0) : Real(-1.0);
        if (min(abs(fa), abs(fb)) > dip) return end;
        // Both ends are on one side: look where the parabola through the middle turns.
        Real fm = rayValue(ray, Real(0.5));
        b = Real(0.5);
        if ((fm < Real(0.0)) == below) {
            Real curve = Real(2.0) * (fa + fb - Real(2.0) * fm);
            Real slope = Real(4.0) * fm - Real(3.0) * fa - fb;
            Real turn = -slope / (Real(2.0) * curve);
            if (!(turn > Real(0.0) && turn < Real(1.0))) return end;
            fm = rayValue(ray, turn);
            if ((fm < Real(0.0)) == below) return end;
            b = turn;
        }
        fb = fm;
    }
    int side = 0;
    DONT_UNROLL for (int i = 0; i < steps; i++) {
        Real u = a + (b - a) * (fa / (fa - fb));
        Real fu = rayValue(ray, u);
        if (abs(fu) <= Real(ROOT_RESIDUAL)) return u;
        if ((fu < Real(0.0)) == below) {
            a = u;
            fa = fu;
            if (side == -1) fb *= Real(0.5);
            side = -1;
        } else {
            b = u;
            fb = fu;
            if (side == 1) fa *= Real(0.5);
            side = 1;
        }
    }
    return a + (b - a) * (fa / (fa - fb));
}

// The planes between which a line s d is on the inner side of an edge, for the edge from p along e: x, y the least and
// the largest s. `inward`: at right angles to the edge, in the triangle's plane.
INLINE Real2 withinEdge(Real3 d, Real3 p, Real3 inward) {
    Real rise = dot(d, inward), s = dot(p, inward) / rise;
    return Real2(rise > Real(0.0) ? s : Real(-1e30), rise < Real(0.0) ? s : Real(1e30));
}

// Finds where a line s d that runs nearly in the plane of a triangle meets it: the line is cut by the triangle's edges
// as seen from above, and of what is left the point nearest to the plane counts, where that is within `limit`. The
// weights of the corners say nothing there. The result is that of intersectTriangle.
INLINE Real3 intersectEdgeOn(Real3 d, Real3 va, Real3 vb, Real3 vc, Real limit) {
    Real3 n = cross(vb - va, vc - va);
    Real3 inA = cross(n, vc - vb), inB = cross(n, va - vc), inC = cross(n, vb - va);
    Real2 alongA = withinEdge(d, vb, inA), alongB = withinEdge(d, vc, inB), alongC = withinEdge(d, va, inC);
    Real first = max(alongA.x, max(alongB.x, alongC.x)), last = min(alongA.y, min(alongB.y, alongC.y));
    Real nd = dot(n, d), height = dot(va, n);
    // The two ends may have changed places by rounding, where the line passes a corner.
    Real s = min(max(height / nd, min(first, last)), max(first, last));
    Real above = height - s * nd;
    Real3 x = d * s;
    Real wa = max(dot(x - vb, inA), Real(0.0)), wb = max(dot(x - vc, inB), Real(0.0));
    Real wc = max(dot(x - va, inC), Real(0.0));
    Real scale = Real(1.0) / (wa + wb + wc);
    Real3 off = (va * wa + vb * wb + vc * wc) * scale - x;
    bool near = above * above <= limit * limit * dot(n, n) && dot(off, off) <= limit * limit;
    return near ? Real3(s, wb * scale, wc * scale) : Real3(Real(1e30), Real(0.0), Real(0.0));
}

// Returns the point of the line through p along e that is nearest to the origin.
INLINE Real3 nearestOn(Real3 p, Real3 e) { return p - e * (dot(p, e) / dot(e, e)); }

// Finds where a line s d meets a needle, whose weights are little but rounding, not edge-on: at its plane, which is
// taken from the point of its longest edge that is nearest to the origin. The line passes its edges on the inner side,
// or in their slack. The result is that of intersectTriangle.
INLINE Real3 intersectNeedle(Real3 d, Real3 va, Real3 vb, Real3 vc, Real slack) {
    Real3 ab = vb - va, bc = vc - vb, ca = va - vc, n = cross(ab, vc - va);
    Real la = dot(bc, bc), lb = dot(ca, ca), lc = dot(ab, ab), longest = max(la, max(lb, lc));
    bool isA = la >= longest, isB = !isA && lb >= longest;
    Real3 from = isA ? vb : isB ? vc : va, edge = isA ? bc : isB ? ca : ab;
    Real s = dot(nearestOn(from, edge), n) / dot(n, d);
    Real3 x = d * s, off = nearestOn(from - x, edge);
    // Widened edges meet far beyond the tip, and a plane that is nothing but rounding far from the edge.
    Real along = dot(x - from, edge) / longest, reach = slack / sqrt(longest), wide = sqrt(dot(n, n) / longest) + slack;
    bool near = along >= -reach && along <= Real(1.0) + reach && dot(off, off) <= wide * wide;
    if (!near) return Real3(Real(1e30), Real(0.0), Real(0.0));
    return isA   ? Real3(s, Real(1.0) - along, along)
           : isB ? Real3(s, Real(0.0), Real(1.0) - along)
                 : Real3(s, along, Real(0.0));
}

// Finds where the line q + s d (|d| about 1) meets triangle a b c, in page space: x = s, y and z the weights of
// b and c; x = 1e30 where it does not. Vertices are taken relative to q, edges are widened by
// `slack` cells, so that no ray slips between triangles that share an edge or an edge's point.
INLINE Real3 intersectTriangle(Real3 q, Real3 d, Real3 a, Real3 b, Real3 c, Real slack) {
    Real3 va = a - q, vb = b - q, vc = c - q;
    Real3 ab = b - a, bc = c - b, ca = a - c;
    Real3 n = cross(ab, c - a);
    Real nd = dot(n, d);
    Real flip = nd < Real(0.0) ? Real(-1.0) : Real(1.0);
    // The signed volumes of d with each edge; all have the sign of nd inside. By edges, not by corners, the rounding of
    // a short edge's is small as the edge is, though the other corner is far.
    Real wa = flip * dot(d, cross(vb, bc));
    Real wb = flip * dot(d, cross(vc, ca));
    Real wc = flip * dot(d, cross(va, ab));
    Real3 miss = Real3(Real(1e30), Real(0.0), Real(0.0));
    // Tests wa < -slack |bc| and its like, without roots.
    Real slack2 = slack * slack;
    if ((wa < Real(0.0) && wa * wa > slack2 * dot(bc, bc)) || (wb < Real(0.0) && wb * wb > slack2 * dot(ca, ca)) ||
        (wc < Real(0.0) && wc * wc > slack2 * dot(ab, ab)))
        return miss;
    if (!(abs(nd) > Real(0.0))) return miss;
    // Weights below 0 are cut off, and the hit is the triangle's point with the weights that are left. A ray in the
    // slack must pass near that point: along needles and for grazing rays the widened edges reach far. Any other ray
    // must pass near it too, less strictly: seen edge-on, a needle's weights are nothing but rounding.
    bool outside = wa < Real(0.0) || wb < Real(0.0) || wc < Real(0.0);
    wa = max(wa, Real(0.0));
    wb = max(wb, Real(0.0));
    wc = max(wc, Real(0.0));
    Real total = wa + wb + wc;
    if (!(total > Real(0.0))) return miss;
    Real scale = Real(1.0) / total;
    Real3 at = (va * wa + vb * wb + vc * wc) * scale;
    Real s = dot(at, d);
    Real3 off = at - d * s;
    Real limit = (outside ? Real(4.0) : Real(40.0)) * slack;
    if (dot(off, off) <= limit * limit) return Real3(s, wb * scale, wc * scale);
    if (nd * nd > (outside ? Real(0.25) : Real(0.01)) * dot(n, n)) return intersectNeedle(d, va, vb, vc, slack);
    return outside ? miss : intersectEdgeOn(d, va, vb, vc, Real(40.0) * slack);
}

// A slab leaf's plane and thickness, in leaf edges; its direction is decodeDirection(code >> kSlabDirectionShift).
INLINE Real slabOffset(uint code) {
    return Real(int(code & kSlabOffsetMask) - kSlabOffsetZero) * Real(kSlabOffsetUnit);
}
INLINE Real slabHalfThickness(uint code) {
    Real k = Real(code >> kSlabThicknessShift & kSlabThicknessMask);
    return k * k * Real(kSlabThicknessUnit);
}

// Returns where the segment p + u d, u in [0, 1], in leaf space, first meets a slab within one of the octants that are
// named, or -1. The middle planes of the leaf part the segment; the first of its pieces that lies in such an octant and
// meets the slab is hit, where it is nearest to the slab's middle plane. Octants are widened by kSlabSlack: a ray
// within a middle plane meets those on both sides.
INLINE Real intersectSlab(uint code, uint octants, Real3 p, Real3 d) {
    Real3 n = decodeDirection(code >> kSlabDirectionShift);
    Real slope = dot(n, d), least = Real(1e-20);
    Real scale = Real(1.0) / (abs(slope) < least ? least : slope);
    Real middle = (slabOffset(code) - dot(n, p - Real3(0.5))) * scale, reach = slabHalfThickness(code) * abs(scale);
    Real first = max(middle - reach, Real(0.0)), last = min(middle + reach, Real(1.0));
    // For each axis, where the segment is in the lower and in the upper half of the leaf.
    Real3 inverse = Real3(1.0) / mix(d, Real3(least), lessThan(abs(d), Real3(least)));
    Real3 halfway = (Real3(0.5) - p) * inverse, wide = abs(inverse) * Real(kSlabSlack), far = Real3(Real(1e30));
    bvec3 ahead = greaterThan(inverse, Real3(0.0));
    Real3 lowFirst = mix(halfway - wide, -far, ahead), lowLast = mix(far, halfway + wide, ahead);
    Real3 highFirst = mix(-far, halfway - wide, ahead), highLast = mix(halfway + wide, far, ahead);
    Real enter = Real(2.0), leave = Real(2.0);
    for (uint o = 0u; o < 8u; o++) {
        bvec3 high = bvec3((o & 1u) != 0u, (o & 2u) != 0u, (o & 4u) != 0u);
        Real3 from = mix(lowFirst, highFirst, high), to = mix(lowLast, highLast, high);
        Real begin = max(max(from.x, from.y), max(from.z, first)), end = min(min(to.x, to.y), min(to.z, last));
        bool nearer = (octants >> o & 1u) != 0u && begin <= end && begin < enter;
        enter = nearer ? begin : enter;
        leave = nearer ? end : leave;
    }
    return enter <= Real(1.0) ? clamp(middle, enter, leave) : Real(-1.0);
}
