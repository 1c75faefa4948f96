#include "viewer/scene/base_light.h"

#include <optional>
#include <utility>

#include "builder/measure/mesh_bvh.h"
#include "viewer/asset/share_out.h"

namespace vcp {

using namespace meso;

SceneBase sceneBase(BaseSurface surface, const Shape& shape, double slab, double offset, double albedo) {
    const TileReflection tile = tileReflection(TilePaths(shape, albedo));
    return {std::move(surface), offset + slab * tile.height / shape.extent().z, tile.albedo, false};
}

Result<std::vector<std::shared_ptr<const BaseTransfer>>> traceBases(const std::vector<SceneBase>& bases,
                                                                    const std::function<bool(double)>& progress) {
    BaseScene scene;
    std::vector<std::pair<uint32_t, uint32_t>> ranges;
    for (const SceneBase& base : bases) {
        const uint32_t first = scene.add(base.surface, base.height, base.albedo);
        if (base.isAsked) ranges.emplace_back(first, uint32_t(base.surface.positions.size()));
    }
    std::vector<std::shared_ptr<const BaseTransfer>> made(bases.size());
    if (ranges.empty()) return made;
    const IndexedMesh mesh{scene.positions, scene.triangles, {}};
    const MeshBvh bvh(mesh);
    BaseTransferOptions options;
    options.cast = [&](glm::dvec3 origin, glm::dvec3 direction) -> std::optional<BaseHit> {
        const auto hit = bvh.nearestHit(origin, direction);
        if (!hit) return std::nullopt;
        return BaseHit{hit->triangle, hit->t};
    };
    options.shareOut = [&](size_t count, const auto& fill) {
        return shareOut(count, fill, [&](double part) { return !progress || progress(part); });
    };
    VCP_TRY_ASSIGN(auto traced, traceBaseTransfer(scene, ranges, options));
    size_t next = 0;
    for (size_t i = 0; i < bases.size(); ++i)
        if (bases[i].isAsked) made[i] = std::make_shared<const BaseTransfer>(std::move(traced[next++]));
    return made;
}

}  // namespace vcp
