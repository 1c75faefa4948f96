#include "viewer/window/comparison.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/build.h"
#include "octree/io/caught.h"
#include "viewer/export/diverging_colours.h"
#include "viewer/export/short_edges.h"
#include "viewer/export/surface_mesh.h"
#include "viewer/scene/mesh_cache.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;

// Two surfaces of so many, with the trees that distances are looked up in, take some 5 GB.
constexpr uint64_t kMostTriangles = 12'000'000;
// Leaves of triangles have up to 16, some 9 in the mean; slabs are cut into some 3.
constexpr uint64_t kTrianglesALeaf = 9, kTrianglesASlab = 3;

// A picture of a surface is some such number of colours long.
constexpr double kEdgesADiagonal = 200;
// A legend has so many characters of a name in its title, and numbers and colours on each side of zero.
constexpr size_t kLongestName = 28;
constexpr int kTicks = 2, kStops = 32;

/// Files that colour a surface on their way into a dataset; they are removed with this.
class ColouringFiles {
public:
    static Result<ColouringFiles> inCache() {
        static std::atomic<int> made = 0;
        VCP_TRY_ASSIGN(const auto folder, defaultCacheFolder());
        std::error_code failed;
        fs::create_directories(folder, failed);
        if (failed)
            return Error{.code = ErrorCode::Io,
                         .message = "the cache folder cannot be made: " + failed.message(),
                         .file = folder.string()};
        // Names with this part are cleared away once they are old (MeshCache): also after a crash nothing stays.
        return ColouringFiles(folder / fmt::format("compared.{}.{}.building.", getpid(), ++made));
    }
    ColouringFiles(ColouringFiles&& other) noexcept : start_(std::exchange(other.start_, {})) {}
    ColouringFiles& operator=(ColouringFiles&&) = delete;
    ~ColouringFiles() {
        std::error_code ignored;
        if (start_.empty()) return;
        fs::remove(mesh(), ignored);
        fs::remove(dataset(), ignored);
    }

    [[nodiscard]] fs::path mesh() const { return start_.string() + "ply"; }
    [[nodiscard]] fs::path dataset() const { return start_.string() + "vcp"; }

private:
    explicit ColouringFiles(fs::path start) : start_(std::move(start)) {}

    fs::path start_;
};

}  // namespace

uint32_t finestHeldLevel(const Dataset& dataset, uint64_t most) {
    const uint32_t levels = dataset.header.levels;
    if (dataset.header.triangles <= most) return levels - 1;
    std::vector<uint64_t> ofLevel(levels, 0);
    for (const PageEntry& page : dataset.pages) {
        const uint64_t triangles =
            kTrianglesALeaf * page.hardLeaves + kTrianglesASlab * (uint64_t{page.leaves} - page.hardLeaves);
        // A page without children stands for its cube on all finer levels as well.
        const uint32_t last = page.childMask == 0 ? levels - 1 : page.level;
        for (uint32_t level = page.level; level <= last; ++level) ofLevel[level] += triangles;
    }
    uint32_t level = levels - 1;
    while (level > 0 && ofLevel[level] > most) --level;
    return level;
}

Legend distanceLegend(double range, const std::string& from, const std::optional<LengthUnit>& unit) {
    const WrittenUnit written = writtenUnit(range, unit);
    Legend legend{.name = from.size() <= kLongestName ? "Distance from " + from : "Distance",
                  .unit = std::string(written.name),
                  .end = range,
                  .ticks = {}};
    for (int i = 0; i <= 2 * kTicks; ++i) {
        const double part = i / (2.0 * kTicks);
        legend.ticks.push_back({part, fmt::format("{:.3g}", (2 * part - 1) * range * written.factor)});
    }
    for (int i = 0; i <= 2 * kStops; ++i) legend.colours.emplace_back(divergingColour(double(i - kStops) / kStops));
    return legend;
}

Comparison::Comparison(Subject a, Subject b, const Choice& choice, SourceAccess access) {
    access.cancelled = [this, others = access.cancelled] { return cancelled_ || (others && others()); };
    coloured_ =
        std::async(std::launch::async, [this, a = std::move(a), b = std::move(b), choice, access = std::move(access)] {
            return caught(
                [&]() -> Result<Coloured> {
                    VCP_TRY_ASSIGN(auto measured, measure(a, b, choice, access));
                    const double range = measured->compared.range;
                    return colour(std::move(measured), range, {0.6, 1});
                },
                a.name);
        });
}

Comparison::Comparison(std::shared_ptr<const Measured> measured, double range) {
    coloured_ = std::async(std::launch::async, [this, measured = std::move(measured), range] {
        return caught([&] { return colour(measured, range, {0, 1}); }, measured->compared.a);
    });
}

Comparison::~Comparison() { cancelled_ = true; }

bool Comparison::isDone() const { return coloured_.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }

Result<Comparison::Coloured> Comparison::take() { return coloured_.get(); }

std::function<bool(double)> Comparison::progress(Stage stage) {
    return [this, stage](double fraction) {
        fraction_ = stage.from + (stage.to - stage.from) * fraction;
        return !cancelled_;
    };
}

Result<Comparison::Held> Comparison::load(const Subject& subject, const SourceAccess& access, Stage stage) {
    Held held;
    auto reader = subject.reader;
    if (!reader) {
        VCP_TRY_ASSIGN(const InputKind kind, kindOf({subject.file}));
        if (kind == InputKind::Scene)
            return Error{
                .code = ErrorCode::Usage, .message = "is a scene; choose a .vcp file or a mesh", .file = subject.file};
        if (kind == InputKind::Datasets) {
            VCP_TRY_ASSIGN(reader, openReader(subject.file, access));
        } else {
            VCP_TRY_ASSIGN(held.mesh, loadMesh(subject.file, {.progress = progress(stage)}));
        }
    }
    if (reader) {
        VCP_TRY_ASSIGN(const auto dataset, readDataset(*reader));
        const uint32_t level = finestHeldLevel(dataset, kMostTriangles);
        VCP_TRY_ASSIGN(const auto cut, SurfaceCut::create(dataset, reader->name(), level));
        VCP_TRY_ASSIGN(auto surface, loadSurface(*reader, cut, {.colour = false, .progress = progress(stage)}));
        held = {std::move(surface.mesh), surface.certified * subject.placement.scale};
    }
    for (glm::dvec3& position : held.mesh.positions) position = subject.placement.toWorld(position);
    return held;
}

Result<std::shared_ptr<const Comparison::Measured>> Comparison::measure(const Subject& a, const Subject& b,
                                                                        const Choice& choice,
                                                                        const SourceAccess& access) {
    auto measured = std::make_shared<Measured>();
    VCP_TRY_ASSIGN(auto first, load(a, access, {0, 0.1}));
    VCP_TRY_ASSIGN(const auto second, load(b, access, {0.1, 0.2}));
    measured->mesh = std::move(first.mesh);
    measured->diagonal = Box::of(measured->mesh.positions).diagonal();
    const DeviationTarget target(second.mesh);
    const double within = choice.within * measured->diagonal;
    VCP_TRY_ASSIGN(measured->deviation,
                   measureDeviation(measured->mesh, target, {.within = within, .progress = progress({0.3, 0.4})}));
    if (choice.both) {
        VCP_TRY_ASSIGN(measured->back, measureDeviation(second.mesh, DeviationTarget(measured->mesh),
                                                        {.within = within, .progress = progress({0.4, 0.5})}));
    }
    // Colours are of vertices, so the large triangles of a drawing need more of them; figures do not.
    shortenEdges(measured->mesh, measured->diagonal / kEdgesADiagonal, kMostTriangles);
    VCP_TRY_ASSIGN(measured->distances,
                   distancesOf(measured->mesh.positions, target, {.within = within, .progress = progress({0.5, 0.6})}));
    measured->compared = {.a = a.name,
                          .b = b.name,
                          .unit = {},
                          .certifiedA = first.certified,
                          .certifiedB = second.certified,
                          .range = usualRange(measured->deviation, measured->diagonal)};
    return std::shared_ptr<const Measured>(std::move(measured));
}

Result<Comparison::Coloured> Comparison::colour(std::shared_ptr<const Measured> measured, double range, Stage stage) {
    VCP_TRY_ASSIGN(const auto files, ColouringFiles::inCache());
    VCP_TRY(writeDistances(measured->mesh, measured->distances, range, files.mesh(), {}, {}));
    BuildOptions build;
    build.inputs = {files.mesh()};
    build.output = files.dataset();
    build.progress = [told = progress(stage)](const BuildProgress& at) { return told(at.fraction); };
    VCP_TRY(buildOctree(build));
    VCP_TRY_ASSIGN(auto open, openDataset(files.dataset().string(), {}));
    return Coloured{std::move(measured), range, std::move(open)};
}

}  // namespace vcp
