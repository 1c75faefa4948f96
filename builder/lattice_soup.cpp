#include "builder/lattice_soup.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/lattice_mesh.h"
#include "octree/leaf_math.h"

namespace vcp {

namespace {

/// Middle of two colours, channel by channel.
uint32_t middleColour(uint32_t a, uint32_t b) { return (a & b) + (((a ^ b) & 0xfefefefeu) >> 1); }

glm::i32vec3 middle(glm::i32vec3 a, glm::i32vec3 b) {
    return {(int64_t{a.x} + b.x) >> 1, (int64_t{a.y} + b.y) >> 1, (int64_t{a.z} + b.z) >> 1};
}

/// Longest edge a page can hold.
bool tooLong(glm::i32vec3 a, glm::i32vec3 b) {
    constexpr double limit = double(kMaxEdgeCells) * kLatticePerCell;
    const glm::dvec3 d = glm::dvec3(a) - glm::dvec3(b);
    return glm::dot(d, d) > limit * limit;
}

LatticeTriangle turned(const LatticeTriangle& t, int by) {
    LatticeTriangle r = t;
    for (int i = 0; i < 3; ++i) {
        r.corner[i] = t.corner[(i + by) % 3];
        r.colour[i] = t.colour[(i + by) % 3];
    }
    return r;
}

}  // namespace

bool LatticeSnapper::isShort(const LatticeTriangle& t) {
    return !tooLong(t.corner[0], t.corner[1]) && !tooLong(t.corner[1], t.corner[2]) && !tooLong(t.corner[2], t.corner[0]);
}

// Whether an edge is cut does not depend on the triangle.
int LatticeSnapper::cut(const LatticeTriangle& t, LatticeTriangle (&pieces)[4]) {
    const bool tooLongs[3] = {tooLong(t.corner[0], t.corner[1]), tooLong(t.corner[1], t.corner[2]), tooLong(t.corner[2], t.corner[0])};
    const int cuts = tooLongs[0] + tooLongs[1] + tooLongs[2];
    if (cuts == 0) return 0;
    // Turned so that the cut edges come first: (01), (01, 12) or all.
    LatticeTriangle r = t;
    if (cuts == 1 && !tooLongs[0]) r = tooLongs[1] ? turned(t, 1) : turned(t, 2);
    if (cuts == 2 && tooLongs[2]) r = !tooLongs[0] ? turned(t, 1) : turned(t, 2);
    r.stray += static_cast<float>(kLatticeRounding);
    int count = 0;
    // 0 to 2: corners; 3 to 5: middles of the edges from them.
    const auto piece = [&](int a, int b, int c) {
        LatticeTriangle& p = pieces[count++] = r;
        const int from[3] = {a, b, c};
        for (int i = 0; i < 3; ++i) {
            const int k = from[i] % 3, next = (k + 1) % 3;
            p.corner[i] = from[i] < 3 ? r.corner[k] : middle(r.corner[k], r.corner[next]);
            p.colour[i] = from[i] < 3 ? r.colour[k] : middleColour(r.colour[k], r.colour[next]);
        }
    };
    if (cuts == 1) {
        piece(0, 3, 2);
        piece(3, 1, 2);
    } else if (cuts == 2) {
        piece(3, 1, 4);
        piece(0, 3, 4);
        piece(0, 4, 2);
    } else {
        piece(0, 3, 5);
        piece(3, 1, 4);
        piece(5, 4, 2);
        piece(3, 4, 5);
    }
    return count;
}

template <class Real>
LatticeTriangle LatticeSnapper::snap(const WorldTriangle<Real>& triangle) const {
    LatticeTriangle t{};
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 q = glm::clamp((glm::dvec3(triangle.corner[i]) - origin_) * scale_, glm::dvec3(0), glm::dvec3(2147483647.0));
        t.corner[i] = glm::i32vec3(std::lround(q.x), std::lround(q.y), std::lround(q.z));
        t.colour[i] = triangle.colour[i];
    }
    t.stray = static_cast<float>(kLatticeRounding);
    return t;
}

template LatticeTriangle LatticeSnapper::snap(const WorldTriangle<float>&) const;
template LatticeTriangle LatticeSnapper::snap(const WorldTriangle<double>&) const;

}  // namespace vcp
