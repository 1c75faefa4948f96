// What a mesostructure does to light from everywhere: shadows in its hollows, and light that its walls throw on each
// other, for any surroundings and any turn of them (the reflectance transfer volume of Wang et al. 2004, 4.3, with
// precomputed radiance transfer, Sloan et al. 2002).
//
// The light from far that a point of the surface gets is linear in the light of the surroundings: E = sum of T_i L_i,
// where L_i are 16 coefficients of spherical harmonics of the surroundings and T_i those of the point: of how much of
// the light from each direction reaches it, straight or from wall to wall. The paper stores T for each voxel and view
// direction, in four factors. Here a hit knows its normal, and what is matt looks the same from all sides, so all that
// a view could choose is which normal of the cell is seen: T is stored for each cell with surface, and linear in the
// normal, in four terms: T = T0 + n.x T1 + n.y T2 + n.z T3. For one place that is exact as long as no light crosses
// the horizon (T1 to T3 are Lambert's light vector); for the places of a cell it is fitted. Cells are blended, those of
// other normals less.
//
// Light is counted without albedo: what a white point gives back of it. What comes from other walls has their albedo,
// one number for all colours and the whole tile: colours do not bleed. The slab's bottom is closed.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <glm/gtc/packing.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mesostructure/harmonics.h"
#include "mesostructure/shape.h"
#include "mesostructure/tile_grid.h"

namespace vcp::meso {

struct TransferVolume {
    static constexpr size_t kTexels = 17;  ///< of a cell (mesostructure/shared/transfer_lookup.h)

    static constexpr uint64_t kMostCells = (uint64_t{1} << 22) - 1;  ///< with surface: what shaders can number

    TileGrid grid;
    float albedo = 0;
    uint32_t paths = 0;             ///< a cell
    std::vector<uint32_t> numbers;  ///< one a cell of the grid, x fastest: 1 and more, without gaps; 0: no surface
    std::vector<uint64_t> terms;    ///< kTexels a number: four values of 16 bits (glm::packHalf4x16)

    [[nodiscard]] size_t cells() const { return terms.size() / kTexels; }
    /// What it takes on a device.
    [[nodiscard]] uint64_t bytes() const { return texelBytes(grid.count(), cells()); }
    static uint64_t texelBytes(uint64_t gridCells, uint64_t cells) {
        return (gridCells + 1) / 2 * 8 + cells * kTexels * 8;
    }
};

struct TransferOptions {
    int cells = 32;         ///< of the grid along x; they are cubes, as far as the tile's edges allow
    double albedo = 0.5;    ///< of all walls, from 0 to 1
    uint32_t paths = 1024;  ///< a cell
    uint64_t seed = 1;
    uint64_t memoryBytes = uint64_t{1} << 30;
    /// Calls `fill(first, last)` for all of [0, count), in ranges that may run in several threads at once; false
    /// cancels. Empty: in this thread.
    std::function<bool(size_t count, const std::function<void(size_t first, size_t last)>& fill)> shareOut = {};
};

/// Traces the volume of a shape. The same shape, options and seed give the same bits, in any number of threads. Errors:
/// Usage (options out of range), Limit (the memory cap, or more cells than a device numbers), Cancelled.
Result<TransferVolume> traceTransfer(const Shape& shape, const TransferOptions& options);

/// Returns the volume as shaders read it (mesostructure/shared/transfer_lookup.h).
inline std::vector<uint64_t> transferTexels(const TransferVolume& volume) {
    constexpr uint32_t kHalf = 2048;  // halves hold whole numbers up to it
    std::vector<uint64_t> texels;
    const auto half = [&](size_t cell, bool high) {
        const uint32_t number = cell < volume.numbers.size() ? volume.numbers[cell] : 0;
        return float(high ? number / kHalf : number % kHalf);
    };
    for (size_t cell = 0; cell < volume.numbers.size(); cell += 2)
        texels.push_back(glm::packHalf4x16(
            glm::vec4(half(cell, false), half(cell, true), half(cell + 1, false), half(cell + 1, true))));
    texels.insert(texels.end(), volume.terms.begin(), volume.terms.end());
    return texels;
}

/// Reads such texels as shaders do, in single precision.
class TransferReader {
public:
    explicit TransferReader(const TransferVolume& volume)
        : extent_(volume.grid.extent()), cells_(volume.grid.cells), texels_(transferTexels(volume)) {}
    /// Returns T at a place of the surface, tile space, by its unit normal.
    [[nodiscard]] f32::Harmonics at(glm::dvec3 place, glm::dvec3 normal) const;

private:
    glm::dvec3 extent_;
    glm::ivec3 cells_;
    std::vector<uint64_t> texels_;
};

}  // namespace vcp::meso
