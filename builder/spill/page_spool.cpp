#include "builder/spill/page_spool.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <xxhash.h>

#include "octree/io/content_hash.h"

namespace vcp {

namespace {

/// An entry as it lies in its file.
struct SpooledEntry {
    PageEntry entry;
    uint64_t hash = 0;  ///< hash of the entry and its place
};
static_assert(sizeof(SpooledEntry) == sizeof(PageEntry) + sizeof(uint64_t));

/// Number of entries that are read at once.
constexpr uint64_t kBatchEntries = 4096;

}  // namespace

PageSpool::PageSpool(TempSpace& space, uint32_t level, std::string_view prefix)
    : level_(level),
      pages_(space, fmt::format("{}pages{}.spill", prefix, level)),
      directory_(space, fmt::format("{}entries{}.spill", prefix, level)) {}

uint64_t PageSpool::hashOf(const PageEntry& entry, uint64_t number) const {
    return XXH3_64bits_withSeed(&entry, sizeof entry, number << 8 | level_);
}

Result<void> PageSpool::append(PageEntry entry, const StoredPage& page) {
    page.describe(entry);
    VCP_TRY_ASSIGN(entry.offset, pages_.append(page.geometry));
    VCP_TRY(pages_.append(page.colour));
    const SpooledEntry spooled{entry, hashOf(entry, entries_.size())};
    entries_.push_back(entry);
    VCP_TRY(directory_.append(std::as_bytes(std::span(&spooled, 1))));
    return {};
}

Result<void> PageSpool::sync() {
    VCP_TRY(pages_.sync());
    return directory_.sync();
}

Result<void> PageSpool::reopen(uint64_t bytes, uint64_t entries) {
    if (entries > std::numeric_limits<uint64_t>::max() / sizeof(SpooledEntry))
        return damagedTempFile(directory_.path());
    VCP_TRY(pages_.reopen(bytes));
    VCP_TRY(directory_.reopen(entries * sizeof(SpooledEntry)));
    uint64_t end = 0;  // end of the pages so far
    std::vector<SpooledEntry> batch;
    for (uint64_t first = 0; first < entries; first += batch.size()) {
        batch.resize(std::min(kBatchEntries, entries - first));
        VCP_TRY(directory_.read(first * sizeof(SpooledEntry), std::as_writable_bytes(std::span(batch))));
        for (const auto& [entry, hash] : batch) {
            const uint64_t number = entries_.size();
            if (hash != hashOf(entry, number) || entry.offset != end)
                return damagedTempFile(directory_.path(), number * sizeof(SpooledEntry));
            end += uint64_t{entry.storedBytes} + entry.colourStoredBytes;
            entries_.push_back(entry);
        }
    }
    if (end != bytes) return damagedTempFile(directory_.path(), directory_.size());
    return {};
}

Result<StoredPage> PageSpool::read(const PageEntry& entry) const {
    StoredPage page;
    page.geometry.resize(entry.storedBytes);
    page.colour.resize(entry.colourStoredBytes);
    page.geometryBytes = entry.pageBytes;
    page.colourBytes = entry.colourBytes;
    VCP_TRY(pages_.read(entry.offset, page.geometry));
    VCP_TRY(pages_.read(entry.offset + entry.storedBytes, page.colour));
    const bool isIntact =
        entry.hash == hashBytes(page.geometry) && (page.colour.empty() || entry.colourHash == hashBytes(page.colour));
    if (!isIntact) return damaged(entry);
    return page;
}

void PageSpool::sortEntries() { std::ranges::sort(entries_, {}, &PageEntry::morton); }

void PageSpool::rest() {
    pages_.rest();
    directory_.rest();
}

void PageSpool::remove() {
    pages_.remove();
    directory_.remove();
    entries_.clear();
}

void JoinedSpools::add(PageSpool& spool) {
    if (spool.bytes() == 0) return;
    for (PageEntry& entry : spool.entries()) entry.offset += end_;
    if (entries_.empty())
        entries_ = std::move(spool.entries());
    else
        entries_.insert(entries_.end(), spool.entries().begin(), spool.entries().end());
    std::vector<PageEntry>().swap(spool.entries());
    sources_.push_back({end_, &spool});
    end_ += spool.bytes();
}

void JoinedSpools::rest() {
    for (const Source& each : sources_) each.spool->rest();
}

Result<void> JoinedSpools::wake() {
    for (const Source& each : sources_) VCP_TRY(each.spool->wake());
    return {};
}

Result<StoredPage> JoinedSpools::read(const PageEntry& entry) const {
    const auto behind = std::ranges::upper_bound(sources_, entry.offset, {}, &Source::begin);
    const Source& from = *std::prev(behind);
    PageEntry own = entry;
    own.offset -= from.begin;
    return from.spool->read(own);
}

void JoinedSpools::sortEntries() { std::ranges::sort(entries_, {}, &PageEntry::morton); }

}  // namespace vcp
