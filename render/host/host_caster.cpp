#include "render/host/host_caster.h"

#include <atomic>

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace vcp {

Result<void> castPicture(const HostScene& scene, const PictureRays& rays, const HostCastOptions& options,
                         const std::function<void(const TileHits&)>& take) {
    return forEachTile(rays.size, options, [&](glm::ivec2 corner) {
        TileHits hits;
        hits.corner = corner;
        castTile(scene, rays, hits);
        take(hits);
    });
}

Result<void> forEachTile(glm::ivec2 size, const HostCastOptions& options,
                         const std::function<void(glm::ivec2 corner)>& draw) {
    std::atomic<bool> isCancelled = false;
    const auto drawTiles = [&](const tbb::blocked_range2d<int>& tiles) {
        for (int y = tiles.rows().begin(); y < tiles.rows().end(); ++y)
            for (int x = tiles.cols().begin(); x < tiles.cols().end(); ++x) {
                if (options.cancel && !isCancelled && options.cancel()) isCancelled = true;
                if (isCancelled) return;
                draw({x * kTileWidth, y * kTileHeight});
            }
    };
    const tbb::blocked_range2d<int> all(0, (size.y + kTileHeight - 1) / kTileHeight, 4, 0,
                                        (size.x + kTileWidth - 1) / kTileWidth, 4);
    tbb::task_arena arena(options.threads > 0 ? int(options.threads) : tbb::task_arena::automatic);
    if (!all.empty()) arena.execute([&] { tbb::parallel_for(all, drawTiles); });
    if (isCancelled) return Error::cancelled();
    return {};
}

}  // namespace vcp
