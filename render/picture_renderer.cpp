#include "render/picture_renderer.h"

#include <utility>

#include "render/pixel_samples.h"

namespace vcp {

Result<UpdateResult> PictureRenderer::settle(const FrameRequest& request, const std::function<bool()>& cancel) {
    bool changed = false;
    std::vector<Error> problems;
    while (true) {
        auto result = update(request);
        if (!result) return result;
        changed = changed || result->changed;
        problems.insert(problems.end(), result->problems.begin(), result->problems.end());
        if (result->settled) {
            result->changed = changed;
            result->problems = std::move(problems);
            return result;
        }
        if (cancel && cancel()) return Error::cancelled();
        waitForPage(std::chrono::milliseconds(100));
    }
}

Result<void> PictureRenderer::refineTo(uint32_t samples, const FrameRequest& request,
                                       const std::function<bool()>& cancel,
                                       const std::function<void(uint32_t samples)>& progress) {
    const uint32_t wanted = samplesOf(request, samples);
    for (uint32_t drawn = 1; drawn < wanted;) {
        VCP_TRY_ASSIGN(drawn, refine(cancel));
        if (drawn == 0) {
            VCP_TRY(settle(request, cancel));
            VCP_TRY(render(request, cancel));
            drawn = 1;
        }
        if (progress) progress(drawn);
    }
    return {};
}

}  // namespace vcp
