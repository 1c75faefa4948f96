// The pieces of a remeshed surface for a view, as devices sweep them (mesostructure/shared/remesh_sweep.h). What is
// culled and halved here is what remesher.h culls and halves; what is left is columns of grid points, which know
// nothing of each other.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec4.hpp>

#include "mesostructure/remesh/certified_cells.h"
#include "mesostructure/remesh/remesh_math.h"
#include "mesostructure/remesh/remesher.h"

namespace vcp::meso {

/// Pieces that are swept at once.
struct RemeshBatch {
    std::vector<glm::uvec4> quads;       ///< kRemeshPieceQuads a piece (shared/remesh_layout.h)
    std::vector<uint32_t> firstColumns;  ///< of each piece, and their number
    uint64_t mostVertices = 0;           ///< there are no more; nor more than twice as many triangles

    [[nodiscard]] uint32_t pieces() const { return uint32_t(firstColumns.size() - 1); }
    [[nodiscard]] uint32_t columns() const { return firstColumns.back(); }
};

struct RemeshPieces {
    RemeshMath<float>::RemeshView view{};
    std::vector<RemeshBatch> batches;  ///< the first `used` are in use; the others are kept for their memory
    size_t used = 0;
    RemeshCounts counts;  ///< but what sweeping counts

    [[nodiscard]] std::span<const RemeshBatch> inUse() const { return std::span(batches).first(used); }
};

/// What a batch may have at most, a single piece of 1024 cells' edges at least: 2^21 vertices take 64 MiB.
struct RemeshBatchLimits {
    uint64_t vertices = uint64_t{1} << 21;
    uint64_t pieces = uint64_t{1} << 18;
};

/// Replaces the pieces by those of a view. Errors: as remesh(); Limit where there may be more than `mostVertices`,
/// which is told before they are counted and may be two vertices a column too early.
Result<void> makeRemeshPieces(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshOptions& options,
                              RemeshPieces& pieces, const RemeshBatchLimits& limits = {},
                              uint64_t mostVertices = uint64_t{1} << 26);

/// The same with certified cells, which are chosen for the view.
Result<void> makeRemeshPieces(CertifiedCells& cells, const RemeshCamera& camera, const RemeshOptions& options,
                              RemeshPieces& pieces, const RemeshBatchLimits& limits = {},
                              uint64_t mostVertices = uint64_t{1} << 26);

}  // namespace vcp::meso
