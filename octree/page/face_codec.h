// Codes the soft leaves' faces: runs of leaves, and each corner's vector once, predicted from its neighbours by
// the half-gradient rule of docs/surface.md. Part of page_codec.
#pragma once

#include <algorithm>
#include <cmath>

#include "octree/page/codec_page.h"
#include "octree/page/corner_store.h"
#include "octree/page/octahedral_grid.h"
#include "octree/page/range_coder.h"
#include "octree/surface/position_map.h"

namespace vcp {

/// Corner c of the face at `end` of `axis` of the unit cube.
inline glm::ivec3 faceCorner(uint32_t axis, int end, int c) {
    glm::ivec3 corner;
    corner[int(axis)] = end;
    corner[int((axis + 1) % 3)] = c & 1;
    corner[int((axis + 2) % 3)] = c >> 1;
    return corner;
}

template <class Coder>
class FaceCodec {
public:
    FaceCodec(Coder& coder, CodecPage& page)
        : coder_(coder), page_(page), leaves_(page.header.softLeaves), corners_(1 << page.header.log2Cells) {}

    /// Completes the words of soft leaves and fills the faces.
    void run() {
        std::vector<Leaf> order;
        order.reserve(page_.header.softLeaves);
        page_.forEachNode([&](uint32_t& word, uint32_t source, const NodePlace& place) {
            if (nodeType(word) != kNodeSoft) return;
            order.push_back({&word, source, place});
        });
        for (uint32_t i = 0; i < order.size(); ++i)
            leaves_.findOrAdd(leafKey(order[i].place.lower(), order[i].place.edge)) = i;
        done_.assign(order.size(), 0);
        for (uint32_t i = 0; i < order.size() && !page_.wrong; ++i)
            if (!done_[i]) codeRun(order, i);
        if (nextFace_ != page_.softFaces()) page_.wrong = true;
    }

private:
    static constexpr uint32_t kDirectionMask = 0xfffffu;
    struct Leaf {
        uint32_t* word;
        uint32_t source;
        NodePlace place;
    };
    struct Corner {
        uint32_t code = 0;       ///< the packed vector, its side turned as flip_ said
        int edge = 0;            ///< edge of the leaf that it was coded for; 0: not coded
        glm::i16vec3 normal{0};  ///< direction of `code` in 1/4096, on the side of the corner or the other
    };

    void codeRun(std::vector<Leaf>& order, uint32_t first) {
        uint32_t axis = order[first].source >> kSoftAxisShift & 3u;
        coder_.symbol(axis_, axis);
        if (axis > 2) {
            page_.wrong = true;
            return;
        }
        uint32_t sourceFace = order[first].source & kLeafIndexMask;
        for (uint32_t i = first;;) {
            done_[i] = 1;
            *order[i].word |= axis << kSoftAxisShift | nextFace_;
            codeFace(order[i].place, axis, 0, sourceFace);
            glm::ivec3 beside = order[i].place.lower();
            beside[int(axis)] += order[i].place.edge;
            const uint32_t* next = leaves_.find(leafKey(beside, order[i].place.edge));
            bool goesOn = false;
            if (next != nullptr && !done_[*next]) {
                const uint32_t word = order[*next].source;
                goesOn = Coder::kEncodes && (word >> kSoftAxisShift & 3u) == axis &&
                         (word & kLeafIndexMask) == sourceFace + 1;
                coder_.bit(goesOn_, goesOn);
            }
            ++sourceFace;
            if (!goesOn || page_.wrong) {
                if (!page_.wrong) codeFace(order[i].place, axis, 1, sourceFace);
                return;
            }
            i = *next;
        }
    }

    void codeFace(const NodePlace& place, uint32_t axis, int end, uint32_t sourceFace) {
        if (nextFace_ >= page_.header.faces) {
            page_.wrong = true;
            return;
        }
        uint4& face = page_.faces[nextFace_++];
        if (Coder::kEncodes) {
            page_.faceSource.push_back(sourceFace);
            face = page_.source->faces[sourceFace];
        }
        glm::ivec3 position[4];
        uint4 expected(0);
        bool known[4];
        for (int c = 0; c < 4; ++c) {
            position[c] = place.lower() + int{place.edge} * faceCorner(axis, end, c);
            const Corner& corner = corners_.find(position[c]);
            known[c] = corner.edge != 0;
            if (known[c]) expected[c] = rescaled(corner, place.edge) ^ flip_ << 31;
        }
        // A corner comes up in up to 8 leaves, mostly with the same vector each time.
        bool asExpected = true;
        if (known[0] || known[1] || known[2] || known[3]) {
            for (int c = 0; c < 4; ++c) asExpected = asExpected && (!known[c] || face[c] == expected[c]);
            coder_.bit(asExpected_, asExpected);
        }
        for (int c = 0; c < 4; ++c) {
            uint32_t code = face[c];
            if (known[c] && asExpected)
                code = expected[c];
            else
                codeCorner(position[c], place.edge, code);
            face[c] = code;
        }
    }

    /// A leaf has no outside, so a corner's side is relative to its leaf's surface. flip_ says whether the leaf at hand
    /// names the sides as the leaves before it did.
    void codeCorner(glm::ivec3 position, int edge, uint32_t& code) {
        const Corner known = corners_.find(position);
        if (known.edge == 0) return codeNew(code, foretell(position, edge), position, edge);
        const uint32_t expected = rescaled(known, edge);
        bool same = ((code ^ expected) & 0x7fffffffu) == 0;
        coder_.bit(same_[known.edge == edge ? 0 : 1], same);
        if (same) {
            codeSide(code, expected >> 31, sideKnown_, true);
            code = (expected & 0x7fffffffu) | (code & 0x80000000u);
            return;
        }
        Foretold foretold;
        foretold.normal = known.normal;
        foretold.distance = signedDistance(expected);
        foretold.neighbours = 3;
        foretold.same = true;
        codeNew(code, foretold, position, edge);
    }

    /// What the neighbours say about a corner: its oriented normal (of any length) and its signed distance, in steps of
    /// the packed distance.
    struct Foretold {
        GridDirection normal{0};
        int distance = 0;
        int neighbours = 0;
        int along = 0;         ///< sum, over the neighbours, of the distance without the corner's own normal
        glm::ivec3 offset{0};  ///< sum of the offsets from the neighbours, in leaf edges
        bool same = false;     ///< the corner itself is known, but for rounding
    };

    Foretold foretell(glm::ivec3 position, int edge) {
        Foretold f;
        int sum = 0;
        const Corner* beside[3][2];
        corners_.neighbours(position, edge, beside);
        for (int axis = 0; axis < 3; ++axis)
            for (int end = 0; end < 2; ++end) {
                const Corner& corner = *beside[axis][end];
                if (corner.edge == 0) continue;
                const int along = end != 0 ? -1 : 1;  // direction from the neighbour to the corner
                const int d = signedDistance(rescaled(corner, edge)), slope = steps(along * corner.normal[axis]);
                ++f.neighbours;
                f.normal += GridDirection(corner.normal);
                sum += d + slope;
                f.along += d + slope / 2;
                f.offset[axis] += along;
            }
        if (f.neighbours > 0) f.distance = sum / f.neighbours;
        return f;
    }

    void codeNew(uint32_t& code, const Foretold& f, glm::ivec3 position, int edge) {
        // The side is coded first, then the direction, then the distance: each helps to predict the next.
        const int certainty =
            f.neighbours == 0 ? 0 : std::min(4, int(std::bit_width(unsigned(std::abs(f.distance) / 32))) + 1);
        uint32_t side = code >> 31;
        codeSide(side, f.distance < 0 ? 1u : 0u, sideNew_[certainty], false);
        const bool negative = (side ^ flip_) != 0;
        const int have = std::min(f.neighbours, 3);
        const int context = f.same ? 4 : have;
        uint32_t direction = code >> 11 & kDirectionMask;
        const uint32_t sizes =
            direction_[context].code(coder_, direction, negative ? -f.normal : f.normal, page_.wrong);
        int foretold = f.distance;
        const GridDirection n = oriented(direction << 11 | (negative ? 0x80000000u : 0u));
        if (f.neighbours > 0 && !f.same) {
            foretold = (f.along + (steps(n.x) * f.offset.x + steps(n.y) * f.offset.y + steps(n.z) * f.offset.z) / 2) /
                       f.neighbours;
        }
        if (negative) foretold = -foretold;
        foretold = std::clamp(foretold, 0, int(kPackedDistanceMax));
        int32_t more = int32_t(code & kPackedDistanceMax) - foretold;
        distance_[context][sizes].code(coder_, more);
        const int distance = foretold + more;
        if (distance < 0 || distance > int(kPackedDistanceMax)) page_.wrong = true;
        code = (uint32_t(distance) & kPackedDistanceMax) | direction << 11 | side << 31;
        corners_.at(position) = {code ^ flip_ << 31, edge, glm::i16vec3(n)};
    }

    /// `code`: the side, in bit 31 where `known`, else in bit 0. `expected`: the side before flip_.
    template <class Model>
    void codeSide(uint32_t& code, uint32_t expected, Model& model, bool known) {
        const int shift = known ? 31 : 0;
        bool other = ((code >> shift & 1u) ^ expected ^ flip_) != 0;
        coder_.bit(model, other);
        const uint32_t side = (other ? 1u : 0u) ^ expected ^ flip_;
        code = side << shift;
        if (known && other) flip_ ^= 1u;
    }

    /// A slope in 1/4096 as steps of the packed distance over one leaf edge: 2047 / sqrt(3) steps.
    static int steps(int slope) { return slope * 1182 / 4096; }

    static int signedDistance(uint32_t code) {
        const int d = int(code & kPackedDistanceMax);
        return code >> 31 ? -d : d;
    }
    static GridDirection oriented(uint32_t code) {
        const GridDirection n = gridDirection(code >> 11);
        return code >> 31 ? -n : n;
    }
    /// Converts a corner's vector to the unit of another leaf.
    static uint32_t rescaled(const Corner& corner, int edge) {
        if (corner.edge == edge) return corner.code;
        const uint32_t d = (corner.code & kPackedDistanceMax) * uint32_t(corner.edge) / uint32_t(edge);
        return (corner.code & ~kPackedDistanceMax) | std::min(d, kPackedDistanceMax);
    }

    Coder& coder_;
    CodecPage& page_;
    PositionMap<uint32_t> leaves_;
    CornerStore<Corner> corners_;
    std::vector<uint8_t> done_;
    uint32_t nextFace_ = 0, flip_ = 0;
    SymbolModel axis_;
    BitModel goesOn_, asExpected_, same_[2], sideKnown_, sideNew_[5];
    DirectionModel direction_[5];
    SmallModel distance_[5][4];
};

}  // namespace vcp
