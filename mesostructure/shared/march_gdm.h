// The marchers of generalized displacement maps (Wang et al. 2004), of view-dependent ones (Wang et al. 2003), and of
// slices (Meyer and Neyret 1998). Compiles as march_data.h does. One query answers for a whole ray; none of them is
// conservative.
//
// In a displacement map kSkip says how distances are stored, and kSurface how a hit is told from the way to the
// boundary: by the solid's density there, as printed, or by a bit of its own.

// Where a place lies among the samples of an axis: the sample below, that above, and the weight of that above.
struct Between {
    int low, high;
    float w;
};

INLINE Between betweenRepeated(float at, int n) {
    Between b;
    // What no ray reaches, and what is no number, is sample 0.
    float first = abs(at) < 8e6f ? floor(at) : 0.0f;
    b.low = wrappedCell(int(first), n);
    b.high = b.low + 1 < n ? b.low + 1 : 0;
    b.w = at - first;
    return b;
}

INLINE Between betweenClamped(float at, int n) {
    Between b;
    float inside = clamp(at, 0.0f, float(n - 1));
    b.low = clamp(int(inside), 0, max(n - 2, 0));
    b.high = min(b.low + 1, n - 1);
    b.w = inside - float(b.low);
    return b;
}

// A query: a place in the tile and a direction, among the samples; z is the curvature in a view-dependent map.
struct GdmQuery {
    Between x, y, z, theta, phi;
};

INLINE GdmQuery queryAt(vec3 p, vec3 d) {
    GdmQuery q;
    q.x = betweenRepeated(p.x / meso.extent.x * float(meso.fine.x), meso.fine.x);
    q.y = betweenRepeated(p.y / meso.extent.y * float(meso.fine.y), meso.fine.y);
    q.z = betweenClamped(p.z / meso.extent.z * float(meso.fine.z - 1), meso.fine.z);
    q.phi = betweenRepeated(turnOf(d.x, d.y) * float(meso.azimuths), meso.azimuths);
    // The elevation from +z, in half turns; the maps of the top alone begin at the horizon.
    float polar = 2.0f * turnOf(d.z, sqrt(d.x * d.x + d.y * d.y));
    if (kWalk == kMesoVdm) polar = 2.0f * polar - 1.0f;
    q.theta = betweenClamped(polar * float(meso.elevations) - 0.5f, meso.elevations);
    return q;
}

INLINE int atCorner(CONST_REF(Between) b, int upper) { return upper != 0 ? b.high : b.low; }
INLINE float weightOf(CONST_REF(Between) b, int upper) { return upper != 0 ? b.w : 1.0f - b.w; }

// The table's row and column at a corner of the query: the bits of `corner` are upper x, y, phi, theta, z. Over flat
// bases alone, a view-dependent map has none for the last.
INLINE uint gdmRow(CONST_REF(GdmQuery) q, int corner) {
    int plane = kWalk == kMesoVdm ? 0 : atCorner(q.phi, corner & 4);
    return uint(atCorner(q.x, corner & 1) + meso.fine.x * (atCorner(q.y, corner & 2) + meso.fine.y * plane));
}
INLINE uint gdmColumn(CONST_REF(GdmQuery) q, int corner) {
    int theta = atCorner(q.theta, corner & 8);
    if (kWalk != kMesoVdm) return uint(theta * meso.fine.z + atCorner(q.z, corner & 16));
    int direction = theta * meso.azimuths + atCorner(q.phi, corner & 4);
    if (kRefinement == kMesoStraight) return uint(direction);
    return uint(atCorner(q.z, corner & 16) * meso.elevations * meso.azimuths + direction);
}
INLINE float gdmWeight(CONST_REF(GdmQuery) q, int corner) {
    float w = weightOf(q.x, corner & 1) * weightOf(q.y, corner & 2) * weightOf(q.phi, corner & 4) *
              weightOf(q.theta, corner & 8);
    return kWalk == kMesoVdm && kRefinement == kMesoStraight ? w : w * weightOf(q.z, corner & 16);
}

INLINE vec4 factorAt(uint array, uint texel) {
    if (meso.valueBits == 8) {
        uint word = fetchWord(array + texel);
        return vec4(float(int(word << 24) >> 24), float(int(word << 16) >> 24), float(int(word << 8) >> 24),
                    float(int(word) >> 24));
    }
    uint low = fetchWord(array + 2u * texel), high = fetchWord(array + 2u * texel + 1u);
    return vec4(signedShort(low), signedShort(low >> 16), signedShort(high), signedShort(high >> 16));
}

// The factors are filtered each for itself, which filters their product: four terms a fetch of each.
INLINE float factoredDistance(CONST_REF(GdmQuery) q, INOUT(MesoResult) result) {
    int corners = kWalk == kMesoVdm ? 4 : 8;
    float sum = 0.0f;
    for (int group = 0; group < meso.levelCount; ++group) {
        result.fetches += 2u;
        vec4 weight = vec4(0.0f), value = vec4(0.0f);
        for (int corner = 0; corner < corners; ++corner) {
            float w = weightOf(q.x, corner & 1) * weightOf(q.y, corner & 2);
            if (kWalk != kMesoVdm) w *= weightOf(q.phi, corner & 4);
            weight += w * factorAt(meso.data, uint(group * meso.cellCount) + gdmRow(q, corner));
        }
        for (int k = 0; k < (kWalk == kMesoVdm && kRefinement == kMesoBent ? 8 : 4); ++k) {
            // Theta, and z; in a view-dependent map theta, phi, and the curvature.
            int second = kWalk == kMesoVdm ? 4 : 16, corner = (k & 1) * 8 + (k >> 1 & 1) * second + (k >> 2) * 16;
            float w = weightOf(q.theta, corner & 8);
            if (kWalk == kMesoVdm) w *= weightOf(q.phi, corner & 4);
            if (kWalk != kMesoVdm || kRefinement == kMesoBent) w *= weightOf(q.z, corner & 16);
            value += w * factorAt(meso.rows, uint(group * meso.columnCount) + gdmColumn(q, corner));
        }
        sum += dot(weight, value);
    }
    return sum * meso.step;
}

// A table of itself is a volume for each direction, or over flat bases a picture: four of them are filtered.
INLINE float tableDistance(CONST_REF(GdmQuery) q, INOUT(MesoResult) result) {
    int corners = kWalk == kMesoVdm && kRefinement == kMesoStraight ? 16 : 32;
    result.fetches += 4u;
    float sum = 0.0f;
    for (int corner = 0; corner < corners; ++corner) {
        uint entry = gdmRow(q, corner) * uint(meso.columnCount) + gdmColumn(q, corner);
        uint value = meso.valueBits == 8 ? fetchByte(meso.data, entry) : fetchShort(meso.data, entry);
        sum += gdmWeight(q, corner) * float(value);
    }
    return sum * meso.step;
}

INLINE float gdmDistance(CONST_REF(GdmQuery) q, INOUT(MesoResult) result) {
    float distance = kSkip == kMesoFactored ? factoredDistance(q, result) : tableDistance(q, result);
    return max(distance, 0.0f);
}

// Whether the nearest sample's ray meets the solid.
INLINE bool isHitNear(CONST_REF(GdmQuery) q, INOUT(MesoResult) result) {
    result.fetches++;
    int corner = int(q.x.w >= 0.5f) | int(q.y.w >= 0.5f) << 1 | int(q.phi.w >= 0.5f) << 2 |
                 int(q.theta.w >= 0.5f) << 3 | int(q.z.w >= 0.5f) << 4;
    uint column = gdmColumn(q, corner), across = uint(meso.columnCount + 31) / 32u;
    return ((fetchWord(meso.skipping + gdmRow(q, corner) * across + (column >> 5)) >> (column & 31u)) & 1u) != 0u;
}

// Returns the normal, not unit, and the density of the solid, 0 to 1, filtered: one fetch of a volume of four bytes.
INLINE vec4 propertyAt(vec3 p, INOUT(MesoResult) result) {
    result.fetches++;
    Between x = betweenRepeated(p.x / meso.extent.x * float(meso.volume.x), meso.volume.x),
            y = betweenRepeated(p.y / meso.extent.y * float(meso.volume.y), meso.volume.y),
            z = betweenClamped(p.z / meso.extent.z * float(meso.volume.z - 1), meso.volume.z);
    vec4 sum = vec4(0.0f);
    for (int corner = 0; corner < 8; ++corner) {
        uint texel = uint(atCorner(x, corner & 1) +
                          meso.volume.x * (atCorner(y, corner & 2) + meso.volume.y * atCorner(z, corner & 4)));
        uint word = fetchWord(meso.patches + texel);
        sum += weightOf(x, corner & 1) * weightOf(y, corner & 2) * weightOf(z, corner & 4) *
               vec4(float(int(word << 24) >> 24), float(int(word << 16) >> 24), float(int(word << 8) >> 24),
                    float(word >> 24) * (127.0f / 255.0f));
    }
    return sum * (1.0f / 127.0f);
}

INLINE void hitWithProperty(float t, vec4 property, INOUT(MesoResult) result) {
    vec3 normal = vec3(property);
    result.state = kMesoHit;
    result.t = t;
    result.normal = dot(normal, normal) > 1e-12f ? normalize(normal) : vec3(0.0f);
}

// Returns when a ray leaves the slab.
INLINE float slabExit(MesoRay ray) {
    float z = ray.atTop ? meso.extent.z : clamp(ray.o.z, 0.0f, meso.extent.z);
    return ray.d.z > 0.0f ? (meso.extent.z - z) / ray.d.z : ray.d.z < 0.0f ? -z / ray.d.z : kMostReach;
}

// The listing of Wang et al. 2004: one query; a hit where the distance is less than the ray's length and the solid is
// there.
INLINE void marchGdm(MesoRay ray, INOUT(MesoResult) result) {
    result.iterations++;
    float leaves = slabExit(ray);
    GdmQuery q = queryAt(ray.o, ray.d);
    // Where the distance is the way to the boundary, which the ray reaches, its end decides.
    float t = min(gdmDistance(q, result), leaves);
    if (t > ray.tMax) return;
    if (kSurface == kMesoVisibilityBit && !isHitNear(q, result)) return;
    vec4 property = propertyAt(ray.o + t * ray.d, result);
    if (kSurface != kMesoVisibilityBit && property.w <= 0.0f) return;
    hitWithProperty(t, property, result);
}

// A map of the top alone. A ray that begins below the top is carried back to it; one that goes up is asked from where
// it leaves, backwards: what is seen from there before the ray's start is in its way.
INLINE void marchVdm(MesoRay ray, INOUT(MesoResult) result) {
    result.iterations++;
    if (ray.d.z == 0.0f) return;
    bool isUp = ray.d.z > 0.0f;
    float toTop = (ray.atTop ? 0.0f : meso.extent.z - ray.o.z) / ray.d.z;
    vec3 top = ray.o + toTop * ray.d, down = isUp ? -ray.d : ray.d;
    GdmQuery q = queryAt(top, down);
    float seen = min(gdmDistance(q, result), meso.extent.z / -down.z), t = isUp ? toTop - seen : toTop + seen;
    // A start that is itself what is seen casts no shadow on itself: half a texel is left out.
    float own = isUp ? 0.5f * meso.extent.x / float(meso.fine.x) : 0.0f;
    if (t > ray.tMax || t < own) return;
    if (kSurface == kMesoVisibilityBit && !isHitNear(q, result)) return;
    vec4 property = propertyAt(ray.o + t * ray.d, result);
    if (kSurface != kMesoVisibilityBit && property.w <= 0.0f) return;
    hitWithProperty(t, property, result);
}

// Where a ray over a base that bends is at the slab's top, and in which direction it goes down from there, or comes up.
struct BentTop {
    vec3 place;
    vec2 across;      // unit, along the tile, the way that the ray goes down
    BentPath down;    // from the top
    bool isUp;        // the ray itself comes up by it
    float at, scale;  // time from the ray's start, and of one unit of `down`
};

INLINE bool bentTop(MesoRay ray, OUT(BentTop) top) {
    float run = length(vec2(ray.d.x, ray.d.y)), height = meso.extent.z;
    BentPath own;
    own.z = ray.atTop ? height : clamp(ray.o.z, 0.0f, height);
    own.c = clamp(curvatureOfBend(ray.bend, own.z), -meso.mostCurvature, meso.mostCurvature);
    own.run = run;
    own.rise = ray.d.z;
    if (!bentReaches(own, height, top.at)) return false;
    vec2 heading = bentHeading(own, top.at);
    float speed = length(heading);
    top.isUp = heading.y >= 0.0f;
    top.scale = 1.0f / speed;
    top.across = run > 0.0f ? vec2(ray.d.x, ray.d.y) / run : vec2(1.0f, 0.0f);
    vec2 moved = bentAlong(own, top.at) * top.across;
    top.place = vec3(ray.o.x + moved.x, ray.o.y + moved.y, height);
    if (top.isUp) top.across = -top.across;
    top.down.c = own.c;
    top.down.z = height;
    top.down.run = heading.x / speed;
    top.down.rise = -abs(heading.y) / speed;
    return top.down.rise < 0.0f;
}

// Turns a normal of a place along a bent base into the frame of another: `along` ahead of it, in the direction
// `across`.
INLINE vec3 turnedBack(vec3 n, vec2 across, float angle) {
    float ahead = dot(vec2(n.x, n.y), across), turned = ahead * cos(angle) + n.z * sin(angle);
    vec2 level = vec2(n.x, n.y) + (turned - ahead) * across;
    return vec3(level.x, level.y, n.z * cos(angle) - ahead * sin(angle));
}

// The same over a base that bends, as MesoRay::bend says. The ray is carried to the top along its own curve. The normal
// is in the frame of the ray's start.
INLINE void marchBent(MesoRay ray, INOUT(MesoResult) result) {
    result.iterations++;
    BentTop top;
    if (!bentTop(ray, top)) return;
    GdmQuery q = queryAt(top.place, vec3(top.down.run * top.across.x, top.down.run * top.across.y, top.down.rise));
    q.z = betweenClamped((top.down.c / meso.mostCurvature + 1.0f) * 0.5f * float(meso.curvatures - 1), meso.curvatures);
    bool byBottom;
    float leaves = bentExit(top.down, byBottom), seen = min(gdmDistance(q, result), leaves),
          t = top.at + (top.isUp ? -seen : seen) * top.scale;
    float own = top.isUp ? 0.5f * meso.extent.x / float(meso.fine.x) : 0.0f;
    if (t > ray.tMax || t < own) return;
    if (kSurface == kMesoVisibilityBit && !isHitNear(q, result)) return;
    float along = bentAlong(top.down, seen);
    vec3 place =
        vec3(top.place.x + along * top.across.x, top.place.y + along * top.across.y, bentHeight(top.down, seen));
    vec4 property = propertyAt(place, result);
    if (kSurface != kMesoVisibilityBit && property.w <= 0.0f) return;
    hitWithProperty(t, property, result);
    vec2 moved = vec2(place.x - ray.o.x, place.y - ray.o.y);
    result.normal = turnedBack(result.normal, top.across, top.down.c * dot(moved, top.across));
}

// Layers of the volume, nearest first, along the axis that the ray passes most of them of; the first whose density is a
// half or more is the hit.
INLINE void marchSlices(MesoRay ray, INOUT(MesoResult) result) {
    vec3 scale = vec3(float(meso.volume.x), float(meso.volume.y), float(meso.volume.z - 1)) / meso.extent;
    vec3 o = ray.o * scale, d = ray.d * scale, steep = abs(d);
    if (ray.atTop) o.z = float(meso.volume.z - 1);
    int axis = steep.z >= max(steep.x, steep.y) ? 2 : steep.x >= steep.y ? 0 : 1;
    float at = axis == 2 ? o.z : axis == 0 ? o.x : o.y, along = axis == 2 ? d.z : axis == 0 ? d.x : d.y;
    float end = min(ray.tMax, slabExit(ray)), layer = along > 0.0f ? ceil(at) : floor(at);
    bool outside = ray.isOutside || (ray.atTop && ray.d.z < 0.0f);
    while (true) {
        float t = max((layer - at) / along, 0.0f);
        // The slab's last layer is its bottom, however the ray's way there rounds.
        if (axis == 2 ? layer < 0.0f || layer > float(meso.volume.z - 1) || t > ray.tMax : t > end) return;
        if (result.iterations++ == kMesoMostIterations) {
            result.state = kMesoUnresolved;
            return;
        }
        vec4 property = propertyAt(ray.o + t * ray.d, result);
        if (property.w < 0.5f)
            outside = true;
        else if (outside) {
            hitWithProperty(t, property, result);
            return;
        }
        layer += along > 0.0f ? 1.0f : -1.0f;
    }
}
