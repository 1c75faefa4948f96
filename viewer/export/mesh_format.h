// The mesh formats that are written, as bytes: a header of a size that is known before its numbers are, then vertices
// and triangles, or triangles by themselves.
//
//   PLY   binary little endian; positions float or double; red, green, blue, alpha; lists of three ints
//   OBJ   text; "v x y z", with colours "v x y z r g b" from 0 to 1
//   STL   binary; single precision, no vertices shared, no colours
//   GLB   glTF 2.0; positions float, from the node's translation; COLOR_0 in light, normalized shorts
//
// Notes are words and texts that say what the file is; each format has a place for them: comments of PLY and OBJ, the
// first 80 bytes of an STL (as much as fits), asset.extras of a GLB.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "octree/io/output_file.h"
#include "viewer/export/surface_stream.h"

namespace vcp {

/// A word and what it stands for; texts of one line.
using Notes = std::vector<std::pair<std::string, std::string>>;

/// How positions are stored.
struct PositionFormat {
    bool isDouble = false;
    glm::dvec3 origin{0};  ///< what positions count from
    double rounding = 0;   ///< how far a point may be moved by that, world units
};

struct MeshFormatOptions {
    bool hasColour = false;
    PositionFormat positions;
    bool hasDistance = false;  ///< PLY only: a property float "distance"
};

class MeshFormat {
public:
    virtual ~MeshFormat() = default;

    /// Whether triangles come by themselves (addFacet), not vertices and their numbers.
    [[nodiscard]] virtual bool takesFacets() const { return false; }
    /// Returns the most vertices, triangles and bytes that the format can count; the message says what is too much.
    [[nodiscard]] virtual std::optional<std::string> problemWith(uint64_t vertices, uint64_t triangles) const = 0;
    /// Returns the header. It has as many bytes whatever the numbers are.
    [[nodiscard]] virtual std::string header(uint64_t vertices, uint64_t triangles, const Notes& notes) const = 0;
    virtual void add(const SurfaceVertex& vertex, std::string& bytes) = 0;
    virtual void add(const std::array<uint64_t, 3>& triangle, std::string& bytes) const = 0;
    virtual void add(const Facet& facet, std::string& bytes) const = 0;
};

/// Chooses how a format stores positions in these bounds so that points a step apart stay apart, where it can.
PositionFormat positionsFor(OutputKind kind, const Box& bounds, double step);

/// `kind`: Ply, Obj, Stl or Glb.
std::unique_ptr<MeshFormat> meshFormat(OutputKind kind, const MeshFormatOptions& options);

}  // namespace vcp
