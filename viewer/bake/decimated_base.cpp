#include "viewer/bake/decimated_base.h"

#include <algorithm>
#include <vector>

#include "builder/measure/mesh_bvh.h"
#include "builder/measure/mesh_deviation.h"
#include "builder/measure/mesh_samples.h"
#include "mesostructure/base/decimation.h"
#include "mesostructure/base/manifold_part.h"
#include "mesostructure/shell.h"
#include "viewer/bake/bake_maps.h"

namespace vcp {

namespace {

using namespace meso;

constexpr int kRounds = 3;          // after the first
constexpr double kFollowed = 1e-4;  // so little of a base may be no height field
constexpr float kMore = 16;         // in each round, changes count so many times more where it is none
constexpr uint64_t kForReach = 50'000;

class FollowingBase {
public:
    FollowingBase(const std::shared_ptr<const ByteReader>& reader, const Dataset& dataset, const IndexedMesh& scan,
                  const DecimatedBaseOptions& options)
        : reader_(reader), dataset_(dataset), scan_(scan), options_(options) {}

    Result<DecimatedBase> run() {
        surface_ = {scan_.positions, scan_.triangles, {}};
        joinPositions(surface_);
        leftOut_ = keepManifoldPart(surface_);
        DecimatedBase best;
        std::vector<float> weights;
        for (;; ++round_) {
            VCP_TRY_ASSIGN(DecimatedBase next, decimate(weights));
            VCP_TRY_ASSIGN(const std::vector<bool> isField, tryMaps(next));
            next.unlikeAtFirst = round_ == 0 ? next.unlike : best.unlikeAtFirst;
            if (round_ > 0 && next.unlike >= best.unlike) return best;
            best = std::move(next);
            if (best.unlike <= kFollowed || round_ == kRounds) return best;
            VCP_TRY(weigh(best.surface, isField, weights));
        }
    }

private:
    /// Returns the progress of a part of a round; the first counts as much as all others.
    [[nodiscard]] std::function<bool(double)> progress(double from, double to) const {
        return [this, from, to](double fraction) {
            const double first = round_ == 0 ? 0 : 0.5 + 0.5 / kRounds * (round_ - 1);
            const double whole = round_ == 0 ? 0.5 : 0.5 / kRounds;
            return !options_.progress || options_.progress(first + whole * (from + (to - from) * fraction));
        };
    }

    Result<DecimatedBase> decimate(const std::vector<float>& weights) {
        DecimatedBase made;
        VCP_TRY_ASSIGN(
            made.surface,
            decimated(surface_, {.triangles = options_.triangles, .weights = weights, .progress = progress(0, 0.6)}));
        made.scanVertices = surface_.positions.size();
        made.leftOut = leftOut_ + keepDrawable(made.surface);
        if (made.surface.triangles.empty())
            return Error{.code = ErrorCode::InvalidInput,
                         .message = "nothing of it is a surface with an outside; give a base of your own"};
        made.reach = options_.reach;
        if (made.reach > 0) return made;
        const IndexedMesh mesh{made.surface.positions, made.surface.triangles, {}};
        const DeviationTarget target(mesh);
        VCP_TRY_ASSIGN(const auto away,
                       measureDeviation(scan_, target, {.samples = kForReach, .progress = progress(0.6, 0.7)}));
        made.reach = std::max(1.5 * (away.absoluteQuantile(1) + options_.scanAway),
                              4 * dataset_.cellOf(dataset_.header.levels - 1));
        return made;
    }

    /// Leaves out what no scene draws: triangles on edges that have become one, and at corners whose normals cancel.
    static uint64_t keepDrawable(BaseSurface& base) {
        uint64_t leftOut = 0;
        joinPositions(base);
        for (size_t before = 0; before != base.triangles.size();) {
            before = base.triangles.size();
            leftOut += keepManifoldPart(base);
            const std::vector<glm::dvec3> directions = shellDirections(base);
            leftOut += std::erase_if(base.triangles, [&](const auto& t) {
                return std::any_of(t.begin(), t.end(), [&](uint32_t v) { return directions[v] == glm::dvec3(0); });
            });
        }
        return leftOut;
    }

    /// Returns over which triangles of a base small maps find a height field.
    Result<std::vector<bool>> tryMaps(DecimatedBase& base) {
        int texels = std::max(options_.texels / 4, 8);
        auto map = makeAtlas(base.surface, texels);
        while (!map && texels < options_.texels) {
            texels = std::min(2 * texels, options_.texels);
            map = makeAtlas(base.surface, texels);
        }
        if (!map) return map.error();
        const std::vector<glm::dvec3> directions = shellDirections(base.surface);
        const BaseFrames frames = framesOf(base.surface, *map, directions);
        VCP_TRY_ASSIGN(BakedMaps maps, bakeMaps(reader_, dataset_, base.surface, *map, frames, directions,
                                                {.reach = base.reach,
                                                 .withColour = false,
                                                 .memoryBytes = options_.memoryBytes,
                                                 .progress = progress(0.7, 0.95)}));
        base.unlike = 1 - maps.shares.height;
        return std::move(maps.isField);
    }

    /// Lets those triangles of the scan count more that are nearest to a triangle over which it is no height field, or
    /// to a neighbour of one.
    Result<void> weigh(const BaseSurface& base, const std::vector<bool>& isField, std::vector<float>& weights) {
        std::vector<bool> isAt(base.positions.size(), false);
        for (size_t i = 0; i < base.triangles.size(); ++i)
            for (const uint32_t corner : base.triangles[i]) isAt[corner] = isAt[corner] || !isField[i];
        const IndexedMesh mesh{base.positions, base.triangles, {}};
        const MeshBvh bvh(mesh);
        weights.resize(surface_.triangles.size(), 1);
        const std::function<bool(double)> told = progress(0.95, 1);
        SampleRunner runner(0, told);
        const bool isDone = runner.run(surface_.triangles.size(), 0, 1, [&](uint64_t i) {
            const auto& t = surface_.triangles[i];
            const glm::dvec3 middle =
                (surface_.positions[t[0]] + surface_.positions[t[1]] + surface_.positions[t[2]]) / 3.0;
            const auto& nearest = base.triangles[bvh.nearestPoint(middle)->triangle];
            if (std::any_of(nearest.begin(), nearest.end(), [&](uint32_t v) { return isAt[v]; })) weights[i] *= kMore;
        });
        if (!isDone) return Error::cancelled();
        return {};
    }

    const std::shared_ptr<const ByteReader>& reader_;
    const Dataset& dataset_;
    const IndexedMesh& scan_;
    const DecimatedBaseOptions& options_;
    BaseSurface surface_;  // the scan, joined
    uint64_t leftOut_ = 0;
    int round_ = 0;
};

}  // namespace

Result<DecimatedBase> decimateToFollow(const std::shared_ptr<const ByteReader>& reader, const Dataset& dataset,
                                       const IndexedMesh& scan, const DecimatedBaseOptions& options) {
    return FollowingBase(reader, dataset, scan, options).run();
}

}  // namespace vcp
