// The normal that is seen of a slab leaf where it is wide in the picture: a blend with the slabs about it. Compiles as
// GLSL (Real = float) and as C++ in float and double (octree/surface/slab_blend.h), after leaf_math.h. Only the common
// subset of GLSL and GLM is used.
//
// The leaves count that meet at the hit leaf's corner next to the hit. A slab counts by its trilinear weight, as if all
// were of the hit leaf's size, and by how near the hit is to its plane. Leaves that are none (empty, triangles) have no
// weight, and the others count for more.

// Word of a page's header with the node of the whole page: of what is drawn of it, an octant may be left alone.
const uint kPageHeaderRoot = 2u;

// Returns by how much the neighbours of a leaf count that is so many pixels wide. Up to one pixel they do not: there
// samples filter the light. From two on they do wholly; in between nothing jumps.
INLINE Real slabBlendShare(Real pixels) { return clamp(pixels - Real(1.0), Real(0.0), Real(1.0)); }

// Returns the leaf's corner next to a point in leaf space: 0 or 1 on each axis.
INLINE Real3 nearestCorner(Real3 x) { return floor(clamp(x, Real3(0.0), Real3(1.0)) + Real3(0.5)); }

// Returns the octant about that corner that the leaf itself is in, x + 2y + 4z.
INLINE uint octantOfLeaf(Real3 corner) {
    return (corner.x > Real(0.5) ? 0u : 1u) | (corner.y > Real(0.5) ? 0u : 2u) | (corner.z > Real(0.5) ? 0u : 4u);
}

// Returns how much what is above that corner counts at a point, on each axis: 0 to 1.
INLINE Real3 shareAbove(Real3 x) { return clamp(x, Real3(0.0), Real3(1.0)) + Real3(0.5) - nearestCorner(x); }

// Returns the trilinear weight of the leaf in an octant about the corner. `above`: shareAbove of the hit.
INLINE Real octantWeight(Real3 above, uint octant) {
    Real x = (octant & 1u) != 0u ? above.x : Real(1.0) - above.x;
    Real y = (octant & 2u) != 0u ? above.y : Real(1.0) - above.y;
    Real z = (octant & 4u) != 0u ? above.z : Real(1.0) - above.z;
    return x * y * z;
}

// Returns how much a slab counts by its distance from the hit: 1 where its plane passes through it, 0 where that is an
// edge of its leaf away. `n`, `offset`: the plane's; `fromCentre`: the hit from the leaf's centre, in edges of the
// leaf.
INLINE Real slabNearness(Real3 n, Real offset, Real3 fromCentre) {
    return max(Real(1.0) - abs(dot(n, fromCentre) - offset), Real(0.0));
}

// What the slabs that count add up to.
struct SlabBlend {
    Real3 normal;
    Real4 colour;
    Real weight;
};

// Adds a slab. `own`: the direction of the leaf that was hit, to whose side the slab's, `n`, is turned.
INLINE SlabBlend withSlab(SlabBlend sum, Real3 n, Real4 colour, Real weight, Real3 own) {
    sum.normal = sum.normal + turnedTo(n, own) * weight;
    sum.colour = sum.colour + colour * weight;
    sum.weight = sum.weight + weight;
    return sum;
}
