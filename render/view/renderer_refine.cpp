// Renderer: further samples of the last picture. A sample is drawn part by part into a small frame of its own and added
// to the sums, and the picture that is shown becomes their mean: its frame keeps hits and statistics of the first
// sample.
#include <algorithm>

#include "render/frame_setup.h"
#include "render/pixel_samples.h"
#include "render/view/renderer_view.h"

namespace vcp {

namespace {

// What a ray through mesostructure costs, in rays through pages.
constexpr uint32_t kSurfaceRays = 8;

}  // namespace

uint32_t raysPerPixel(const FrameRequest& request, bool hasSurfaces) {
    const Shading& shading = request.shading;
    const uint32_t light = hasLight(shading) ? (castsShadows(shading) ? 1 : 0) + shading.occlusionRays : 0;
    // Each of these goes through surfaces, too.
    return (1 + light) * (1 + (hasSurfaces ? kSurfaceRays : 0));
}

Result<uint32_t> Renderer::refineAhead() {
    return view_->shared->tryAgain(*view_, [&] { return view_->drawPart(); });
}

Result<uint32_t> Renderer::refine(const std::function<bool()>& cancel) {
    for (const uint32_t before = view_->samples;;) {
        if (cancel && cancel()) return Error::cancelled();
        VCP_TRY_ASSIGN(const auto samples, refineAhead());
        if (samples == before) continue;
        // A device that is lost here is found by the next call.
        if (const auto done = view_->takeInAll(); !done && !view_->shared->device->isLost()) return done.error();
        return samples;
    }
}

Result<uint32_t> Renderer::View::drawPart() {
    if (!shared->device) return kGone;
    if (!drawn || !isComplete()) return 0u;
    Frame& shown = frames[*drawn];
    VCP_TRY(checkRefinable(shown.request, samples));
    if (shown.cast) return castPart();
    for (size_t i = 0; i < layers.size(); ++i) {
        refreshTable(layers[i]);
        if (layers[i].tableNumber != shown.layers[i].tableNumber) return 0u;
        const Residency* const residency = layers[i].residency;
        if (residency != nullptr && residency->imagesVersion() != shown.layers[i].imagesVersion) return 0u;
    }
    Frame& frame = frames[kRefiningFrame];
    VCP_TRY(shared->device->waitFor(frame.lastUse));
    VCP_TRY(takeInDone());
    VCP_TRY(makeLayers(frame));
    VCP_TRY(sums.resize(*shared->device, {shown.request.width, shown.request.height}));
    FrameRequest request = shown.request;
    request.sample = samples;
    frame.part = picturePart(request, nextPart, raysPerPixel(request, shared->meso != nullptr),
                             shared->info.software ? kPartRays : kCardPartRays);
    VCP_TRY(submit(kRefiningFrame, frame.part->request, {}, false));
    shown.lastUse = std::max(shown.lastUse, frame.submission);
    ++nextPart;
    if (!frame.part->isLast) return samples;
    nextPart = 0;
    return ++samples;
}

}  // namespace vcp
