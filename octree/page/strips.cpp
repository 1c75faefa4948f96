#include "octree/page/strips.h"

#include <algorithm>
#include <bit>

namespace vcp {

namespace {

constexpr uint32_t kMostTogether = 64;

/// Finds strips of at most 64 triangles: each begins where fewest neighbours are left, and goes on to the neighbour
/// that has fewest left, so that few triangles are left alone.
///
/// Edge k of a triangle is the one opposite its vertex k; edges are numbered 3 * triangle + k.
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
    static constexpr uint8_t kNone = 0xff;

    [[nodiscard]] uint32_t from(uint32_t edge) const { return triangles_[edge / 3][(edge + 1) % 3]; }
    [[nodiscard]] uint32_t to(uint32_t edge) const { return triangles_[edge / 3][(edge + 2) % 3]; }

    /// Pairs each edge with one that runs the other way. Of three and more at an edge, some stay alone.
    void findMates() {
        const uint32_t edges = uint32_t(3 * triangles_.size());
        const uint32_t slots = std::bit_ceil(2 * edges), shift = uint32_t(32 - std::countr_zero(slots));
        std::array<uint8_t, 2 * 256> edgeAt;  // by hash of the vertices: an edge that was met
        std::fill_n(edgeAt.begin(), slots, kNone);
        std::fill_n(mate_.begin(), edges, kNone);
        for (uint32_t e = 0; e < edges; ++e) {
            const uint32_t a = from(e), b = to(e);
            uint32_t slot = (std::min(a, b) * 0x9e3779b1u + std::max(a, b) * 0x85ebca6bu) >> shift;
            for (; edgeAt[slot] != kNone; slot = (slot + 1) & (slots - 1)) {
                const uint8_t other = edgeAt[slot];
                if (mate_[other] != kNone || from(other) != b || to(other) != a || other / 3 == e / 3) continue;
                mate_[other] = uint8_t(e);
                mate_[e] = other;
                break;
            }
            if (mate_[e] == kNone) edgeAt[slot] = uint8_t(e);
        }
    }

    [[nodiscard]] bool isLeft(uint8_t edge) const { return edge != kNone && (left_ >> edge / 3 & 1) != 0; }

    [[nodiscard]] uint32_t neighboursLeft(uint32_t triangle) const {
        return uint32_t{isLeft(mate_[3 * triangle])} + uint32_t{isLeft(mate_[3 * triangle + 1])} +
               uint32_t{isLeft(mate_[3 * triangle + 2])};
    }

    /// Returns the first of the triangles with fewest neighbours.
    [[nodiscard]] uint32_t loneliest() const {
        uint32_t best = 0, fewest = 4;
        for (uint64_t rest = left_; rest != 0 && fewest > 0; rest &= rest - 1) {
            const uint32_t t = uint32_t(std::countr_zero(rest)), neighbours = neighboursLeft(t);
            if (neighbours >= fewest) continue;
            best = t;
            fewest = neighbours;
        }
        return best;
    }

    void appendStrip(uint32_t t, std::vector<uint32_t>& entries) {
        left_ &= ~(uint64_t{1} << t);
        for (const uint32_t vertex : triangles_[t]) entries.push_back(stripEntry(kStepBegin, vertex));
        uint32_t first = 0;  // which of the triangle's vertices is the strip's a
        for (;;) {
            uint32_t over = 3, fewest = 4;
            for (uint32_t step = 0; step < 3; ++step) {
                const uint8_t mate = mate_[3 * t + (first + step) % 3];
                if (!isLeft(mate) || neighboursLeft(mate / 3u) >= fewest) continue;
                over = step;
                fewest = neighboursLeft(mate / 3u);
            }
            if (over == 3) return;
            const uint32_t mate = mate_[3 * t + (first + over) % 3];
            t = mate / 3;
            first = (mate + 1) % 3;
            left_ &= ~(uint64_t{1} << t);
            entries.push_back(stripEntry(kStepOverBC + over, triangles_[t][mate % 3]));
        }
    }

    std::span<const Index3> triangles_;
    uint64_t left_;                              ///< bit t: triangle t is in no strip yet
    std::array<uint8_t, 3 * kMostTogether> mate_;  ///< for each edge, the one across it
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

StripWalk::StripWalk(const StripEntries& entries, uint32_t leaf)
    : entries_(entries), at_(leaf & kHardFirstMask), count_(leaf >> kHardCountShift & kHardCountMask) {
    if (count_ != kHardCountLong) return;
    if (entries.size() < 2 || at_ > entries.size() - 2) {
        count_ = 0;
        return;
    }
    count_ = entries[at_] | entries[at_ + 1] << kShortVertexBits;
    at_ += 2;
}

bool StripWalk::next() {
    if (done_ == count_ || at_ >= entries_.size()) return false;
    const uint32_t entry = entries_[at_], vertex = vertexOf(entry);
    const auto [a, b, c] = triangle_;
    switch (stepOf(entry)) {
        case kStepBegin:
            if (entries_.size() - at_ < 3 || stepOf(entries_[at_ + 1] | entries_[at_ + 2]) != kStepBegin) return false;
            triangle_ = {vertex, entries_[at_ + 1], entries_[at_ + 2]};
            at_ += 2;
            break;
        case kStepOverBC:
            triangle_ = {c, b, vertex};
            break;
        case kStepOverCA:
            triangle_ = {a, c, vertex};
            break;
        default:
            triangle_ = {b, a, vertex};
    }
    if (done_ == 0 && stepOf(entry) != kStepBegin) return false;
    ++at_;
    ++done_;
    return true;
}

}  // namespace vcp
