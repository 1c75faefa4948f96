// MeshStream: a triangle mesh file read in bounded chunks, whatever its format.
//
// A reader parses and validates; it never holds the mesh. Vertices are numbered in the order of the
// file; triangles name them by that number and may name vertices of any chunk, earlier or later
// (PLY allows faces before vertices, OBJ relative indices). Who consumes the stream joins the two.
//
// Input is hostile: counts are checked against the file's size before anything is allocated, indices
// against the vertex count, positions for NaN and infinity. Polygons are cut into triangle fans,
// strips into triangles. Errors name file, element and byte.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "octree/result.h"

namespace vcp {

/// Colour of a vertex: 8 bits a channel, R in the lowest byte; alpha 255 where the file has none.
using Rgba8 = uint32_t;

/// A bounded piece of a mesh. Reused by the caller to keep its capacity.
struct MeshChunk {
    std::vector<glm::dvec3> positions;               ///< the next vertices, in file order, world units
    std::vector<Rgba8> colours;                      ///< as many as positions, or empty when the mesh has none
    std::vector<std::array<uint64_t, 3>> triangles;  ///< vertex numbers, 0-based over the whole mesh
    std::vector<std::array<glm::vec2, 3>> uvs;       ///< as many as triangles, or empty
    std::vector<uint32_t> materials;                 ///< as many as triangles, or empty

    void clear() {
        positions.clear();
        colours.clear();
        triangles.clear();
        uvs.clear();
        materials.clear();
    }
};

/// What the header says, before anything is read.
struct MeshInfo {
    std::string format;                    ///< "PLY binary little endian", "OBJ", "STL ASCII", ...
    uint64_t fileBytes = 0;
    std::optional<uint64_t> vertices;      ///< declared; absent for formats that do not say (OBJ, ASCII STL)
    std::optional<uint64_t> faces;         ///< declared polygons (not triangles)
    bool hasColour = false;                ///< for OBJ and other formats without a header: of the first vertex
};

class MeshStream {
public:
    virtual ~MeshStream() = default;

    [[nodiscard]] virtual const MeshInfo& info() const = 0;

    /// Replaces `chunk` by the next piece (about 64 Ki elements). False at the end of the mesh, with an
    /// empty chunk. After an error the stream is spent. Errors: InvalidInput (wrong bytes, truncated,
    /// index out of range, not finite), Io, Limit, Unsupported.
    virtual Result<bool> next(MeshChunk& chunk) = 0;

    /// Bytes of the file consumed so far; for progress.
    [[nodiscard]] virtual uint64_t bytesRead() const = 0;
};

/// Opens a mesh by its content, then by its extension: PLY (ASCII, binary of either byte order), OBJ,
/// STL (ASCII, binary). Errors: Io (missing, unreadable, a folder), InvalidInput (empty, broken header),
/// Unsupported (unknown format; the message lists what is known).
Result<std::unique_ptr<MeshStream>> openMesh(const std::filesystem::path& path);

}  // namespace vcp
