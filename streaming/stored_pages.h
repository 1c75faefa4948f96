// Pages as their file stores them, kept in memory to be read again: a view under a small budget gives pages up and
// wants them back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

namespace vcp {

/// What was used longest ago goes first. Any thread.
class StoredPages {
public:
    using Bytes = std::shared_ptr<const std::vector<std::byte>>;

    /// No more than `bytes` from now on, what each page takes besides included. Returns how many there are.
    uint64_t limitTo(uint64_t bytes);
    /// Nothing where it is not kept.
    [[nodiscard]] Bytes find(uint64_t page);
    /// Nothing happens where it is kept already, or larger than the limit.
    void keep(uint64_t page, std::vector<std::byte> bytes);

private:
    struct Entry {
        uint64_t page;
        Bytes bytes;
    };
    static uint64_t costOf(const Entry& entry);
    void trim();

    std::mutex mutex_;
    std::list<Entry> entries_;  // used last first
    std::unordered_map<uint64_t, std::list<Entry>::iterator> places_;
    uint64_t bytes_ = 0, limit_ = 0;
};

}  // namespace vcp
