// Codes the vectors of slab leaves and the octants that they name: each vector once, foretold by the planes of the
// leaves beside its own; octants by the plane itself. Part of page_codec.
#pragma once

#include <algorithm>
#include <cstdlib>

#include "octree/page/codec_page.h"
#include "octree/page/octahedral_grid.h"
#include "octree/page/range_coder.h"
#include "octree/surface/position_map.h"

namespace vcp {

template <class Coder>
class SlabCodec {
public:
    SlabCodec(Coder& coder, CodecPage& page)
        : coder_(coder), page_(page), leaves_(page.header.slabLeaves), nextVector_(4 * page.softFaces()) {}

    /// Completes the words of slab leaves and fills their vectors, in the order of nodes.
    void run() {
        const uint64_t end = uint64_t{nextVector_} + page_.header.slabLeaves;
        if (page_.header.slabLeaves > 0 && end > kSlabVectorMask) page_.wrong = true;
        if (page_.wrong || page_.header.slabLeaves == 0) return;
        page_.forEachNode([&](uint32_t& word, uint32_t source, const NodePlace& place) {
            if (nodeType(word) == kNodeSlab) leaf(word, source, place);
        });
    }

private:
    /// Offsets count in 1/16 of a vector's; this many are a leaf's edge.
    static constexpr int kFinePerEdge = 1164;

    struct Leaf {
        uint32_t octants = 0;
        bool isOpen = false;
        GridDirection normal{0};
        int offset = 0;     ///< along `normal`, fine
        int thickness = 0;  ///< the code
    };
    /// A leaf that was coded already, and on which side of the one at hand it lies.
    struct Neighbour {
        const Leaf* leaf = nullptr;
        int axis = 0, along = 0;
    };

    void leaf(uint32_t& word, uint32_t source, const NodePlace& place) {
        findNeighbours(place);
        uint32_t code = 0;
        if (Coder::kEncodes) {
            code = vectorWord(page_.source->faces, slabVector(source));
            page_.vectorSource.push_back(slabVector(source));
        }
        Leaf made = vector(code);
        if (page_.hasMarks) made.isOpen = codeMark(isOpenSlab(source));
        const uint32_t octants = codeOctants(slabOctants(source), made);
        word |= octants << kSlabOctantsShift | (made.isOpen ? kSlabOpenBit : 0u) | nextVector_;
        reinterpret_cast<uint32_t*>(page_.faces.data())[nextVector_++] = code;
        Leaf& kept = leaves_.findOrAdd(leafKey(place.lower(), place.edge));
        kept = made;
        kept.octants = octants;
        last_ = made.normal;
    }

    void findNeighbours(const NodePlace& place) {
        count_ = 0;
        for (auto& ends : beside_) ends[0] = ends[1] = nullptr;
        forEachBeside(place, [&](int axis, int end, uint64_t key) {
            const Leaf* beside = leaves_.find(key);
            beside_[axis][end] = beside;
            if (beside != nullptr) neighbours_[count_++] = {beside, axis, end != 0 ? 1 : -1};
        });
    }

    /// Codes a vector: thickness, direction, offset; each helps to foretell the next.
    Leaf vector(uint32_t& code) {
        Leaf made;
        made.thickness = codeThickness(int(code >> kSlabThicknessShift & kSlabThicknessMask));
        const int rough = made.thickness <= 3 ? 0 : made.thickness <= 6 ? 1 : made.thickness <= 10 ? 2 : 3;
        uint32_t direction = code >> kSlabDirectionShift;
        const uint32_t size = codeDirection(direction, rough);
        made.normal = gridDirection(direction);
        const int foretold = std::clamp(foretoldOffset(made.normal), 0, int(kSlabOffsetMask));
        int32_t more = int32_t(code & kSlabOffsetMask) - foretold;
        offset_[std::min(count_, 2)][rough][size].code(coder_, more);
        const int offset = foretold + more;
        if (offset < 0 || offset > int(kSlabOffsetMask)) page_.wrong = true;
        made.offset = 16 * (std::clamp(offset, 0, int(kSlabOffsetMask)) - kSlabOffsetZero);
        code = (uint32_t(offset) & kSlabOffsetMask) | uint32_t(made.thickness) << kSlabThicknessShift |
               direction << kSlabDirectionShift;
        return made;
    }

    bool codeMark(bool isOpen) {
        int open = 0;
        for (int i = 0; i < count_; ++i) open += neighbours_[i].leaf->isOpen ? 1 : 0;
        coder_.bit(open_[count_ == 0 ? 0 : open == 0 ? 1 : open < count_ ? 2 : 3], isOpen);
        return isOpen;
    }

    int codeThickness(int thickness) {
        int sum = 0;
        for (int i = 0; i < count_; ++i) sum += neighbours_[i].leaf->thickness;
        const int mean = count_ > 0 ? std::min(15, (sum + count_ / 2) / count_) : 16;
        constexpr uint32_t kThick = SymbolModel::kSymbols - 1;
        uint32_t symbol = std::min(uint32_t(thickness), kThick);
        coder_.symbol(thickness_[mean], symbol);
        if (symbol < kThick) return int(symbol);
        uint32_t more = uint32_t(thickness) - kThick;
        thicker_.code(coder_, more);
        if (more > kSlabThicknessMask - kThick) page_.wrong = true;
        return int(std::min(kThick + more, kSlabThicknessMask));
    }

    uint32_t codeDirection(uint32_t& direction, int rough) {
        GridDirection foretold(0);
        for (int i = 0; i < count_; ++i) {
            const GridDirection n = neighbours_[i].leaf->normal;
            foretold += dot(foretold, n) < 0 ? -n : n;
        }
        if (count_ == 0) foretold = last_;
        // A direction and its opposite mean the same plane.
        bool turned = Coder::kEncodes && dot(gridDirection(direction), foretold) < 0;
        coder_.bit(turned_[count_ > 0 ? 1 : 0], turned);
        return direction_[std::min(count_, 2)][rough].code(coder_, direction, turned ? -foretold : foretold,
                                                           page_.wrong);
    }

    /// Returns the code of the offset of a plane with this normal that goes on with those beside it. As with the fields
    /// of soft leaves, the mean of what both planes say is taken.
    [[nodiscard]] int foretoldOffset(GridDirection n) const {
        int sum = 0;
        for (int i = 0; i < count_; ++i) {
            const Neighbour& near = neighbours_[i];
            const int cosine = dot(n, near.leaf->normal) / 4096, side = cosine < 0 ? -1 : 1;
            const int offset = side * near.leaf->offset;
            const int byTheirs = offset + side * near.along * near.leaf->normal[near.axis] * kFinePerEdge / 4096;
            const int byThis = offset * std::abs(cosine) / 4096 + near.along * n[near.axis] * kFinePerEdge / 4096;
            sum += byTheirs + byThis;
        }
        return kSlabOffsetZero + (count_ > 0 ? sum / (32 * count_) : 0);
    }

    uint32_t codeOctants(uint32_t octants, const Leaf& made) {
        const int reach =
            (std::abs(made.normal.x) + std::abs(made.normal.y) + std::abs(made.normal.z)) * kFinePerEdge / (4 * 4096) +
            made.thickness * made.thickness * 21 / 20;
        uint32_t result = 0;
        for (uint32_t o = 0; o < 8; ++o) {
            bool holds = (octants >> o & 1u) != 0;
            // At least one octant holds surface.
            if (o == 7 && result == 0) return 0x80u;
            coder_.bit(octant_[depthIn(o, made, reach)][evidence(o)], holds);
            if (holds) result |= 1u << o;
        }
        return result;
    }

    /// Returns how deep the slab reaches into an octant, 0 (not at all) to 15.
    [[nodiscard]] static int depthIn(uint32_t o, const Leaf& made, int reach) {
        const GridDirection n = made.normal;
        const int height =
            ((o & 1u ? n.x : -n.x) + (o & 2u ? n.y : -n.y) + (o & 4u ? n.z : -n.z)) * kFinePerEdge / (4 * 4096) -
            made.offset;
        const int depth = reach - std::abs(height);
        return depth < 0 ? 0 : std::min(15, 1 + depth / 32);
    }

    /// Returns what the leaves that were coded already say of an octant: how many of the three beside it hold surface
    /// there, and how many do not.
    [[nodiscard]] int evidence(uint32_t o) const {
        int holding = 0, known = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const Leaf* leaf = beside_[axis][o >> axis & 1u];
            if (leaf == nullptr) continue;
            ++known;
            holding += int(leaf->octants >> (o ^ 1u << axis) & 1u);
        }
        return known * 4 + holding;
    }

    static int dot(GridDirection a, GridDirection b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

    Coder& coder_;
    CodecPage& page_;
    PositionMap<Leaf> leaves_;
    uint32_t nextVector_;
    Neighbour neighbours_[6];
    const Leaf* beside_[3][2] = {};
    int count_ = 0;  ///< neighbours of the leaf at hand
    GridDirection last_{0};
    BitModel turned_[2], octant_[16][16], open_[4];
    SymbolModel thickness_[17];
    NumberModel thicker_;
    DirectionModel direction_[3][4];
    SmallModel offset_[3][4][4];
};

}  // namespace vcp
