#include "render/picture_renderer.h"

#include <iterator>
#include <utility>

#include "render/frame_setup.h"
#include "render/pixel_samples.h"

namespace vcp {

namespace {

/// Adds what an update reported before another one to that.
void takeReports(UpdateResult& before, UpdateResult& now) {
    now.changed = now.changed || before.changed;
    now.problems.insert(now.problems.begin(), std::make_move_iterator(before.problems.begin()),
                        std::make_move_iterator(before.problems.end()));
}

/// Calls update() until settled, and draws where rays are to say what they hit. `drawn` is what the picture's last
/// frame came to, where that is the picture that was settled on. What updates report is added to `all`.
Result<void> settleOn(PictureRenderer& renderer, const FrameRequest& request, const std::function<bool()>& cancel,
                      std::optional<FrameStats>& drawn, UpdateResult& all) {
    while (true) {
        VCP_TRY_ASSIGN(auto next, renderer.update(request));
        if (next.changed) drawn.reset();
        takeReports(all, next);
        all = std::move(next);
        if (all.settled) return {};
        if (cancel && cancel()) return Error::cancelled();
        if (all.awaitsRays) {
            VCP_TRY_ASSIGN(drawn, renderer.render(request, cancel));
        } else {
            renderer.waitForPage(std::chrono::milliseconds(100));
        }
    }
}

/// Settles on what the camera's rays hit before rays of light are cast: those begin where the former hit.
Result<UpdateResult> settleAll(PictureRenderer& renderer, const FrameRequest& request,
                               const std::function<bool()>& cancel, std::optional<FrameStats>& drawn) {
    UpdateResult all;
    if (hasLight(request.shading)) {
        FrameRequest dark = request;
        dark.shading.shadows = false;
        dark.shading.occlusionRays = 0;
        VCP_TRY(settleOn(renderer, dark, cancel, drawn, all));
        drawn.reset();
    }
    VCP_TRY(settleOn(renderer, request, cancel, drawn, all));
    return all;
}

}  // namespace

Result<UpdateResult> PictureRenderer::settle(const FrameRequest& request, const std::function<bool()>& cancel) {
    std::optional<FrameStats> drawn;
    return settleAll(*this, request, cancel, drawn);
}

Result<SettledFrame> PictureRenderer::drawSettled(const FrameRequest& request, const std::function<bool()>& cancel) {
    // A device that is lost, or short of memory, while it draws leaves out pages that are to be read again.
    constexpr int kMostTurns = 8;
    UpdateResult before;
    for (int turn = 1;; ++turn) {
        std::optional<FrameStats> drawn;
        VCP_TRY_ASSIGN(auto update, settleAll(*this, request, cancel, drawn));
        takeReports(before, update);
        if (!drawn) {
            VCP_TRY_ASSIGN(drawn, render(request, cancel));
        }
        before = update;
        if (turn == kMostTurns || drawn->pagesInCut == update.pagesInCut)
            return SettledFrame{std::move(update), *drawn};
    }
}

Result<void> PictureRenderer::refineTo(uint32_t samples, const FrameRequest& request,
                                       const std::function<bool()>& cancel,
                                       const std::function<void(uint32_t samples)>& progress) {
    const uint32_t wanted = samplesOf(request, samples);
    for (uint32_t drawn = 1; drawn < wanted;) {
        VCP_TRY_ASSIGN(drawn, refine(cancel));
        if (drawn == 0) {
            VCP_TRY(drawSettled(request, cancel));
            drawn = 1;
        }
        if (progress) progress(drawn);
    }
    return {};
}

}  // namespace vcp
