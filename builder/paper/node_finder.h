// Finds the leaf or empty node at a cell of a corner octree, remembering where the last one was: the search starts at
// the parent of the last node where it holds the cell too (Demir and Westermann 2015, 4.2).
#pragma once

#include "builder/paper/corner_octree.h"
#include "builder/paper/octree_walk.h"

namespace vcp {

class NodeFinder {
public:
    explicit NodeFinder(const CornerOctree& tree) : tree_(tree) {}

    /// Returns the word of the node at cell c; low() and level() say where it is.
    template <class Work>
    int32_t find(glm::ivec3 c, Work& work) {
        if (level_ >= 0 && holds(level_, c)) return word_;
        int level = parentLevel_;
        int32_t word = parent_;
        if (level < 0 || !holds(level, c)) {
            level = tree_.frame.rootLevel;
            word = tree_.rootWord(c);
            parentLevel_ = -1;
            work.fetch();
        }
        while (CornerOctree::isInner(word)) {
            parent_ = word;
            parentLevel_ = level;
            --level;
            word = tree_.childWord(word, level, octantOf(c, level));
            work.fetch();
        }
        cell_ = c;
        level_ = level;
        return word_ = word;
    }
    /// Lets the next search start at the root.
    void forget() { level_ = parentLevel_ = -1; }
    [[nodiscard]] int level() const { return level_; }
    [[nodiscard]] glm::ivec3 low() const { return cell_ & glm::ivec3(-(1 << level_)); }

private:
    [[nodiscard]] bool holds(int level, glm::ivec3 c) const {
        return ((c.x ^ cell_.x) | (c.y ^ cell_.y) | (c.z ^ cell_.z)) >> level == 0;
    }

    const CornerOctree& tree_;
    glm::ivec3 cell_{0};
    int level_ = -1, parentLevel_ = -1;
    int32_t word_ = 0, parent_ = 0;
};

}  // namespace vcp
