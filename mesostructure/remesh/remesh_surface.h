// A base surface with a height map, as it is remeshed: what a frame reads and none changes.
//
// A point of the displaced surface is p + h d, with place p, direction d and height h in [0, 1]; directions are those
// of the shell (shell.h), as long as the slab is high, and are interpolated as places are: the same surface that
// marchers march, where the paper normalizes them. Where the map jumps along an edge, the two sides have different
// heights: both take the higher one, so that nothing gapes.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mesostructure/base_surface.h"
#include "mesostructure/remesh/height_levels.h"

namespace vcp::meso {

struct RemeshSurface {
    static constexpr uint32_t kNoSeam = ~uint32_t{0};

    std::shared_ptr<const HeightLevels> heights;
    glm::dvec3 origin{0};               ///< what positions are relative to
    glm::dvec3 low{0}, high{0};         ///< box of base and displaced surface, world
    double longest = 0;                 ///< of the directions, world units
    std::vector<glm::vec3> positions;   ///< relative to the origin
    std::vector<glm::vec3> directions;  ///< world units, to height 1
    std::vector<float> densities;       ///< texels a world unit, the most of the triangles at a position
    std::vector<std::array<uint32_t, 3>> triangles;
    std::vector<std::array<glm::vec2, 3>> uvs;      ///< tile units
    std::vector<uint32_t> baseTriangles;            ///< that they were cut from; uncut: each its own number
    std::vector<std::array<uint32_t, 3>> seams;     ///< of the edges from corner k to the next: number, or kNoSeam
    std::vector<std::array<glm::vec2, 2>> seamUvs;  ///< the other side's, at the edge's start and end
    std::vector<uint32_t> firstPlace;               ///< of each position, and one more
    std::vector<glm::vec2> places;                  ///< texture coordinates that a position has, each once
    uint64_t withoutCorners = 0;                    ///< triangles with two equal corners, which are left out
};

/// `height`: height of the slab over flat parts, world units; `offset`: as in buildShell. Errors: Usage (heights not
/// above 0, an offset that is not finite); InvalidInput, with the triangle: no texture coordinates, coordinates that
/// are not finite, an edge of three triangles, a position without a direction, no triangle.
Result<RemeshSurface> buildRemeshSurface(const BaseSurface& base, std::shared_ptr<const HeightLevels> heights,
                                         double height, double offset = 0);

class HeightBends;

struct CutOptions {
    double mostTexels = 16;              ///< of an edge
    const HeightBends* bends = nullptr;  ///< of the map; null: it is steep nowhere
    double mostSteepTexels = 4;          ///< of an edge where the map is steep, or jumps along it
    uint64_t mostTriangles = uint64_t{1} << 22;
    std::function<bool(double part)> progress = {};  ///< takes the part that is done, from 0 to 1; false cancels
};

/// Returns the same surface in triangles with shorter edges: longer ones are halved, along both sides of an edge alike.
/// Errors: Limit (more than `mostTriangles`); Cancelled.
Result<RemeshSurface> cutSurface(const RemeshSurface& surface, const CutOptions& options);

}  // namespace vcp::meso
