// Strips: how hard leaves store their triangles (octree/shared/page_layout.h). What writes them, and the one walk that
// reads them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "octree/surface/leaf_math.h"

namespace vcp {

/// The numbers of a triangle's vertices, in an order that says which side is its front.
using Index3 = std::array<uint32_t, 3>;

/// Entry of a strip, as it is kept while a page is made, and read from it: a step and the number of a vertex.
constexpr uint32_t stripEntry(uint32_t step, uint32_t vertex) { return step << kLongVertexBits | vertex; }
constexpr uint32_t stepOf(uint32_t entry) { return entry >> kLongVertexBits; }
constexpr uint32_t vertexOf(uint32_t entry) { return entry & ((1u << kLongVertexBits) - 1); }

/// Bytes of an entry in a page with so many vertices.
constexpr uint32_t entryBytes(uint32_t vertices) { return vertices <= kShortEntryVertices ? 2 : 4; }

/// The entries of a page's strips. The bytes must outlive it.
class StripEntries {
public:
    StripEntries() = default;
    /// `bytes`: entries of 2 or 4 bytes each.
    StripEntries(std::span<const std::byte> bytes, uint32_t bytesEach)
        : bytes_(bytes.data()), count_(uint32_t(bytes.size() / bytesEach)), short_(bytesEach == 2) {}

    [[nodiscard]] uint32_t size() const { return count_; }
    [[nodiscard]] uint32_t operator[](uint32_t i) const {
        if (!short_) return read<uint32_t>(i);
        const uint32_t entry = read<uint16_t>(i);
        return stripEntry(entry >> kShortVertexBits, entry & ((1u << kShortVertexBits) - 1));
    }

private:
    template <class Word>
    [[nodiscard]] Word read(uint32_t i) const {
        Word word;
        std::memcpy(&word, bytes_ + sizeof(Word) * i, sizeof word);
        return word;
    }

    const std::byte* bytes_ = nullptr;
    uint32_t count_ = 0;
    bool short_ = false;
};

/// Walks the triangles of a hard leaf, one after the other. The leaf's word and the entries may be hostile: no entry
/// beyond the last is read, and no triangle comes from a step that leads from none.
class StripWalk {
public:
    StripWalk(const StripEntries& entries, uint32_t leaf);

    /// The number of triangles that the leaf claims.
    [[nodiscard]] uint32_t count() const { return count_; }
    /// Goes on to the next triangle. Returns false behind the last one, or where the entries are no strip.
    bool next();
    [[nodiscard]] Index3 triangle() const {
        return isTurned_ ? Index3{corners_[0], corners_[2], corners_[1]} : corners_;
    }
    /// Number of the entry that completed the latest triangle.
    [[nodiscard]] uint32_t entry() const { return at_ - 1; }
    /// Whether all triangles came.
    [[nodiscard]] bool isWhole() const { return done_ == count_; }

private:
    const StripEntries& entries_;
    uint32_t at_, count_, done_ = 0;
    Index3 corners_{};  ///< a, b, c
    bool isTurned_ = false;
};

inline StripWalk::StripWalk(const StripEntries& entries, uint32_t leaf)
    : entries_(entries), at_(leaf & kHardFirstMask), count_(leaf >> kHardCountShift & kHardCountMask) {
    if (count_ != kHardCountLong) return;
    if (entries.size() < 2 || at_ > entries.size() - 2) {
        count_ = 0;
        return;
    }
    count_ = entries[at_] | entries[at_ + 1] << kShortVertexBits;
    at_ += 2;
}

inline bool StripWalk::next() {
    if (done_ == count_ || at_ >= entries_.size()) return false;
    const uint32_t entry = entries_[at_], step = stepOf(entry);
    if (step != kStepBegin) {
        if (done_ == 0) return false;
        corners_[step - 1] = vertexOf(entry);
        isTurned_ = !isTurned_;
        ++at_;
    } else {
        if (entries_.size() - at_ < 3 || stepOf(entries_[at_ + 1] | entries_[at_ + 2]) != kStepBegin) return false;
        corners_ = {entry, entries_[at_ + 1], entries_[at_ + 2]};
        isTurned_ = false;
        at_ += 3;
    }
    ++done_;
    return true;
}

/// Calls `visit(triangle)` for each triangle of a hard leaf of a checked page.
template <class Visit>
void forEachTriangle(const StripEntries& entries, uint32_t leaf, Visit&& visit) {
    for (StripWalk walk(entries, leaf); walk.next();) visit(walk.triangle());
}

/// Appends strips of a leaf's triangles to the entries of a page; returns the leaf's word. The same list gives the same
/// strips everywhere. Each triangle takes at least one entry, at most three, and two more a leaf; the work is linear.
/// Precondition: there are triangles, fewer than 2^28; entries.size() <= kHardFirstMask.
uint32_t appendHardLeaf(std::span<const Index3> triangles, std::vector<uint32_t>& entries);

/// Writes entries as a page with so many vertices stores them.
void storeEntries(std::span<const uint32_t> entries, uint32_t vertices, std::byte* out);

}  // namespace vcp
