#include "octree/page/strips.h"

#include <algorithm>
#include <bit>

namespace vcp {

namespace {

constexpr uint32_t kMostTogether = 64;

/// Finds strips of at most 64 triangles: each begins where fewest neighbours are left, and goes on to the neighbour
/// that has fewest left, so that few triangles are left alone.
///
/// Edge k of a triangle is the one opposite its vertex k; edges are numbered 4 * triangle + k.
class StripFinder {
public:
    explicit StripFinder(std::span<const Index3> triangles)
        : triangles_(triangles), left_(~uint64_t{0} >> (kMostTogether - triangles.size())) {
        findMates();
    }

    void append(std::vector<uint32_t>& entries) {
        while (left_ != 0) appendStrip(loneliest(), entries);
    }

private:
    static constexpr uint8_t kNone = 0xff;  // edge 3 of a triangle, which has none
    static constexpr uint32_t kNext[3] = {1, 2, 0};

    /// Pairs each edge with one that runs the other way. Of three and more at an edge, some stay alone.
    void findMates() {
        const uint32_t count = uint32_t(triangles_.size()), slots = std::bit_ceil(6 * count);
        const uint32_t shift = uint32_t(32 - std::countr_zero(slots));
        std::array<uint8_t, 8 * kMostTogether> edgeAt;  // by hash of the vertices: an edge that was met
        std::fill_n(edgeAt.begin(), slots, kNone);
        std::fill_n(mate_.begin(), 4 * count, kNone);
        std::fill_n(neighbours_.begin(), count, uint8_t{0});
        for (uint32_t t = 0; t < count; ++t)
            for (uint32_t k = 0; k < 3; ++k) {
                const uint32_t e = 4 * t + k, a = triangles_[t][kNext[k]], b = triangles_[t][kNext[kNext[k]]];
                uint32_t slot = ((a + b) * 0x9e3779b1u ^ (a ^ b) * 0x85ebca6bu) >> shift;
                for (; edgeAt[slot] != kNone; slot = (slot + 1) & (slots - 1))
                    if (pair(e, edgeAt[slot], a, b)) break;
                if (edgeAt[slot] == kNone) edgeAt[slot] = uint8_t(e);
            }
    }

    /// Makes an edge from a to b the mate of another one, if it is that.
    bool pair(uint32_t edge, uint32_t other, uint32_t a, uint32_t b) {
        const uint32_t t = other / 4, k = other % 4;
        if (triangles_[t][kNext[k]] != b || triangles_[t][kNext[kNext[k]]] != a) return false;
        if (mate_[other] != kNone || t == edge / 4) return false;
        mate_[other] = uint8_t(edge);
        mate_[edge] = uint8_t(other);
        ++neighbours_[t];
        ++neighbours_[edge / 4];
        return true;
    }

    [[nodiscard]] bool isLeft(uint32_t triangle) const { return (left_ >> triangle & 1) != 0; }

    /// Returns the first of the triangles with fewest neighbours.
    [[nodiscard]] uint32_t loneliest() const {
        uint32_t best = 0, fewest = 4;
        for (uint64_t rest = left_; rest != 0; rest &= rest - 1) {
            const uint32_t t = uint32_t(std::countr_zero(rest));
            if (neighbours_[t] >= fewest) continue;
            best = t;
            fewest = neighbours_[t];
        }
        return best;
    }

    void take(uint32_t triangle) {
        left_ &= ~(uint64_t{1} << triangle);
        for (uint32_t k = 0; k < 3; ++k)
            if (const uint8_t mate = mate_[4 * triangle + k]; mate != kNone) --neighbours_[mate / 4];
    }

    void appendStrip(uint32_t t, std::vector<uint32_t>& entries) {
        take(t);
        for (const uint32_t vertex : triangles_[t]) entries.push_back(stripEntry(kStepBegin, vertex));
        uint32_t place[3] = {0, 1, 2};  // for each vertex of the triangle, which of the strip's a, b, c it is
        while (neighbours_[t] > 0) {
            uint32_t over = 0, fewest = 4;
            for (uint32_t k = 0; k < 3; ++k) {
                const uint32_t mate = mate_[4 * t + k];
                if (mate == kNone || !isLeft(mate / 4) || neighbours_[mate / 4] >= fewest) continue;
                over = k;
                fewest = neighbours_[mate / 4];
            }
            // The edge's ends keep their places; from the other side it runs the other way.
            const uint32_t mate = mate_[4 * t + over], k = mate % 4, step = place[over];
            const uint32_t from = place[kNext[over]], to = place[kNext[kNext[over]]];
            place[k] = step;
            place[kNext[k]] = to;
            place[kNext[kNext[k]]] = from;
            t = mate / 4;
            take(t);
            entries.push_back(stripEntry(kStepBegin + 1 + step, triangles_[t][k]));
        }
    }

    std::span<const Index3> triangles_;
    uint64_t left_;                                  ///< bit t: triangle t is in no strip yet
    std::array<uint8_t, 4 * kMostTogether> mate_;    ///< for each edge, the one across it
    std::array<uint8_t, kMostTogether> neighbours_;  ///< for each triangle, how many neighbours are left
};

}  // namespace

uint32_t appendHardLeaf(std::span<const Index3> triangles, std::vector<uint32_t>& entries) {
    const uint32_t first = uint32_t(entries.size()), count = uint32_t(triangles.size());
    if (count >= kHardCountLong) {
        entries.push_back(count & ((1u << kShortVertexBits) - 1));
        entries.push_back(count >> kShortVertexBits);
    }
    for (uint32_t i = 0; i < count; i += kMostTogether)
        StripFinder(triangles.subspan(i, std::min(kMostTogether, count - i))).append(entries);
    return kNodeHard << kNodeTypeShift | std::min(count, kHardCountLong) << kHardCountShift | first;
}

void storeEntries(std::span<const uint32_t> entries, uint32_t vertices, std::byte* out) {
    if (entryBytes(vertices) == sizeof(uint32_t)) {
        if (!entries.empty()) std::memcpy(out, entries.data(), entries.size_bytes());
        return;
    }
    for (const uint32_t entry : entries) {
        const uint16_t word = uint16_t(stepOf(entry) << kShortVertexBits | vertexOf(entry));
        std::memcpy(out, &word, sizeof word);
        out += sizeof word;
    }
}

}  // namespace vcp
