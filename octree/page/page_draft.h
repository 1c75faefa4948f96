// A page before its strips are made: the triangles of its hard leaves once each, and a list for each leaf.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "octree/page/page.h"

namespace vcp {

struct PageDraft {
    PageHeader header;            ///< all counts but that of entries
    std::vector<uint32_t> nodes;  ///< as in a page, but that the word of a hard leaf (draftLeaf) has its list's number
    std::vector<uint4> faces;
    std::vector<glm::u32vec2> vertices;
    std::vector<uint32_t> normals;
    std::vector<Index3> triangles;   ///< of all hard leaves, each once, in no order
    std::vector<uint32_t> lists;     ///< the triangles of list 0, of list 1, and so on
    std::vector<uint32_t> begin{0};  ///< where in `lists` each begins, and the end
    /// Whether it is certain that each list names all triangles that touch its leaf's closed box, and no others.
    bool listsAreCertain = false;

    [[nodiscard]] std::span<const uint32_t> listOf(uint32_t leaf) const {
        return std::span(lists).subspan(begin[leaf], begin[leaf + 1] - begin[leaf]);
    }
};

/// The word of a hard leaf in a draft, and the number of its list.
inline uint32_t draftLeaf(uint32_t list) { return kNodeHard << kNodeTypeShift | list; }
inline uint32_t draftList(uint32_t word) { return word & kNodePayloadMask; }

/// Returns the page, with strips. It has no more entries than a page names; parsePage says whether it is whole.
std::vector<std::byte> pageOf(const PageDraft& draft);

/// Returns the draft of a checked page.
PageDraft draftOf(const PageView& page);

}  // namespace vcp
