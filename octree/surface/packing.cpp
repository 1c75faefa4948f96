#include "octree/surface/packing.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

/// Octahedral map of a direction onto [-1, 1]^2.
glm::dvec2 octahedral(glm::dvec3 n) {
    const double norm = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
    if (!(norm > 0)) return {0, 0};
    double x = n.x / norm, y = n.y / norm;
    if (n.z < 0) {
        const double oldX = x;
        x = (1 - std::abs(y)) * (x >= 0 ? 1 : -1);
        y = (1 - std::abs(oldX)) * (y >= 0 ? 1 : -1);
    }
    return {x, y};
}

uint32_t quantize(double unit, uint32_t steps) { return uint32_t(std::lround(std::clamp(unit, 0.0, 1.0) * steps)); }

}  // namespace

uint32_t packVector(double distance, glm::dvec3 direction, bool negative) {
    const glm::dvec2 o = octahedral(direction);
    const uint32_t d = quantize(distance / double(kPackedDistanceRange), kPackedDistanceMax);
    const uint32_t sign = negative ? 1u : 0u;
    return d | quantize(o.x * 0.5 + 0.5, 1023) << 11 | quantize(o.y * 0.5 + 0.5, 1023) << 21 | sign << 31;
}

uint32_t packVectorSpherical(glm::dvec3 v, double range) {
    const double r = glm::length(v);
    if (!(r > 0)) return 0;
    const double theta = std::asin(std::clamp(v.z / r, -1.0, 1.0));
    double phi = std::atan2(v.y, v.x);
    if (phi < 0) phi += 2 * std::numbers::pi;
    return quantize(std::sqrt(std::min(r / range, 1.0)), 8191) | quantize(theta / std::numbers::pi + 0.5, 511) << 13 |
           quantize(phi / (2 * std::numbers::pi), 1023) << 22;
}

glm::dvec3 unpackVectorSpherical(uint32_t code, double range) {
    const double root = (code & 8191u) / 8191.0;
    const double r = root * root * range;
    const double theta = ((code >> 13 & 511u) / 511.0 - 0.5) * std::numbers::pi;
    const double phi = (code >> 22) / 1023.0 * 2 * std::numbers::pi;
    return r * glm::dvec3(std::cos(theta) * std::cos(phi), std::cos(theta) * std::sin(phi), std::sin(theta));
}

uint32_t packSlabDirection(glm::dvec3 n) {
    const glm::dvec3 size = glm::abs(n);
    const int largest = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    if (n[largest] < 0) n = -n;
    const glm::dvec2 at = (octahedral(n) * 0.5 + 0.5) * 1023.0;
    uint32_t best = 0;
    double most = -1;
    for (int i = 0; i < 4; ++i) {
        const auto corner = [&](double x, int up) { return uint32_t(std::clamp(std::floor(x) + up, 0.0, 1023.0)); };
        const uint32_t code = corner(at.x, i & 1) | corner(at.y, i >> 1) << 10;
        const double along = std::abs(glm::dot(n, f64::decodeDirection(code)));
        if (along > most) best = code, most = along;
    }
    return best;
}

uint32_t packSlab(uint32_t direction, double first, double last) {
    const double corner = std::sqrt(0.75);
    const double low = std::clamp(first, -corner, corner) - double(kSlabSlack),
                 high = std::clamp(last, -corner, corner) + double(kSlabSlack);
    const int nearest = kSlabOffsetZero + int(std::lround((low + high) / 2 / double(kSlabOffsetUnit)));
    const auto offset = uint32_t(std::clamp(nearest, 1, int(kSlabOffsetMask)));
    const auto codeOf = [&](uint32_t at, uint32_t thickness) {
        return at | thickness << kSlabThicknessShift | direction << kSlabDirectionShift;
    };
    for (uint32_t thickness = 0; thickness <= kSlabThicknessMask; ++thickness) {
        const uint32_t code = codeOf(offset, thickness);
        const double middle = f64::slabOffset(code), half = f64::slabHalfThickness(code);
        if (middle - half <= low && high <= middle + half) return code;
    }
    return codeOf(kSlabOffsetZero, kSlabThicknessMask);
}

uint32_t slabNode(uint32_t octants, uint32_t vector) {
    return kNodeEmpty << kNodeTypeShift | kNodeSlabBit | octants << kSlabOctantsShift | vector;
}

uint32_t packNormal(glm::dvec3 normal, bool crease) {
    const glm::dvec2 o = octahedral(normal);
    const uint32_t x = quantize(o.x * 0.5 + 0.5, 32767) << 1;
    const uint32_t y = quantize(o.y * 0.5 + 0.5, 65535);
    return x | (crease ? kNormalCreaseBit : 0u) | y << 16;
}

glm::u32vec2 pack21(uint32_t x, uint32_t y, uint32_t z) {
    return {(x & kField21Mask) | y << 21, (y & kField21Mask) >> 11 | z << 10};
}

glm::u32vec3 unpack21(glm::u32vec2 code) {
    return {code.x & kField21Mask, (code.x >> 21 | code.y << 11) & kField21Mask, code.y >> 10 & kField21Mask};
}

}  // namespace vcp
