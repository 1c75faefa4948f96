// Remeshes displaced surfaces for a view (Gumhold and Huettner 1999, 3): triangles of a cell's size on the screen, and
// as long in depth, from the base triangles that are seen.
//
// A base triangle is culled where all of it, and all that may stand on it, is outside the view. What is left is halved
// along its longest edge until none is longer than `mostCells` cells, which also takes triangles through the nearest
// depth apart; whether an edge is halved, into what it is split, and the heights along it depend on its two ends alone,
// so that neighbours agree bit for bit (the edge constraint). The level of the heights comes from the depth and from
// what the corners know of their density: triangles of one corner agree on it. Then each triangle is swept
// (mesostructure/shared/remesh_math.h): columns of grid points, and strips of triangles between them.
//
// Errors on the screen are bounded where that is asked for, triangle by triangle.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mesostructure/remesh/remesh_surface.h"

namespace vcp::meso {

struct RemeshCamera {
    glm::dvec3 eye{0}, right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, 1};  ///< world; the axes are unit vectors
    double focal = 1;         ///< pixels that a unit tangent spans; of parallel rays: that a world unit spans
    bool isParallel = false;  ///< rays are parallel to `forward`; then `eye` is where depth is 0
    /// What is seen: left, lower, right, upper, in tangents, or in world units for parallel rays.
    glm::dvec4 seen{-1, -1, 1, 1};
    double nearest = 1e-3;              ///< world units; nearer than this nothing is seen. Not used for parallel rays.
    std::optional<glm::dvec4> picture;  ///< what all of a picture sees of which this is a tile: its cells are chosen

    bool operator==(const RemeshCamera&) const = default;
};

enum class HeightAccess {
    Sample,  ///< the level's height
    Most,    ///< the most of the samples over the footprint, the least where the surface is seen from behind (4.1)
    Map,     ///< of certified cells (certified_cells.h): of the levels that the pieces name, whatever the footprint
};

struct RemeshOptions {
    double cell = 1;         ///< pixels; of certified cells the widest beside a jump of the map
    double errorPixels = 0;  ///< what certified cells may err by; others have one size
    HeightAccess access = HeightAccess::Sample;
    int mostCells = 256;  ///< of an edge that is not halved: 2 to 1024
    bool bounds = false;  ///< RemeshCounts::boundPixels is filled in; of certified cells it always is
    /// Shares what certified cells measure: calls `fill` for ranges of [0, count), in any threads, and returns whether
    /// all was done; false cancels. Empty: the caller's thread does it.
    std::function<bool(size_t count, const std::function<void(size_t first, size_t last)>& fill)> shareOut = {};
};

template <class Real>
struct RemeshVertex {
    glm::vec<3, Real> position;  ///< eye space
    glm::vec<2, Real> uv;        ///< tile units
    uint32_t triangle;           ///< of the base, whose frame normals are found in (remesh_frames.h)
};

struct RemeshCounts {
    uint64_t baseTriangles = 0, culled = 0, pieces = 0;  ///< pieces: triangles that are swept
    uint64_t halvings = 0;
    uint64_t whole = 0;              ///< pieces whose corners are rounded to one grid point
    uint64_t threeAxes = 0;          ///< pieces whose edges have three main directions
    uint64_t tooDeep = 0;            ///< pieces that were halved kMostHalvings times and are drawn as they are
    uint64_t quads = 0, strips = 0;  ///< steps of the sweep; columns that it goes between
    double boundPixels = 0;          ///< most that a point of the mesh is off on the screen
    uint64_t looked = 0;             ///< texels that certified cells looked at to choose
    uint64_t uncertified = 0;        ///< patches of which boundPixels says nothing (certified_cells.h)
};

template <class Real>
struct RemeshMesh {
    std::vector<RemeshVertex<Real>> vertices;
    std::vector<uint32_t> indices;  ///< three a triangle, counter-clockwise from outside as the base's
    RemeshCounts counts;

    void clear() { vertices.clear(), indices.clear(), counts = {}; }
    [[nodiscard]] uint64_t bytes() const {
        return vertices.size() * sizeof(RemeshVertex<Real>) + indices.size() * sizeof(uint32_t);
    }
};

/// Adds the surface's triangles to a mesh. Errors: Usage (cells not above 0, of an edge not from 2 to 1024); Limit
/// (more than `mostVertices`).
template <class Real>
Result<void> remesh(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshOptions& options,
                    RemeshMesh<Real>& mesh, uint64_t mostVertices = uint64_t{1} << 26);

extern template Result<void> remesh(const RemeshSurface&, const RemeshCamera&, const RemeshOptions&, RemeshMesh<float>&,
                                    uint64_t);
extern template Result<void> remesh(const RemeshSurface&, const RemeshCamera&, const RemeshOptions&,
                                    RemeshMesh<double>&, uint64_t);

}  // namespace vcp::meso
