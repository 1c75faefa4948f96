#include "render/host_layer.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp {

std::vector<CutPage> cutPages(Residency& residency, ViewNumber view) {
    const std::vector<PartialPage>& partials = residency.partial(view);
    auto partial = partials.begin();
    std::vector<CutPage> cut;
    for (const uint64_t number : residency.cut(view)) {
        const PageEntry& entry = residency.dataset().pages[number];
        const bool isPartial = partial != partials.end() && partial->page == number;
        const uint64_t bytes = entry.pageBytes + (residency.hasColour() ? entry.colourBytes : 0);
        cut.push_back({.number = number,
                       .entry = entry,
                       .octants = isPartial ? partial++->octants : 0u,
                       .bytes = residency.pages().bytesOf(residency.slotOf(number)).first(bytes)});
    }
    return cut;
}

Result<CutScene> CutScene::create(const FileHeader& header, bool withColour, std::vector<CutPage> cut) {
    CutScene made;
    made.cut_ = std::move(cut);
    made.views_.reserve(made.cut_.size());
    std::vector<HostPage> pages;
    for (const CutPage& each : made.cut_) {
        const PageEntry& entry = each.entry;
        const uint64_t colours = withColour ? entry.colourBytes : 0;
        made.views_.push_back(
            viewOfChecked(each.bytes.first(entry.pageBytes), each.bytes.subspan(entry.pageBytes, colours)));
        appendDrawn(pages, hostPage(header, each.number, entry, made.views_.back()), each.octants);
    }
    VCP_TRY_ASSIGN(made.scene_, HostScene::create(hostGrid(header), pages));
    return made;
}

std::vector<uint64_t> CutScene::marked(const PageMarks& marks) const {
    std::vector<uint64_t> pages;
    for (uint32_t i = 0; i < scene_.pages(); ++i) {
        if (!marks.isMarked(i)) continue;
        const HostScene::Page& page = scene_.page(i);
        pages.push_back(page.number);
        if (!page.octant) continue;
        const auto of = std::lower_bound(cut_.begin(), cut_.end(), page.number,
                                         [](const CutPage& each, uint64_t number) { return each.number < number; });
        pages.push_back(childIn(of->entry, *page.octant));
    }
    return pages;
}

glm::ivec2 probedPixel(uint32_t ray, glm::ivec2 size) {
    const glm::dvec2 part(ray % frame::kFeedbackWidth, ray / frame::kFeedbackWidth);
    return {(part + 0.5) * glm::dvec2(size) / glm::dvec2(frame::kFeedbackWidth, frame::kFeedbackHeight)};
}

void addTo(RayFeedback& feedback, const Dataset& dataset, const PictureRays& rays, const ProbedHit& hit) {
    const glm::dvec3 origin = dataset.originOf(dataset.pages[0]);
    const double rootEdge = dataset.edgeOf(dataset.pages[0]), unit = std::ldexp(rootEdge, -int(frame::kLatticeBits));
    const glm::dvec3 from = rays.originAt(hit.point.x, hit.point.y);
    const glm::dvec3 along = glm::normalize(rays.directionAt(hit.point.x, hit.point.y));
    const glm::dvec3 place = (from + hit.depth * along - origin) / unit;
    constexpr double kLast = double((uint32_t{1} << frame::kLatticeBits) - 1);
    feedback.hits.push_back({hit.page, glm::ivec3(glm::clamp(place, 0.0, kLast)), hit.ray});
    feedback.passed.push_back({hit.page, frame::kNearnessEps / (hit.depth / rootEdge + frame::kNearnessEps)});
}

RayFeedback feedbackOf(const HostLayer& layer, const Dataset& dataset, const HostPicture& picture, RowsOfWhole rows) {
    RayFeedback feedback;
    for (uint32_t ray = 0; ray < frame::kFeedbackRays; ++ray) {
        glm::ivec2 pixel = probedPixel(ray, {picture.size.x, rows.wholeHeight});
        if (pixel.y < rows.begin || pixel.y >= rows.end) continue;
        pixel.y -= rows.first;
        const size_t at = size_t(pixel.y) * size_t(picture.size.x) + size_t(pixel.x);
        if (picture.hits[at].dataset != layer.number) continue;
        addTo(feedback, dataset, layer.rays,
              {.ray = ray,
               .page = layer.scene.page(picture.hits[at].page).number,
               .depth = double(picture.depth[at]) / layer.worldPerUnit,
               .point = glm::dvec2(pixel) + 0.5});
    }
    return feedback;
}

}  // namespace vcp
