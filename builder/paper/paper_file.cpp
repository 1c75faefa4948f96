#include "builder/paper/paper_file.h"

#include <bit>
#include <chrono>
#include <cstring>
#include <limits>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "builder/bin_passes.h"
#include "builder/ingest.h"
#include "builder/mesh/open_mesh.h"
#include "builder/paper/paper_subvolumes.h"
#include "octree/io/output_claim.h"
#include "octree/io/output_file.h"
#include "octree/vcp_writer.h"

namespace vcp {

namespace {

constexpr uint64_t kMostPageBytes = uint64_t{1} << 28;

SoupMeasures measuresOf(const IndexedMesh& mesh) {
    SoupMeasures m;
    m.boundsMin = glm::dvec3(std::numeric_limits<double>::infinity());
    m.boundsMax = -m.boundsMin;
    m.triangles = mesh.triangles.size();
    m.vertices = mesh.positions.size();
    for (uint64_t t = 0; t < m.triangles; ++t) {
        const auto [a, b, c] = mesh.corners(t);
        const double twice = glm::length(glm::cross(b - a, c - a));
        if (twice > 0)
            m.area += twice / 2;
        else
            ++m.degenerateTriangles;
        for (const glm::dvec3 p : {a, b, c}) {
            m.boundsMin = glm::min(m.boundsMin, p);
            m.boundsMax = glm::max(m.boundsMax, p);
        }
    }
    return m;
}

FileHeader headerOf(const PaperCaster& octree, const SoupMeasures& mesh) {
    const RootGrid& grid = octree.frame();
    const glm::ivec3 cells = grid.cells();
    FileHeader header;
    header.method = Method::Paper;
    header.cell = grid.cell;
    header.levels = 1;
    header.pages = 1;
    header.log2Cells = uint32_t(std::bit_width(uint32_t(std::max({cells.x, cells.y, cells.z}) - 1)));
    for (int axis = 0; axis < 3; ++axis) {
        header.origin[axis] = grid.low[axis];
        header.boundsMin[axis] = mesh.boundsMin[axis];
        header.boundsMax[axis] = mesh.boundsMax[axis];
    }
    header.triangles = mesh.triangles;
    header.degenerateTriangles = mesh.degenerateTriangles;
    header.vertices = mesh.vertices;
    header.leaves = octree.tree().leaves;
    header.level[0].pages = 1;
    header.paper = parametersOf(octree.options());
    return header;
}

/// Tells the caller how far things are; false means that the caller cancelled.
class Stages {
public:
    explicit Stages(const BuildOptions& options) : options_(options) {}
    Result<void> at(const char* stage, double fraction, uint64_t triangles = 0) const {
        if (!options_.progress || options_.progress({.stage = stage, .fraction = fraction, .triangles = triangles}))
            return {};
        return Error::cancelled();
    }

private:
    const BuildOptions& options_;
};

OutputRules rulesOf(const BuildOptions& options) { return {.overwrite = options.overwrite, .inputs = options.inputs}; }

Result<uint64_t> write(const BuildOptions& options, const PaperFile& file) {
    VCP_TRY_ASSIGN(auto writer, VcpWriter::create(options.output, 1, rulesOf(options)));
    VCP_TRY(writer->append(file.entry, compressPage(file.page.geometryBytes(), {})));
    return writer->commit(file.header);
}

}  // namespace

Result<PageBytes> paperPage(const CornerOctree& tree, PaperPacking packing, uint32_t cellShift) {
    PaperPageHeader header;
    header.rootLevel = uint32_t(tree.frame.rootLevel);
    header.packing = uint32_t(packing);
    header.nodes = uint32_t(tree.nodes.size());
    for (int axis = 0; axis < 3; ++axis) header.roots[axis] = uint32_t(tree.frame.roots[axis]);
    header.slices = uint32_t(tree.slices.size());
    header.cutoff = tree.cutoff;
    header.longest = tree.largest;
    header.leaves = uint32_t(tree.leaves);
    header.emptyNodes = uint32_t(tree.emptyNodes);
    header.cellShift = cellShift;
    const PaperSections sections = paperSections(header);
    if (sections.end > kMostPageBytes)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format(
                "the octree takes {} bytes, and of this method a page holds {} at most; use a larger cell edge, or cut "
                "it into subvolumes",
                sections.end, kMostPageBytes)};
    PageBytes page;
    page.geometry.resize(sections.end / 16);
    auto* out = reinterpret_cast<std::byte*>(page.geometry.data());
    std::memcpy(out, &header, sizeof header);
    std::memcpy(out + sizeof header, tree.nodes.data(), tree.nodes.size() * 4);
    if (!tree.slices.empty()) std::memcpy(out + sections.slices, tree.slices.data(), tree.slices.size() * 16);
    return page;
}

PaperParameters parametersOf(const PaperOptions& options) {
    PaperParameters parameters;
    parameters.band = options.band;
    parameters.mergeThreshold = options.mergeThreshold;
    parameters.growRounds = options.growRounds;
    parameters.packing = uint32_t(options.packing);
    parameters.mergeScheme = uint32_t(options.mergeScheme);
    parameters.safeEmpty = options.safeEmpty ? 1 : 0;
    return parameters;
}

Result<PaperFile> paperFile(const PaperCaster& octree, const IndexedMesh& mesh) {
    VCP_TRY_ASSIGN(auto page, paperPage(octree.tree(), octree.options().packing));
    PageEntry entry;
    entry.pageBytes = uint32_t(page.geometryBytes().size());
    entry.leaves = uint32_t(octree.tree().leaves);
    return PaperFile{headerOf(octree, measuresOf(mesh)), entry, std::move(page)};
}

Result<BuildReport> buildPaperFile(const BuildOptions& options, const PaperOptions& paper) {
    if (paper.subvolumeCells > 0) return buildPaperSubvolumes(options, paper);
    VCP_TRY_ASSIGN(const auto claim, OutputClaim::take(options.output));
    VCP_TRY(checkOutput(options.output, OutputKind::Dataset, rulesOf(options)));
    const auto began = std::chrono::steady_clock::now();
    const Stages stages(options);
    VCP_TRY(stages.at("reading", 0));
    VCP_TRY_ASSIGN(const auto inputs, expandInputs(options.inputs));
    VCP_TRY_ASSIGN(const auto mesh, loadMesh(inputs, {.masks = options.masks}));
    const SoupMeasures measures = measuresOf(mesh);
    if (!(measures.area > 0))
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "its triangles have no area",
                     .file = options.inputs.front().string()};
    VCP_TRY_ASSIGN(const auto frame, chooseFrame(options, measures));
    VCP_TRY(stages.at("sorting", 0.2, measures.triangles));
    const MeshBvh bvh(mesh);
    VCP_TRY(stages.at("octree", 0.3, measures.triangles));
    VCP_TRY_ASSIGN(const auto octree,
                   PaperCaster::create(bvh, paper, {.cell = frame.cell, .threads = options.threads}));
    VCP_TRY(stages.at("writing", 0.9, measures.triangles));
    VCP_TRY_ASSIGN(const auto file, paperFile(octree, mesh));
    VCP_TRY_ASSIGN(const auto bytes, write(options, file));
    BuildReport report;
    report.triangles = measures.triangles;
    report.degenerateTriangles = measures.degenerateTriangles;
    report.vertices = measures.vertices;
    report.fileBytes = bytes;
    report.levels = 1;
    report.subvolumes = 1;
    report.leaves = octree.tree().leaves;
    report.cell = frame.cell;
    report.certifiedErrorMax = std::numeric_limits<double>::quiet_NaN();
    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    report.peakRssBytes = peakRssBytes();
    return report;
}

}  // namespace vcp
