// How far all rays of a narrow cone may go from any point of a cell before one may meet an occupied cell: the
// conservative form of the distances of a generalized displacement map, whose published values hold at a point and in
// one direction alone.
//
// A cone is an interval of azimuths and one of elevations, narrow enough that one axis, the major one, has a component
// of one sign. Cells are passed layer by layer along it. A ray that has advanced u cells along the major axis lies, by
// the slopes of the cone, within an interval of each other axis; in the layer j cells ahead u is between j - 1 and
// j + 1, wherever in the first cell it began. So the cells of a layer that any ray may be in are a rectangle, and
// whether one of it is occupied is four reads of a table of sums. The first layer j with one is reached after j - 1
// cells at the least.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace vcp::meso {

/// A cone of directions, radians; azimuths from the x axis, elevations from -pi/2.
struct Beam {
    double azimuth[2] = {}, elevation[2] = {};
};

/// Returns a cone of azimuths x elevations, widened by `slack` on all sides.
Beam beamOf(int azimuths, int elevations, int azimuth, int elevation, double slack);

/// Whether all cones have a major axis.
inline bool areBeams(int azimuths, int elevations) { return azimuths >= 8 && elevations >= 4; }

/// Occupied cells of a tile, as sums over the rectangles of their layers. Cells repeat along x and y; above and below
/// the slab is nothing.
class BeamGrid {
public:
    /// `occupied`: not 0 where the surface may be; x fastest. `open`: by which part of a cell rectangles are drawn in,
    /// which is right where cells are marked for surface that is that far outside of them.
    BeamGrid(glm::ivec3 cells, glm::dvec3 cell, std::span<const uint8_t> occupied, double open);

    /// Writes each cell's length, in the unit of `cell`, at most `cap`; 0 in occupied cells.
    void lengths(const Beam& beam, double cap, std::span<float> lengths) const;

private:
    struct Layers {
        int a = 0, b = 0;    ///< the minor axes
        size_t acrossA = 0;  ///< entries of a row of sums
        size_t size = 0;     ///< entries of a layer
        std::vector<uint32_t> sums;
    };
    [[nodiscard]] bool isEmpty(int major, int layer, int a0, int a1, int b0, int b1) const;
    [[nodiscard]] bool isOccupied(glm::ivec3 cell) const;

    glm::ivec3 cells_;
    glm::dvec3 cell_;
    std::vector<uint8_t> occupied_;
    double open_;
    std::array<Layers, 3> layers_;
};

}  // namespace vcp::meso
