// The rows of one PLY element, read in bounded pieces: vertices with optional colour, polygons, triangle
// strips, or rows to skip. One reader for the binary encodings, one for ASCII, with the same rules:
//
// - A row may be larger than the window (one strip may hold a whole mesh): both readers stop and resume at
//   any value, so memory is bounded by the window and the chunk.
// - List lengths are checked against the bytes that are left before anything is read or allocated.
// - An ASCII row is a line; values beyond the declared ones are ignored.
// - Polygons become fans about their first vertex; those with fewer than three vertices are skipped.
// - In strips -1 (or, for uint, all ones) starts a new strip. Every second triangle is turned over; triangles
//   that name a vertex twice only steer the strip and are skipped.
// - Normals: directions of any length; those of length 0 or that are not finite are unknown.
// - Colours: 8 bits as they are, ushort >> 8, float and double 0..1, other integers clamped to 0..255.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "builder/mesh/ply_header.h"
#include "builder/stream/chunk_room.h"

namespace vcp {

enum class PlyRole : uint8_t { Skip, Vertices, Faces, Strips };

/// Which columns of an element matter.
struct PlyPlan {
    const PlyElement* element = nullptr;
    PlyRole role = PlyRole::Skip;
    uint64_t vertexCount = 0;                            ///< vertices of the mesh; bounds the indices
    size_t indexColumn = 0;                              ///< Faces, Strips: the list of vertex numbers
    std::array<size_t, 3> positionColumns{};             ///< Vertices: x, y, z
    std::array<std::optional<size_t>, 4> colourColumns;  ///< Vertices: red, green, blue, alpha
    bool hasColour = false;
    std::optional<std::array<size_t, 3>> normalColumns;  ///< Vertices: nx, ny, nz
};

/// Cuts the vertex numbers of one list after another into triangles.
class PolygonCutter {
public:
    PolygonCutter(PlyRole role, uint64_t vertexCount) : role_(role), vertexCount_(vertexCount) {}

    void beginList() { seen_ = 0; }

    /// Takes the next number of the list. Returns false when it names no vertex.
    bool add(std::optional<int64_t> number, std::vector<std::array<uint64_t, 3>>& triangles);

private:
    PlyRole role_;
    uint64_t vertexCount_;
    uint64_t seen_ = 0;   // numbers since the list, or the strip in it, began
    uint64_t first_ = 0;  // first vertex of the fan; in a strip the last but one
    uint64_t last_ = 0;
};

/// Returns a number as a vertex or list count; nothing when it is not whole.
std::optional<int64_t> wholeNumber(double value);

/// Returns a colour value of a property of this type as 8 bits.
uint8_t colourChannel(PlyType type, double value);

class PlyRows {
public:
    PlyRows(ByteSource& source, const PlyPlan& plan)
        : source_(source), plan_(plan), cutter_(plan.role, plan.vertexCount) {}
    virtual ~PlyRows() = default;

    [[nodiscard]] bool done() const { return row_ == plan_.element->count; }

    /// Appends what the next window holds, until the chunk is full at most.
    virtual Result<void> readSome(MeshChunk& chunk) = 0;

protected:
    [[nodiscard]] Error wrong(std::optional<uint64_t> byte, std::string message) const;
    [[nodiscard]] Error truncated() const;
    [[nodiscard]] Error notFinite(uint64_t byte) const;
    [[nodiscard]] Error badIndex(std::optional<int64_t> index, uint64_t byte) const;
    [[nodiscard]] Error badLength(std::optional<int64_t> length, uint64_t byte) const;

    ByteSource& source_;
    PlyPlan plan_;
    PolygonCutter cutter_;
    uint64_t row_ = 0;
};

/// Makes a reader. `source` stands at the first row and must outlive it. Errors: InvalidInput with row and byte, Io.
std::unique_ptr<PlyRows> makePlyBinaryRows(ByteSource& source, const PlyPlan& plan, PlyEncoding encoding);
std::unique_ptr<PlyRows> makePlyAsciiRows(ByteSource& source, const PlyPlan& plan);

}  // namespace vcp
