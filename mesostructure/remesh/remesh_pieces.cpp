#include "mesostructure/remesh/remesh_pieces.h"

#include <bit>

#include "mesostructure/remesh/piece_maker.h"

namespace vcp::meso {

namespace {

using Math = RemeshMath<float>;

uint32_t word(float x) { return std::bit_cast<uint32_t>(x); }
uint32_t word(int x) { return std::bit_cast<uint32_t>(x); }
glm::uvec4 quad(const glm::vec3& v, float w) { return {word(v.x), word(v.y), word(v.z), word(w)}; }
glm::uvec4 quad(const glm::vec2& a, const glm::vec2& b) { return {word(a.x), word(a.y), word(b.x), word(b.y)}; }

void addPiece(std::vector<glm::uvec4>& quads, const RemeshPiece<float>& piece) {
    const auto& c = piece.corners;
    for (const auto& corner : c) quads.push_back(quad(corner.position, corner.weight));
    for (const auto& corner : c) quads.push_back(quad(corner.direction, corner.density));
    for (const auto& corner : c)
        quads.emplace_back(word(corner.grid.x), word(corner.grid.y), word(corner.grid.z), word(corner.height));
    quads.push_back(quad(c[0].uv, c[1].uv));
    uint32_t seams = piece.triangle << 3;
    for (uint32_t k = 0; k < 3; ++k) seams |= piece.seams[k].is ? 1u << k : 0u;
    uint32_t parts = 0;
    for (int k = 0; k < 3; ++k) parts |= uint32_t(piece.parts[k]) << (10 * k);
    quads.emplace_back(word(c[2].uv.x), word(c[2].uv.y), seams, parts);
    for (const auto& seam : piece.seams) quads.push_back(quad(seam.start, seam.end));
    quads.emplace_back(piece.levels);
}

struct PieceSize {
    uint32_t columns = 1;
    uint64_t mostVertices = 3;
};

/// A column has at most as many grid points as it is long, and its ends are whole numbers at corners: all of a piece's
/// are at most half the product of its edges.
PieceSize sizeOf(const RemeshPiece<float>& piece) {
    const auto& c = piece.corners;
    const Math::RemeshPlan plan = Math::remeshPlan(c[0].grid, c[1].grid, c[2].grid);
    if (plan.isWhole != 0) return {};
    PieceSize size;
    size.columns = uint32_t(c[size_t(plan.second)].grid[plan.sweep] - c[size_t(plan.first)].grid[plan.sweep]);
    size.mostVertices = 1 + uint64_t(Math::remeshArea(c[size_t(plan.first)].grid, c[size_t(plan.second)].grid,
                                                      c[size_t(plan.apex)].grid, plan.sweep, plan.side)) /
                                2;
    for (size_t k = 0; k < 3; ++k)
        size.mostVertices += uint64_t(Math::remeshEdge(c[k].grid, c[(k + 1) % 3].grid).cells);
    return size;
}

RemeshBatch& nextBatch(RemeshPieces& pieces) {
    if (pieces.used == pieces.batches.size()) pieces.batches.emplace_back();
    RemeshBatch& batch = pieces.batches[pieces.used++];
    batch.quads.clear(), batch.firstColumns.assign(1, 0), batch.mostVertices = 0;
    return batch;
}

Result<void> addPieces(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshOptions& options,
                       const CertifiedCells* cells, RemeshPieces& pieces, const RemeshBatchLimits& limits,
                       uint64_t mostVertices) {
    pieces.view = remeshViewOf<float>(camera, options);
    pieces.used = 0, pieces.counts = {};
    RemeshBatch* batch = nullptr;
    uint64_t all = 0;
    PieceMaker<float> maker(surface, camera, options, pieces.counts, cells);
    return maker.run([&](const RemeshPiece<float>& piece) -> Result<void> {
        const PieceSize size = sizeOf(piece);
        ++pieces.counts.pieces;
        all += size.mostVertices;
        if (all > mostVertices) return tooManyVertices(mostVertices);
        if (batch == nullptr || batch->mostVertices + size.mostVertices > limits.vertices ||
            batch->pieces() >= limits.pieces)
            batch = &nextBatch(pieces);
        addPiece(batch->quads, piece);
        batch->firstColumns.push_back(batch->columns() + size.columns);
        batch->mostVertices += size.mostVertices;
        return {};
    });
}

}  // namespace

Result<void> makeRemeshPieces(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshOptions& options,
                              RemeshPieces& pieces, const RemeshBatchLimits& limits, uint64_t mostVertices) {
    VCP_TRY(checkRemeshing(options));
    return addPieces(surface, camera, options, nullptr, pieces, limits, mostVertices);
}

Result<void> makeRemeshPieces(CertifiedCells& cells, const RemeshCamera& camera, const RemeshOptions& options,
                              RemeshPieces& pieces, const RemeshBatchLimits& limits, uint64_t mostVertices) {
    VCP_TRY(checkRemeshing(options));
    RemeshOptions ofMap = options;
    ofMap.access = HeightAccess::Map;
    RemeshCounts counts;
    VCP_TRY(cells.choose(camera, options, counts));
    VCP_TRY(addPieces(cells.patches(), camera, ofMap, &cells, pieces, limits, mostVertices));
    pieces.counts.boundPixels = counts.boundPixels, pieces.counts.uncertified = counts.uncertified;
    return {};
}

}  // namespace vcp::meso
