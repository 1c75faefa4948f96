// Ingest: mesh files become a soup of triangles in world space, measured; and the grid that will hold it.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "builder/build.h"
#include "builder/lattice/exact_sum.h"
#include "builder/lattice/soup.h"
#include "builder/mask/mask_cutter.h"
#include "builder/mask/mask_detail.h"
#include "builder/spill/record_bins.h"
#include "builder/stream/material.h"
#include "builder/stream/mesh_stream.h"
#include "octree/io/result.h"

namespace vcp {

/// Where the lattice lies in the world, and how many levels there are.
struct GridFrame {
    glm::dvec3 origin{0};  ///< lowest corner of the root page
    double cell = 0;       ///< finest cell edge, world units
    uint32_t levels = 1;
    uint32_t log2Cells = 5;  ///< cells an edge of a page

    /// Returns the frame with so many levels more below.
    [[nodiscard]] GridFrame withLevelsBelow(uint32_t count) const {
        GridFrame frame = *this;
        frame.cell = std::ldexp(cell, -int(count));
        frame.levels += count;
        return frame;
    }
};

/// What reading found out. It does not depend on the order of the triangles.
struct SoupMeasures {
    glm::dvec3 boundsMin{0}, boundsMax{0};  ///< bounds of the vertices that triangles use
    double area = 0;
    double length = 0;  ///< sum of the triangles' longest edges
    uint64_t triangles = 0;
    uint64_t degenerateTriangles = 0;  ///< those among them without area in the file's own coordinates
    uint64_t cutTriangles = 0;         ///< of the inputs, that masks cut into some of them, or cut out
    uint64_t vertices = 0;
    bool hasVertexColours = false;
    bool hasMaterials = false;  ///< some have a colour other than white, or an image
};

/// The same while it is found out, or of some of the inputs.
struct SoupTally {
    SoupMeasures counted;  ///< without area and length
    ExactSum area, length;
    bool isTooLarge = false;  ///< some lengths or areas are no finite doubles
    /// Of a soup of several bins: tells which triangle is in which bin. Which threads worked on them does not count.
    uint64_t content = 0;

    SoupTally();
    void add(const SoupTally& other);
};

/// Returns what all triangles together are. Errors: InvalidInput (there are none, or none that a build can use).
Result<SoupMeasures> measuresOf(const SoupTally& tally, const BuildOptions& options);

/// Returns the length of a triangle's longest edge.
inline double longestEdge(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    return std::sqrt(std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)}));
}

/// The triangles of inputs. Most files hold floats, which take half the room.
struct Soup {
    /// `bins`: what is read next goes to bins firstBin to lastBin, a batch to each in turn.
    Soup(TempSpace& space, uint64_t bufferBytes, size_t bins = 1)
        : floats(space, "floats", bins, bufferBytes / 2), doubles(space, "doubles", bins, bufferBytes / 2) {}

    RecordBins<WorldTriangle<float>> floats;
    RecordBins<WorldTriangle<double>> doubles;
    size_t firstBin = 0, lastBin = 0;
    std::vector<Material> materials;  ///< materials of all these inputs
};

/// Triangles of a soup: all, or those of one bin.
struct SoupShare {
    const Soup& soup;
    std::optional<size_t> bin = {};
    uint32_t materialsBefore = 0;  ///< of soups before this one: its triangles count theirs from here

    [[nodiscard]] uint64_t triangles() const {
        if (bin) return soup.floats.count(*bin) + soup.doubles.count(*bin);
        return soup.floats.raw().total() + soup.doubles.raw().total();
    }
};

/// Reads all inputs into `soup` (flushed), cut by the masks of their materials. `vertexBytes`: memory for the vertices
/// of one input; masks take up to a quarter as much beside them. An input with masks is read twice. `progress` is given
/// the fraction read; false cancels. Triangles without area are counted and left out. `warnings` lists what the readers
/// left out, `sideFiles` the files that the inputs name, each once. Uses the calling arena's threads.
Result<SoupTally> readInputs(const BuildOptions& options, TempSpace& space, uint64_t vertexBytes, Soup& soup,
                             const std::function<bool(double fraction, uint64_t triangles)>& progress,
                             std::vector<std::string>& warnings, std::vector<SideFile>& sideFiles);

/// Returns what MaskCutter::setDetail() is to be given for an input with masks, whose vertices are read for that; 0
/// where it can be read only once. `progress` returning false cancels. Errors: as those of MeshStream.
Result<double> maskDetailOf(const std::filesystem::path& path, const BuildOptions& options,
                            const std::function<bool()>& progress);

/// Gives what a mask leaves of a triangle of `materials[number]` to `take`, which returns a Result<void>.
template <class Take>
Result<void> cutByMask(MaskCutter& cutter, std::span<const Material> materials, uint32_t number,
                       const WorldTriangle<double>& triangle, Take&& take) {
    const MaskParts* const parts =
        cutter.partsOf(materials, number, {triangle.uv[0], triangle.uv[1], triangle.uv[2]},
                       triangleArea(triangle.corner[0], triangle.corner[1], triangle.corner[2]));
    if (parts == nullptr) return take(triangle);
    std::array<MaskCorner, 3> corners;
    for (size_t i = 0; i < 3; ++i)
        corners[i] = {triangle.corner[i], triangle.uv[i], triangle.colour[i], triangle.normal[i]};
    for (const auto& t : parts->triangles) {
        WorldTriangle<double> part = triangle;
        for (size_t i = 0; i < 3; ++i) {
            const MaskCorner point = blend(corners, parts->points[t[i]]);
            part.corner[i] = point.position;
            part.uv[i] = point.uv;
            part.colour[i] = point.colour;
            part.normal[i] = point.normal;
        }
        VCP_TRY(take(part));
    }
    return {};
}

/// Returns how the inputs are opened.
MeshOpenOptions meshOptionsOf(const BuildOptions& options);

/// Returns what to say where the mesh reaches so far that its cells are wider than suits its triangles; none where they
/// are not, or where the cell was given.
std::optional<std::string> wideCellWarning(const BuildOptions& options, const SoupMeasures& measures);

/// Whether coarser levels are slabs. Beside soft leaves these would have to be continued across walls: their surface
/// does not cover the mesh's.
inline bool hasSlabs(const BuildOptions& options) {
    return options.error <= 0 && options.coarseLeaves == CoarseLeaves::Slabs;
}

/// Chooses the grid; `options.cell` 0 chooses a cell from the area, the lengths and the number of triangles, then twice
/// as long as often as `levelsLess` says. Errors: InvalidInput, Limit.
Result<GridFrame> chooseFrame(const BuildOptions& options, const SoupMeasures& measures, uint32_t levelsLess = 0);

/// Returns how many levels more than the frame's the lattice and the mesh's coordinates can tell apart.
uint32_t mostLevelsBelow(const GridFrame& frame, const SoupMeasures& measures);

/// Returns the tolerance of the finest level in world units; `options.error` 0 chooses it. Errors: Limit (finer than
/// the lattice can resolve).
Result<double> chooseError(const BuildOptions& options, const SoupMeasures& measures, const GridFrame& frame);

}  // namespace vcp
