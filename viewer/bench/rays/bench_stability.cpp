#include "viewer/bench/rays/bench_stability.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "builder/build.h"
#include "builder/paper/parallel_rows.h"
#include "octree/reference_caster.h"
#include "render/camera.h"
#include "render/view/renderer.h"
#include "streaming/page_source.h"
#include "viewer/bench/rays/analytic_models.h"

namespace vcp {

namespace {

using Hits = std::vector<std::optional<SurfaceHit>>;

// The pixel error that only the finest page fulfils.
constexpr double kFinestPixels = 0;

/// Returns the shape in cells about the origin: a torus, and inside it a box on the grid's planes.
IndexedMesh shape() {
    constexpr uint32_t kAround = 96, kAcross = 40;
    constexpr double kRing = 22, kTube = 8, kHalf = 6, kTurn = 2 * std::numbers::pi;
    IndexedMesh mesh;
    for (uint32_t i = 0; i < kAround; ++i)
        for (uint32_t j = 0; j < kAcross; ++j) {
            const double a = kTurn * i / kAround, b = kTurn * j / kAcross, r = kRing + kTube * std::cos(b);
            mesh.positions.push_back({r * std::cos(a), r * std::sin(a), kTube * std::sin(b)});
            const auto at = [&](uint32_t u, uint32_t v) { return u % kAround * kAcross + v % kAcross; };
            mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    const auto first = uint32_t(mesh.positions.size());
    for (int corner = 0; corner < 8; ++corner)
        mesh.positions.push_back(kHalf * (2.0 * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2 & 1) - 1.0));
    for (const std::array<uint32_t, 4> face :
         {std::array<uint32_t, 4>{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}}) {
        mesh.triangles.push_back({first + face[0], first + face[1], first + face[2]});
        mesh.triangles.push_back({first + face[0], first + face[2], first + face[3]});
    }
    return mesh;
}

/// The shape with one cell at one origin, and the casters of rays into it.
class StabilityCase {
public:
    StabilityCase(const StabilityOptions& options, double cell, double originCells)
        : options_(options), cell_(cell), mesh_(shape()) {
        const glm::dvec3 origin = originCells * glm::dvec3(1, -1.0 / 3, 0.7);
        for (glm::dvec3& p : mesh_.positions) p = (p + origin) * cell;
        bvh_ = std::make_unique<MeshBvh>(mesh_);
        camera_ = fitCamera(bvh_->low(), bvh_->high(), {-0.3, -0.5, -1}, {0.1, 1, 0.2}, 0.6,
                            double(options.width) / options.height);
        row_.cell = cell;
        row_.originCells = originCells;
        row_.rays = uint64_t(options.width) * options.height;
    }

    Result<StabilityRow> run(Renderer& renderer) {
        const std::filesystem::path ply = options_.folder / "stability.ply", vcp = options_.folder / "stability.vcp";
        VCP_TRY(writePly(mesh_, ply));
        BuildOptions build;
        build.inputs = {ply};
        build.output = vcp;
        build.cell = cell_;
        build.threads = options_.threads;
        if (const auto built = buildOctree(build); !built) return built.error();
        VCP_TRY(measure(vcp, renderer));
        renderer.close();
        std::error_code ignored;
        std::filesystem::remove(ply, ignored);
        std::filesystem::remove(vcp, ignored);
        return row_;
    }

private:
    Result<void> measure(const std::filesystem::path& vcp, Renderer& renderer) {
        VCP_TRY_ASSIGN(auto cache, PageCache::open(vcp));
        const FileHeader& header = cache.dataset().header;
        VCP_TRY(cache.loadLevel(header.levels - 1));
        row_.certifiedCells = header.certifiedErrorMax / header.cell;
        VCP_TRY_ASSIGN(const auto exact, castReference(cache, {}));
        VCP_TRY_ASSIGN(const auto floats, castReference(cache, {.singlePrecision = true, .steps = 8}));
        VCP_TRY_ASSIGN(const auto device, castDevice(vcp, renderer));
        row_.doubles = compare(exact, exact);
        row_.floats = compare(floats, exact);
        row_.device = compare(device, exact);
        return {};
    }

    [[nodiscard]] CameraRay rayOf(int x, int y) const {
        return cameraRay(camera_, uint32_t(options_.width), uint32_t(options_.height), x + 0.5, y + 0.5);
    }
    template <class Work>
    void forRays(const Work& work) const {
        forEachRow(options_.height, options_.threads, [&](int y) {
            for (int x = 0; x < options_.width; ++x) work(size_t(y) * options_.width + x, rayOf(x, y));
        });
    }

    Result<Hits> castReference(const PageCache& cache, const CastOptions& precision) const {
        VCP_TRY_ASSIGN(
            const auto caster,
            ReferenceCaster::create(cache, cutAtLevel(cache.dataset(), cache.dataset().header.levels), precision));
        Hits hits(row_.rays);
        forRays([&](size_t i, const CameraRay& ray) {
            if (const auto hit = caster.cast({ray.origin, ray.direction}))
                hits[i] = SurfaceHit{hit->t, hit->normal, hit->certifiedError};
        });
        return hits;
    }

    Result<Hits> castDevice(const std::filesystem::path& vcp, Renderer& renderer) const {
        VCP_TRY_ASSIGN(const auto reader, openFile(vcp));
        VCP_TRY_ASSIGN(auto dataset, readDataset(*reader));
        const auto shared = std::make_shared<const Dataset>(std::move(dataset));
        VCP_TRY(renderer.open(shared, std::make_shared<FilePageSource>(reader, shared)));
        FrameRequest request;
        request.camera = camera_;
        request.width = uint32_t(options_.width);
        request.height = uint32_t(options_.height);
        request.errorPixels = kFinestPixels;
        if (const auto settled = renderer.settle(request); !settled) return settled.error();
        if (const auto frame = renderer.render(request); !frame) return frame.error();
        VCP_TRY_ASSIGN(const auto depth, renderer.readDepth());
        Hits hits(row_.rays);
        for (size_t i = 0; i < hits.size(); ++i)
            if (std::isfinite(depth[i])) hits[i] = SurfaceHit{depth[i], {}, shared->header.certifiedErrorMax};
        return hits;
    }

    [[nodiscard]] PrecisionRow compare(const Hits& hits, const Hits& exact) const {
        PrecisionRow row;
        std::vector<float> differences;
        for (size_t i = 0; i < hits.size(); ++i) {
            row.hits += hits[i] ? 1 : 0;
            const double apart = hits[i] && exact[i] ? std::abs(hits[i]->t - exact[i]->t) / cell_ : 0;
            if (hits[i].has_value() != exact[i].has_value() || apart > kWrongSheetCells)
                ++row.otherOutcome;
            else if (hits[i])
                differences.push_back(float(apart));
        }
        row.depthCells = quantilesOf(std::move(differences));
        std::vector<RayClassTable> tables(size_t(options_.height));
        const RayJudge judge(*bvh_, cell_, row_.certifiedCells * cell_);
        forRays([&](size_t i, const CameraRay& ray) {
            tables[i / size_t(options_.width)].add(judge.judge(ray.origin, ray.direction, hits[i]));
        });
        RayClassTable all;
        for (const RayClassTable& table : tables) all.merge(table);
        row.holes = all.holes();
        row.distanceCells = all.distanceCells(cell_);
        return row;
    }

    const StabilityOptions& options_;
    double cell_;
    IndexedMesh mesh_;
    std::unique_ptr<MeshBvh> bvh_;
    Camera camera_;
    StabilityRow row_;
};

}  // namespace

Result<std::vector<StabilityRow>> benchStability(const StabilityOptions& options) {
    RendererOptions device;
    device.device = options.device;
    VCP_TRY_ASSIGN(auto renderer, Renderer::create(device));
    std::vector<StabilityRow> rows;
    const size_t cases = options.cells.size() * options.originCells.size();
    for (const double cell : options.cells)
        for (const double origin : options.originCells) {
            const auto what = fmt::format("stability: cell {:g}, origin {:g} cells", cell, origin);
            if (options.progress && !options.progress(what, double(rows.size()) / double(cases)))
                return Error::cancelled();
            VCP_TRY_ASSIGN(auto row, StabilityCase(options, cell, origin).run(*renderer));
            rows.push_back(row);
        }
    return rows;
}

std::string stabilityMarkdown(const std::vector<StabilityRow>& rows) {
    if (rows.empty()) return "";
    std::string text = fmt::format(
        "\n## Numerical stability\n\nSingle precision on the processor and on the device against double, {} rays each, "
        "in cells: a torus about a box on "
        "planes of the grid. *Other* rays hit where double misses, miss where it hits, or hit over {:g} cells away; "
        "*error* is the distance of hits to the mesh.\n\n"
        "| cell | origin, cells | hits | holes, double | error p99 | float: other | holes | depth p50 | p99 | max | "
        "error p99 "
        "| device: other | holes | depth p50 | p99 | max | error p99 "
        "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        rows.front().rays, kWrongSheetCells);
    const auto beside = [](const PrecisionRow& row) {
        return fmt::format(" {} | {} | {:.1e} | {:.1e} | {:.1e} | {:.5f} |", row.otherOutcome, row.holes,
                           row.depthCells.p50, row.depthCells.p99, row.depthCells.max, row.distanceCells.p99);
    };
    for (const StabilityRow& row : rows)
        text += fmt::format("| {:g} | {:g} | {} | {} | {:.5f} |{}{}\n", row.cell, row.originCells, row.doubles.hits,
                            row.doubles.holes, row.doubles.distanceCells.p99, beside(row.floats), beside(row.device));
    return text;
}

}  // namespace vcp
