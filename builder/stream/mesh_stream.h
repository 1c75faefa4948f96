// MeshStream: a triangle mesh file read in bounded chunks, whatever its format.
//
// A reader parses and validates; it never holds the mesh. Vertices are numbered in the order of the
// file; triangles name them by that number and may name vertices of any chunk, earlier or later
// (PLY allows faces before vertices, OBJ relative indices). Who consumes the stream joins the two.
//
// Input is hostile: counts are checked against the file's size before anything is allocated, or, where the
// size is not known (pipes, compressed files), only what arrives is allocated; indices are checked against the
// vertex count, positions for NaN and infinity. Polygons are cut into triangle fans, strips into triangles.
// Errors name file, element and byte.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "builder/stream/material.h"
#include "builder/stream/side_file.h"
#include "octree/io/result.h"
#include "octree/surface/vertex_normal.h"

namespace vcp {

/// A bounded piece of a mesh. The caller reuses it to keep its capacity.
///
/// The colour at a point of a triangle is the product of those that exist: the vertex colours, interpolated; the factor
/// of the triangle's material; that material's image at the interpolated texture coordinates.
struct MeshChunk {
    std::vector<glm::dvec3> positions;               ///< the next vertices, in file order, world units
    std::vector<Rgba8> colours;                      ///< as many as positions, or empty when the mesh has none
    std::vector<uint32_t> normals;                   ///< as many as positions (packDirection), or empty
    std::vector<std::array<uint64_t, 3>> triangles;  ///< vertex numbers, 0-based over the whole mesh
    /// One for each triangle, or both are empty when the mesh has no materials. Texture coordinates of the corners: (0,
    /// 0) is the upper left corner of the image, v grows downwards; finite, 0 where the file has none.
    std::vector<std::array<glm::vec2, 3>> uvs;
    std::vector<uint32_t> materials;  ///< indices into MeshStream::materials(), or kNoMaterial
    /// Normals of the corners, one for each triangle, or empty. Those of vertices count where these are kUnknownNormal.
    std::vector<std::array<uint32_t, 3>> cornerNormals;
    /// OBJ with MeshOpenOptions::coordinates: texture coordinates of the corners in the order of the triangles, as the
    /// file has them, v growing upwards. Triangles without are left out, so there may be fewer than triangles.
    std::vector<std::array<glm::dvec2, 3>> coordinates;

    void clear() {
        positions.clear();
        colours.clear();
        normals.clear();
        triangles.clear();
        uvs.clear();
        materials.clear();
        cornerNormals.clear();
        coordinates.clear();
    }
};

/// What the header says, before anything is read.
struct MeshInfo {
    std::string format;                ///< "PLY binary little endian", "OBJ", "STL ASCII", ...
    uint64_t fileBytes = 0;            ///< bytes of the file as it is, compressed or not; 0 for a pipe
    std::optional<uint64_t> vertices;  ///< declared; absent for formats that do not say (OBJ, ASCII STL)
    std::optional<uint64_t> faces;     ///< declared polygons (not triangles)
    bool hasColour = false;            ///< vertex colours; where there is no header (OBJ), the first vertex decides
    bool hasMaterials = false;         ///< chunks carry uvs and materials
};

class MeshStream {
public:
    virtual ~MeshStream() = default;

    [[nodiscard]] virtual const MeshInfo& info() const = 0;

    /// Replaces `chunk` by the next piece (about 64 Ki elements). Returns false at the end of the mesh, with an empty
    /// chunk. After an error the stream cannot be used. Errors: InvalidInput (wrong bytes, truncated, index out of
    /// range, not finite), Io, Limit, Unsupported.
    virtual Result<bool> next(MeshChunk& chunk) = 0;

    /// The bytes of the file consumed so far, before decompression; for progress.
    [[nodiscard]] virtual uint64_t bytesRead() const = 0;

    /// The materials so far; they grow while the mesh is read. What a chunk names is there when next() returns it.
    [[nodiscard]] virtual std::span<const Material> materials() const { return {}; }

    /// What was left out, one line each (a missing material file); complete at the end of the mesh.
    [[nodiscard]] virtual std::span<const std::string> warnings() const { return {}; }

    /// The files beside the mesh that it names, perhaps more than once; complete at the end of the mesh.
    [[nodiscard]] virtual std::span<const SideFile> sideFiles() const { return {}; }
};

/// Which texture coordinates a reader hands on.
enum class Coordinates {
    OfMaterials,  ///< those that an image is looked up with: MeshChunk::uvs
    IfAny,        ///< of an OBJ all of them, with or without materials, in double precision: MeshChunk::coordinates
    Required,     ///< as before, and a face of an OBJ without them is an error
};

struct MeshOpenOptions {
    /// One of meshFormats() (open_mesh.h), without regard to case; empty: recognised by content, then by extension.
    /// Where the content is beyond doubt, it decides; a pipe needs this where the content is not.
    std::string format;
    bool materials = true;  ///< false: MTL files are not looked for, chunks carry no uvs
    /// Whether files that a mesh names are opened also where they lie outside its folder.
    bool allowOutside = false;
    /// The folder for data that must be read more than once (texture coordinates of a large OBJ, a piped GLB), in a
    /// file without a name. Empty: the system's folder for such files.
    std::filesystem::path tempFolder = {};
    Coordinates coordinates = Coordinates::OfMaterials;
    uint64_t mostCoordinates = 15'000'000;      ///< limit on those that an OBJ reader holds for Coordinates
    uint64_t decoderBytes = uint64_t{1} << 30;  ///< limit on the memory that decodes Draco and meshopt
};

}  // namespace vcp
