#include "render/picture_renderer.h"

#include <utility>

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

}  // namespace vcp
