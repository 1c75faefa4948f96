// The finished pages of all levels, on temporary files until the output's directory is known.
//
// An entry has the hashes of its page's bytes, made before these are written; each entry is followed by a hash of its
// own.
#pragma once

#include <deque>
#include <string_view>
#include <vector>

#include "builder/spill/temp_space.h"
#include "octree/vcp_writer.h"

namespace vcp {

/// The pages of a level: directory entries, and where the bytes are (offsets of the entries point into the spool).
class PageSpool {
public:
    /// `prefix`: of the files' names (temp_folder.cpp lists them).
    PageSpool(TempSpace& space, uint32_t level, std::string_view prefix = "");

    /// Appends a page. One thread.
    Result<void> append(PageEntry entry, const StoredPage& page);
    Result<void> sync();
    /// Takes over what an interrupted build had: so many bytes and entries. Errors: Io; InvalidInput (damaged).
    Result<void> reopen(uint64_t bytes, uint64_t entries);
    /// Returns a page as it was appended. Errors: Io; InvalidInput (damaged).
    Result<StoredPage> read(const PageEntry& entry) const;
    /// Returns the error that says that a page is damaged.
    [[nodiscard]] Error damaged(const PageEntry& entry) const { return damagedTempFile(pages_.path(), entry.offset); }
    /// Closes the files of a spool that another build finished, whose entries stay; wake() opens that of the pages
    /// again (TempFile::rest). Errors of wake: reopen's.
    void rest();
    Result<void> wake() { return pages_.wake(); }
    void remove();
    /// Brings the entries that are in memory into Morton order.
    void sortEntries();

    [[nodiscard]] std::vector<PageEntry>& entries() { return entries_; }
    [[nodiscard]] const std::vector<PageEntry>& entries() const { return entries_; }
    [[nodiscard]] uint64_t bytes() const { return pages_.size(); }
    [[nodiscard]] const std::string& pagesFile() const { return pages_.name(); }
    [[nodiscard]] const std::string& directoryFile() const { return directory_.name(); }

private:
    [[nodiscard]] uint64_t hashOf(const PageEntry& entry, uint64_t number) const;

    uint32_t level_;
    TempFile pages_, directory_;
    std::vector<PageEntry> entries_;
};

/// The pages of a level, in one spool or in those of many parts. The offset of an entry counts on from spool to spool:
/// the sum of the bytes before its spool is where that begins.
class JoinedSpools {
public:
    /// Takes over the entries of a spool, which outlives this; their bytes stay where they are.
    void add(PageSpool& spool);
    /// Does so with the files of all spools (PageSpool::rest). Errors: PageSpool::wake's.
    void rest();
    Result<void> wake();
    /// Returns a page as it was appended; any thread. Errors: PageSpool::read's.
    [[nodiscard]] Result<StoredPage> read(const PageEntry& entry) const;
    void sortEntries();

    [[nodiscard]] std::vector<PageEntry>& entries() { return entries_; }
    [[nodiscard]] const std::vector<PageEntry>& entries() const { return entries_; }

private:
    struct Source {
        uint64_t begin;
        PageSpool* spool;
    };
    std::vector<Source> sources_;  ///< those with any bytes
    uint64_t end_ = 0;
    std::vector<PageEntry> entries_;
};

}  // namespace vcp
