#include "viewer/bake/bake.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "builder/measure/mesh_deviation.h"
#include "mesostructure/asset_file.h"
#include "mesostructure/base/surface_edges.h"
#include "mesostructure/shell.h"
#include "viewer/bake/bake_files.h"
#include "viewer/bake/coarsened_scan.h"
#include "viewer/bake/decimated_base.h"
#include "viewer/bake/displaced_mesh.h"
#include "viewer/export/surface_mesh.h"
#include "viewer/scene/base_mesh.h"

namespace vcp {

namespace {

using namespace meso;

constexpr uint64_t kMostOfBase = 1'000'000, kMeasured = 200'000;
/// Memory for each triangle of a scan that is held, once as it was read and once joined; and of one that is measured.
constexpr uint64_t kHeldBytes = 200, kMeasuredBytes = 400;
/// Memory for each triangle of a mesh that is decimated.
constexpr uint64_t kDecimationBytes = 800;
/// Triangles that a large scan is made coarser to; at least so many times those of the base.
constexpr uint64_t kCoarsened = 2'000'000, kLeastOverBase = 2;

/// Where the parts of the work lie in the whole.
struct Part {
    const char* name;
    double from, to;
};
constexpr Part kReading{"reading the scan", 0, 0.1}, kDecimating{"making the base", 0.1, 0.4},
    kCoarsening{"making the scan coarser", 0, 0.25}, kDecimatingCoarse{"making the base", 0.25, 0.4},
    kSampling{"sampling", 0.4, 0.85}, kWriting{"writing", 0.85, 0.88},
    kReadingAgain{"reading the scan again", 0.88, 0.9}, kMeasuring{"measuring", 0.9, 0.95},
    kMeasuringBack{"measuring back", 0.95, 1};

/// An error of the base is said with the base's name.
Error named(Error error, const std::string& name) {
    if (error.file.empty() && error.code != ErrorCode::Cancelled) error.file = name;
    return error;
}

class Baker {
public:
    Baker(const std::shared_ptr<const ByteReader>& reader, const Dataset& dataset, const std::filesystem::path& folder,
          const BakeOptions& options)
        : reader_(reader), dataset_(dataset), folder_(folder), options_(options) {}

    Result<BakeFigures> run() {
        figures_.scanTriangles = dataset_.header.triangles;
        if (dataset_.header.method != Method::Certified)
            return Error{.code = ErrorCode::Unsupported,
                         .message = "was built by the paper's method; build it by the other to bake it",
                         .file = reader_->name()};
        if (options_.measured && figures_.scanTriangles * kMeasuredBytes > options_.memoryBytes)
            return tooLarge(
                fmt::format("and measuring them takes {} MiB of memory, more than the memory cap; leave out "
                            "the measuring",
                            figures_.scanTriangles * kMeasuredBytes >> 20));
        VCP_TRY(options_.base.empty() ? makeBase() : readBase());
        VCP_TRY_ASSIGN(const TexelMap map, mapOf());
        const std::vector<glm::dvec3> directions = shellDirections(base_);
        const BaseFrames frames = framesOf(base_, map, directions);
        auto maps = bakeMaps(reader_, dataset_, base_, map, frames, directions,
                             {.reach = figures_.reach,
                              .withColour = options_.withColour,
                              .memoryBytes = options_.memoryBytes,
                              .progress = progress(kSampling)});
        if (!maps) return named(maps.error(), baseName());
        figures_.baseTriangles = base_.triangles.size();
        figures_.isAtlas = map.isAtlas();
        figures_.offset = maps->heights.offset, figures_.range = maps->heights.range;
        figures_.shares = maps->shares;
        if (!at(kWriting, 0)) return Error::cancelled();
        const std::string name = std::filesystem::path(reader_->name()).stem().string();
        VCP_TRY_ASSIGN(figures_.bytes, writeBaked(folder_, name, base_, map, frames, *maps));
        std::error_code ignored;
        figures_.baseBytes = std::filesystem::file_size(folder_ / "base.obj", ignored);
        figures_.heightBytes = std::filesystem::file_size(folder_ / "heights.meso", ignored);
        maps = BakedMaps();
        if (options_.measured) VCP_TRY(measure());
        return figures_;
    }

private:
    [[nodiscard]] bool at(const Part& part, double fraction) const {
        return !options_.progress || options_.progress(part.name, part.from + (part.to - part.from) * fraction);
    }
    [[nodiscard]] std::function<bool(double)> progress(const Part& part) const {
        return [this, part](double fraction) { return at(part, fraction); };
    }
    /// What errors of the base are said of.
    [[nodiscard]] std::string baseName() const {
        return options_.base.empty() ? reader_->name() : options_.base.string();
    }

    [[nodiscard]] Error tooLarge(std::string why) const {
        return {.code = ErrorCode::Limit,
                .message = fmt::format("has {} triangles, {}", figures_.scanTriangles, why),
                .file = reader_->name()};
    }

    /// Returns the finest level, where it is the mesh itself.
    Result<SurfaceCut> finestMesh() const {
        VCP_TRY_ASSIGN(auto cut, SurfaceCut::create(dataset_, reader_->name(), UINT32_MAX));
        if (!cut.isMesh() && options_.base.empty())
            return Error{.code = ErrorCode::Unsupported,
                         .message =
                             "its finest level is not the mesh itself, which a base could be made from; build it "
                             "anew, or give a base of your own",
                         .file = reader_->name()};
        return cut;
    }

    Result<LoadedSurface> readScan(const Part& part) const {
        VCP_TRY_ASSIGN(const auto cut, finestMesh());
        VCP_TRY_ASSIGN(auto scan, loadSurface(*reader_, cut, {.colour = false, .progress = progress(part)}));
        if (scan.mesh.triangles.empty())
            return Error{.code = ErrorCode::InvalidInput, .message = "has no triangle", .file = reader_->name()};
        return scan;
    }

    Result<void> makeBase() {
        const uint64_t count = figures_.scanTriangles;
        const bool isLarge = count > options_.mostDecimated || count * kDecimationBytes > options_.memoryBytes;
        if (isLarge) return coarsenAndDecimate();
        VCP_TRY_ASSIGN(LoadedSurface scan, readScan(kReading));
        return decimate(scan.mesh, 0, kDecimating);
    }

    Result<void> coarsenAndDecimate() {
        // Half of the memory is for what is decimated while the scan is read.
        const uint64_t most = std::min(options_.memoryBytes / 2 / kDecimationBytes, options_.mostDecimated),
                       least = kLeastOverBase * options_.triangles;
        if (most < least)
            return tooLarge(fmt::format("and a base of {} of them takes {} MiB of memory, more than the memory cap",
                                        options_.triangles, (2 * least * kDecimationBytes >> 20) + 1));
        VCP_TRY_ASSIGN(const auto cut, finestMesh());
        VCP_TRY_ASSIGN(CoarsenedScan scan, coarsenScan(*reader_, cut,
                                                       {.triangles = std::min(most, std::max(kCoarsened, least)),
                                                        .memoryBytes = options_.memoryBytes,
                                                        .progress = progress(kCoarsening)}));
        if (scan.mesh.triangles.empty())
            return Error{.code = ErrorCode::InvalidInput, .message = "has no triangle", .file = reader_->name()};
        if (scan.mesh.triangles.size() * kDecimationBytes > options_.memoryBytes)
            return tooLarge(
                fmt::format("and {} of them are left where no more can go, which take {} MiB of memory, more "
                            "than the memory cap; give a base of your own",
                            scan.mesh.triangles.size(), scan.mesh.triangles.size() * kDecimationBytes >> 20));
        figures_.coarseTriangles = scan.mesh.triangles.size();
        VCP_TRY(decimate(scan.mesh, scan.away, kDecimatingCoarse));
        figures_.scanVertices = scan.vertices, figures_.leftOut += scan.leftOut;
        return {};
    }

    Result<void> decimate(const IndexedMesh& mesh, double away, const Part& part) {
        auto made = decimateToFollow(reader_, dataset_, mesh,
                                     {.triangles = options_.triangles,
                                      .texels = options_.texels,
                                      .reach = options_.reach,
                                      .scanAway = away,
                                      .memoryBytes = options_.memoryBytes - kHeldBytes * mesh.triangles.size(),
                                      .progress = progress(part)});
        if (!made) return named(made.error(), reader_->name());
        base_ = std::move(made->surface);
        figures_.leftOut = made->leftOut, figures_.reach = made->reach;
        figures_.scanVertices = made->scanVertices;
        figures_.unlike = made->unlike, figures_.unlikeAtFirst = made->unlikeAtFirst;
        return {};
    }

    Result<void> readBase() {
        LoadOptions loading;
        loading.coordinates = Coordinates::IfAny;
        loading.mostTriangles = kMostOfBase, loading.mostPositions = 3 * kMostOfBase;
        loading.progress = progress(kDecimating);
        VCP_TRY_ASSIGN(auto mesh, loadMesh(options_.base, loading));
        base_ = {std::move(mesh.positions), std::move(mesh.triangles), std::move(mesh.coordinates)};
        joinPositions(base_);
        if (const auto edges = edgesOf(base_); !edges) return named(edges.error(), baseName());
        const Box bounds = boundsOf(dataset_.header);
        figures_.reach = options_.reach > 0 ? options_.reach : 0.02 * glm::distance(bounds.low, bounds.high);
        return {};
    }

    Result<TexelMap> mapOf() {
        const bool isGiven = !base_.uvs.empty() && !options_.newMap;
        auto map = isGiven ? givenMap(base_, options_.texels) : makeAtlas(base_, options_.texels);
        if (!map) return named(map.error(), baseName());
        return map;
    }

    /// Measures what was written, read again, against the scan.
    Result<void> measure() {
        VCP_TRY_ASSIGN(const auto surface, readBaseMesh(folder_ / "base.obj", 1));
        VCP_TRY_ASSIGN(const auto asset, readAsset(folder_ / "heights.meso"));
        VCP_TRY_ASSIGN(const IndexedMesh displaced, displacedMesh(surface, *asset.heights, figures_.offset));
        VCP_TRY_ASSIGN(const LoadedSurface scan, readScan(kReadingAgain));
        VCP_TRY_ASSIGN(figures_.scanToBase, distances(scan.mesh, displaced, kMeasuring));
        VCP_TRY_ASSIGN(figures_.baseToScan, distances(displaced, scan.mesh, kMeasuringBack));
        return {};
    }

    Result<Quantiles> distances(const IndexedMesh& from, const IndexedMesh& to, const Part& part) {
        const DeviationTarget target(to);
        VCP_TRY_ASSIGN(const auto found,
                       measureDeviation(from, target, {.samples = kMeasured, .progress = progress(part)}));
        return Quantiles{found.absoluteQuantile(0.5), found.absoluteQuantile(0.95), found.absoluteQuantile(0.99),
                         found.absoluteQuantile(1)};
    }

    const std::shared_ptr<const ByteReader>& reader_;
    const Dataset& dataset_;
    const std::filesystem::path& folder_;
    const BakeOptions& options_;
    BaseSurface base_;
    BakeFigures figures_;
};

}  // namespace

Result<BakeFigures> bake(const std::shared_ptr<const ByteReader>& reader, const Dataset& dataset,
                         const std::filesystem::path& folder, const BakeOptions& options) {
    return Baker(reader, dataset, folder, options).run();
}

}  // namespace vcp
