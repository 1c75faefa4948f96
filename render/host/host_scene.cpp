#include "render/host/host_scene.h"

#include <bit>

#include <fmt/format.h>

#include "octree/surface/morton.h"

namespace vcp {

namespace {

Error badCut(uint64_t page, const char* what) {
    return {.code = ErrorCode::Usage, .message = what, .element = fmt::format("page {}", page)};
}

}  // namespace

HostGrid hostGrid(const FileHeader& header) {
    return {.origin = {header.origin[0], header.origin[1], header.origin[2]},
            .cell = header.cell,
            .levels = header.levels,
            .log2Cells = header.log2Cells};
}

uint32_t HostScene::rootBits() const { return grid_.log2Cells + grid_.levels - 1 + kMaxSubcellDepth; }

HostPage hostPage(const FileHeader& header, uint64_t number, const PageEntry& entry, const PageView& view) {
    return {.view = &view,
            .number = number,
            .place = mortonDecode(entry.morton),
            .level = entry.level,
            .error = float(double(entry.certifiedError) / header.cell),
            .parts = entry.parts};
}

void appendDrawn(std::vector<HostPage>& pages, HostPage page, uint32_t octants) {
    if (octants == 0) pages.push_back(page);
    for (; octants != 0; octants &= octants - 1) {
        page.octant = uint32_t(std::countr_zero(octants));
        pages.push_back(page);
    }
}

Result<HostScene> HostScene::create(const HostGrid& grid, std::span<const HostPage> cut) {
    HostScene scene;
    scene.grid_ = grid;
    for (const HostPage& page : cut) VCP_TRY(scene.add(page));
    return scene;
}

Result<HostScene> HostScene::create(const PageCache& cache, std::span<const uint64_t> cut,
                                    std::span<const uint8_t> octants) {
    const Dataset& dataset = cache.dataset();
    std::vector<HostPage> pages;
    for (size_t i = 0; i < cut.size(); ++i) {
        const PageView* view = cache.view(cut[i]);
        if (!view) return badCut(cut[i], "a page of the cut is not loaded");
        appendDrawn(pages, hostPage(dataset.header, cut[i], dataset.pages[cut[i]], *view),
                    octants.empty() ? 0 : octants[i]);
    }
    return create(hostGrid(dataset.header), pages);
}

std::optional<uint32_t> HostScene::pageAt(glm::dvec3 point) const {
    const double subcells = double(1u << kMaxSubcellDepth), edge = double(uint64_t{1} << rootBits());
    const glm::dvec3 at = point * subcells;
    for (int axis = 0; axis < 3; ++axis)
        if (!(at[axis] >= 0 && at[axis] < edge)) return std::nullopt;
    const glm::uvec3 place(at);
    Child child = root_;
    for (uint32_t bit = rootBits(); child.kind == Child::Kind::Node;) {
        --bit;
        child = nodes_[child.index][(place.x >> bit & 1u) | (place.y >> bit & 1u) << 1 | (place.z >> bit & 1u) << 2];
    }
    return child.kind == Child::Kind::Page ? std::optional(child.index) : std::nullopt;
}

Result<void> HostScene::add(const HostPage& page) {
    const uint32_t part = page.octant.value_or(0);
    const uint32_t level = page.level + (page.octant ? 1 : 0);  // of the box that is drawn
    const glm::uvec3 place =
        page.octant ? 2u * page.place + glm::uvec3(part & 1, part >> 1 & 1, part >> 2) : page.place;
    if (level >= grid_.levels || page.view->header.log2Cells != grid_.log2Cells)
        return badCut(page.number, "is no page of this grid");
    for (int axis = 0; axis < 3; ++axis)
        if (place[axis] >> level != 0) return badCut(page.number, "lies outside of the grid");
    Child at = root_;
    Node* parent = nullptr;
    uint32_t octant = 0;
    // Goes down from the root and makes the nodes above the page that are missing.
    for (uint32_t depth = 0;; ++depth) {
        const bool isPlace = depth == level;
        if (at.kind == Child::Kind::Page || (isPlace && at.kind == Child::Kind::Node))
            return badCut(page.number, "and another page of the cut lie one in the other");
        if (at.kind == Child::Kind::None) {
            at = isPlace ? Child{Child::Kind::Page, uint32_t(pages_.size())}
                         : Child{Child::Kind::Node, uint32_t(nodes_.size())};
            (parent ? (*parent)[octant] : root_) = at;
            if (!isPlace) nodes_.emplace_back();
        }
        if (isPlace) break;
        const uint32_t bit = level - 1 - depth;
        octant = (place.x >> bit & 1u) | (place.y >> bit & 1u) << 1 | (place.z >> bit & 1u) << 2;
        parent = &nodes_[at.index];
        at = (*parent)[octant];
    }
    const uint32_t root = page.view->header.root;
    pages_.push_back({page.view, page.number, page.octant,
                      page.octant ? page.view->nodes[8 * (root & kNodePayloadMask) + part] : root,
                      page.place << (rootBits() - page.level), grid_.levels - 1 - page.level, page.error, page.parts});
    return {};
}

}  // namespace vcp
