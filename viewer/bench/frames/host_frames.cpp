#include <optional>

#include <glm/geometric.hpp>

#include "render/host/host_caster.h"
#include "render/host/layer_tiles.h"
#include "viewer/bench/frames/frame_drawer.h"
#include "viewer/bench/rays/drawn_cut.h"

namespace vcp {

namespace {

class HostDrawer final : public FrameDrawer {
public:
    HostDrawer(PageCache& cache, unsigned threads) : cache_(cache), options_{.threads = threads} {}

    Result<void> prepare(const FrameTask& task) override {
        VCP_TRY_ASSIGN(scene_, loadDrawnScene(cache_, task.request));
        return {};
    }

    Result<void> draw(const FrameTask& task, HostPicture& picture) override {
        const HostLayer layer{.scene = *scene_, .rays = task.rays, .frame = task.frame};
        if (!task.isHitsOnly) return drawLayer(layer, options_, picture);
        return castPicture(*scene_, task.rays, options_, [&](const TileHits& hits) {
            if (!hits.any) return;
            forEachPixel(picture.size, hits.corner, [&](glm::ivec2 pixel, int i) {
                const size_t to = size_t(pixel.y) * size_t(picture.size.x) + size_t(pixel.x);
                picture.depth[to] = hits.depth[i];
                picture.normals[to] = {hits.normalX[i], hits.normalY[i], hits.normalZ[i]};
            });
        });
    }

private:
    PageCache& cache_;
    const HostCastOptions options_;
    std::optional<HostScene> scene_;
};

}  // namespace

std::unique_ptr<FrameDrawer> makeHostDrawer(PageCache& cache, unsigned threads) {
    return std::make_unique<HostDrawer>(cache, threads);
}

}  // namespace vcp
