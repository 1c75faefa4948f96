#include "viewer/meso_backdrop.h"

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/vector_relational.hpp>

#include "viewer/dataset_opening.h"
#include "viewer/interrupt.h"

namespace vcp {

namespace {

/// As the shader that shades octrees encodes.
glm::vec3 linearOf(glm::vec3 encoded) { return glm::mix(glm::pow((encoded + 0.055f) / 1.055f, glm::vec3(2.4f)), encoded / 12.92f, glm::lessThanEqual(encoded, glm::vec3(0.04045f))); }

}  // namespace

Result<MesoBackdrop> MesoBackdrop::open(const std::string& input, const std::string& device) {
    auto open = openScene({input}, BuildSettings{}, SourceSettings{}, ProgressStyle::None);
    if (!open) return open.error();
    RendererOptions options;
    options.device = device, options.loaderThreads = open->loaderThreads();
    auto renderer = Renderer::create(options);
    if (!renderer) return renderer.error();
    VCP_TRY((*renderer)->open(open->placed()));
    MesoBackdrop made;
    made.open_ = *std::move(open), made.renderer_ = *std::move(renderer);
    return made;
}

Result<MesoBehind> MesoBackdrop::draw(const MesoRequest& request) {
    FrameRequest frame;
    frame.camera = request.look.camera;
    frame.width = request.width, frame.height = request.height;
    frame.shading.lightFollowsCamera = false, frame.shading.lightDirection = glm::vec3(request.look.light), frame.shading.shadows = request.look.shadows;
    frame.shading.backgroundTop = linearOf(request.backgroundTop), frame.shading.backgroundBottom = linearOf(request.backgroundBottom);
    const InterruptScope catching;
    const auto update = renderer_->settle(frame, interrupted);
    if (!update) return update.error();
    if (!update->problems.empty()) return update->problems.front();
    const auto drawn = renderer_->render(frame);
    if (!drawn) return drawn.error();
    auto picture = renderer_->readPicture();
    if (!picture) return picture.error();
    auto depths = renderer_->readDepth();
    if (!depths) return depths.error();
    return MesoBehind{*std::move(picture), *std::move(depths)};
}

}  // namespace vcp
