#include "mesostructure/remesh/remesher.h"

#include <cmath>

#include <fmt/format.h>

#include "mesostructure/remesh/piece_maker.h"

namespace vcp::meso {

Result<void> checkRemeshing(const RemeshOptions& options) {
    if (!(options.cell > 0) || !std::isfinite(options.cell))
        return Error{.code = ErrorCode::Usage, .message = "cells of a remeshed surface must be above 0 pixels"};
    if (options.mostCells < 2 || options.mostCells > 1024)
        return Error{.code = ErrorCode::Usage, .message = "an edge has from 2 to 1024 cells before it is halved"};
    if (!(options.errorPixels >= 0) || !std::isfinite(options.errorPixels))
        return Error{.code = ErrorCode::Usage, .message = "a remeshed surface may err by 0 pixels or more"};
    return {};
}

Error tooManyVertices(uint64_t most) {
    return {.code = ErrorCode::Limit,
            .message = fmt::format("remeshing makes more than {} vertices: larger cells, or errors, make fewer", most)};
}

template <class Real>
Result<void> remesh(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshOptions& options,
                    RemeshMesh<Real>& mesh, uint64_t mostVertices) {
    VCP_TRY(checkRemeshing(options));
    PieceSweep<Real> sweep(surface, options, remeshViewOf<Real>(camera, options), mesh);
    PieceMaker<Real> maker(surface, camera, options, mesh.counts);
    return maker.run([&](const RemeshPiece<Real>& piece) -> Result<void> {
        sweep.sweep(piece);
        if (mesh.vertices.size() > mostVertices) return tooManyVertices(mostVertices);
        return {};
    });
}

template Result<void> remesh(const RemeshSurface&, const RemeshCamera&, const RemeshOptions&, RemeshMesh<float>&,
                             uint64_t);
template Result<void> remesh(const RemeshSurface&, const RemeshCamera&, const RemeshOptions&, RemeshMesh<double>&,
                             uint64_t);

}  // namespace vcp::meso
