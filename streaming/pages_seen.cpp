#include "streaming/pages_seen.h"

#include <utility>

namespace vcp {

namespace {

/// Adds pages and all above them; nothing is above one whose entry is not known: its parent is added by itself.
void addWithParents(const Dataset& dataset, const std::vector<uint64_t>& pages, std::unordered_set<uint64_t>& to) {
    for (const uint64_t page : pages) {
        const PageEntry& entry = dataset.pages[page];
        uint64_t above = 0;
        for (int depth = entry.level; depth > 0; --depth) {
            to.insert(above);
            above = childIn(dataset.pages[above], uint32_t(entry.morton >> 3 * (depth - 1) & 7));
        }
        to.insert(page);
    }
}

}  // namespace

void PagesSeen::begin() {
    if (isHeard_) guess_ = std::exchange(seen_, {});
    isHeard_ = false;
}

bool PagesSeen::add(const Dataset& dataset, const std::vector<uint64_t>& pages) {
    const size_t before = seen_.size();
    addWithParents(dataset, pages, seen_);
    isHeard_ = true;
    return !std::exchange(guess_, {}).empty() || seen_.size() > before;
}

void PagesSeen::guess(const Dataset& dataset, const std::vector<uint64_t>& pages) {
    guess_.clear();
    if (!isHeard_) addWithParents(dataset, pages, guess_);
}

uint64_t PagesSeen::bytesHeld() const {
    constexpr uint64_t kEntry = 3 * sizeof(void*);
    return (seen_.bucket_count() + guess_.bucket_count()) * sizeof(void*) + (seen_.size() + guess_.size()) * kEntry;
}

}  // namespace vcp
