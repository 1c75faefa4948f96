#include "render/host/host_caster.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace vcp {

Result<void> castPicture(const HostScene& scene, const PictureRays& rays, const HostCastOptions& options,
                         const std::function<void(const TileHits&)>& take) {
    const auto castTiles = [&](const tbb::blocked_range2d<int>& tiles) {
        TileHits hits;
        for (int y = tiles.rows().begin(); y < tiles.rows().end(); ++y)
            for (int x = tiles.cols().begin(); x < tiles.cols().end(); ++x) {
                if (options.stop.stop_requested()) return;
                hits.corner = {x * kTileWidth, y * kTileHeight};
                castTile(scene, rays, hits);
                take(hits);
            }
    };
    const tbb::blocked_range2d<int> all(0, (rays.size.y + kTileHeight - 1) / kTileHeight, 4, 0,
                                        (rays.size.x + kTileWidth - 1) / kTileWidth, 4);
    tbb::task_arena arena(options.threads > 0 ? int(options.threads) : tbb::task_arena::automatic);
    if (!all.empty()) arena.execute([&] { tbb::parallel_for(all, castTiles); });
    if (options.stop.stop_requested()) return Error::cancelled();
    return {};
}

}  // namespace vcp
