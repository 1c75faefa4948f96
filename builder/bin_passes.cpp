#include "builder/bin_passes.h"

#include <sys/resource.h>
#include <algorithm>

#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/task_arena.h>

#include "builder/dataset_assembly.h"
#include "builder/lattice/collapsed_triangles.h"
#include "builder/slab_pages.h"

namespace vcp {

ColourUse colourUseOf(const BuildOptions& options, const SoupMeasures& measures) {
    const bool all = options.colour == ColourChoice::Auto;
    return {.vertices = measures.hasVertexColours && (all || options.colour == ColourChoice::Vertex),
            .materials = measures.hasMaterials && (all || options.colour == ColourChoice::Texture)};
}

bool mayKeepImages(const BuildOptions& options, const SoupMeasures& measures, std::span<const Material> materials) {
    const auto hasImage = [](const Material& material) { return material.hasImages(); };
    return keepsImages(options) && colourUseOf(options, measures).materials && std::ranges::any_of(materials, hasImage);
}

unsigned threadsOf(const BuildOptions& options) {
    return options.threads > 0 ? options.threads : unsigned(std::max(1, tbb::this_task_arena::max_concurrency()));
}

Result<MemoryPlan> memoryOf(const BuildOptions& options) {
    return planMemory(options.memoryBytes > 0 ? options.memoryBytes : defaultMemoryBytes(), threadsOf(options));
}

Result<LevelPlan> planLevels(const BuildOptions& options, const SoupMeasures& measures, uint32_t levelsLess) {
    LevelPlan plan;
    VCP_TRY_ASSIGN(auto frame, chooseFrame(options, measures, levelsLess));
    VCP_TRY_ASSIGN(plan.errorTarget, chooseError(options, measures, frame));
    plan.setPages(frame, FinestPages({frame.log2Cells, frame.levels - 1}));
    plan.isExact = options.error <= 0;
    plan.hasSlabs = hasSlabs(options);
    return plan;
}

Result<LatticeMesh> meshWithNormals(const LevelPlan& plan, std::vector<LatticeTriangle> soup, size_t bin,
                                    bool withColour, PartNotes& parts) {
    const PageGrid grid = plan.gridOf(plan.levels() - 1);
    const auto isIn = [&](glm::i32vec3 p) { return plan.finest.binOf(grid.pageOf(p)) == bin; };
    const std::vector<Corners> changed = keepCollapsed(
        soup, isIn, [&](glm::i32vec3 p, glm::i32vec3 q) { return grid.pageOf(p) == grid.pageOf(q); },
        [&](glm::i32vec3 p) { return plan.pages.stepAt(p); });
    LatticeMesh mesh = meshOf(soup, withColour);
    std::vector<LatticeTriangle>().swap(soup);
    Result<void> noted;
    tbb::parallel_invoke([&] { computeNormals(mesh); }, [&] { noted = parts.add(mesh, changed, isIn); });
    VCP_TRY(noted);
    return mesh;
}

Result<void> buildBinPages(const LevelPlan& plan, LatticeMesh& mesh, const BinPages& bin) {
    const bool isFinest = bin.pass + 1 == plan.levels();
    const FinestPages pages = isFinest ? plan.pages : FinestPages(plan.gridOf(bin.pass));
    const double margin = isFinest && plan.isExact ? kExactMarginCells : kBinMarginCells;
    const std::vector<LevelBins> levels = binTriangles(mesh, pages, margin, bin.first, bin.end);
    size_t total = 0, done = 0;
    for (const LevelBins& level : levels) total += level.bins.triangles.size();
    uint32_t lattice = pages.deepest();
    for (const auto& [level, bins] : levels) {
        for (; lattice > level; --lattice) halveLattice(mesh);
        const size_t count = bins.triangles.size();
        PageSpool* const surfaces = level > 0 && !bin.surfaces.empty() ? &bin.surfaces[level] : nullptr;
        VCP_TRY(buildPages(bin.settings(int(level)), mesh, bins, bin.pages[level], surfaces, [&](double part) {
            return bin.progress((double(done) + part * double(count)) / double(total));
        }));
        done += count;
    }
    return {};
}

FileHeader headerOf(const LevelPlan& plan, const SoupMeasures& measures, bool hasColour, const PartCounts& parts) {
    FileHeader header = headerOf(measures, plan.frame, plan.errorTarget, hasColour);
    if (plan.hasSlabs) header.flags |= kFlagCovering | kFlagFineSlabs;
    header.flags |= kFlagParts;
    header.parts = parts.parts;
    header.closedParts = parts.closed;
    header.openEdges = parts.openEdges;
    return header;
}

void describe(const FileHeader& header, BuildFigures& figures) {
    figures.triangles = header.triangles;
    figures.degenerateTriangles = header.degenerateTriangles;
    figures.vertices = header.vertices;
    figures.levels = header.levels;
    figures.subvolumes = header.pages;
    figures.leaves = header.leaves;
    figures.hardLeaves = header.hardLeaves;
    figures.cell = header.cell;
    figures.errorTarget = header.errorTarget;
    figures.certifiedErrorMax = header.certifiedErrorMax;
}

uint64_t peakRssBytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return uint64_t(usage.ru_maxrss) * 1024;
}

}  // namespace vcp
