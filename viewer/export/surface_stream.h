// Streams the surface of a dataset, page by page: as a mesh with shared vertices, or as triangles by themselves.
//
// A mesh takes two passes over the pages: vertices, then triangles. A page numbers the vertices that belong to it from
// its first number on, in the order of its points, and its loose ones behind them. A triangle across pages needs the
// numbers of vertices that belong elsewhere: each home keeps a table of those that it shares. Where the tables exceed
// kTableBytes, the ones used longest ago go, and the page is read again when it is asked.
//
// Memory, whatever the size of the file: the directory, 8 bytes a page, kTableBytes, and some 200 bytes for each
// triangle of the pages at work: kBatchBytes of pages as they lie in memory, or one page that is larger. Pages are read
// and made into triangles on all threads; what comes out does not depend on their number.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>

#include "octree/io/byte_reader.h"
#include "octree/io/result.h"
#include "viewer/export/surface_cut.h"

namespace vcp {

inline constexpr uint64_t kTableBytes = 64 << 20;
inline constexpr uint64_t kBatchBytes = 8 << 20;

struct SurfaceVertex {
    glm::dvec3 at{0};              ///< world
    uint32_t colour = 0xffffffff;  ///< RGBA8 as stored; white where the dataset has none
    float distance = 0;            ///< from another surface, world units, where that was measured
};

struct StreamOptions {
    bool colour = true;    ///< colours are read where the dataset has them
    unsigned threads = 0;  ///< 0: one a processor
    uint64_t tableBytes = kTableBytes;
    /// Called from one thread with the fraction done; false cancels. May be empty.
    std::function<bool(double)> progress = {};
};

struct SurfaceTotals {
    uint64_t vertices = 0, triangles = 0;
    double certified = 0;  ///< bound on the distance between what was streamed and the mesh, both ways, world units
    Box bounds = Box::nothing();
};

/// Takes the mesh: first all vertices, then all triangles. One thread.
class MeshSink {
public:
    virtual ~MeshSink() = default;
    virtual Result<void> addVertices(std::span<const SurfaceVertex> vertices) = 0;
    /// Called once, between the two.
    virtual Result<void> endVertices(const SurfaceTotals& totals) { return static_cast<void>(totals), Result<void>(); }
    virtual Result<void> addTriangles(std::span<const std::array<uint64_t, 3>> triangles) = 0;
};

/// Streams the surface as a mesh: a vertex for each place where whole triangles meet, so what is closed stays closed.
/// Errors: those of readPage and of the sink; InvalidInput, where pages disagree about a triangle; Cancelled.
Result<SurfaceTotals> streamMesh(const ByteReader& reader, const SurfaceCut& cut, const StreamOptions& options,
                                 MeshSink& sink);

using Facet = std::array<glm::dvec3, 3>;
using TakeFacets = std::function<Result<void>(std::span<const Facet>)>;

/// Streams triangles in one pass. `once`: each; else a whole triangle comes from every page of the cut that has it,
/// also where its own page is not of the cut (a plane's). Errors: as streamMesh.
Result<SurfaceTotals> streamFacets(const ByteReader& reader, const SurfaceCut& cut, const StreamOptions& options,
                                   bool once, const TakeFacets& take);

}  // namespace vcp
