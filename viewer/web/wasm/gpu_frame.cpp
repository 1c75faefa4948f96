#include "viewer/web/wasm/gpu_frame.h"

#include <algorithm>
#include <bit>

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include "render/frame_setup.h"
#include "render/host_layer.h"
#include "render/residencies.h"

namespace vcp {

std::vector<MirroredRows> PoolMirror::rowsToCopy(Residency& residency) {
    std::vector<MirroredRows> rows;
    for (const uint64_t page : residency.cut()) {
        const PoolSlot slot = residency.slotOf(page);
        if (pages_.size() < slot.end()) pages_.resize(slot.end(), 0);
        const auto first = pages_.begin() + std::ptrdiff_t(slot.firstUnit),
                   end = pages_.begin() + std::ptrdiff_t(slot.end());
        if (std::all_of(first, end, [&](uint64_t there) { return there == page + 1; })) continue;
        std::fill(first, end, page + 1);
        rows.push_back({.first = uint32_t(slot.firstUnit),
                        .count = uint32_t(slot.units),
                        .address = uint32_t(reinterpret_cast<uintptr_t>(residency.pages().bytesOf(slot).data()))});
    }
    return rows;
}

GpuConstants gpuConstants(const FrameRequest& request, const Residency& residency) {
    GpuConstants constants;
    if (residency.hasColour()) constants.colour = 1;
    if (residency.images()) constants.colour = showsChannels(residency, request) ? 3 : 2;
    constants.sections = uint32_t(sectionKind(request, capsOf(request, residency.dataset())));
    constants.light = hasLight(request.shading) ? 1 : 0;
    return constants;
}

RayFeedback feedbackOf(std::span<const glm::uvec4> hits, std::span<const frame::TableRecord> table,
                       const Dataset& dataset, const FrameRequest& request) {
    RayFeedback feedback;
    const PictureRays rays = pictureRays(request);
    for (uint32_t ray = 0; ray < hits.size(); ++ray) {
        const uint32_t record = hits[ray].w;
        const float depth = std::bit_cast<float>(hits[ray].x);
        // On the cap of a section there is no page.
        if (record == 0 || record > table.size() || !(depth >= 0)) continue;
        addTo(feedback, dataset, rays,
              {.ray = ray,
               .page = table[record - 1].colours.entry,
               .depth = double(depth) * dataset.header.cell,
               .point = glm::dvec2(probedPixel(ray, {request.width, request.height})) + 0.5});
    }
    return feedback;
}

PagesHit pagesMarked(std::span<const uint32_t> marks, std::span<const frame::TableRecord> table, const Dataset& dataset,
                     const FrameRequest& request) {
    PagesHit hit;
    const bool lights = hasLight(request.shading);
    const auto add = [](std::vector<uint64_t>& to, const frame::TableColours& page) {
        to.push_back(page.entry);
        if (page.asked != page.entry) to.push_back(page.asked);
    };
    // A page may be that in which rays begin where the eye, or a section plane, is in its box.
    const auto mayBegin = [&](uint64_t page) {
        if (!request.sections.empty()) return true;
        const glm::dvec3 low = dataset.originOf(dataset.pages[page]);
        const glm::dvec3 high = low + dataset.edgeOf(dataset.pages[page]);
        return glm::all(glm::lessThanEqual(low, request.camera.eye)) &&
               glm::all(glm::lessThanEqual(request.camera.eye, high));
    };
    for (size_t i = 0; i < table.size(); ++i) {
        if ((table[i].node.flags & frame::kRecordInCut) == 0) continue;
        const frame::TableColours& page = table[i].colours;
        if ((i < marks.size() && marks[i] != 0) || mayBegin(page.entry)) add(hit.byCamera, page);
        if (lights) add(hit.byLight, page);
    }
    return hit;
}

}  // namespace vcp
