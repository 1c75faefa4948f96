#include "render/page_table.h"

#include <algorithm>
#include <bit>
#include <unordered_map>

#include "render/frame.h"

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

void writePage(glm::uvec4* record, const ResidentPage& page, uint64_t entry, float errorCells) {
    const PageSections sections = pageSections(page.header);
    const auto texelOf = [&](uint64_t byte) { return page.texel + uint32_t(byte / 16); };
    const uint32_t error = (std::bit_cast<uint32_t>(errorCells) + ~frame::kRecordErrorMask) & frame::kRecordErrorMask;
    record[0] = {frame::kRecordResident | error, 0, page.header.root, page.texel};
    record[1] = {texelOf(sections.faces), texelOf(sections.triangles), texelOf(sections.vertices),
                 texelOf(sections.normals)};
    record[2] = {page.colourTexel, page.colourTexel + page.header.faces, uint32_t(entry), 0};
}

}  // namespace

std::vector<glm::uvec4> pageTable(const Dataset& dataset, std::span<const uint64_t> cut,
                                  const std::function<std::optional<ResidentPage>(uint64_t)>& pageOf) {
    if (cut.empty()) return std::vector<glm::uvec4>(frame::kRecordTexels, glm::uvec4(0));
    const Parts parts = partsOf(dataset, cut);
    // The order is breadth first, so that the children of a page stand together.
    std::vector<uint64_t> order{0};
    std::vector<glm::uvec4> table;
    for (size_t next = 0; next < order.size(); ++next) {
        const uint64_t page = order[next];
        glm::uvec4 record[frame::kRecordTexels] = {};
        const PageEntry& entry = dataset.pages[page];
        if (const auto resident = pageOf(page))
            writePage(record, *resident, page, float(double(entry.certifiedError) / dataset.header.cell));
        if (partOf(parts, page) == Part::Cut) {
            record[0].x |= frame::kRecordInCut;
        } else {
            record[0].y = uint32_t(order.size());
            uint64_t child = entry.firstChild;
            for (uint32_t octant = 0; octant < 8; ++octant) {
                if ((entry.childMask >> octant & 1) == 0) continue;
                if (partOf(parts, child) != Part::None) {
                    record[0].x |= 1u << octant;
                    order.push_back(child);
                }
                ++child;
            }
        }
        table.insert(table.end(), record, record + frame::kRecordTexels);
    }
    return table;
}

}  // namespace vcp
