// The marchers (mesostructure/march.h), one by kWalk, kSkip, kSurface and kRefinement. Compiles as march_data.h does. A
// ray that used up its iterations is unresolved.

// Hits the slab's bottom: no height is below it, however a ray's end there rounds.
INLINE void hitBottom(CONST_REF(Walk) w, bool outside, INOUT(MesoResult) result) {
    if (w.cell.z >= 0 || w.sign.z >= 0 || !outside || w.t > w.tMax) return;
    result.state = kMesoHit;
    result.t = w.t;
    result.normal = vec3(0.0f, 0.0f, 1.0f);
}

INLINE int directionOf(vec3 d) {
    if (kSkip == kMesoOccupancy) return 0;
    if (kSkip == kMesoBoxes || kSkip == kMesoGuess) return octantOf(d);
    return coneAlong(d);
}

INLINE void marchGrid(MesoRay ray, INOUT(MesoResult) result) {
    Walk w = startWalk(ray, meso.cells, meso.extent);
    vec3 heading = w.d * meso.cell;
    int direction = directionOf(heading), guesses = kSkip == kMesoGuess ? meso.guesses : 0;
    KeptBlock kept = noBlock();
    Side side;
    side.outside = w.startsAtTop || ray.isOutside;
    side.inRun = !ray.isOutside;
    // All rays of a group look for their next occupied cell, then all solve: solving takes long, and would otherwise
    // run for one ray at a time.
    while (true) {
        bool found = false;
        float exit = kFar;
        int axisOut = -1;
        uint marks = 0u;
        while (!found && w.cell.z >= 0 && w.cell.z < meso.cells.z && w.t <= w.tMax) {
            if (result.iterations++ == kMesoMostIterations) {
                result.state = kMesoUnresolved;
                return;
            }
            Space space = spaceAt(direction, w.cell, w.sign, kept, result.fetches);
            exit = walkExit(w, space.further, axisOut);
            found = space.occupied;
            marks = space.marks;
            if (found) break;
            side.inRun = false;
            if (guesses > 0) {
                guesses--;
                space.reach = guessAt(coneAlong(heading), w.cell, result.fetches);
            }
            if (space.reach > 0.0f && w.t + space.reach > exit)
                walkJump(w, w.t + space.reach);
            else if (exit >= kFar)
                break;
            else
                walkLeave(w, space.further, exit, axisOut);
        }
        if (!found) break;
        float entry = walkEntry(w), end = max(entry, min(exit, w.tMax));
        if (meetSurface(w, entry, end, marks, side, result)) {
            result.state = kMesoHit;
            return;
        }
        if (exit >= kFar) break;
        walkLeave(w, ivec3(0), exit, axisOut);
    }
    if (kSurface == kMesoHeights) hitBottom(w, side.outside, result);
}

// f > 0 above the height field; texels along x and y, the slab's height along z.
INLINE float reliefF(vec3 o, vec3 d, float t, INOUT(MesoResult) result) {
    vec3 p = o + t * d, first = floor(p);
    if (kSurface == kMesoLayers) {
        // Four bounds are a texel of four channels.
        result.fetches += uint(meso.levelCount + 3) / 4u;
        return aboveLayers(p);
    }
    result.fetches++;
    return p.z - blendCorners(heightsAt(int(first.x), int(first.y)) * (1.0f / 65535.0f), p - first);
}

// The step along a ray in which f falls to 0.
struct Bracket {
    vec3 o, d;
    float low, fLow, high, fHigh;
};

INLINE float refineRelief(Bracket at, INOUT(MesoResult) result) {
    if (kRefinement == kMesoUnrefined) return at.high;
    float t = at.high;
    int kept = 0;  // which end the last step kept: -1 low, +1 high
    for (int i = 0; i < meso.mostRefinements; ++i) {
        float chord = at.low + (at.high - at.low) * (at.fLow / (at.fLow - at.fHigh));
        bool isHalved = kRefinement == kMesoBinary || !(chord >= at.low && chord <= at.high);
        t = isHalved ? 0.5f * (at.low + at.high) : chord;
        result.iterations++;
        result.tests++;
        float f = reliefF(at.o, at.d, t, result);
        if (abs(f) < meso.tolerance || f == 0.0f) break;
        // Illinois (Dowell and Jarratt 1971): an end that is kept twice counts half.
        if (f > 0.0f) {
            if (kRefinement == kMesoIllinois && kept == 1) at.fHigh *= 0.5f;
            at.low = t;
            at.fLow = f;
            kept = 1;
        } else {
            if (kRefinement == kMesoIllinois && kept == -1) at.fLow *= 0.5f;
            at.high = t;
            at.fHigh = f;
            kept = -1;
        }
    }
    return t;
}

INLINE bool isFinite(float x) { return abs(x) <= 3.4028235e38f; }

// Refines as the listing does, with depths from the top: the branch replaces the upper bound by what is below the
// surface.
INLINE float refineAsPrinted(Bracket at, INOUT(MesoResult) result) {
    float slope = -at.d.z, depth0 = 1.0f - at.o.z;
    // The depth of the surface is the depth of the ray + f.
    float upperD = at.low, upperH = depth0 + slope * at.low + at.fLow;
    float lowerD = at.high, lowerH = depth0 + slope * at.high + at.fHigh, best = upperH;
    for (int i = 0; i < meso.mostRefinements; ++i) {
        float lineSlope = (upperH - lowerH) / (upperD - lowerD);
        float time = (upperH - lineSlope * upperD - depth0) / (slope - lineSlope);
        if (!isFinite(time)) break;
        result.iterations++;
        result.tests++;
        float f = reliefF(at.o, at.d, time, result), depth = depth0 + slope * time, surface = depth + f;
        best = surface;
        if (surface < depth) {
            upperH = surface;
            upperD = time;
        } else {
            lowerH = surface;
            lowerD = time;
        }
        if (abs(f) <= meso.tolerance) break;
    }
    float t = (best - depth0) / slope;
    return isFinite(t) ? t : at.high;
}

INLINE void marchRelief(MesoRay ray, INOUT(MesoResult) result) {
    const float kLongest = 64.0f;  // a ray along the slab ends there
    vec3 scale = vec3(float(meso.fine.x), float(meso.fine.x), 1.0f / meso.height);
    Bracket at;
    at.o = ray.o * scale;
    at.d = ray.d * scale;
    if (ray.atTop) at.o.z = 1.0f;
    float leaves = at.d.z < 0.0f ? -at.o.z / at.d.z : at.d.z > 0.0f ? (1.0f - at.o.z) / at.d.z : kLongest;
    float end = clamp(leaves, 0.0f, min(ray.tMax, kLongest));
    bool bottomIsEnd = at.d.z < 0.0f && end == leaves;
    int steps = meso.mostSteps;
    // A piece of a shell has its part of the steps between top and bottom.
    float whole = min(1.0f / max(abs(at.d.z), 1e-9f), kLongest);
    if (ray.isOutside) steps = clamp(int(ceil(float(steps) * end / whole)), 1, steps);
    at.low = 0.0f;
    at.fLow = reliefF(at.o, at.d, 0.0f, result);
    if (ray.isOutside && at.fLow <= 0.0f) {
        result.state = kMesoHit;
        return;
    }
    for (int i = 1; i <= steps; ++i) {
        result.iterations++;
        at.high = end * (float(i) / float(steps));
        at.fHigh = reliefF(at.o, at.d, at.high, result);
        // The slab's bottom is below every height, however it rounds.
        if (i == steps && bottomIsEnd && kSurface != kMesoLayers) at.fHigh = min(at.fHigh, 0.0f);
        if (at.fLow > 0.0f && at.fHigh <= 0.0f) {
            result.state = kMesoHit;
            if (kRefinement == kMesoAsPrinted)
                result.t = refineAsPrinted(at, result);
            else
                result.t = refineRelief(at, result);
            return;
        }
        at.low = at.high;
        at.fLow = at.fHigh;
    }
}

INLINE bool solvePyramid(CONST_REF(Walk) w, float end, INOUT(bool) outside, INOUT(MesoResult) result) {
    result.fetches++;
    result.tests++;
    float entry = min(walkEntry(w), end);
    vec4 h = heightsAt(w.cell.x, w.cell.y) * (1.0f / 65535.0f);
    vec3 o = walkAt(w, entry) - vec3(w.cell);
    CellHit found = firstEntryBilinear(h, o, w.d, 0.0f, end - entry, outside);
    outside = found.outside;
    if (!found.hit) return false;
    result.state = kMesoHit;
    result.t = entry + found.t;
    vec2 slope = slopeBilinear(h, o + found.t * w.d) * float(meso.fine.x) * meso.height;
    result.normal = normalize(vec3(-slope, 1.0f));
    return true;
}

// Cells are texels along x and y, and the slab is one cell high.
INLINE void marchPyramid(MesoRay ray, INOUT(MesoResult) result) {
    ivec2 size = ivec2(meso.fine);
    Walk w = startWalk(ray, ivec3(size, 1), meso.extent);
    bool outside = w.startsAtTop || ray.isOutside;
    int top = meso.levelCount - 1, level = top;
    while (w.cell.z == 0 && w.t <= w.tMax) {
        if (result.iterations++ == kMesoMostIterations) {
            result.state = kMesoUnresolved;
            return;
        }
        ivec2 home = wrappedCells(w.cell.x, w.cell.y, size), entry = home >> level;
        ivec2 first = entry << level, last = min(first + (1 << level), size) - 1;
        ivec3 further = ivec3(w.sign.x > 0 ? last.x - home.x : home.x - first.x,
                              w.sign.y > 0 ? last.y - home.y : home.y - first.y, 0);
        int axisOut;
        float exit = walkExit(w, further, axisOut), end = max(w.t, min(exit, w.tMax));
        result.fetches++;
        uint texel = uint(entry.y) * meso.levels[level].entries + uint(entry.x);
        float most = float(fetchShort(meso.levels[level].first, texel)) * (1.0f / 65535.0f);
        // Where the ray leaves by the slab's bottom its height is 0, however that rounds: ground at 0 is a tie there.
        float atEnd = axisOut == 2 && end == exit ? float(w.sign.z > 0) : walkAt(w, end).z;
        float lowest = min(walkAt(w, w.t).z, atEnd);
        bool isAbove = lowest > most && (outside || level > 0 || w.t > 0.0f);
        if (!isAbove && level > 0) {
            level--;
            continue;
        }
        if (isAbove)
            outside = true;
        else if (solvePyramid(w, end, outside, result))
            return;
        if (exit >= kFar) break;
        walkLeave(w, further, exit, axisOut);
        if (isAbove) level = min(level + 1, top);
    }
    hitBottom(w, outside, result);
}

INLINE float sphereDistance(vec3 p, INOUT(MesoResult) result) {
    result.fetches++;
    vec4 v0, v1;
    vec3 w;
    distancesAt(p, v0, v1, w);
    return blendCorners(mix(v0, v1, w.z), w) * meso.step;
}

INLINE void marchSphere(MesoRay ray, INOUT(MesoResult) result) {
    bool outside = ray.isOutside;
    float top = meso.extent.z;
    for (float t = 0.0f; t <= ray.tMax;) {
        vec3 p = ray.o + t * ray.d;
        if (p.z < 0.0f ? ray.d.z <= 0.0f : p.z > top && ray.d.z >= 0.0f) return;
        if (result.iterations++ == uint(meso.mostSteps)) {
            result.state = kMesoUnresolved;
            return;
        }
        float reach = sphereDistance(p, result);
        // Inside, and on the start's own surface, it moves on by a part of a cell until the distance grows.
        if (reach >= meso.reach)
            outside = true;
        else if (outside || (t == 0.0f && (p.z >= top || ray.atTop))) {
            result.state = kMesoHit;
            result.t = t;
            return;
        }
        t += max(reach, outside ? 0.0f : meso.cell.x * 0.25f);
    }
}

// Whether a point is in the solid, for the methods that have samples and look only at cells with surface.
INLINE bool isSolidAt(vec3 p) {
    if (kWalk >= kMesoGdm) {
        MesoResult unused;
        unused.fetches = 0u;
        return propertyAt(p, unused).w >= 0.5f;
    }
    if (kSurface != kMesoHeights && kSurface != kMesoField) return false;
    vec3 at = p / meso.extent * vec3(meso.fine), w = fract(at);
    if (kSurface == kMesoHeights)
        return p.z <= blendCorners(heightsAt(int(floor(at.x)), int(floor(at.y))), w) * meso.step;
    int z = min(int(at.z), meso.fine.z - 1);
    vec4 v0, v1;
    fieldAt(ivec3(int(floor(at.x)), int(floor(at.y)), z), v0, v1);
    return blendCorners(mix(v0, v1, at.z - float(z)), w) <= 0.0f;
}

INLINE MesoResult marchMeso(MesoRay ray) {
    MesoResult result;
    result.state = kMesoMiss;
    result.t = 0.0f;
    result.normal = vec3(0.0f);
    result.iterations = 0u;
    result.fetches = 0u;
    result.tests = 0u;
    if (kWalk == kMesoRelief)
        marchRelief(ray, result);
    else if (kWalk == kMesoPyramid)
        marchPyramid(ray, result);
    else if (kWalk == kMesoSphere)
        marchSphere(ray, result);
    else if (kWalk == kMesoGdm)
        marchGdm(ray, result);
    else if (kWalk == kMesoVdm && kRefinement == kMesoBent)
        marchBent(ray, result);
    else if (kWalk == kMesoVdm)
        marchVdm(ray, result);
    else if (kWalk == kMesoSlices)
        marchSlices(ray, result);
    else
        marchGrid(ray, result);
    return result;
}
