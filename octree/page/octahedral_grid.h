// Octahedral directions of 10 + 10 bits, as the page codec foretells and codes them, in integers: every machine gets
// the same. Part of page_codec.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "octree/page/range_coder.h"

namespace vcp {

/// A direction; its unit is 1/4096.
using GridDirection = glm::ivec3;

/// Decodes a direction of 20 bits. Square root, division and product are correctly rounded wherever doubles are, and no
/// product can be fused with a sum.
inline GridDirection gridDirection(uint32_t code) {
    int x = 2 * int(code & 1023u) - 1023, y = 2 * int(code >> 10 & 1023u) - 1023;
    const int z = 1023 - std::abs(x) - std::abs(y);
    const int fold = std::max(-z, 0);
    x += x >= 0 ? -fold : fold;
    y += y >= 0 ? -fold : fold;
    const double scale = 4096.0 / std::sqrt(double(x * x + y * y + z * z));
    return {int(x * scale), int(y * scale), int(z * scale)};
}

/// Returns the point of the octahedron's square for a direction of any length, 0 to 1023 each.
inline glm::ivec2 gridPoint(GridDirection n) {
    const int norm = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
    if (norm == 0) return {512, 512};
    const double scale = 1023.0 / norm;
    int x = int(n.x * scale), y = int(n.y * scale);
    if (n.z < 0) {
        const int before = x;
        x = (1023 - std::abs(y)) * (x >= 0 ? 1 : -1);
        y = (1023 - std::abs(before)) * (y >= 0 ? 1 : -1);
    }
    return {(x + 1023) / 2, (y + 1023) / 2};
}

/// Brings a point a little beyond an edge of the octahedron's square back: it lies on the other half of that edge.
inline glm::ivec2 foldedPoint(glm::ivec2 p) {
    if (p.x < 0)
        p = {-p.x, 1023 - p.y};
    else if (p.x > 1023)
        p = {2046 - p.x, 1023 - p.y};
    if (p.y < 0)
        p = {1023 - p.x, -p.y};
    else if (p.y > 1023)
        p = {1023 - p.x, 2046 - p.y};
    return p;
}

/// Returns the least step from `from` to a point or to one of its places beyond the edges.
inline glm::ivec2 leastStep(glm::ivec2 p, glm::ivec2 from) {
    glm::ivec2 least = p - from;
    const glm::ivec2 images[] = {
        {-p.x, 1023 - p.y}, {2046 - p.x, 1023 - p.y}, {1023 - p.x, -p.y}, {1023 - p.x, 2046 - p.y}};
    for (const glm::ivec2 image : images) {
        const glm::ivec2 d = image - from;
        if (foldedPoint(image) == p && std::abs(d.x) + std::abs(d.y) < std::abs(least.x) + std::abs(least.y)) least = d;
    }
    return least;
}

/// Codes a direction of 20 bits as the step from a foretold one.
struct DirectionModel {
    SmallModel first, second[4];

    /// Returns how well it was foretold, 0 (best) to 3; sets `wrong` where the bytes name no direction.
    template <class Coder>
    uint32_t code(Coder& coder, uint32_t& direction, GridDirection foretold, bool& wrong) {
        const glm::ivec2 from = gridPoint(foretold);
        glm::ivec2 step(0);
        if (Coder::kEncodes) step = leastStep({int(direction & 1023u), int(direction >> 10 & 1023u)}, from);
        first.code(coder, step.x);
        const uint32_t size = sizeOf(step.x);
        second[size].code(coder, step.y);
        const glm::ivec2 point = foldedPoint(from + step);
        if (std::min(point.x, point.y) < 0 || std::max(point.x, point.y) > 1023) wrong = true;
        direction = (uint32_t(point.x) & 1023u) | (uint32_t(point.y) & 1023u) << 10;
        return std::max(size, sizeOf(step.y));
    }

private:
    static uint32_t sizeOf(int step) {
        return uint32_t(std::min(3, int(std::bit_width(unsigned(std::abs(step)))) / 2));
    }
};

}  // namespace vcp
