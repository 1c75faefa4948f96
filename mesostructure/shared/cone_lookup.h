// Which cone a direction is in (mesostructure/distance_map.h has the proof). Compiles as GLSL and, in a struct whose
// `meso` has the borders, as C++.

// Returns a direction's cone: elevation * azimuths + azimuth. 0 counts as positive. It uses only signs and products,
// which no device may round further off than is allowed for.
INLINE int coneAlong(vec3 d) {
    int azimuth = 0, elevation = 0;
    // A direction in the lower half turn is past all borders of the upper one.
    bool isLower = d.y < 0.0f;
    for (int k = 1; k < meso.azimuths; ++k) {
        float along = meso.borders[k].azimuth.x * d.y, across = meso.borders[k].azimuth.y * d.x;
        azimuth += int(2 * k < meso.azimuths ? isLower || along > across : isLower && along >= across);
    }
    float flatness = d.x * d.x + d.y * d.y, height = d.z * abs(d.z);
    for (int k = 1; k < meso.elevations; ++k)
        elevation += int(height * meso.borders[k].elevation.x >= meso.borders[k].elevation.y * flatness);
    return elevation * meso.azimuths + azimuth;
}
