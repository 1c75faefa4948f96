#include "octree/page_reader.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "octree/io/content_hash.h"
#include "octree/page/page.h"
#include "octree/page/page_codec.h"
#include "octree/page/paper_page.h"

namespace vcp {

namespace {

/// Reads the stored bytes of a page and checks them against their hash.
Result<std::vector<std::byte>> readStored(const ByteReader& reader, const std::string& element, uint64_t offset,
                                          uint32_t stored, uint64_t hash) {
    std::vector<std::byte> packed;
    if (stored <= kFirstPiece) {
        packed.resize(stored);
        VCP_TRY(reader.read(offset, packed));
    } else {
        VCP_TRY(readInPieces(reader, offset, stored, [&](std::span<const std::byte> piece) -> Result<void> {
            packed.insert(packed.end(), piece.begin(), piece.end());
            return {};
        }));
    }
    if (hashBytes(packed) != hash)
        return brokenBytes(reader.name(), element, offset, "hash does not match: the page was changed or damaged");
    return packed;
}

/// A page's header and its entry in the directory say the same.
Result<void> checkAgainstEntry(const ByteReader& reader, const Dataset& dataset, uint64_t index,
                               const PageHeader& page) {
    const PageEntry& e = dataset.pages[index];
    const auto fail = [&](std::string message) {
        return brokenBytes(reader.name(), fmt::format("page {}", index), e.offset, std::move(message));
    };
    const uint64_t leaves = uint64_t{page.softLeaves} + page.slabLeaves + page.hardLeaves;
    if (leaves != e.leaves || page.hardLeaves != e.hardLeaves || page.slabLeaves != e.slabLeaves)
        return fail(fmt::format("has {} leaves, {} of them hard and {} slabs; its directory entry says {}, {} and {}",
                                leaves, page.hardLeaves, page.slabLeaves, e.leaves, e.hardLeaves, e.slabLeaves));
    // Both errors were rounded up to single precision, one in cells and one in world units.
    const double error = page.certifiedError * dataset.cellOf(e.level),
                 slack = 1e-6 * error + 4 * double(std::numeric_limits<float>::denorm_min());
    if (std::abs(error - e.certifiedError) > slack)
        return fail(
            fmt::format("has a certified error of {:g}, its directory entry says {:g}", error, e.certifiedError));
    return {};
}

bool fillsSubvolume(const PaperPageHeader& page, uint32_t log2Cells) {
    return page.cellShift == 0 && page.rootLevel == log2Cells &&
           std::all_of(std::begin(page.roots), std::end(page.roots), [](uint32_t roots) { return roots == 1; });
}

}  // namespace

Result<PageBytes> readPage(const ByteReader& reader, const Dataset& dataset, uint64_t index, bool withColour) {
    const PageEntry& e = dataset.pages[index];
    const std::string element = fmt::format("page {}", index);
    PageBytes page;
    VCP_TRY_ASSIGN(const auto stored, readStored(reader, element, e.offset, e.storedBytes, e.hash));
    auto geometry = unpackGeometry(stored, e.pageBytes);
    if (!geometry) return brokenBytes(reader.name(), element, e.offset, geometry.error().message);
    page.geometry = *std::move(geometry);
    if (dataset.header.method == Method::Paper) {
        const auto paper = parsePaperPage(page.geometryBytes(), dataset.header.log2Cells + dataset.header.levels - 1);
        if (!paper) return brokenBytes(reader.name(), element, e.offset, paper.error().line());
        if (e.level > 0 && !fillsSubvolume(paper->header, dataset.header.log2Cells))
            return brokenBytes(reader.name(), element, e.offset, "its cells do not fill its subvolume");
        if (paper->header.leaves != e.leaves)
            return brokenBytes(
                reader.name(), element, e.offset,
                fmt::format("has {} leaves, its directory entry says {}", paper->header.leaves, e.leaves));
        if (paper->header.packing != dataset.header.paper.packing)
            return brokenBytes(reader.name(), element, e.offset, "its packing differs from the file's");
        return page;
    }
    const auto view = parsePage(page.geometryBytes());
    if (!view) return brokenBytes(reader.name(), element, e.offset, view.error().line());
    if (view->header.log2Cells != dataset.header.log2Cells)
        return brokenBytes(reader.name(), element, e.offset, "page size differs from the file's");
    VCP_TRY(checkAgainstEntry(reader, dataset, index, view->header));
    if (!withColour || e.colourBytes == 0) return page;
    VCP_TRY_ASSIGN(const auto storedColour,
                   readStored(reader, element + " colour", e.colourOffset, e.colourStoredBytes, e.colourHash));
    const bool hasPoints = e.colourBytes != colourPageBytes(view->header);
    if (hasPoints && (!dataset.hasImages() || e.colourBytes != texturedPageBytes(view->header)))
        return brokenBytes(reader.name(), element + " colour", e.colourOffset,
                           "colour page does not decode to its page's size");
    auto colour = unpackColour(storedColour, e.colourBytes, *view);
    if (!colour) return brokenBytes(reader.name(), element + " colour", e.colourOffset, colour.error().message);
    page.colour = *std::move(colour);
    if (!hasPoints) return page;
    for (const TexturePoint& point : viewOfChecked(page.geometryBytes(), page.colourBytes()).points)
        if (point.material > dataset.header.images.materials)
            return brokenBytes(reader.name(), element + " colour", e.colourOffset,
                               "a triangle names a material that there is not");
    return page;
}

}  // namespace vcp
