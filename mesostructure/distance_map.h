// Distance maps and directional distance maps (Mehra and Kumar, 3.1), conservative.
//
// A map holds, for each cone of directions and each cell of a grid, a length that may be travelled from any point of
// the cell in any direction of the cone without passing the surface. DDM m x n cuts the azimuth into m intervals from
// 0 (the x axis, towards y) and the elevation from -90 to 90 degrees into n; cones are closed, 1 x 1 is the plain
// distance map. The paper's n = 1 is the full range here, so shadow rays find their cone as view rays do.
//
// Proof of the bound, for the rule AnyPoint. The surface lies in the occupied cells W, which are closed and widened
// (kCellSlack). If v in V, m on the surface and m - v is in the cone, then m is in some W with w - v in the cone; the
// stored value is the least |w - v| over such pairs, or less. For cones that are a sign for each of some axes (m in
// {1, 2, 4}, n in {1, 2}: octants, quadrants and halves) the pairs are those of cells ordered by index along these
// axes, the square of the gap is a sum over the axes, and its least value is three one-sided lower envelopes of
// parabolas, one axis after the other: exact, in time linear in the cells (after Felzenszwalb and Huttenlocher 2012,
// one-sided). Narrow cones, from 8 x 4 on, are followed layer by layer (mesostructure/gdm/beam_lengths.h), to at most a
// cell less than the least distance. Other cones are searched cell by cell in the order of distance, up to `cap`; they
// are widened by kConeSlack for the rounding of a ray's cone.
//
// Lengths above the cap are cut to it (an empty cone has no least distance on a repeated tile), and values are rounded
// down to a byte. Whether a cell is occupied is a byte of its own, kOccupied: 0 is a length, not a flag.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

#include "mesostructure/march_math.h"
#include "mesostructure/shape.h"

namespace vcp::meso {

/// One byte a cell: whether the surface may touch the widened closed cell.
struct Occupancy {
    TileGrid grid;
    std::vector<uint8_t> cells;

    [[nodiscard]] bool at(glm::ivec3 cell) const {
        return cell.z >= 0 && cell.z < grid.cells.z && cells[grid.index(cell)] != 0;
    }
    [[nodiscard]] size_t count() const;
};

/// Errors: Limit (more than kMaxGridCells or kMaxGridEdge), Usage (no cells); InvalidInput where no cell is occupied.
Result<Occupancy> occupy(const Shape& shape, glm::ivec3 cells);

inline constexpr int kMostAzimuths = f32::kMesoMostBorders, kMostElevations = 16;

struct Cones {
    int azimuth = 1;    ///< 1 to kMostAzimuths
    int elevation = 1;  ///< 1 to kMostElevations

    [[nodiscard]] int count() const { return azimuth * elevation; }
    /// Whether each cone is a sign for each of some axes.
    [[nodiscard]] bool areSigns() const { return (azimuth == 1 || azimuth == 2 || azimuth == 4) && elevation <= 2; }
};
/// Where cones meet, for coneOf. For azimuth k from 0, at most half a turn: cosine and sine. For elevation k from -90
/// degrees: the cosine's square and the sine's, with the sine's sign. On the axes both are exact.
struct ConeBorders {
    explicit ConeBorders(Cones cones);

    int azimuths, elevations;
    std::array<f32::MesoBorder, kMostAzimuths> borders{};
};

/// Returns a direction's cone: elevation * azimuths + azimuth. 0 counts as positive. Single precision
/// (mesostructure/shared/cone_lookup.h).
///
/// It uses only signs and products, which every device rounds correctly; an atan may be off by 4096 units of the last
/// place there. Let u be 2^-23, the most that a product or a sum is off, whichever way it is rounded. The comparison
/// with a border of azimuth is off by 1.5 u of the direction's length, that with a border of elevation by 1.5 u as well
/// (6 u of the tangent's square), and a shader's direction by 1.5 u: a direction is within 3 u, 4e-7 radians, of the
/// cone that is found. kConeSlack is more.
int coneOf(const ConeBorders& borders, glm::vec3 direction);
inline constexpr double kConeSlack = 1e-6;  ///< radians

enum class DistanceRule {
    AnyPoint,  ///< from any point of the cell to any point of an occupied cell: conservative
    Paper,     ///< between centres on a grid `refine` times as fine, then the least of each cell: oversteps
    PaperSafe  ///< as Paper, less the diagonal of a fine cell: conservative, at the paper's price
};

inline constexpr uint8_t kOccupied = f32::kMesoOccupied;  ///< in place of a length
inline constexpr int kMostSteps = f32::kMesoMostSteps;

struct DistanceMap {
    TileGrid grid;
    Cones cones;
    float unit = 0;              ///< tile units of one step
    std::vector<uint8_t> steps;  ///< 0 to kMostSteps, or kOccupied; cone by cone, cells as in the grid

    [[nodiscard]] size_t slot(int cone, glm::ivec3 cell) const {
        return size_t(cone) * grid.count() + grid.index(cell);
    }
    /// Returns the length of a cell that is not occupied.
    [[nodiscard]] float length(int cone, glm::ivec3 cell) const { return float(steps[slot(cone, cell)]) * unit; }
    [[nodiscard]] uint64_t bytes() const { return steps.size(); }
};

struct DistanceOptions {
    Cones cones;
    DistanceRule rule = DistanceRule::AnyPoint;
    double cap = 0.25;    ///< tile units; longer ones are cut to it
    int refine = 2;       ///< for the paper's rules: 2 to 8
    bool search = false;  ///< also search cones that are signs (for tests)
};

/// Builds the maps of all cones. The paper's rules need the shape, for the finer grid. Errors: Usage (cones, cap,
/// refine out of range), Limit.
Result<DistanceMap> buildDistanceMap(const Occupancy& occupancy, const DistanceOptions& options,
                                     const Shape* shape = nullptr);

/// Returns lengths in tile units before they are cut and rounded; infinity where the cone has no occupied cell. The
/// cone is one of signs: `sign` is +1, -1 or 0 (both) for each axis.
std::vector<float> signedConeDistances(const Occupancy& occupancy, glm::ivec3 sign, bool betweenCentres = false);

}  // namespace vcp::meso
