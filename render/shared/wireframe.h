// Lines on a surface where its leaves and triangles end, about a pixel wide at any distance. Compiles as GLSL and as
// C++ (render/host/wireframe.h). Only the common subset of GLSL and GLM is used.
//
// Each line is where a number falls to 0 that is linear on the surface's plane: a weight of a triangle's vertex, or the
// way to a wall of the leaf. How fast it changes from pixel to pixel says how far the line is in the picture, and how
// far apart such lines are.

// Lines this many pixels apart, or nearer, are not drawn; from the second number on they are drawn wholly.
const float kFaintestLines = 3.0f;
const float kFullLines = 8.0f;
// Planes that are seen from nearer their edge, as a cosine, are taken to be seen from there.
const float kLeastFacing = 1e-3f;

// Returns by how much a number changes in a pixel, where it changes fastest. `slope`: its gradient, by unit of length;
// `n`: of the plane, unit; `direction`: of the ray, unit; `pixelEdge`: of a pixel at the hit.
INLINE float changeInPixel(Real3 slope, Real3 n, Real3 direction, float pixelEdge) {
    float facing = dot(n, direction);
    float along = max(abs(facing), kLeastFacing) * (facing < 0.0f ? -1.0f : 1.0f);
    // A step across the ray goes along the ray as well, until it is on the plane again.
    return length(slope - n * (dot(slope, direction) / along)) * pixelEdge;
}

// Returns how much of a line is seen, 0 to 1, where the number is `value` of 1.
INLINE float lineAt(float value, float change) {
    float drawn = clamp((1.0f / max(change, 1e-20f) - kFaintestLines) / (kFullLines - kFaintestLines), 0.0f, 1.0f);
    return drawn * clamp(1.0f - value / max(change, 1e-20f), 0.0f, 1.0f);
}

// Returns how much of a triangle's edges is seen at a hit with these weights of its vertices.
INLINE float linesOfTriangle(Real3 a, Real3 b, Real3 c, Real3 weights, Real3 direction, float pixelEdge) {
    Real3 across = cross(b - a, c - a);
    float area = max(length(across), 1e-30f);
    Real3 n = across / area;
    float toA = lineAt(weights.x, changeInPixel(cross(n, c - b) / area, n, direction, pixelEdge));
    float toB = lineAt(weights.y, changeInPixel(cross(n, a - c) / area, n, direction, pixelEdge));
    float toC = lineAt(weights.z, changeInPixel(cross(n, b - a) / area, n, direction, pixelEdge));
    return max(toA, max(toB, toC));
}

// Returns how much of the lines is seen in which a surface meets the walls of its leaf. `x`: the hit in leaf space;
// `n`: of the surface, unit; `pixelEdge`: in edges of the leaf.
INLINE float linesOfLeaf(Real3 x, Real3 n, Real3 direction, float pixelEdge) {
    Real3 toWall = max(min(x, Real3(1.0f) - x), Real3(0.0f));
    float first = lineAt(toWall.x, changeInPixel(Real3(1.0f, 0.0f, 0.0f), n, direction, pixelEdge));
    float second = lineAt(toWall.y, changeInPixel(Real3(0.0f, 1.0f, 0.0f), n, direction, pixelEdge));
    float third = lineAt(toWall.z, changeInPixel(Real3(0.0f, 0.0f, 1.0f), n, direction, pixelEdge));
    return max(first, max(second, third));
}

// The colours of the lines, as the screen has them: of triangles, of leaves.
INLINE Real3 triangleInk() { return Real3(0.06f, 0.07f, 0.10f); }
INLINE Real3 leafInk() { return Real3(0.02f, 0.22f, 0.62f); }
