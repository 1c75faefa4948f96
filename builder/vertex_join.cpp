#include "builder/vertex_join.h"

#include <algorithm>

#include <fmt/format.h>

namespace vcp {

namespace {

// A vertex number beyond this is broken; numbers below it make a bounded number of bins.
constexpr uint64_t kMaxVertices = uint64_t{1} << 40;

constexpr uint64_t kMinChunkVertices = uint64_t{1} << 16;
constexpr size_t kExpectedChunks = 16;
constexpr uint64_t kWaitingBufferBytes = 4 << 20;

}  // namespace

VertexJoin::VertexJoin(TempSpace& space, uint64_t vertexBytes, Emit emit)
    : space_(space),
      emit_(std::move(emit)),
      chunkVertices_(std::max(vertexBytes / sizeof(Vertex), kMinChunkVertices)),
      later_(space, "vertices.spill"),
      hash_(XXH3_createState(), XXH3_freeState),
      waiting_(space, "waiting", kExpectedChunks, kWaitingBufferBytes) {}

Result<void> VertexJoin::takeVertices(const MeshChunk& chunk) {
    std::vector<Vertex> rest;
    for (size_t i = 0; i < chunk.positions.size(); ++i) {
        const Vertex vertex{chunk.positions[i], chunk.colours.empty() ? kWhite : chunk.colours[i],
                            chunk.normals.empty() ? kUnknownNormal : chunk.normals[i]};
        if (resident_.size() < chunkVertices_) {
            // Doubling would exceed the memory by half.
            if (resident_.size() == resident_.capacity())
                resident_.reserve(
                    std::min<uint64_t>(chunkVertices_, std::max<size_t>(resident_.capacity() * 3 / 2, 1 << 16)));
            resident_.push_back(vertex);
        } else {
            rest.push_back(vertex);
        }
    }
    vertices_ += chunk.positions.size();
    return append(rest);
}

/// Appends vertices to the chunks on the disk, each with a hash made before it went there.
Result<void> VertexJoin::append(std::span<const Vertex> vertices) {
    while (!vertices.empty()) {
        const uint64_t inChunk = later_.size() / sizeof(Vertex) % chunkVertices_;
        if (inChunk == 0) XXH3_64bits_reset(hash_.get());
        const auto part = std::as_bytes(vertices.first(std::min<uint64_t>(vertices.size(), chunkVertices_ - inChunk)));
        XXH3_64bits_update(hash_.get(), part.data(), part.size());
        VCP_TRY(later_.append(part));
        vertices = vertices.subspan(part.size() / sizeof(Vertex));
        if (later_.size() / sizeof(Vertex) % chunkVertices_ == 0) hashes_.push_back(XXH3_64bits_digest(hash_.get()));
    }
    return {};
}

/// Loads a chunk after the first, in place of the one in memory.
Result<void> VertexJoin::load(uint64_t chunk) {
    residentFirst_ = chunk * chunkVertices_;
    resident_.resize(std::min(chunkVertices_, vertices_ - residentFirst_));
    const uint64_t offset = (residentFirst_ - chunkVertices_) * sizeof(Vertex);
    VCP_TRY(later_.read(offset, std::as_writable_bytes(std::span(resident_))));
    if (XXH3_64bits(resident_.data(), resident_.size() * sizeof(Vertex)) != hashes_[chunk - 1])
        return damagedTempFile(later_.path(), offset);
    return {};
}

Result<void> VertexJoin::add(const MeshChunk& chunk, uint32_t materialBase) {
    VCP_TRY(takeVertices(chunk));
    for (size_t k = 0; k < chunk.triangles.size(); ++k) {
        Waiting w{};
        for (int i = 0; i < 3; ++i) w.vertex[i] = chunk.triangles[k][i];
        if (std::max({w.vertex[0], w.vertex[1], w.vertex[2]}) >= kMaxVertices)
            return Error{.code = ErrorCode::InvalidInput,
                         .message = "a triangle names a vertex that the file does not have"};
        if (!chunk.cornerNormals.empty()) std::copy_n(chunk.cornerNormals[k].begin(), 3, w.triangle.normal);
        if (!chunk.uvs.empty())
            for (int i = 0; i < 3; ++i) w.triangle.uv[i] = chunk.uvs[k][i];
        if (!chunk.materials.empty() && chunk.materials[k] != kNoMaterial)
            w.triangle.material = materialBase + chunk.materials[k] + 1;
        VCP_TRY(resolve(w));
    }
    return {};
}

Result<void> VertexJoin::resolve(Waiting& w) {
    uint64_t lowest = kDone;
    for (int i = 0; i < 3; ++i) {
        if (w.vertex[i] == kDone) continue;
        const uint64_t at = w.vertex[i] - residentFirst_;
        if (w.vertex[i] >= residentFirst_ && at < resident_.size()) {
            w.triangle.corner[i] = resident_[at].position;
            w.triangle.colour[i] = resident_[at].colour;
            if (w.triangle.normal[i] == kUnknownNormal) w.triangle.normal[i] = resident_[at].normal;
            w.vertex[i] = kDone;
        } else {
            lowest = std::min(lowest, w.vertex[i]);
        }
    }
    if (lowest == kDone) return emit_(w.triangle);
    return waiting_.append(lowest / chunkVertices_, std::span(&w, 1));
}

Result<void> VertexJoin::process(uint64_t chunk) {
    VCP_TRY_ASSIGN(const auto blocks, waiting_.blocks(chunk));
    for (const RawBins::Block& block : blocks) {
        VCP_TRY_ASSIGN(auto records, waiting_.read(block));
        for (Waiting& w : records) VCP_TRY(resolve(w));
    }
    return {};
}

Result<void> VertexJoin::finish(const std::string& file) {
    const uint64_t chunks = (vertices_ + chunkVertices_ - 1) / chunkVertices_;
    const auto missing = [&] {
        return Error{
            .code = ErrorCode::InvalidInput,
            .message = fmt::format("a triangle names a vertex that the file does not have; it has {}", vertices_),
            .file = file};
    };
    const auto anyBeyond = [&] {
        for (uint64_t chunk = chunks; chunk < waiting_.raw().bins(); ++chunk)
            if (waiting_.count(chunk) > 0) return true;
        return false;
    };
    VCP_TRY(waiting_.raw().flush());
    if (anyBeyond()) return missing();
    if (later_.size() / sizeof(Vertex) % chunkVertices_ != 0) hashes_.push_back(XXH3_64bits_digest(hash_.get()));
    for (uint64_t chunk = 0; chunk < chunks; ++chunk) {
        if (chunk > 0) VCP_TRY(load(chunk));
        const uint64_t before = waiting_.count(chunk);
        VCP_TRY(process(chunk));
        VCP_TRY(waiting_.raw().flush());
        // A triangle that waits for a vertex of this chunk that is not there was sent back to it.
        if (waiting_.count(chunk) > before) return missing();
    }
    // Vertices that exist were taken from their chunks; the rest names chunks that never came.
    if (anyBeyond()) return missing();
    later_.remove();
    waiting_.raw().remove();
    std::vector<Vertex>().swap(resident_);
    return {};
}

}  // namespace vcp
