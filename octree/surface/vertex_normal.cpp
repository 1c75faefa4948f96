#include "octree/surface/vertex_normal.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

int64_t magnitude(int64_t v) { return v < 0 ? -v : v; }
int64_t largest(WideVector v) { return std::max(magnitude(v.x), std::max(magnitude(v.y), magnitude(v.z))); }

/// Returns the vector, scaled down to components of at most `bits` bits.
WideVector shortened(WideVector v, int bits) {
    const int shift = std::max(0, int(std::bit_width(uint64_t(largest(v)))) - bits);
    return {v.x >> shift, v.y >> shift, v.z >> shift};
}

template <class Vector>
int64_t product(const Vector& a, const Vector& b) {
    return int64_t{a.x} * b.x + int64_t{a.y} * b.y + int64_t{a.z} * b.z;
}

}  // namespace

WideVector areaNormal(glm::i32vec3 a, glm::i32vec3 b, glm::i32vec3 c) {
    const WideVector u(b - a), v(c - a);
    return {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
}

void addNormal(WideVector& sum, WideVector normal) {
    const int64_t most = std::max(largest(sum), largest(normal));
    if (most >= int64_t{1} << 61) return;  // only a page that was made to overflow gets here
    const bool opposed =
        most < int64_t{1} << 30 ? product(sum, normal) < 0 : product(shortened(sum, 30), shortened(normal, 30)) < 0;
    if (opposed)
        sum -= normal;
    else
        sum += normal;
}

std::vector<uint8_t> creases(std::span<const WideVector> normals, std::span<const WideVector> sums,
                             std::span<const std::array<uint32_t, 3>> triangles, int64_t share) {
    std::vector<glm::i32vec3> of(sums.size());
    for (size_t v = 0; v < sums.size(); ++v) of[v] = glm::i32vec3(shortened(sums[v], 11));
    std::vector<int64_t> turned(sums.size(), 0);  // by area
    for (size_t k = 0; k < triangles.size(); ++k) {
        const glm::i32vec3 n(shortened(normals[k], 11));
        const int64_t size = product(n, n);
        for (const uint32_t v : triangles[k]) {
            const int64_t along = product(n, of[v]);
            // cos^2 of 40 degrees is 0.5868.
            if (along * along * 10000 < 5868 * size * product(of[v], of[v]))
                turned[v] = std::min(turned[v] + largest(normals[k]), int64_t{1} << 61);
        }
    }
    std::vector<uint8_t> crease(sums.size(), 0);
    for (size_t v = 0; v < sums.size(); ++v)
        crease[v] = turned[v] > 0 && (share == 0 || turned[v] >= largest(sums[v]) / share) ? 1 : 0;
    return crease;
}

NormalGridPoint normalGridPoint(WideVector sum) {
    WideVector n = shortened(sum, 40);
    // Takes the one of the two directions with z > 0; on the rim, where the map folds, with y > 0, then x > 0.
    const bool turned = n.z != 0 ? n.z < 0 : n.y != 0 ? n.y < 0 : n.x < 0;
    if (turned) n = -n;
    const int64_t norm = magnitude(n.x) + magnitude(n.y) + n.z;
    if (norm == 0) return {(kNormalSteps + 1) / 2, (kNormalSteps + 1) / 2};
    const auto step = [&](int64_t v) { return uint32_t(((v + norm) * kNormalSteps + norm) / (2 * norm)); };
    return {step(n.x), step(n.y)};
}

uint32_t packGridNormal(NormalGridPoint p, bool crease) {
    const uint32_t x = (p.u * 32767 + kNormalSteps / 2) / kNormalSteps * 2,
                   y = (p.v * 65535 + kNormalSteps / 2) / kNormalSteps;
    return x | (crease ? kNormalCreaseBit : 0u) | y << 16;
}

bool gridPointOf(uint32_t code, NormalGridPoint& point) {
    point.u = ((code & 0xfffeu) / 2 * kNormalSteps + 32767 / 2) / 32767;
    point.v = ((code >> 16) * kNormalSteps + 65535 / 2) / 65535;
    return packGridNormal(point, (code & kNormalCreaseBit) != 0) == code;
}

uint32_t packDirection(glm::dvec3 direction) {
    const double size = std::max(std::abs(direction.x), std::max(std::abs(direction.y), std::abs(direction.z)));
    const bool isFinite = std::isfinite(direction.x) && std::isfinite(direction.y) && std::isfinite(direction.z);
    if (!isFinite || size == 0) return kUnknownNormal;
    // Numbers below the normal ones have no inverse that is finite.
    const glm::dvec3 unit = direction / size * double(1 << 30);
    return packGridNormal(normalGridPoint(WideVector(glm::round(unit))), false);
}

}  // namespace vcp
