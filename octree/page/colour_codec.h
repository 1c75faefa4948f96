// Codes the colours of a page: each corner's and each slab's colour once, predicted from its neighbours, and each
// vertex' colour, predicted from those of its triangle. Part of page_codec.
#pragma once

#include <array>

#include "octree/page/codec_page.h"
#include "octree/page/corner_store.h"
#include "octree/page/face_codec.h"
#include "octree/page/range_coder.h"
#include "octree/surface/leaf_triangles.h"

namespace vcp {

template <class Coder>
class ColourCodec {
public:
    /// `faces` and `vertices` are colours of `page`; the encoder reads them, the decoder fills them.
    ColourCodec(Coder& coder, const PageView& page, std::span<uint4> faces, std::span<uint32_t> vertices)
        : coder_(coder),
          page_(page),
          faces_(faces),
          vertices_(vertices),
          corners_(1 << page.header.log2Cells),
          slabs_(page.header.slabLeaves),
          faceDone_(faces.size(), 0),
          vertexDone_(vertices.size(), 0) {}

    /// Returns false when the page has faces or vertices that no leaf uses: their colours would be lost.
    bool run() {
        const std::vector<NodePlace> places = placesOf(page_);
        const auto visit = [&](uint32_t word, const NodePlace& place) {
            if (nodeType(word) == kNodeSoft) codeLeaf(word, place);
            if (nodeType(word) == kNodeSlab) codeSlab(word, place);
            if (nodeType(word) == kNodeHard)
                forEachTriangle(page_.strips, word, [&](const Index3& triangle) { codeTriangle(triangle); });
        };
        visit(page_.header.root, {0, 0, 0, uint16_t(kSubcellsPerCell << page_.header.log2Cells)});
        for (size_t i = 0; i < places.size(); ++i) visit(page_.nodes[i], places[i]);
        return used_ + (page_.header.slabLeaves + 3) / 4 == faces_.size() + vertices_.size();
    }

private:
    void codeLeaf(uint32_t word, const NodePlace& place) {
        const uint32_t axis = word >> kSoftAxisShift & 3u, first = word & kLeafIndexMask;
        for (int end = 0; end < 2; ++end) {
            const uint32_t face = first + uint32_t(end);
            if (faceDone_[face]) continue;
            faceDone_[face] = 1;
            ++used_;
            for (int c = 0; c < 4; ++c)
                codeCorner(place.lower() + int{place.edge} * faceCorner(axis, end, c), place.edge, faces_[face][c]);
        }
    }

    void codeCorner(glm::ivec3 position, int edge, uint32_t& colour) {
        Known& here = corners_.at(position);
        if (here.known) {
            bool same = colour == here.colour;
            coder_.bit(same_, same);
            if (same)
                colour = here.colour;
            else
                codeColour(colour, here.colour, 0);
        } else {
            std::array<uint32_t, 4> sum{};
            uint32_t count = 0;
            const Known* beside[3][2];
            corners_.neighbours(position, edge, beside);
            for (const auto& axis : beside)
                for (const Known* near : axis) {
                    if (!near->known) continue;
                    ++count;
                    for (size_t i = 0; i < 4; ++i) sum[i] += near->colour >> 8 * i & 255u;
                }
            codeColour(colour, count > 0 ? mean(sum, count) : last_, 1);
        }
        here = {colour, true};
        last_ = colour;
    }

    void codeSlab(uint32_t word, const NodePlace& place) {
        std::array<uint32_t, 4> sum{};
        uint32_t count = 0;
        forEachBeside(place, [&](int, int, uint64_t key) {
            const uint32_t* near = slabs_.find(key);
            if (near == nullptr) return;
            ++count;
            for (size_t i = 0; i < 4; ++i) sum[i] += *near >> 8 * i & 255u;
        });
        uint32_t& colour = reinterpret_cast<uint32_t*>(faces_.data())[slabVector(word)];
        codeColour(colour, count > 0 ? mean(sum, count) : last_, 3);
        slabs_.findOrAdd(leafKey(place.lower(), place.edge)) = last_ = colour;
    }

    void codeTriangle(const Index3& triangle) {
        for (const uint32_t vertex : triangle) {
            if (vertexDone_[vertex]) continue;
            std::array<uint32_t, 4> sum{};
            uint32_t count = 0;
            for (const uint32_t other : triangle) {
                if (!vertexDone_[other]) continue;
                ++count;
                for (size_t i = 0; i < 4; ++i) sum[i] += vertices_[other] >> 8 * i & 255u;
            }
            codeColour(vertices_[vertex], count > 0 ? mean(sum, count) : last_, 2);
            vertexDone_[vertex] = 1;
            ++used_;
            last_ = vertices_[vertex];
        }
    }

    static uint32_t mean(const std::array<uint32_t, 4>& sum, uint32_t count) {
        uint32_t colour = 0;
        for (size_t i = 0; i < 4; ++i) colour |= (sum[i] + count / 2) / count << 8 * i;
        return colour;
    }

    /// The channels are coded together: green first, then red and blue by how their change differs from green's.
    void codeColour(uint32_t& colour, uint32_t foretold, size_t kind) {
        bool equal = colour == foretold;
        coder_.bit(equal_[kind], equal);
        if (equal) {
            colour = foretold;
            return;
        }
        uint32_t result = 0;
        int32_t green = 0;
        size_t size = 0;
        for (const size_t i : {size_t{1}, size_t{0}, size_t{2}, size_t{3}}) {
            const int32_t before = int32_t(foretold >> 8 * i & 255u), lead = i == 0 || i == 2 ? green : 0;
            int32_t more = int32_t(colour >> 8 * i & 255u) - before - lead;
            channel_[kind][i][size].code(coder_, more);
            if (i == 1) green = std::clamp(more, -255, 255);
            size = std::min<size_t>(2, size_t(std::bit_width(unsigned(std::abs(more)))) / 2);
            result |= (uint32_t(before + lead + more) & 255u) << 8 * i;
        }
        colour = result;
    }

    struct Known {
        uint32_t colour = 0;
        bool known = false;
    };
    Coder& coder_;
    const PageView& page_;
    std::span<uint4> faces_;
    std::span<uint32_t> vertices_;
    CornerStore<Known> corners_;
    PositionMap<uint32_t> slabs_;  ///< colours of slab leaves that were coded
    std::vector<uint8_t> faceDone_, vertexDone_;
    size_t used_ = 0;
    uint32_t last_ = 0;
    BitModel same_, equal_[4];
    SmallModel channel_[4][4][3];
};

}  // namespace vcp
