#include "render/host/host_scene.h"

#include <fmt/format.h>

#include "octree/surface/morton.h"

namespace vcp {

namespace {

Error badCut(const HostPage& page, const char* what) {
    return {.code = ErrorCode::Usage, .message = what, .element = fmt::format("page {}", page.number)};
}

}  // namespace

HostGrid hostGrid(const FileHeader& header) {
    return {.origin = {header.origin[0], header.origin[1], header.origin[2]},
            .cell = header.cell,
            .levels = header.levels,
            .log2Cells = header.log2Cells};
}

uint32_t HostScene::rootBits() const { return grid_.log2Cells + grid_.levels - 1 + kMaxSubcellDepth; }

Result<HostScene> HostScene::create(const HostGrid& grid, std::span<const HostPage> cut) {
    HostScene scene;
    scene.grid_ = grid;
    for (const HostPage& page : cut) VCP_TRY(scene.add(page));
    return scene;
}

Result<HostScene> HostScene::create(const PageCache& cache, std::span<const uint64_t> cut) {
    const FileHeader& header = cache.dataset().header;
    std::vector<HostPage> pages;
    for (const uint64_t number : cut) {
        HostPage page{.view = cache.view(number), .number = number};
        if (!page.view) return badCut(page, "a page of the cut is not loaded");
        const PageEntry& entry = cache.dataset().pages[number];
        page.place = mortonDecode(entry.morton);
        page.level = entry.level;
        page.error = float(double(entry.certifiedError) / header.cell);
        pages.push_back(page);
    }
    return create(hostGrid(header), pages);
}

Result<void> HostScene::add(const HostPage& page) {
    const uint32_t level = page.level;
    if (level >= grid_.levels || page.view->header.log2Cells != grid_.log2Cells)
        return badCut(page, "is no page of this grid");
    for (int axis = 0; axis < 3; ++axis)
        if (page.place[axis] >> level != 0) return badCut(page, "lies outside of the grid");
    Child at = root_;
    Node* parent = nullptr;
    uint32_t octant = 0;
    // Goes down from the root and makes the nodes above the page that are missing.
    for (uint32_t depth = 0;; ++depth) {
        const bool isPlace = depth == level;
        if (at.kind == Child::Kind::Page || (isPlace && at.kind == Child::Kind::Node))
            return badCut(page, "and another page of the cut lie one in the other");
        if (at.kind == Child::Kind::None) {
            at = isPlace ? Child{Child::Kind::Page, uint32_t(pages_.size())}
                         : Child{Child::Kind::Node, uint32_t(nodes_.size())};
            (parent ? (*parent)[octant] : root_) = at;
            if (!isPlace) nodes_.emplace_back();
        }
        if (isPlace) break;
        const uint32_t bit = level - 1 - depth;
        octant = (page.place.x >> bit & 1u) | (page.place.y >> bit & 1u) << 1 | (page.place.z >> bit & 1u) << 2;
        parent = &nodes_[at.index];
        at = (*parent)[octant];
    }
    const uint32_t bits = rootBits() - level;
    pages_.push_back({page.view, page.number, page.place << bits, bits, grid_.levels - 1 - level, page.error});
    return {};
}

}  // namespace vcp
