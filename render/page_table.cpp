#include "render/page_table.h"

#include <bit>

#include "render/frame.h"

namespace vcp {

namespace {

enum class Part : uint8_t { None, Above, Cut };

std::vector<Part> partsOf(const Dataset& dataset, std::span<const uint64_t> cut) {
    std::vector<Part> parts(dataset.pages.size(), Part::None);
    for (const uint64_t page : cut) parts[page] = Part::Cut;
    // Children follow their parents in the directory.
    for (uint64_t page = parts.size(); page-- > 0;) {
        const PageEntry& entry = dataset.pages[page];
        for (int i = 0; i < std::popcount(entry.childMask) && parts[page] == Part::None; ++i)
            if (parts[entry.firstChild + i] != Part::None) parts[page] = Part::Above;
    }
    return parts;
}

void writePage(glm::uvec4* record, const ResidentPage& page, uint64_t entry, float errorCells) {
    const PageSections sections = pageSections(page.header);
    const auto texelOf = [&](uint64_t byte) { return page.texel + static_cast<uint32_t>(byte / 16); };
    const uint32_t error = (std::bit_cast<uint32_t>(errorCells) + ~frame::kRecordErrorMask) & frame::kRecordErrorMask;
    record[0] = {frame::kRecordResident | error, 0, page.header.root, page.texel};
    record[1] = {texelOf(sections.faces), texelOf(sections.triangles), texelOf(sections.vertices), texelOf(sections.normals)};
    record[2] = {page.colourTexel, page.colourTexel + page.header.faces, static_cast<uint32_t>(entry), 0};
}

}  // namespace

std::vector<glm::uvec4> pageTable(const Dataset& dataset, std::span<const uint64_t> cut,
                                  const std::function<std::optional<ResidentPage>(uint64_t)>& pageOf) {
    if (cut.empty()) return std::vector<glm::uvec4>(frame::kRecordTexels, glm::uvec4(0));
    const std::vector<Part> parts = partsOf(dataset, cut);
    // Breadth first, so that the children of a page stand together.
    std::vector<uint64_t> order{0};
    std::vector<glm::uvec4> table;
    for (size_t next = 0; next < order.size(); ++next) {
        const uint64_t page = order[next];
        glm::uvec4 record[frame::kRecordTexels] = {};
        const PageEntry& entry = dataset.pages[page];
        if (const auto resident = pageOf(page))
            writePage(record, *resident, page, static_cast<float>(double(entry.certifiedError) / dataset.header.cell));
        if (parts[page] == Part::Cut) {
            record[0].x |= frame::kRecordInCut;
        } else {
            record[0].y = static_cast<uint32_t>(order.size());
            uint64_t child = entry.firstChild;
            for (uint32_t octant = 0; octant < 8; ++octant) {
                if ((entry.childMask >> octant & 1) == 0) continue;
                if (parts[child] != Part::None) {
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
