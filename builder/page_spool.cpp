#include "builder/page_spool.h"

#include <fmt/format.h>

namespace vcp {

PageSpool::PageSpool(TempSpace& space, uint32_t level)
    : pages_(space, fmt::format("pages{}.spill", level)), directory_(space, fmt::format("entries{}.spill", level)) {}

Result<void> PageSpool::append(PageEntry entry, const StoredPage& page) {
    entry.storedBytes = static_cast<uint32_t>(page.geometry.size());
    entry.pageBytes = page.geometryBytes;
    entry.colourStoredBytes = static_cast<uint32_t>(page.colour.size());
    entry.colourBytes = page.colourBytes;
    const auto at = pages_.append(page.geometry);
    if (!at) return at.error();
    entry.offset = *at;
    const auto colour = pages_.append(page.colour);
    if (!colour) return colour.error();
    entries_.push_back(entry);
    const auto listed = directory_.append(std::as_bytes(std::span(&entry, 1)));
    if (!listed) return listed.error();
    return {};
}

Result<void> PageSpool::sync() {
    VCP_TRY(pages_.sync());
    return directory_.sync();
}

Result<void> PageSpool::reopen(uint64_t bytes, uint64_t entries) {
    VCP_TRY(pages_.reopen(bytes));
    VCP_TRY(directory_.reopen(entries * sizeof(PageEntry)));
    entries_.resize(entries);
    return directory_.read(0, std::as_writable_bytes(std::span(entries_)));
}

Result<StoredPage> PageSpool::read(const PageEntry& entry) const {
    StoredPage page;
    page.geometry.resize(entry.storedBytes);
    page.colour.resize(entry.colourStoredBytes);
    page.geometryBytes = entry.pageBytes;
    page.colourBytes = entry.colourBytes;
    VCP_TRY(pages_.read(entry.offset, page.geometry));
    VCP_TRY(pages_.read(entry.offset + entry.storedBytes, page.colour));
    return page;
}

void PageSpool::remove() {
    pages_.remove();
    directory_.remove();
}

}  // namespace vcp
