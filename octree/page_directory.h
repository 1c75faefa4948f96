// The directory of a .vcp file in memory, whole or in parts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "octree/io/result.h"
#include "octree/io/sparse_array.h"
#include "octree/vcp_file.h"

namespace vcp {

struct Dataset;

/// The entries of all pages, in the file's order: a vector of them. The directory of a large file comes in parts: at
/// first the entries of some blocks are known (readDatasetStart), the others follow with admitBlock(). What is known
/// stays as it is, and any thread may read it; the entry of a page that is not known must not be read. Entries that are
/// not known take no memory.
class PageDirectory {
public:
    PageDirectory();
    PageDirectory(const PageDirectory& other);
    PageDirectory(PageDirectory&& other) noexcept;
    PageDirectory& operator=(const PageDirectory& other);
    PageDirectory& operator=(PageDirectory&& other) noexcept;
    ~PageDirectory();

    [[nodiscard]] size_t size() const { return parts_ ? sparse_.size() : entries_.size(); }
    [[nodiscard]] bool empty() const { return size() == 0; }
    [[nodiscard]] const PageEntry& operator[](size_t page) const { return data()[page]; }
    [[nodiscard]] PageEntry& operator[](size_t page) { return parts_ ? sparse_[page] : entries_[page]; }
    [[nodiscard]] const PageEntry* begin() const { return data(); }
    [[nodiscard]] const PageEntry* end() const { return data() + size(); }
    [[nodiscard]] const PageEntry* data() const { return parts_ ? sparse_.data() : entries_.data(); }
    /// Appends an entry to a directory that is known as a whole.
    void push_back(const PageEntry& entry) { entries_.push_back(entry); }
    void resize(size_t pages) { entries_.resize(pages); }

    /// Makes a directory of so many pages, none known yet. Throws std::bad_alloc where there are no addresses for them.
    void expect(size_t pages);
    [[nodiscard]] bool knows(uint64_t page) const { return !parts_ || knowsBlock(page / kEntriesPerBlock); }
    [[nodiscard]] bool knowsBlock(uint64_t block) const;
    [[nodiscard]] uint64_t blocks() const { return blocksOf(size()); }
    [[nodiscard]] uint64_t blocksKnown() const;

private:
    friend class BlockAdmission;
    struct Parts;
    std::vector<PageEntry> entries_;         // all entries, where the directory is known as a whole
    mutable SparseArray<PageEntry> sparse_;  // entries where it comes in parts
    std::unique_ptr<Parts> parts_;           // null: all is known
};

/// Checks a block of the directory, by its hash and against the blocks that are known, and makes its entries known;
/// does nothing where they are known already. `bytes`: the kBlockBytes at blockOffset(block) of the file named `file`.
/// Any thread. Errors: InvalidInput.
Result<void> admitBlock(const Dataset& dataset, const std::string& file, uint64_t block,
                        std::span<const std::byte> bytes);

}  // namespace vcp
