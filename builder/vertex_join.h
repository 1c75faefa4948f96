// Joins indexed triangles with their vertices, whatever the memory and the order in the file.
//
// The first vertices stay in memory, as many as fit; the rest go to temporary files, in chunks of the same number. A
// triangle whose corners are in memory is done at once. Any other takes along the corners that are there and waits for
// the chunk of its lowest missing corner. After the last vertex the chunks are loaded one after the other; each
// resolves the triangles that wait for it and sends the unfinished ones on to a higher chunk. So every vertex is
// written and read at most once, every triangle at most three times.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <xxhash.h>

#include "builder/lattice/soup.h"
#include "builder/spill/record_bins.h"
#include "builder/stream/mesh_stream.h"

namespace vcp {

/// The join of one input file. One thread.
class VertexJoin {
public:
    using Emit = std::function<Result<void>(const WorldTriangle<double>&)>;

    /// `vertexBytes`: memory for vertices, with their colours and normals.
    VertexJoin(TempSpace& space, uint64_t vertexBytes, Emit emit);

    /// Takes a chunk of the stream, in order. `materialBase`: number of materials of the inputs before this one.
    Result<void> add(const MeshChunk& chunk, uint32_t materialBase);
    /// Finishes after the last chunk. `file` is for errors. Errors: InvalidInput (a triangle names a vertex that never
    /// came), Io.
    Result<void> finish(const std::string& file);

    [[nodiscard]] uint64_t vertices() const { return vertices_; }

private:
    struct Vertex {
        glm::dvec3 position;
        uint32_t colour;
        uint32_t normal;
    };
    struct Waiting {
        WorldTriangle<double> triangle;
        uint64_t vertex[3];  ///< kDone: resolved
        uint64_t reserved = 0;
    };
    static constexpr uint64_t kDone = ~uint64_t{0};
    using ChunkHash = std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)>;

    Result<void> takeVertices(const MeshChunk& chunk);
    Result<void> append(std::span<const Vertex> vertices);
    Result<void> load(uint64_t chunk);
    Result<void> resolve(Waiting& waiting);
    Result<void> process(uint64_t chunk);

    TempSpace& space_;
    Emit emit_;
    uint64_t chunkVertices_;
    std::vector<Vertex> resident_;
    uint64_t residentFirst_ = 0;
    uint64_t vertices_ = 0;
    bool hasColour_ = false;
    TempFile later_;                ///< the vertices from chunk 1 on
    std::vector<uint64_t> hashes_;  ///< hashes of the chunks that are whole, then of the last one
    ChunkHash hash_;                ///< hash of the chunk that is being appended
    RecordBins<Waiting> waiting_;
};

}  // namespace vcp
