#include "render/pages/page_table.h"

#include <algorithm>
#include <bit>
#include <unordered_map>

namespace vcp {

namespace {

enum class Part : uint8_t { None, Above, Cut };

using Parts = std::unordered_map<uint64_t, Part>;

Part partOf(const Parts& parts, uint64_t page) {
    const auto found = parts.find(page);
    return found != parts.end() ? found->second : Part::None;
}

/// Finds the parts of the cut; reads only the pages above the cut, and nothing behind its last page.
Parts partsOf(const Dataset& dataset, std::span<const uint64_t> cut) {
    Parts parts;
    parts.reserve(2 * cut.size());
    for (const uint64_t page : cut) parts.emplace(page, Part::Cut);
    const uint64_t last = *std::max_element(cut.begin(), cut.end());
    const auto visit = [&](const auto& self, uint64_t page) -> bool {
        if (parts.contains(page)) return true;
        if (page > last || !dataset.pages.knows(page)) return false;
        bool isAbove = false;
        for (const uint64_t child : childrenOf(dataset.pages[page])) isAbove = self(self, child) || isAbove;
        if (isAbove) parts.emplace(page, Part::Above);
        return isAbove;
    };
    visit(visit, 0);
    return parts;
}

frame::TableRecord recordOf(const ResidentPage& page, uint64_t entry, float errorCells) {
    const PageSections sections = pageSections(page.header);
    const auto texelOf = [&](uint64_t byte) { return page.texel + uint32_t(byte / 16); };
    const uint32_t error = (std::bit_cast<uint32_t>(errorCells) + ~frame::kRecordErrorMask) & frame::kRecordErrorMask;
    return {.node = {.flags = frame::kRecordResident | error,
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
                        .unused = 0}};
}

}  // namespace

std::vector<frame::TableRecord> pageTable(const Dataset& dataset, std::span<const uint64_t> cut,
                                          const std::function<std::optional<ResidentPage>(uint64_t)>& pageOf) {
    if (cut.empty()) return {frame::TableRecord{}};
    const Parts parts = partsOf(dataset, cut);
    // The order is breadth first, so that the children of a page stand together.
    std::vector<uint64_t> order{0};
    std::vector<frame::TableRecord> table;
    for (size_t next = 0; next < order.size(); ++next) {
        const uint64_t page = order[next];
        frame::TableRecord record{};
        const PageEntry& entry = dataset.pages[page];
        if (const auto resident = pageOf(page))
            record = recordOf(*resident, page, float(double(entry.certifiedError) / dataset.header.cell));
        if (partOf(parts, page) == Part::Cut) {
            record.node.flags |= frame::kRecordInCut;
        } else {
            record.node.firstChild = uint32_t(order.size());
            uint64_t child = entry.firstChild;
            for (uint32_t octant = 0; octant < 8; ++octant) {
                if ((entry.childMask >> octant & 1) == 0) continue;
                if (partOf(parts, child) != Part::None) {
                    record.node.flags |= 1u << octant;
                    order.push_back(child);
                }
                ++child;
            }
        }
        table.push_back(record);
    }
    return table;
}

}  // namespace vcp
