// Rays of the picture and the lattice that pages sit on (render/shared/frame_layout.h).

struct Ray {
    vec3 origin;     // finest cells, relative to frame.originLattice
    vec3 direction;  // unit, no component 0
    vec3 inverse;
};

// No component may be 0: 1e-18 of a cell sideways is less than any rounding.
vec3 withoutZeros(vec3 d) {
    vec3 tiny = mix(vec3(-1e-18), vec3(1e-18), greaterThanEqual(d, vec3(0.0)));
    return mix(d, tiny, lessThan(abs(d), vec3(1e-18)));
}

Ray rayAt(vec2 point) {
    Ray ray;
    ray.origin = frame.origin.xyz + point.x * frame.originX.xyz + point.y * frame.originY.xyz;
    vec3 d = frame.direction.xyz + point.x * frame.directionX.xyz + point.y * frame.directionY.xyz;
    ray.direction = withoutZeros(d * inversesqrt(dot(d, d)));
    ray.inverse = 1.0 / ray.direction;
    return ray;
}

// Returns a lattice plane minus the ray's origin, in finest cells: one rounding of an exact difference.
vec3 fromOrigin(Ray ray, ivec3 planes) {
    precise vec3 difference = vec3(planes - frame.originLattice.xyz) * frame.cellPerLattice - ray.origin;
    return difference;
}

// Returns the distances to three lattice planes. They depend only on the ray and the planes, so that all callers get
// the same answer.
vec3 planeDistances(Ray ray, ivec3 planes) {
    precise vec3 distances = fromOrigin(ray, planes) * ray.inverse;
    return distances;
}

// Returns the lattice point next to the ray's point at distance s.
ivec3 latticePoint(Ray ray, float s) {
    return frame.originLattice.xyz + ivec3(round((ray.origin + s * ray.direction) * frame.latticePerCell));
}

float minOf(vec3 v) { return min(v.x, min(v.y, v.z)); }
float maxOf(vec3 v) { return max(v.x, max(v.y, v.z)); }
