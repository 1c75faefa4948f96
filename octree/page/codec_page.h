// What the parts of the page codec (page_codec.h) share: the page that is being made, in canonical order, by
// the encoder and the decoder alike, and, for the encoder, the page it codes.
#pragma once

#include <bit>
#include <cstring>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/page/page_draft.h"

namespace vcp {

/// A node's place in a page: lowest corner and edge in subcells (1/8 cell).
struct NodePlace {
    uint16_t x = 0, y = 0, z = 0, edge = 0;

    [[nodiscard]] glm::ivec3 lower() const { return {x, y, z}; }
    [[nodiscard]] NodePlace child(uint32_t octant) const {
        const uint16_t half = edge / 2;
        return {uint16_t(x + (octant & 1u ? half : 0)), uint16_t(y + (octant & 2u ? half : 0)),
                uint16_t(z + (octant & 4u ? half : 0)), half};
    }
};

inline constexpr int kSubcellsPerCell = 1 << kMaxSubcellDepth;

/// Keys of hash maps: a place in subcells, not below 0, and a node by its lowest corner and edge.
inline uint64_t positionKey(glm::ivec3 p) {
    return uint64_t(uint32_t(p.x)) | uint64_t(uint32_t(p.y)) << 16 | uint64_t(uint32_t(p.z)) << 32;
}
inline uint64_t leafKey(glm::ivec3 lower, int edge) {
    return positionKey(lower) | uint64_t(std::countr_zero(unsigned(edge))) << 48;
}

/// Calls visit(axis, end, key) for the nodes beside one, of its size: those of them that are not below 0.
template <class Visit>
void forEachBeside(const NodePlace& place, Visit&& visit) {
    for (int axis = 0; axis < 3; ++axis)
        for (int end = 0; end < 2; ++end) {
            glm::ivec3 lower = place.lower();
            lower[axis] += end != 0 ? int{place.edge} : -int{place.edge};
            if (lower[axis] >= 0) visit(axis, end, leafKey(lower, place.edge));
        }
}

/// The places of a checked page's nodes.
inline std::vector<NodePlace> placesOf(const PageView& page) {
    std::vector<NodePlace> places(page.nodes.size());
    const auto fill = [&](uint32_t word, NodePlace place) {
        if (nodeType(word) != kNodeInternal) return;
        for (uint32_t o = 0; o < 8; ++o) places[size_t{8} * (word & kNodePayloadMask) + o] = place.child(o);
    };
    fill(page.header.root, {0, 0, 0, uint16_t(kSubcellsPerCell << page.header.log2Cells)});
    for (size_t i = 0; i < places.size(); ++i) fill(page.nodes[i], places[i]);
    return places;
}

struct CodecPage {
    PageHeader header;
    std::vector<uint4> block;  ///< the page
    std::span<uint32_t> nodes;
    std::span<uint4> faces;
    std::span<glm::u32vec2> vertices;
    std::span<uint32_t> normals;
    std::vector<uint32_t> entries;  ///< of strips (strips.h)
    std::vector<NodePlace> places;  ///< places of the nodes in `nodes`

    const PageDraft* source = nullptr;  ///< the page that the encoder codes
    /// Encoder: which element of `source` each one is; faces are those of soft leaves, vectors those of slab leaves.
    std::vector<uint32_t> groupSource, faceSource, vectorSource, vertexSource;

    bool hasMarks = false;                  ///< whether open marks are coded
    uint32_t mostEntries = kHardFirstMask;  ///< a page may not ask for more memory or work than its size allows
    bool wrong = false;                     ///< decoder: the bytes are no page; encoder: the page needs the plain form

    /// Makes room for as much as the header says; entries come later.
    void allocate() {
        const PageSections s = pageSections(header);
        block.resize(s.end / 16);
        auto* bytes = reinterpret_cast<std::byte*>(block.data());
        nodes = {reinterpret_cast<uint32_t*>(bytes + s.nodes), size_t{8} * header.groups};
        faces = {reinterpret_cast<uint4*>(bytes + s.faces), header.faces};
        vertices = {reinterpret_cast<glm::u32vec2*>(bytes + s.vertices), header.vertices};
        normals = {reinterpret_cast<uint32_t*>(bytes + s.normals), header.vertices};
    }
    /// Appends the strips and writes the header.
    void finish() {
        header.entries = uint32_t(entries.size());
        const PageSections s = pageSections(header);
        block.resize(s.end / 16);
        auto* bytes = reinterpret_cast<std::byte*>(block.data());
        storeEntries(entries, header.vertices, bytes + s.strips);
        std::memcpy(bytes, &header, sizeof header);
    }
    /// The number of faces that soft leaves have; the vectors of slab leaves are in the rest. The codec of nodes has
    /// counted slab leaves.
    [[nodiscard]] uint32_t softFaces() const { return header.faces - (header.slabLeaves + 3) / 4; }
    /// The word of node i in the page that the encoder codes; 0 for the decoder.
    [[nodiscard]] uint32_t sourceWord(size_t i) const {
        return source != nullptr ? source->nodes[size_t{8} * groupSource[i / 8] + i % 8] : 0u;
    }

    /// Calls `visit(word, source word, place)` for the root and every node, in order, until something is wrong.
    template <class Visit>
    void forEachNode(Visit&& visit) {
        const uint16_t edge = uint16_t(kSubcellsPerCell << header.log2Cells);
        visit(header.root, source != nullptr ? source->header.root : 0u, NodePlace{0, 0, 0, edge});
        for (size_t i = 0; i < nodes.size() && !wrong; ++i) visit(nodes[i], sourceWord(i), places[i]);
    }
};

}  // namespace vcp
