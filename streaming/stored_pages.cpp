#include "streaming/stored_pages.h"

#include <utility>

namespace vcp {

/// Bytes that one page takes besides its own: allocations, list and map.
constexpr uint64_t kEntryBytes = 192;

uint64_t StoredPages::costOf(const Entry& entry) { return entry.bytes->size() + kEntryBytes; }

uint64_t StoredPages::limitTo(uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    limit_ = bytes;
    trim();
    return bytes_;
}

StoredPages::Bytes StoredPages::find(uint64_t page) {
    const std::lock_guard lock(mutex_);
    const auto place = places_.find(page);
    if (place == places_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, place->second);
    return place->second->bytes;
}

void StoredPages::keep(uint64_t page, std::vector<std::byte> bytes) {
    Entry entry{page, std::make_shared<const std::vector<std::byte>>(std::move(bytes))};
    const std::lock_guard lock(mutex_);
    if (places_.contains(page) || costOf(entry) > limit_) return;
    bytes_ += costOf(entry);
    entries_.push_front(std::move(entry));
    places_.emplace(page, entries_.begin());
    trim();
}

void StoredPages::trim() {
    while (bytes_ > limit_) {
        bytes_ -= costOf(entries_.back());
        places_.erase(entries_.back().page);
        entries_.pop_back();
    }
}

}  // namespace vcp
