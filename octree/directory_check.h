// What blocks and entries of the directory of a .vcp file say, checked before anything is read or allocated by it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "octree/dataset_reader.h"

namespace vcp {

/// What entry `index` says is wrong. `field`: offset of what is wrong within the entry.
Error brokenEntry(const std::string& file, uint64_t index, std::string message, uint64_t field = 0);

/// A block that holds `entries` and a hash, and is zero between. `bytes`: kBlockBytes.
Result<void> checkBlock(const std::string& file, uint64_t block, uint64_t entries, std::span<const std::byte> bytes);

/// A directory that is there as a whole: every entry, and that the tree is one.
Result<void> checkDirectory(const std::string& file, const Dataset& dataset);

/// What entries say for themselves: sizes fit the file, offsets ascend from one entry to the next.
class EntryCheck {
public:
    /// Entries of the file named `file`; both must outlive this.
    EntryCheck(const std::string& file, const Dataset& dataset);

    /// The next entry, which is on this level. Errors: InvalidInput.
    Result<void> check(uint64_t index, const PageEntry& entry, uint32_t level);

private:
    Result<void> colour(uint64_t index, const PageEntry& entry);
    Result<void> extent(uint64_t index, uint64_t offset, uint64_t stored, uint64_t bytes);

    const std::string& file_;
    const FileHeader& header_;
    bool hasColour_;
    uint8_t mostParts_;  ///< the largest PageEntry::parts
    uint64_t end_;       // of what came before
};

/// Calls visit(page, octant) for each child, until one gives an error.
template <class Visit>
Result<void> eachChild(const PageEntry& parent, Visit&& visit) {
    uint64_t child = parent.firstChild;
    for (uint32_t octant = 0; octant < 8; ++octant)
        if (parent.childMask >> octant & 1) VCP_TRY(visit(child++, octant));
    return {};
}

inline bool isChildAt(const PageEntry& child, const PageEntry& parent, uint32_t octant) {
    return child.level == parent.level + 1 && child.morton == (parent.morton << 3 | octant);
}

}  // namespace vcp
