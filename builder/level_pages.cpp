#include "builder/level_pages.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include "builder/page/exact_tree.h"
#include "builder/slab/slab_tree.h"

namespace vcp {

namespace {

/// Builds a page's bytes; what they were made of is freed before they are coded.
EncodedPage buildGeometry(const LevelSettings& settings, const LatticeMesh& mesh, uint64_t code,
                          std::span<const uint32_t> triangles) {
    if (settings.exact) {
        PageTree tree = buildExactTree(mesh, triangles, mortonDecode(code), settings.grid.log2Cells);
        return encodePage(tree, mesh);
    }
    PageGeometry geometry(mesh, triangles, mortonDecode(code), settings.grid.log2Cells);
    const double tolerance = settings.finest ? settings.tolerance - geometry.stray() : settings.tolerance;
    PageTree tree = buildPageTree(geometry, tolerance);
    return encodePage(tree, mesh);
}

/// Builds a page as it is stored; all else that this takes is freed at the end.
Result<BuiltPage> storedPage(const LevelSettings& settings, const LatticeMesh& mesh, uint64_t code,
                             std::span<const uint32_t> triangles) {
    const EncodedPage encoded = buildGeometry(settings, mesh, code, triangles);
    auto page = builtPage(settings, code, encoded);
    // Clusters of coarser levels belong to no part.
    if (page && !settings.finest) page->entry.parts = 0;
    if (page) return page;
    return Error{.code = ErrorCode::Limit,
                 .message = fmt::format(
                     "a subvolume of {} triangles and {} leaves is more than a page holds; use a smaller cell edge",
                     triangles.size(), encoded.leaves)};
}

Result<BuiltPage> buildPage(const LevelSettings& settings, const LatticeMesh& mesh, uint64_t code,
                            std::span<const uint32_t> triangles, bool withSurface, size_t mostPieces) {
    VCP_TRY_ASSIGN(auto page, storedPage(settings, mesh, code, triangles));
    if (withSurface)
        page.surface = surfaceToHandUp(
            settings, surfaceOf(mesh, triangles, mortonDecode(code), settings.grid.log2Cells, mostPieces));
    return page;
}

uint64_t bytesOf(const LatticeMesh& mesh) {
    return mesh.positions.size() * (sizeof(glm::i32vec3) + 2 * sizeof(uint32_t)) +
           mesh.triangles.size() * (sizeof mesh.triangles[0] + sizeof(float)) +
           mesh.textures.size() * sizeof mesh.textures[0] + mesh.cornerNormals.size() * sizeof mesh.cornerNormals[0];
}

/// Measures of triangles, each counted by itself; in cells.
struct Extents {
    double area = 0, perimeter = 0;
};

/// Returns bounds for the parts of triangles that lie in a page. No section of a cube has a larger area, or a longer
/// perimeter, than the rectangle through the diagonals of two faces.
Extents extentsOf(const LatticeMesh& mesh, std::span<const uint32_t> triangles, double pageEdge) {
    const Extents most{std::sqrt(2.0) * pageEdge * pageEdge, 2 * (1 + std::sqrt(2.0)) * pageEdge};
    Extents sum;
    for (const uint32_t k : triangles) {
        glm::dvec3 p[3];
        for (int i = 0; i < 3; ++i) p[i] = glm::dvec3(mesh.positions[mesh.triangles[k][i]]) / double(kLatticePerCell);
        const double perimeter = glm::distance(p[0], p[1]) + glm::distance(p[1], p[2]) + glm::distance(p[2], p[0]);
        sum.area += std::min(glm::length(glm::cross(p[1] - p[0], p[2] - p[0])) / 2, most.area);
        sum.perimeter += std::min(perimeter, most.perimeter);
    }
    return sum;
}

/// Returns how many vertices a page of these triangles may have: where they have images or normals of their own, each
/// of its own places and normals makes one.
uint64_t mostVertices(const LatticeMesh& mesh, std::span<const uint32_t> triangles) {
    if (!mesh.textures.empty() || !mesh.cornerNormals.empty() || triangles.empty()) return 3 * triangles.size();
    uint32_t least = UINT32_MAX, most = 0;
    for (const uint32_t k : triangles)
        for (const uint32_t v : mesh.triangles[k]) {
            least = std::min(least, v);
            most = std::max(most, v);
        }
    std::vector<bool> seen(size_t{most} - least + 1);
    for (const uint32_t k : triangles)
        for (const uint32_t v : mesh.triangles[k]) seen[v - least] = true;
    return uint64_t(std::ranges::count(seen, true));
}

/// What a page takes while it is built: its bytes first, then its surface, which is cut in parts of so many pieces.
struct PageWork {
    uint64_t bytes = 0;
    size_t pieces = kMostPieces;
};

/// Foretells the work of a page of these triangles.
PageWork foretoldWork(const LevelSettings& settings, const LatticeMesh& mesh, std::span<const uint32_t> triangles,
                      bool withSurface) {
    const uint64_t count = triangles.size();
    const auto records = uint64_t(mostRepetitionOf(count) * double(count));
    const uint64_t exact = settings.exact ? exactPageWorkBytes(count, mostVertices(mesh, triangles), records) : 0;
    if (settings.exact && !withSurface) return {exact};
    const double margin = settings.exact ? kExactMarginCells : kBinMarginCells;
    const Extents extents = extentsOf(mesh, triangles, settings.grid.edgeCells() + 2 * margin);
    if (settings.exact) return {std::max(exact, surfaceWorkBytes(count, extents.area, extents.perimeter))};
    // The cells that a flat shape touches: its area over three axes, its rim, and those of its corners.
    return {pageWorkBytes(count, uint64_t(1.75 * extents.area + 1.5 * extents.perimeter + 4 * double(count)))};
}

/// Counts the work of a page of the finest level, for which what is foretold is too much: its leaves may name triangles
/// less often than they can, three to four times in scans, and its surface may be cut in smaller parts.
PageWork countedWork(const LevelSettings& settings, const LatticeMesh& mesh, uint64_t code,
                     std::span<const uint32_t> triangles, bool withSurface) {
    constexpr size_t kFewPieces = kMostPieces / 8;
    const glm::u32vec3 page = mortonDecode(code);
    const uint32_t log2Cells = settings.grid.log2Cells;
    const uint64_t records = buildExactTree(mesh, triangles, page, log2Cells).records();
    const uint64_t exact = exactPageWorkBytes(triangles.size(), mostVertices(mesh, triangles), records);
    if (!withSurface) return {exact};
    const uint64_t halves = halvesTouched(mesh, triangles, page, log2Cells);
    const Extents extents = extentsOf(mesh, triangles, settings.grid.edgeCells() + 2 * kExactMarginCells);
    const uint64_t surface = surfaceWorkBytes(triangles.size(), extents.area, extents.perimeter, halves, kFewPieces);
    return {std::max(exact, surface), kFewPieces};
}

/// Returns the work of all pages, none of which is to take more than `most` bytes if that can be.
std::vector<PageWork> workOfPages(const LevelSettings& settings, const LatticeMesh& mesh, const TriangleBins& bins,
                                  bool withSurface, uint64_t most) {
    std::vector<PageWork> work(bins.pages.size());
    tbb::parallel_for(size_t{0}, work.size(),
                      [&](size_t i) { work[i] = foretoldWork(settings, mesh, bins.of(i), withSurface); });
    // One after the other, and none of very many triangles: counting takes memory, too.
    constexpr size_t kMostCounted = 1 << 18;
    for (size_t i = 0; settings.exact && i < work.size(); ++i)
        if (work[i].bytes > most && bins.of(i).size() <= kMostCounted)
            work[i] = countedWork(settings, mesh, bins.pages[i], bins.of(i), withSurface);
    return work;
}

}  // namespace

void LevelSettings::buildBeside(TempSpace& space, uint64_t tempBytes) {
    codesSurface = space.diskBytes() > 0 || !space.isAmple(0);
    roomBytes = tempBytes;
    makeRoom = [&space] { return space.spill(); };
}

Result<BuiltPage> builtPage(const LevelSettings& settings, uint64_t code, const EncodedPage& encoded) {
    BuiltPage page;
    page.entry.morton = code;
    page.entry.level = uint8_t(settings.grid.level);
    page.entry.leaves = encoded.leaves;
    page.entry.slabLeaves = encoded.slabLeaves & 0xffffffu;
    page.entry.hardLeaves = encoded.hardLeaves;
    page.entry.parts = encoded.parts;
    page.entry.certifiedError =
        std::nextafter(float(encoded.certifiedError * settings.cell), std::numeric_limits<float>::infinity());
    if (encoded.leaves > 0) {
        VCP_TRY_ASSIGN(page.stored, compressPage(encoded.draft, encoded.colour));
    }
    return page;
}

StoredPage surfaceToHandUp(const LevelSettings& settings, PageSurface surface) {
    std::vector<CellSlab> slabs = slabsOf(surface, settings.withColour);
    surface.quarters = {};
    return storedSurface({std::move(surface.halves), std::move(slabs)}, settings.codesSurface);
}

Result<void> buildPages(const LevelSettings& settings, const LatticeMesh& mesh, const TriangleBins& bins,
                        PageSpool& spool, PageSpool* surfaces, const std::function<bool(double)>& progress) {
    const uint64_t held = bytesOf(mesh) + bins.triangles.size() * sizeof(uint32_t);
    const auto left = [&](uint64_t bytes) { return bytes - std::min(held, bytes); };
    const std::vector<PageWork> work = workOfPages(settings, mesh, bins, surfaces != nullptr, left(settings.pageBytes));
    std::vector<uint64_t> bytes(work.size());
    std::ranges::transform(work, bytes.begin(), &PageWork::bytes);
    return buildInOrder(
        {.work = bytes,
         .pageBytes = left(settings.pageBytes),
         .roomBytes = left(settings.pageBytes + settings.roomBytes) - left(settings.pageBytes),
         .makeRoom = settings.makeRoom,
         .build =
             [&](size_t i) {
                 return buildPage(settings, mesh, bins.pages[i], bins.of(i), surfaces != nullptr, work[i].pieces);
             },
         .description = [&](size_t i) { return fmt::format("a subvolume holds {} triangles", bins.of(i).size()); },
         .pages = spool,
         .surfaces = surfaces,
         .progress = progress});
}

}  // namespace vcp
