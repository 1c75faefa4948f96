#include "octree/directory_check.h"

#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "octree/io/byte_reader.h"
#include "octree/io/content_hash.h"

namespace vcp {

namespace {

// A page is built from at most a few 10^5 leaves; anything above this is a lie.
constexpr uint64_t kMaxPageBytes = uint64_t{1} << 28;

constexpr uint64_t kSlabLeavesOffset = 76;  ///< three bytes, and one of the colour error

uint8_t mostPartsOf(uint32_t flags) {
    const uint8_t both = kPageHasClosed | kPageHasOpen;
    return (flags & kFlagParts) == 0 ? uint8_t{0} : (flags & kFlagMarks) == 0 ? both : uint8_t(both | kPageHasMarks);
}

}  // namespace

Error brokenEntry(const std::string& file, uint64_t index, std::string message, uint64_t field) {
    const uint64_t byte = blockOffset(index / kEntriesPerBlock) + index % kEntriesPerBlock * sizeof(PageEntry) + field;
    return brokenBytes(file, fmt::format("directory entry {}", index), byte, std::move(message));
}

EntryCheck::EntryCheck(const std::string& file, const Dataset& dataset)
    : file_(file),
      header_(dataset.header),
      hasColour_(dataset.hasColour()),
      mostParts_(mostPartsOf(dataset.header.flags)),
      end_(blockOffset(blocksOf(dataset.header.pages))) {}

Result<void> EntryCheck::check(uint64_t index, const PageEntry& e, uint32_t level) {
    const auto fail = [&](uint64_t field, const char* message) { return brokenEntry(file_, index, message, field); };
    if (e.level != level) return fail(offsetof(PageEntry, level), "wrong level");
    VCP_TRY(extent(index, e.offset, e.storedBytes, e.pageBytes));
    VCP_TRY(colour(index, e));
    if (!(e.certifiedError >= 0) || !std::isfinite(e.certifiedError))
        return fail(offsetof(PageEntry, certifiedError), "certified error is not a length");
    if (e.certifiedError > header_.level[level].certifiedError)
        return fail(offsetof(PageEntry, certifiedError), "certified error is larger than its level's in the header");
    if (e.hardLeaves > e.leaves)
        return fail(offsetof(PageEntry, hardLeaves), "leaf counts: more hard leaves than leaves");
    if (e.slabLeaves > e.leaves - e.hardLeaves || (e.slabLeaves != 0 && header_.version == 3))
        return fail(kSlabLeavesOffset, "leaf counts: more slab leaves than leaves");
    // The root's word stands in the page's header, the words of all other leaves among the nodes.
    if (e.leaves > e.pageBytes / sizeof(uint32_t))
        return fail(offsetof(PageEntry, leaves), "leaf counts: more leaves than its page has room for");
    if (e.childMask == 0 && e.firstChild != 0)
        return fail(offsetof(PageEntry, firstChild), "wrong child pages: a first one where there are none");
    if (e.colourErrorP95 > e.colourErrorMax)
        return fail(offsetof(PageEntry, colourErrorP95), "colour error: of 95 % more than of all");
    if (e.colourErrorMax != 0 && (e.slabLeaves == 0 || (header_.flags & kFlagColourErrors) == 0))
        return fail(kSlabLeavesOffset + 3, "a colour error where no slab can have one");
    const bool isMarked = e.parts > (kPageHasClosed | kPageHasOpen);
    if (e.parts > mostParts_ || (isMarked && e.parts != mostParts_))
        return fail(offsetof(PageEntry, parts), "kinds of parts out of range");
    if (e.parts == 0 && mostParts_ != 0 && e.leaves != 0)
        return fail(offsetof(PageEntry, parts), "kinds of parts are missing");
    const bool isFinest = level + 1 == header_.levels;
    if (header_.method == Method::Paper && e.leaves != 0 && level > 0 && !isFinest)
        return fail(offsetof(PageEntry, leaves), "leaves between the two levels that have some");
    if (header_.method == Method::Paper && e.childMask == 0 && !isFinest)
        return fail(offsetof(PageEntry, childMask), "leads to no subvolume");
    if (level == 0 && e.morton != 0) return fail(offsetof(PageEntry, morton), "the root is not at the origin");
    return {};
}

Result<void> EntryCheck::colour(uint64_t index, const PageEntry& e) {
    const auto fail = [&](uint64_t field, const char* message) { return brokenEntry(file_, index, message, field); };
    if (e.colourStoredBytes == 0) {
        if (e.colourBytes != 0 || (hasColour_ && e.leaves != 0))
            return fail(offsetof(PageEntry, colourStoredBytes), "colour is missing");
        if (e.colourOffset != 0)
            return fail(offsetof(PageEntry, colourOffset), "a place of colour where there is none");
        if (e.colourHash != 0) return fail(offsetof(PageEntry, colourHash), "a hash of colour where there is none");
        return {};
    }
    if (!hasColour_)
        return fail(offsetof(PageEntry, colourStoredBytes), "has colour, but the header says that no page has");
    if (e.colourOffset > end_ + kBlockBytes)
        return fail(offsetof(PageEntry, colourOffset), "its colour does not follow it");
    return extent(index, e.colourOffset, e.colourStoredBytes, e.colourBytes);
}

Result<void> EntryCheck::extent(uint64_t index, uint64_t offset, uint64_t stored, uint64_t bytes) {
    const bool hasImages = (header_.flags & kFlagImages) != 0;
    const uint64_t pagesEnd = hasImages ? header_.images.offset : header_.fileBytes - sizeof(CommitRecord);
    if (offset < end_ || offset % kPageAlignment != 0 || stored == 0 || stored > pagesEnd || offset > pagesEnd - stored)
        return brokenEntry(file_, index, "page lies outside the file or overlaps another");
    if (bytes == 0 || bytes > kMaxPageBytes || bytes % 16 != 0)
        return brokenEntry(file_, index, "page size out of range");
    end_ = offset + stored;
    return {};
}

Result<void> checkDirectory(const std::string& file, const Dataset& d) {
    EntryCheck entries(file, d);
    uint64_t next = d.header.levels > 1 ? d.header.level[1].firstEntry : d.header.pages;
    uint64_t index = 0;
    for (uint32_t level = 0; level < d.header.levels; ++level)
        for (uint64_t i = 0; i < d.header.level[level].pages; ++i, ++index) {
            const PageEntry& e = d.pages[index];
            VCP_TRY(entries.check(index, e, level));
            if (e.childMask == 0) continue;
            if (level + 1 >= d.header.levels || e.firstChild != next)
                return brokenEntry(file, index, "wrong child pages");
            VCP_TRY(eachChild(e, [&](uint64_t child, uint32_t octant) -> Result<void> {
                if (child >= d.header.pages || !isChildAt(d.pages[child], e, octant))
                    return brokenEntry(file, index, "child pages do not match");
                return {};
            }));
            next += childrenOf(e).size();
        }
    if (next != d.header.pages) return brokenEntry(file, 0, "pages without a parent");
    return {};
}

Result<void> checkBlock(const std::string& file, uint64_t block, uint64_t entries, std::span<const std::byte> bytes) {
    const auto fail = [&](uint64_t byte, std::string message) {
        return brokenBytes(file, fmt::format("directory block {}", block), blockOffset(block) + byte,
                           std::move(message));
    };
    uint64_t hash = 0;
    std::memcpy(&hash, bytes.data() + kBlockBytes - 8, 8);
    if (hashBytes(bytes.first(kBlockBytes - 8)) != hash)
        return fail(0, "hash does not match: the file was changed or damaged");
    for (uint64_t byte = entries * sizeof(PageEntry); byte < kBlockBytes - 8; ++byte)
        if (bytes[byte] != std::byte{0}) return fail(byte, "bytes behind the last entry must be zero");
    return {};
}

}  // namespace vcp
