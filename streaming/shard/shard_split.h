// How the pages of a .vcp file are dealt to shards.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "octree/dataset_reader.h"

namespace vcp {

/// Which shards a file is cut into. Each but the first begins with a page that has children, and also has a copy of it.
struct ShardSplit {
    /// Entry of the page that each shard begins with, ascending; the first is 0.
    std::vector<uint64_t> firstPages;
    /// For each page, the shard that has it with its own bytes: of a page that a shard begins with, the one above.
    std::vector<uint32_t> owner;

    /// Returns the number of the shard that begins with a page, or 0 where none does (or the page is the first).
    [[nodiscard]] uint32_t shardFrom(uint64_t page) const;
};

/// Cuts a file into shards of about `shardBytes`: never more, but where a page with those of its children alone takes
/// more. Where a page and what is below it take more, each child becomes a shard's first page that takes, with what is
/// below it, more than a sixteenth of that. So what is cut where depends on the sizes nearby alone, and a scan of which
/// a part is replaced is cut elsewhere as before. Precondition: all of the directory is known; fewer than 2^32 shards.
ShardSplit splitIntoShards(const Dataset& dataset, uint64_t shardBytes);

}  // namespace vcp
