#include "viewer/command/method_panels.h"

#include <numeric>

#include <fmt/format.h>

#include "viewer/scene/option_values.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

Result<MesoScene> surfacesBy(const std::string& method, SceneFile scene, const SurfaceProgress& progress) {
    SurfaceChoices{.method = method, .subdivide = {}}.applyTo(scene);
    return makeMesoScene(scene.surfaces, progress);
}

Result<MethodPanel> readPanel(PictureRenderer& renderer, const std::string& method, bool withIterations,
                              const FrameStats& stats, double msPerFrame) {
    VCP_TRY_ASSIGN(auto picture, renderer.readPicture());
    MethodPanel panel{method, std::move(picture), stats, msPerFrame, {}};
    if (!withIterations) return panel;
    VCP_TRY_ASSIGN(const auto iterations, renderer.readIterations());
    const double sum = std::accumulate(iterations.begin(), iterations.end(), 0.0);
    panel.iterationsMean = sum / double(iterations.size());
    return panel;
}

Picture sideBySide(std::span<const MethodPanel> panels) {
    const Picture& first = panels.front().picture;
    Picture all{uint32_t(first.width * panels.size()), first.height, {}};
    all.rgba.reserve(first.rgba.size() * panels.size());
    const size_t row = size_t{4} * first.width;
    for (size_t y = 0; y < first.height; ++y)
        for (const MethodPanel& panel : panels) {
            const auto begin = panel.picture.rgba.begin() + std::ptrdiff_t(y * row);
            all.rgba.insert(all.rgba.end(), begin, begin + std::ptrdiff_t(row));
        }
    return all;
}

Json toJson(const MethodPanel& panel) {
    return {{"method", panel.method},
            {"ms_per_frame", panel.msPerFrame},
            {"hit_pixels", panel.stats.hitPixels},
            {"iterations_mean", panel.iterationsMean.value_or(0)},
            {"unresolved_rays", panel.stats.unresolvedRays},
            {"far_hits", panel.stats.farHits},
            {"surface_bytes", panel.stats.surfaceBytes},
            {"remeshed_pixels", panel.stats.remeshedPixels},
            {"uncertified_patches", panel.stats.uncertifiedPatches}};
}

std::string summary(const MethodPanel& panel) {
    return fmt::format("{}: {:.1f} ms, {:.1f} iterations a pixel, {} unresolved, {}", panel.method, panel.msPerFrame,
                       panel.iterationsMean.value_or(0), panel.stats.unresolvedRays,
                       formatBytes(panel.stats.surfaceBytes));
}

}  // namespace vcp
