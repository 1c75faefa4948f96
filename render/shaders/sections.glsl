// Section planes: which interval of a ray they leave.

struct Interval {
    float first, last;
    vec3 plane;  // normal, towards what was cut away, of the plane that the interval begins at
};

Interval keptInterval(Ray ray) {
    Interval kept = Interval(0.0, kNoHit, vec3(0.0));
    for (uint i = 0u; i < frame.sectionCount; i++) {
        vec4 plane = frame.sections[i];
        float along = dot(plane.xyz, ray.direction);
        float off = dot(plane.xyz, ray.origin) + plane.w;
        float t = -off / (along == 0.0 ? 1e-30 : along);
        if (along > 0.0 && t > kept.first) {
            kept.first = t;
            kept.plane = -plane.xyz;
        }
        if (along < 0.0) kept.last = min(kept.last, max(t, 0.0));
        if (along == 0.0 && off < 0.0) kept.last = 0.0;
    }
    if (kept.last < kept.first) kept = Interval(0.0, 0.0, vec3(0.0));
    return kept;
}

Ray movedAlong(Ray ray, float s) {
    ray.origin += s * ray.direction;
    return ray;
}
