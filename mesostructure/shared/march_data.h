// What a marcher reads of its arrays, every fetch counted (march_layout.h says where they lie). Compiles as GLSL and,
// in a struct with the record `meso`, the constants kSkip and kSurface, fetchWord and fetchQuad, as C++
// (mesostructure/march_math.h).

INLINE uint fetchByte(uint array, uint i) { return (fetchWord(array + (i >> 2)) >> ((i & 3u) * 8u)) & 0xffu; }
INLINE uint fetchShort(uint array, uint i) { return (fetchWord(array + (i >> 1)) >> ((i & 1u) * 16u)) & 0xffffu; }
INLINE float signedShort(uint bits) { return float(int(bits << 16) >> 16); }

// What is known of a cell: occupied, or what may be skipped.
struct Space {
    bool occupied;
    ivec3 further;  // empty cells towards the ray
    float reach;    // empty length from where the ray is
    uint marks;     // which small cells of an occupied cell the surface passes (meso::markSmallCells); 0: not known
};

INLINE Space occupiedSpace(uint marks) {
    Space space;
    space.occupied = true;
    space.further = ivec3(0);
    space.reach = 0.0f;
    space.marks = marks;
    return space;
}

INLINE Space emptySpace(ivec3 further, float reach) {
    Space space;
    space.occupied = false;
    space.further = further;
    space.reach = reach;
    space.marks = 0u;
    return space;
}

// The block of a compressed map whose entry was read last, and where it leads: cells of a brick are next to each other
// along a ray, and the way to their brick is read once.
struct KeptBlock {
    ivec3 block;  // along the axes, in blocks of the level above the cells
    uint first;   // the brick's first entry
};

INLINE KeptBlock noBlock() {
    KeptBlock kept;
    kept.block = ivec3(-1);
    kept.first = 0u;
    return kept;
}

// Looks up a cell of a compressed map, level by level. A block without surface may always be left whole, as a cell may.
INLINE Space lookUp(uint cone, ivec3 cell, ivec3 sign, INOUT(KeptBlock) kept, INOUT(uint) fetches) {
    ivec3 at = ivec3(wrappedCells(cell.x, cell.y, ivec2(meso.cells)), cell.z);
    int last = meso.levelCount - 1, least = int(meso.levels[last - 1].edgeAndFactor >> 16);
    ivec3 leastBlock = at / least;
    if (leastBlock != kept.block) {
        ivec3 block = at / int(meso.levels[0].edgeAndFactor >> 16);
        uint entry = uint(block.x + meso.top.x * (block.y + meso.top.y * block.z));
        for (int i = 0; i < last; ++i) {
            uint word = fetchWord(meso.levels[i].first + cone * meso.levels[i].entries + entry);
            fetches++;
            int edge = int(meso.levels[i].edgeAndFactor >> 16);
            if ((word & kMesoBrick) == 0u) {
                ivec3 lower = at / edge * edge, upper = min(lower + edge, meso.cells) - 1;
                ivec3 further =
                    ivec3(sign.x > 0 ? upper.x - at.x : at.x - lower.x, sign.y > 0 ? upper.y - at.y : at.y - lower.y,
                          sign.z > 0 ? upper.z - at.z : at.z - lower.z);
                return emptySpace(further, float(word) * meso.unit);
            }
            uint below = meso.levels[i + 1].edgeAndFactor;
            int factor = int(below & 0xffffu);
            entry = (word & (kMesoBrick - 1u)) * uint(factor * factor * factor);
            if (i + 1 == last) break;
            ivec3 local = at % edge / int(below >> 16);
            entry += uint(local.x + factor * (local.y + factor * local.z));
        }
        kept.block = leastBlock;
        kept.first = entry;
    }
    ivec3 local = at - leastBlock * least;
    uint steps = fetchByte(meso.levels[last].first, cone * meso.levels[last].entries + kept.first +
                                                        uint(local.x + least * (local.y + least * local.z)));
    fetches++;
    if (steps == kMesoOccupied) return occupiedSpace(0u);
    return emptySpace(ivec3(0), float(steps) * meso.unit);
}

// `direction`: the cone, or the octant; `sign`: of the ray's direction.
INLINE Space spaceAt(int direction, ivec3 cell, ivec3 sign, INOUT(KeptBlock) kept, INOUT(uint) fetches) {
    if (kSkip == kMesoCompressed) return lookUp(uint(direction), cell, sign, kept, fetches);
    fetches++;
    uint slot = uint(direction) * uint(meso.cellCount) + cellIndex(cell, meso.cells);
    if (kSkip == kMesoBoxes || kSkip == kMesoGuess) {
        uint box = fetchShort(meso.skipping, slot);
        if ((box & kMesoBoxOccupied) != 0u) return occupiedSpace(box & (kMesoBoxOccupied - 1u));
        return emptySpace(ivec3(int(box & 31u), int((box >> 5) & 31u), int((box >> 10) & 31u)), 0.0f);
    }
    uint steps = fetchByte(meso.skipping, slot);
    if (kSkip == kMesoOccupancy) {
        if (steps != 0u) return occupiedSpace(0u);
        return emptySpace(ivec3(0), 0.0f);
    }
    if (steps == kMesoOccupied) return occupiedSpace(0u);
    return emptySpace(ivec3(0), float(steps) * meso.unit);
}

INLINE float halfAt(uvec4 quad, int place) {
    uint word = place < 4 ? (place < 2 ? quad.x : quad.y) : (place < 6 ? quad.z : quad.w);
    return signedShort(word >> (uint(place & 1) * 16u));
}

// Returns a length that a ray may go from a cell in a cone, or less, or none: a sum of few factors less its bound
// (meso::SafeFactors).
INLINE float guessAt(int cone, ivec3 cell, INOUT(uint) fetches) {
    uint plane = uint(meso.cells.x * meso.cells.y);
    uint row = uint(cone % meso.azimuths) * plane + cellIndex(ivec3(cell.x, cell.y, 0), meso.cells);
    uint column = uint(cone / meso.azimuths * meso.cells.z + cell.z);
    uint rows = plane * uint(meso.azimuths), columns = uint(meso.columnCount * meso.clusters);
    float sum = 0.0f, bound = 0.0f;
    for (int group = 0; group < meso.levelCount; ++group) {
        fetches += 2u;
        uvec4 weights = fetchQuad(meso.guessRows + uint(group) * rows + row);
        if (group == 0) column += (weights.w >> 16) * uint(meso.columnCount);
        uvec4 values = fetchQuad(meso.guessColumns + uint(group) * columns + column);
        if (group == 0) {
            sum = halfAt(values, 7) * meso.unit;
            bound = float(min(weights.w & 0xffffu, values.w & 0xffffu)) * meso.unit;
        }
        for (int place = 0; place < (group == 0 ? 6 : 8); ++place)
            sum += halfAt(weights, place) * halfAt(values, place) * meso.product;
    }
    return min(sum - bound, 16.0f);
}

INLINE Patch fetchPatch(uint i) {
    uint at = meso.patches + 5u * i;
    vec4 q0 = uintBitsToFloat(fetchQuad(at)), q1 = uintBitsToFloat(fetchQuad(at + 1u));
    vec4 q2 = uintBitsToFloat(fetchQuad(at + 2u)), q3 = uintBitsToFloat(fetchQuad(at + 3u));
    uvec4 last = fetchQuad(at + 4u);
    vec4 q4 = uintBitsToFloat(last);
    Patch it;
    it.quadric[0] = q0.x;
    it.quadric[1] = q0.y;
    it.quadric[2] = q0.z;
    it.quadric[3] = q0.w;
    it.quadric[4] = q1.x;
    it.quadric[5] = q1.y;
    it.quadric[6] = q1.z;
    it.quadric[7] = q1.w;
    it.quadric[8] = q2.x;
    it.quadric[9] = q2.y;
    it.u = vec4(q2.z, q2.w, q3.x, q3.y);
    it.v = vec4(q3.z, q3.w, q4.x, q4.y);
    it.isTriangle = last.z;
    return it;
}

INLINE vec4 samplesAt(uvec4 at) {
    return vec4(signedShort(fetchShort(meso.data, at.x)), signedShort(fetchShort(meso.data, at.y)),
                signedShort(fetchShort(meso.data, at.z)), signedShort(fetchShort(meso.data, at.w)));
}

// Returns the places of a cell and of its neighbours towards +x, +y and both, in a plane of cells.
INLINE uvec4 cornersOf(int x, int y, ivec2 cells) {
    ivec2 a = wrappedCells(x, y, cells), b = nextCells(a, cells);
    return uvec4(a.x + cells.x * a.y, b.x + cells.x * a.y, a.x + cells.x * b.y, b.x + cells.x * b.y);
}

// Returns the heights of the bilinear cell at a texel, in 16-bit steps.
INLINE vec4 heightsAt(int x, int y) {
    uvec4 at = cornersOf(x, y, ivec2(meso.fine));
    return vec4(fetchShort(meso.data, at.x), fetchShort(meso.data, at.y), fetchShort(meso.data, at.z),
                fetchShort(meso.data, at.w));
}

// Blends the values at four corners, x fastest.
INLINE float blendCorners(vec4 v, vec3 w) { return mix(mix(v.x, v.y, w.x), mix(v.z, v.w, w.x), w.y); }

// Returns how far a point is from the nearest bound of its column, along z; below 0 within the solid, which is where an
// odd number of bounds is above it. x and y are in texels, z in the slab's height.
INLINE float aboveLayers(vec3 p) {
    vec3 first = floor(p);
    uvec4 at = cornersOf(int(first.x), int(first.y), ivec2(meso.fine)) * uint(meso.levelCount);
    float nearest = kFar;
    bool inside = false;
    for (int k = 0; k < meso.levelCount; ++k) {
        vec4 bounds = vec4(fetchShort(meso.data, at.x), fetchShort(meso.data, at.y), fetchShort(meso.data, at.z),
                           fetchShort(meso.data, at.w));
        float off = blendCorners(bounds * (1.0f / 65535.0f), p - first) - p.z;
        if (off > 0.0f) inside = !inside;
        nearest = min(nearest, abs(off));
        at = at + 1u;
    }
    // On a bound, outside is outside: at the slab's bottom lie the bounds that are missing.
    return inside ? -nearest : max(nearest, 1e-9f);
}

// Returns the samples at the corners of a field's cell, below and above.
INLINE void fieldAt(ivec3 cell, OUT(vec4) v0, OUT(vec4) v1) {
    uint plane = uint(meso.fine.x * meso.fine.y);
    uvec4 at = cornersOf(cell.x, cell.y, ivec2(meso.fine)) + uint(cell.z) * plane;
    v0 = samplesAt(at);
    v1 = samplesAt(at + plane);
}

// Returns the distances at the cells' centres around a point, and its place between them; z does not repeat.
INLINE void distancesAt(vec3 p, OUT(vec4) v0, OUT(vec4) v1, OUT(vec3) w) {
    vec3 at = p / meso.cell - 0.5f, first = floor(at);
    w = at - first;
    ivec3 cell = ivec3(first);
    ivec2 z = clamp(ivec2(cell.z, cell.z + 1), 0, meso.cells.z - 1);
    uint plane = uint(meso.cells.x * meso.cells.y);
    uvec4 column = cornersOf(cell.x, cell.y, ivec2(meso.cells));
    v0 = samplesAt(column + uint(z.x) * plane);
    v1 = samplesAt(column + uint(z.y) * plane);
}
