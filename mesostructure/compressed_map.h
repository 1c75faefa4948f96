// Distance maps in a lookup grid and atlases (Mehra and Kumar, 4 and appendix A): a block without surface keeps the
// least of its lengths, a block with surface is a brick of an atlas. One lookup is the paper's two levels; more make
// the tree its hierarchical extension.
//
// "Lossless" is said of what is rendered: lengths away from the surface become shorter, steps stay safe, hits stay the
// same. Texels are fetched by integer coordinates; nothing is filtered, so bricks have no apron.
#pragma once

#include <span>
#include <vector>

#include "mesostructure/distance_map.h"

namespace vcp::meso {

struct CompressedMap {
    static constexpr uint32_t kBrick = f32::kMesoBrick;

    /// Entries of one size. Level 0 is a grid over the tile; entries of a lower level are in bricks of factor^3, one
    /// brick after the other, x fastest.
    struct Level {
        int edge = 1;    ///< cells an entry is wide; the last level's is 1
        int factor = 1;  ///< entries of this level that an entry of the level above is wide
        uint32_t entries = 0;
        /// Above the cells, cone by cone: the least length, or kBrick and the number of the brick on the level below.
        /// It is the same for all cones, and is repeated so that one fetch answers.
        std::vector<uint32_t> blocks;
        std::vector<uint8_t> steps;  ///< of cells, cone by cone; a length, or kOccupied
    };

    TileGrid grid;
    Cones cones;
    float unit = 0;
    glm::ivec3 top{0};  ///< entries of level 0
    std::vector<Level> levels;

    [[nodiscard]] uint64_t bytes() const;
    /// The ratio of the paper's Table 3: texels of the map over texels of lookup and atlases, whatever their bytes.
    [[nodiscard]] double texelRatio() const;
};

/// `factors`: one for each level below the grid, coarse first; {4} is the paper's way with blocks of 4^3. Errors: Usage
/// (no factor, one below 2 or above 16, or blocks above 64 cells).
Result<CompressedMap> compressMap(const DistanceMap& map, std::span<const int> factors);

}  // namespace vcp::meso
