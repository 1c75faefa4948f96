// Keeps pages in memory as their file stores them, to be read again: a view under a small budget evicts pages that it
// soon wants back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

namespace vcp {

/// A cache of stored pages; those used longest ago go first. Any thread.
class StoredPages {
public:
    using Bytes = std::shared_ptr<const std::vector<std::byte>>;

    /// Keeps at most `bytes` from now on, bookkeeping included. Returns how many bytes there are.
    uint64_t limitTo(uint64_t bytes);
    /// Returns a page's bytes, or nothing where it is not kept.
    [[nodiscard]] Bytes find(uint64_t page);
    /// Keeps a page. Nothing happens where it is kept already or is larger than the limit.
    void keep(uint64_t page, std::vector<std::byte> bytes);

private:
    struct Entry {
        uint64_t page;
        Bytes bytes;
    };
    static uint64_t costOf(const Entry& entry);
    void trim();

    std::mutex mutex_;
    std::list<Entry> entries_;  // the last used comes first
    std::unordered_map<uint64_t, std::list<Entry>::iterator> places_;
    uint64_t bytes_ = 0, limit_ = 0;
};

}  // namespace vcp
