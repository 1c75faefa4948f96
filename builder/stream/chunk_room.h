// How much a reader puts into a MeshChunk before it hands the chunk over.
#pragma once

#include <cstddef>

#include "builder/stream/mesh_stream.h"

namespace vcp {

constexpr size_t kChunkElements = 64 * 1024;

inline bool hasRoom(const MeshChunk& chunk) {
    return chunk.positions.size() < kChunkElements && chunk.triangles.size() < kChunkElements;
}

inline bool isEmpty(const MeshChunk& chunk) { return chunk.positions.empty() && chunk.triangles.empty(); }

}  // namespace vcp
