// A page before its strips are made: the triangles of its hard leaves once each, and a list for each leaf.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "octree/page/page.h"

namespace vcp {

/// The triangles of each leaf, list after list.
struct LeafLists {
    std::vector<uint32_t> triangles;
    std::vector<uint32_t> begin{0};  ///< where each list begins, and the end

    [[nodiscard]] std::span<const uint32_t> of(uint32_t leaf) const {
        return std::span(triangles).subspan(begin[leaf], begin[leaf + 1] - begin[leaf]);
    }
    /// Ends a list, whose triangles were appended; returns its number.
    uint32_t endList() {
        begin.push_back(uint32_t(triangles.size()));
        return uint32_t(begin.size() - 2);
    }
    bool operator==(const LeafLists&) const = default;
};

struct PageDraft {
    PageHeader header;            ///< all counts but that of entries
    std::vector<uint32_t> nodes;  ///< as in a page, but that the word of a hard leaf (draftLeaf) has its list's number
    std::vector<uint4> faces;
    std::vector<glm::u32vec2> vertices;
    std::vector<uint32_t> normals;
    std::vector<Index3> triangles;  ///< of all hard leaves, each once, in no order
    LeafLists lists;
    /// Whether it is certain that each list names all triangles that touch its leaf's closed box, and no others.
    bool listsAreCertain = false;

    /// Whether some of it has an open mark.
    [[nodiscard]] bool hasMarks() const;
};

/// The word of a hard leaf in a draft, and the number of its list.
inline uint32_t draftLeaf(uint32_t list) { return kNodeHard << kNodeTypeShift | list; }
inline uint32_t draftList(uint32_t word) { return word & kNodePayloadMask; }

/// Returns the page, with strips. It has no more entries than a page names; parsePage says whether it is whole.
std::vector<std::byte> pageOf(const PageDraft& draft);

/// Returns the draft of a checked page.
PageDraft draftOf(const PageView& page);

}  // namespace vcp
