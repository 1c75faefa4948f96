// The finished pages of all levels, on temporary files until the output's directory is known.
#pragma once

#include <deque>
#include <vector>

#include "builder/temp_space.h"
#include "octree/vcp_writer.h"

namespace vcp {

/// A page of a level: its directory entry, and where its bytes are (offsets of the entry point into the spool).
class PageSpool {
public:
    PageSpool(TempSpace& space, uint32_t level);

    /// Pages come in Morton order. One thread.
    Result<void> append(PageEntry entry, const StoredPage& page);
    Result<void> sync();
    /// What an interrupted build had: so many bytes and entries.
    Result<void> reopen(uint64_t bytes, uint64_t entries);
    Result<StoredPage> read(const PageEntry& entry) const;
    void remove();

    [[nodiscard]] std::vector<PageEntry>& entries() { return entries_; }
    [[nodiscard]] const std::vector<PageEntry>& entries() const { return entries_; }
    [[nodiscard]] uint64_t bytes() const { return pages_.size(); }
    [[nodiscard]] const std::string& pagesFile() const { return pages_.name(); }
    [[nodiscard]] const std::string& directoryFile() const { return directory_.name(); }

private:
    TempFile pages_, directory_;
    std::vector<PageEntry> entries_;
};

}  // namespace vcp
