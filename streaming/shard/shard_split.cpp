#include "streaming/shard/shard_split.h"

#include <algorithm>

#include "octree/vcp_writer.h"

namespace vcp {

namespace {

constexpr uint64_t kSmallestShare = 16;

/// Returns what a page takes in a file, with its entry.
uint64_t bytesOf(const PageEntry& page) {
    return alignPage(page.storedBytes) + alignPage(page.colourStoredBytes) + sizeof(PageEntry);
}

}  // namespace

uint32_t ShardSplit::shardFrom(uint64_t page) const {
    const auto found = std::lower_bound(firstPages.begin(), firstPages.end(), page);
    return found != firstPages.end() && *found == page ? uint32_t(found - firstPages.begin()) : 0;
}

ShardSplit splitIntoShards(const Dataset& dataset, uint64_t shardBytes) {
    const PageDirectory& pages = dataset.pages;
    // What each page takes in its shard, with what is below it there. Children have larger numbers than their parents.
    std::vector<uint64_t> below(pages.size());
    ShardSplit split;
    for (size_t p = pages.size(); p-- > 0;) {
        const PageEntry& page = pages[p];
        below[p] = bytesOf(page);
        for (const uint64_t child : childrenOf(page)) below[p] += below[child];
        if (below[p] <= shardBytes) continue;
        below[p] = bytesOf(page);
        for (const uint64_t child : childrenOf(page)) {
            if (pages[child].childMask != 0 && below[child] > shardBytes / kSmallestShare) {
                split.firstPages.push_back(child);
                // The child itself stays.
                below[child] = bytesOf(pages[child]);
            }
            below[p] += below[child];
        }
    }
    split.firstPages.push_back(0);
    std::sort(split.firstPages.begin(), split.firstPages.end());
    split.owner.assign(pages.size(), 0);
    for (size_t p = 0; p < pages.size(); ++p) {
        const uint32_t from = split.shardFrom(p), owner = p > 0 && from > 0 ? from : split.owner[p];
        for (const uint64_t child : childrenOf(pages[p])) split.owner[child] = owner;
    }
    return split;
}

}  // namespace vcp
