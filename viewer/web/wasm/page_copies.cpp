#include "viewer/web/wasm/page_copies.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>

#include "render/frame_setup.h"

namespace vcp {

namespace {

/// Returns how many times a page's edge is halved down to its widest slab leaf; nothing of it where there is none.
uint32_t depthOfWidestSlab(const PageView& page, uint32_t most) {
    // Level by level, so that the first one is the widest.
    std::vector<uint32_t> words{page.header.root}, below;
    for (uint32_t depth = 0; depth < most && !words.empty(); ++depth) {
        below.clear();
        for (const uint32_t word : words) {
            if (nodeType(word) == kNodeSlab) return depth;
            if (nodeType(word) != kNodeInternal) continue;
            const auto group = page.nodes.subspan(8 * size_t(word & kNodePayloadMask), 8);
            below.insert(below.end(), group.begin(), group.end());
        }
        std::swap(words, below);
    }
    return most;
}

}  // namespace

double PagesNeeded::widestSlab(const Dataset& dataset, const CutPage& page) {
    const auto known = widest_.find(page.number);
    if (known != widest_.end()) return known->second;
    const PageView view = viewOfChecked(page.bytes.first(page.entry.pageBytes));
    // What is not found is narrower than a cell by far.
    const uint32_t most = view.header.log2Cells + kMaxSubcellDepth;
    const uint32_t depth = view.header.slabLeaves == 0 ? most : depthOfWidestSlab(view, most);
    const double edge = std::ldexp(dataset.edgeOf(page.entry), -int(depth));
    widest_.emplace(page.number, edge);
    return edge;
}

std::vector<CutRecord> PagesNeeded::of(const Dataset& dataset, const FrameRequest& request,
                                       const std::vector<CutPage>& cut, uint32_t first, uint32_t count) {
    // Samples move rays by up to half a pixel.
    constexpr uint32_t kBeside = 2;
    FrameRequest rows = request;
    const uint32_t begin = first - std::min(first, kBeside);
    rows.height = std::min(request.height, first + count + kBeside) - begin;
    rows.tile = PictureTile{0, begin, request.width, request.height};
    SelectionView view = selectionView(rows);
    double margin = 0;
    for (const CutPage& page : cut) margin = std::max(margin, widestSlab(dataset, page));
    for (glm::dvec4& plane : view.planes) plane.w += margin * glm::length(glm::dvec3(plane));
    const bool isWhole = hasLight(request.shading) || capsOf(request, dataset) != Caps::None;
    std::vector<CutRecord> needed;
    for (const CutPage& page : cut)
        if (isWhole || inFrustum(dataset, page.entry, view))
            needed.push_back({.number = page.number,
                              .entry = page.entry,
                              .octants = page.octants,
                              .bytes = uint32_t(page.bytes.size()),
                              .address = uint32_t(reinterpret_cast<uintptr_t>(page.bytes.data()))});
    return needed;
}

std::byte* PageCopies::room(uint64_t number, uint32_t bytes) {
    Copy& copy = pages_[number];
    copy = {std::unique_ptr<std::byte[]>(new std::byte[bytes]), bytes};
    return copy.bytes.get();
}

Result<std::vector<CutPage>> PageCopies::cutOf(std::span<const CutRecord> records) const {
    std::vector<CutPage> cut;
    for (const CutRecord& record : records) {
        const auto copy = pages_.find(record.number);
        if (copy == pages_.end() || copy->second.count != record.bytes)
            return Error{.code = ErrorCode::Usage, .message = "a page of the cut was not copied"};
        cut.push_back({.number = record.number,
                       .entry = record.entry,
                       .octants = record.octants,
                       .bytes = {copy->second.bytes.get(), record.bytes}});
    }
    return cut;
}

}  // namespace vcp
