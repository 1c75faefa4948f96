// The normal that is seen of a slab leaf where it is wide in the picture: a blend with the slabs about it. Compiles as
// GLSL (Real = float) and as C++ in float and double (octree/surface/slab_blend.h), after leaf_math.h. Only the common
// subset of GLSL and GLM is used.
//
// Eight cells of the hit leaf's size have their centres about the hit: the dual cell. Each that lies in a slab leaf of
// this size or a larger one counts by its trilinear weight and by how near the hit is to its plane. Those that do not
// (empty, parted, triangles) have no weight, and the others count for more.

// Returns by how much the neighbours of a leaf count that is so many pixels wide. Up to one pixel they do not: there
// samples filter the light. From two on they do wholly; in between nothing jumps.
INLINE Real slabBlendShare(Real pixels) { return clamp(pixels - Real(1.0), Real(0.0), Real(1.0)); }

// Returns the lowest corner of the dual cell's lowest cell, -1 or 0 on each axis, for a hit at x in leaf space.
INLINE Real3 dualCorner(Real3 x) { return floor(clamp(x, Real3(0.0), Real3(1.0)) - Real3(0.5)); }

// Returns the trilinear weight of one of the eight cells, octant x + 2y + 4z.
INLINE Real dualWeight(Real3 x, uint octant) {
    Real3 upper = clamp(x, Real3(0.0), Real3(1.0)) - Real3(0.5) - dualCorner(x);
    bvec3 high = bvec3((octant & 1u) != 0u, (octant & 2u) != 0u, (octant & 4u) != 0u);
    Real3 w = mix(Real3(1.0) - upper, upper, high);
    return w.x * w.y * w.z;
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
