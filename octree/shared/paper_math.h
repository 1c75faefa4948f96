// The march of Demir and Westermann 2015: vectors inside a leaf, step sizes, the hit. Compiles as GLSL and as C++
// in

// These values are those of PaperScheme, PaperStep and PaperPacking.
const uint kPaperTrilinear = 0u;
const uint kPaperMinPlane = 1u;
const uint kPaperByPlane = 1u;
const uint kPaperOnward = 2u;
const uint kPaperSpherical = 0u;

const uint kPaperHeaderBytes = 64u;
const int kPaperEmpty = 1073741824;  // 2^30: node words from here on are empty, below they are inner, negative leaves
const uint kPaperMostSteps = 4096u;
const float kPaperFar = 3e38f;

// The vectors of a leaf's corners; corner 4 x + 2 z + y.
struct LeafVectors {
    float x[8];
    float y[8];
    float z[8];
};

// Decodes the direction of a packed vector (section 4.1): 13 bits root of the length, then the angles. The polar angle
// counts from -pi here, where sines are most exact on all devices.
INLINE vec3 sphericalDirection(uint code) {
    float theta = (float((code >> 13) & 511u) * (1.0f / 511.0f) - 0.5f) * 3.14159265f;
    float phi = (float(code >> 22) * (2.0f / 1023.0f) - 1.0f) * 3.14159265f;
    float c = cos(theta);
    return vec3(-c * cos(phi), -c * sin(phi), sin(theta));
}

// Decodes the direction of 10 + 9 bits, for comparison.
INLINE vec3 octahedralDirection(uint code) {
    float x = float((code >> 13) & 1023u) * (2.0f / 1023.0f) - 1.0f;
    float y = float(code >> 23) * (2.0f / 511.0f) - 1.0f;
    float z = 1.0f - abs(x) - abs(y);
    float fold = max(-z, 0.0f);
    x += x >= 0.0f ? -fold : fold;
    y += y >= 0.0f ? -fold : fold;
    float scale = 1.0f / sqrt(x * x + y * y + z * z);
    return vec3(x * scale, y * scale, z * scale);
}

// Returns the vector at `at` (0 to 1 an axis) of a leaf of edge `size` (2.2; Fig. 4): trilinear; the perpendicular to
// the nearest of the corners' planes; or the longer of the two. A vector of length 0 has no plane.
INLINE vec3 interpolateVectors(CONST_REF(LeafVectors) corners, float size, vec3 at, uint scheme) {
    float wx0 = 1.0f - at.x, wy0 = 1.0f - at.y, wz0 = 1.0f - at.z;
    float weight[8];
    float along[8];
    float squared[8];
    for (int k = 0; k < 8; ++k) {
        weight[k] = (k >= 4 ? at.x : wx0) * ((k & 1) != 0 ? at.y : wy0) * ((k & 2) != 0 ? at.z : wz0);
        // The vector from the point to the corner's closest point, along the corner's vector.
        float ox = (float(k >> 2) - at.x) * size, oy = (float(k & 1) - at.y) * size,
              oz = (float((k >> 1) & 1) - at.z) * size;
        float x = corners.x[k], y = corners.y[k], z = corners.z[k];
        squared[k] = x * x + y * y + z * z;
        along[k] = x * (x + ox) + y * (y + oy) + z * (z + oz);
    }
    vec3 trilinear = vec3(0.0f, 0.0f, 0.0f);
    for (int k = 0; k < 8; ++k) {
        trilinear.x += weight[k] * corners.x[k];
        trilinear.y += weight[k] * corners.y[k];
        trilinear.z += weight[k] * corners.z[k];
    }
    if (scheme == kPaperTrilinear) return trilinear;
    float nearest = kPaperFar, scale = 0.0f;
    vec3 plane = trilinear;
    for (int k = 0; k < 8; ++k) {
        float part = along[k] / max(squared[k], 1e-30f);
        float distance2 = part * along[k];
        if (squared[k] > 0.0f && distance2 < nearest) {
            nearest = distance2;
            scale = part;
            plane = vec3(corners.x[k], corners.y[k], corners.z[k]);
        }
    }
    if (nearest >= kPaperFar) return trilinear;
    if (scheme == kPaperMinPlane || dot(trilinear, trilinear) <= nearest) return plane * scale;
    return trilinear;
}

// How far to step where the vector has length d and v . direction is `approach`: d, or, by a plane, up to twice epsilon
// (4.2), or, by another reading, up to twice epsilon beyond d. A ray never meets a plane that it does not approach.
INLINE float marchStep(float d, float approach, float epsilon, uint step) {
    float planar = approach > 0.0f ? d * d / approach : kPaperFar;
    if (step == kPaperOnward) return max(d, min(planar, d + 2.0f * epsilon));
    return step == kPaperByPlane ? max(d, min(planar, 2.0f * epsilon)) : d;
}

// The part of the last step after which the distance is epsilon (2.1); 1 where the distance before was not larger.
INLINE float marchBack(float lastDistance, float d, float epsilon) {
    return lastDistance > epsilon ? (lastDistance - epsilon) / (lastDistance - d) : 1.0f;
}
