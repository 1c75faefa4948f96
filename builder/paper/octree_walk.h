// Walks the nodes that a ray crosses, one after the other, whatever their size.
//
// The cell a ray is in is kept as integers. A step leaves a node through the face that the ray reaches first; the
// cell behind it is found on that axis by counting, on the others by the ray's position clamped to the face. So
// rounding can move a ray within a face, but no ray slips past a node. The descent starts again at the deepest
// node that holds both cells, from a stack (as in Laine and Karras 2010, 3.2).
#pragma once

#include <array>
#include <bit>

#include "builder/paper/root_grid.h"

namespace vcp {

/// Counters of one ray's work, and counters that count nothing. A cell: a leaf whose surface is looked at.
struct RayWork {
    uint32_t steps = 0, cells = 0, fetches = 0;
    void step() { ++steps; }
    void cell() { ++cells; }
    void fetch(uint32_t reads = 1) { fetches += reads; }
};
struct NoWork {
    void step() {}
    void cell() {}
    void fetch(uint32_t = 1) {}
};

/// A node that a ray crosses from t to tExit: a leaf or an empty node.
struct WalkedNode {
    int32_t word = 0;
    int level = 0;
    glm::ivec3 low{0};  ///< its lowest cell
    float t = 0, tExit = 0;
};

inline constexpr float kStopWalk = std::numeric_limits<float>::infinity();

/// Returns the cell that holds p. Truncation is enough: what rounding leaves below 0 belongs to cell 0.
inline glm::ivec3 cellAt(glm::vec3 p, glm::ivec3 last) { return glm::clamp(glm::ivec3(p), glm::ivec3(0), last); }

inline int octantOf(glm::ivec3 c, int level) {
    return (c.x >> level & 1) | (c.y >> level & 1) << 1 | (c.z >> level & 1) << 2;
}

/// `Tree` has rootWord(cell), childWord(inner, levelOfChild, octant), isInner(word) and `frame`. `visit(node)` returns
/// the t up to which nothing need be visited (at least node.tExit is taken), or kStopWalk.
template <class Tree, class Work, class Visit>
void walkOctree(const Tree& tree, const GridRay& ray, Work& work, const Visit& visit) {
    if (!(ray.tMax >= 0)) return;
    const glm::ivec3 last = tree.frame.cells() - 1;
    const glm::ivec3 forward(ray.direction.x >= 0, ray.direction.y >= 0, ray.direction.z >= 0);
    std::array<int32_t, 32> stack;
    glm::ivec3 c = cellAt(ray.origin, last);
    float t = 0;
    int level = tree.frame.rootLevel;
    int32_t word = tree.rootWord(c);
    work.fetch();
    for (;;) {
        while (tree.isInner(word)) {
            stack[level] = word;
            --level;
            word = tree.childWord(word, level, octantOf(c, level));
            work.fetch();
        }
        work.step();
        const int size = 1 << level;
        const glm::ivec3 low = c & glm::ivec3(-size);
        const glm::vec3 exits = (glm::vec3(low + size * forward) - ray.origin) * ray.inverse;
        const bool xFirst = exits.x <= exits.y && exits.x <= exits.z, yFirst = !xFirst && exits.y <= exits.z;
        const float tExit = std::max(xFirst ? exits.x : yFirst ? exits.y : exits.z, t);
        const float jump = visit(WalkedNode{word, level, low, t, tExit});
        if (jump >= ray.tMax || tExit >= ray.tMax) return;
        const glm::ivec3 old = c;
        if (jump > tExit) {
            t = jump;
            c = cellAt(ray.origin + t * ray.direction, last);
        } else {
            t = tExit;
            const glm::ivec3 next = low - 1 + (size + 1) * forward;
            c = glm::clamp(glm::ivec3(ray.origin + t * ray.direction), low, low + (size - 1));
            if (xFirst)
                c.x = next.x;
            else if (yFirst)
                c.y = next.y;
            else
                c.z = next.z;
            const glm::ivec3 room = last - c;
            if ((c.x | c.y | c.z | room.x | room.y | room.z) < 0) return;
        }
        const auto changed = unsigned((old.x ^ c.x) | (old.y ^ c.y) | (old.z ^ c.z));
        const int common = std::max(int(std::bit_width(changed)), level + 1);
        if (common > tree.frame.rootLevel) {
            level = tree.frame.rootLevel;
            word = tree.rootWord(c);
            work.fetch();
        } else {
            level = common;
            word = stack[level];
        }
    }
}

}  // namespace vcp
