#include "render/pages/page_table.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <unordered_map>

#include "octree/surface/image_lookup.h"

namespace vcp {

namespace {

static_assert(offsetof(PageHeader, vertices) == 4 * f32::kPageHeaderVertices &&
              -kLog2TextureUnit == f32::kLog2TextureSteps);

enum class Part : uint8_t { None, Above, Cut };

using Parts = std::unordered_map<uint64_t, Part>;

Part partOf(const Parts& parts, uint64_t page) {
    const auto found = parts.find(page);
    return found != parts.end() ? found->second : Part::None;
}

/// The octants in which a page of the cut is drawn by itself; 0: it is drawn whole, or not at all.
uint8_t ownOctants(std::span<const PartialPage> partial, uint64_t page) {
    const auto at = std::ranges::lower_bound(partial, page, {}, &PartialPage::page);
    return at != partial.end() && at->page == page ? at->octants : uint8_t{0};
}

/// Finds the parts of the cut: pages that are drawn whole, and pages above what is drawn. Reads only the pages above
/// the cut, and nothing behind its last page.
Parts partsOf(const Dataset& dataset, std::span<const uint64_t> cut, std::span<const PartialPage> partial) {
    Parts parts;
    parts.reserve(2 * cut.size());
    for (const uint64_t page : cut) parts.emplace(page, ownOctants(partial, page) != 0 ? Part::Above : Part::Cut);
    const uint64_t last = *std::max_element(cut.begin(), cut.end());
    const auto visit = [&](const auto& self, uint64_t page) -> bool {
        const Part known = partOf(parts, page);
        if (known == Part::Cut) return true;
        if (page > last || !dataset.pages.knows(page)) return false;
        bool isAbove = known == Part::Above;
        for (const uint64_t child : childrenOf(dataset.pages[page])) isAbove = self(self, child) || isAbove;
        if (isAbove) parts.emplace(page, Part::Above);
        return isAbove;
    };
    visit(visit, 0);
    return parts;
}

uint32_t partFlags(uint8_t parts) {
    if ((parts & kPageHasMarks) != 0) return frame::kRecordHasMarks;
    return ((parts & kPageHasOpen) != 0 ? frame::kRecordHasOpen : 0u) |
           (parts == kPageHasOpen ? frame::kRecordIsOpen : 0u);
}

frame::TableRecord recordOf(const ResidentPage& page, uint64_t entry, uint8_t parts, float errorCells) {
    const PageSections sections = pageSections(page.header);
    const auto texelOf = [&](uint64_t byte) { return page.texel + uint32_t(byte / 16); };
    const uint32_t error = (std::bit_cast<uint32_t>(errorCells) + ~frame::kRecordErrorMask) & frame::kRecordErrorMask;
    const uint32_t points = page.hasPoints ? frame::kRecordHasPoints : 0u;
    return {.node = {.flags = frame::kRecordResident | partFlags(parts) | points | error,
                     .firstChild = 0,
                     .root = page.header.root,
                     .pageTexel = page.texel},
            .sections = {.faces = texelOf(sections.faces),
                         .vertices = texelOf(sections.vertices),
                         .normals = texelOf(sections.normals),
                         .strips = texelOf(sections.strips)},
            .colours = {.faces = page.colourTexel,
                        .vertices = page.colourTexel + page.header.faces,
                        .entry = uint32_t(entry),
                        .asked = uint32_t(entry)}};
}

frame::TableRecord octantOf(const Dataset& dataset, const frame::TableRecord& page, uint32_t octant, uint32_t root) {
    frame::TableRecord record = page;
    constexpr uint32_t kKept = frame::kRecordErrorMask | frame::kRecordHasOpen | frame::kRecordIsOpen |
                               frame::kRecordHasMarks | frame::kRecordHasPoints;
    record.node.flags =
        (page.node.flags & kKept) | frame::kRecordResident | frame::kRecordInCut | frame::kRecordIsOctant;
    record.node.firstChild = 0;
    record.node.root = root;
    record.colours.asked = uint32_t(childIn(dataset.pages[page.colours.entry], octant));
    return record;
}

}  // namespace

std::vector<frame::TableRecord> pageTable(const Dataset& dataset, std::span<const uint64_t> cut,
                                          std::span<const PartialPage> partial,
                                          const std::function<std::optional<ResidentPage>(uint64_t)>& pageOf) {
    if (cut.empty()) return {frame::TableRecord{}};
    const Parts parts = partsOf(dataset, cut, partial);
    // The order is breadth first, so that the children of a page stand together: pages, and octants of those drawn in
    // parts, whose records are made with the page's.
    struct Place {
        uint64_t page = 0;
        std::optional<frame::TableRecord> octant;
    };
    std::vector<Place> order{{}};
    std::vector<frame::TableRecord> table;
    for (size_t next = 0; next < order.size(); ++next) {
        if (order[next].octant) {
            table.push_back(*order[next].octant);
            continue;
        }
        const uint64_t page = order[next].page;
        frame::TableRecord record{};
        const PageEntry& entry = dataset.pages[page];
        const auto resident = pageOf(page);
        if (resident)
            record = recordOf(*resident, page, entry.parts, float(double(entry.certifiedError) / dataset.header.cell));
        if (partOf(parts, page) == Part::Cut) {
            record.node.flags |= frame::kRecordInCut;
            table.push_back(record);
            continue;
        }
        const uint8_t own = ownOctants(partial, page);
        record.node.firstChild = uint32_t(order.size());
        for (uint32_t octant = 0; octant < 8; ++octant) {
            if ((entry.childMask >> octant & 1) == 0) continue;
            const uint64_t child = childIn(entry, octant);
            const bool isOwn = (own >> octant & 1) != 0;
            if (!isOwn && partOf(parts, child) == Part::None) continue;
            record.node.flags |= 1u << octant;
            order.push_back({child, isOwn ? std::optional(octantOf(dataset, record, octant, resident->octants[octant]))
                                          : std::nullopt});
        }
        table.push_back(record);
    }
    return table;
}

}  // namespace vcp
