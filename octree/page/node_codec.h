// Codes the nodes of a page: types, wall and dip codes, clearances. Part of page_codec.
#pragma once

#include <algorithm>

#include "octree/page/codec_page.h"
#include "octree/page/range_coder.h"
#include "octree/surface/clearance.h"

namespace vcp {

template <class Coder>
class NodeCodec {
public:
    NodeCodec(Coder& coder, CodecPage& page) : coder_(coder), page_(page), depth_(page.header.groups, 0) {}

    /// Codes types breadth first, so that what is known of a node's surroundings predicts it; then clearances.
    /// Soft leaves' words still lack axis and faces, slab leaves' words octants and vector, hard leaves' words their
    /// triangles. Counts slab leaves.
    void run() {
        const int log2Cells = int(page_.header.log2Cells);
        grid_.resize(size_t(log2Cells) + 1);
        for (int d = 0; d <= log2Cells; ++d) grid_[size_t(d)].assign(size_t{1} << (3 * d), kNodeEmpty);
        page_.places.resize(page_.nodes.size());
        const NodePlace root{0, 0, 0, uint16_t(kSubcellsPerCell << log2Cells)};
        page_.header.slabLeaves = 0;
        page_.header.root = node(page_.source != nullptr ? page_.source->header.root : 0, root, 0, 0);
        for (uint32_t g = 0; g < page_.header.groups && !page_.wrong; ++g) group(g);
        if (groupsMade_ != page_.header.groups) page_.wrong = true;
        if (page_.header.slabLeaves > uint64_t{4} * page_.header.faces) page_.wrong = true;
        if (!page_.wrong) clearances();
    }

private:
    void group(uint32_t g) {
        if (g >= groupsMade_) {
            page_.wrong = true;
            return;
        }
        const NodePlace parent = parents_[g];
        const int depth = depth_[g];
        uint32_t known = 0;  // which octants are not empty
        // Which of the parent's neighbours are not empty: lower and upper by axis.
        uint32_t beside[3][2];
        for (int axis = 0; axis < 3; ++axis)
            for (int end = 0; end < 2; ++end)
                beside[axis][end] = typeBeside(parent, depth - 1, axis, end != 0) != kNodeEmpty ? 1u : 0u;
        for (uint32_t o = 0; o < 8; ++o) {
            const size_t i = size_t{8} * g + o;
            page_.places[i] = parent.child(o);
            // The face neighbours are siblings before this one, and the parent's neighbours on this octant's side.
            uint32_t before = 0, full = 0, outside = 0;
            for (int axis = 0; axis < 3; ++axis) {
                const uint32_t bit = 1u << axis;
                if (o & bit) {
                    ++before;
                    full += known >> (o ^ bit) & 1u;
                }
                outside += beside[axis][o >> axis & 1u];
            }
            const uint32_t context = (before * 4 + full) * 4 + outside;
            page_.nodes[i] = node(page_.sourceWord(i), page_.places[i], depth, context);
            if (nodeType(page_.nodes[i]) != kNodeEmpty) known |= 1u << o;
            if (page_.wrong) return;
        }
    }

    /// Returns the type of the node of the same depth beside a node; kNodeEmpty outside of the page and, at depths
    /// below the cells, kNodeInternal.
    [[nodiscard]] uint32_t typeBeside(const NodePlace& place, int depth, int axis, bool upper) const {
        if (size_t(depth) >= grid_.size()) return kNodeInternal;
        const int n = 1 << depth;
        glm::ivec3 p = place.lower() / int{place.edge};
        p[axis] += upper ? 1 : -1;
        return p[axis] < 0 || p[axis] >= n ? kNodeEmpty : grid_[size_t(depth)][size_t(p.x + n * (p.y + n * p.z))];
    }

    uint32_t node(uint32_t source, const NodePlace& place, int depth, uint32_t context) {
        const int cellDepth = int(page_.header.log2Cells);
        const uint32_t scale = depth < cellDepth ? 0 : depth == cellDepth ? 1 : 2;
        bool occupied = nodeType(source) != kNodeEmpty;
        coder_.bit(occupied_[scale][context], occupied);
        if (!occupied) return kNodeEmpty << kNodeTypeShift;
        // A slab leaf has the number in its word, which an empty node would have.
        uint32_t symbol = source >> kNodeTypeShift;
        coder_.symbol(typeModel_[scale][context & 3u][last_], symbol);
        if (symbol > kNodeHard) page_.wrong = true;
        symbol &= 3u;
        last_ = (last_ << 2 | symbol) & 15u;
        const uint32_t type = symbol == kNodeEmpty ? kNodeSlab : symbol;
        uint32_t word = symbol << kNodeTypeShift;
        if (type == kNodeSlab) {
            word |= kNodeSlabBit;
            ++page_.header.slabLeaves;
        }
        if (type == kNodeInternal) {
            if (depth >= cellDepth + int(kMaxSubcellDepth) || groupsMade_ >= page_.header.groups) {
                page_.wrong = true;
                return word;
            }
            depth_[groupsMade_] = uint8_t(depth + 1);
            parents_.push_back(place);
            if (Coder::kEncodes) page_.groupSource.push_back(source & kNodePayloadMask);
            word |= groupsMade_++;
        }
        if (type == kNodeSoft) word |= codes(source, place);
        if (size_t(depth) < grid_.size()) mark(place, depth, type);
        return word;
    }

    /// Marks a node; a leaf covers the nodes below it, too.
    void mark(const NodePlace& place, int depth, uint32_t type) {
        const int last = type == kNodeInternal ? depth : int(grid_.size()) - 1;
        for (int d = depth; d <= last; ++d) {
            const int n = 1 << d, edge = (kSubcellsPerCell << page_.header.log2Cells) >> d;
            const glm::ivec3 low = place.lower() / edge, high = low + std::max(1, place.edge / edge);
            for (int z = low.z; z < high.z; ++z)
                for (int y = low.y; y < high.y; ++y)
                    for (int x = low.x; x < high.x; ++x) grid_[size_t(d)][size_t(x + n * (y + n * z))] = uint8_t(type);
        }
    }

    uint32_t codes(uint32_t source, const NodePlace& place) {
        const int size = std::min(3, int(std::bit_width(unsigned(place.edge / kSubcellsPerCell))));
        uint32_t wall = source >> kSoftWallShift & kSoftWallMask, dip = source >> kSoftDipShift & 3u;
        coder_.symbol(dip_[size][lastDip_], dip);
        if (dip > 3u) page_.wrong = true;
        dip &= 3u;
        coder_.symbol(wall_[size][dip][std::min(lastWall_ / 2, 3u)], wall);
        lastDip_ = dip;
        lastWall_ = wall;
        return wall << kSoftWallShift | dip << kSoftDipShift;
    }

    /// Codes clearances as differences from what the occupied cells allow.
    void clearances() {
        const int cells = 1 << page_.header.log2Cells;
        Clearance clearance(std::min(cells, 64));
        const bool foretold = cells <= 64;
        if (foretold)
            page_.forEachNode([&](uint32_t word, uint32_t, const NodePlace& place) {
                if (nodeType(word) != kNodeInternal && nodeType(word) != kNodeEmpty)
                    clearance.occupy(place.lower() / kSubcellsPerCell, std::max(1, place.edge / kSubcellsPerCell));
            });
        page_.forEachNode([&](uint32_t& word, uint32_t source, const NodePlace& place) {
            if (nodeType(word) != kNodeEmpty) return;
            const int least = foretold && place.edge >= kSubcellsPerCell
                                  ? clearance.of(place.lower() / kSubcellsPerCell, place.edge / kSubcellsPerCell)
                                  : 0;
            const int foretoldValue = least * int(kClearancePerCell);
            int32_t more = int32_t(source & kNodePayloadMask) - foretoldValue;
            const size_t size = place.edge >= kSubcellsPerCell ? 0 : 1;
            clearance_[size][std::min(least, 3)].code(coder_, more);
            const int64_t value = int64_t{foretoldValue} + more;
            if (value < 0 || value >= int64_t{kNodeSlabBit}) page_.wrong = true;
            word |= uint32_t(value) & (kNodeSlabBit - 1);
        });
    }

    Coder& coder_;
    CodecPage& page_;
    std::vector<uint8_t> depth_;              ///< for each group, the depth of its nodes
    std::vector<NodePlace> parents_;          ///< for each group, its parent
    std::vector<std::vector<uint8_t>> grid_;  ///< for each depth, the types of the nodes; leaves are repeated below
    uint32_t groupsMade_ = 0, last_ = 0, lastWall_ = 0, lastDip_ = 0;
    BitModel occupied_[3][64];
    SymbolModel typeModel_[3][4][16];
    SymbolModel dip_[4][4];
    SymbolModel wall_[4][4][4];
    SignedModel clearance_[2][4];
};

}  // namespace vcp
