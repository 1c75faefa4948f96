// Filter levels of a height map (Gumhold and Huettner 1999, 4): heights at the corners of ever coarser grids.
//
// Heights are parts of the map's range, from 0 to 1, and are kept in 16 bits, as the map has them: those of levels are
// rounded. Level 0 is the map; a level has half the edge of the one below, at least 1. Levels repeat as the map does;
// corner (i, j) of a level lies at the part (i, j) / size of the tile.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include "mesostructure/remesh/remesh_math.h"
#include "mesostructure/shape.h"
#include "octree/io/result.h"

namespace vcp::meso {

enum class LevelFit {
    Sampled,   ///< heights of the map at the corners
    Averaged,  ///< means over the corners' cells, of the level below
    Printed,   ///< least volume, as printed (4.2): differences of the volume, steps of falling size for all at once
    Least,     ///< least volume within the range of the map around each corner, to the optimum
};

struct HeightLevel {
    glm::ivec2 size{0};
    HeightTexels texels;  ///< 65535 is 1

    [[nodiscard]] double at(int x, int y) const {
        return texels[size_t(wrapped(x, size.x)) + size_t(size.x) * size_t(wrapped(y, size.y))] * (1 / 65535.0);
    }
};

/// What fitting one level did; nothing for levels that are not fitted. Volumes are mean distances between level and
/// map, in parts of the range.
struct LevelVolume {
    double averaged = 0;  ///< of the averaged heights, from which fitting starts
    double fitted = 0;
    double bound = 0;  ///< what no heights in their ranges come below (LevelFit::Least; else 0)
    int iterations = 0;
};

struct LevelFitOptions {
    LevelFit fit = LevelFit::Least;
    double gap = 0.01;         ///< LevelFit::Least ends where volume and bound differ by this part
    int mostIterations = 400;  ///< for each level
    /// Levels that heights are taken from, with the map. 1 is for atlases: coarser levels mix charts that have nothing
    /// to do with each other. Those beyond are averages, and stand in for what a device has not got yet.
    int mostLevels = 32;
    HeightStore store = {};  ///< of the coarser levels
};

class HeightLevels {
public:
    /// The map's texels become level 0. Errors: InvalidInput (a map without texels, of another size than it says, or
    /// without a range); Io (levels in a file).
    static Result<HeightLevels> build(HeightMap map, const LevelFitOptions& options = {});

    [[nodiscard]] const std::vector<HeightLevel>& levels() const { return levels_; }
    [[nodiscard]] int used() const { return used_; }  ///< levels that heights are taken from
    [[nodiscard]] const std::vector<LevelVolume>& volumes() const { return volumes_; }  ///< for each level
    [[nodiscard]] double rows() const { return rows_; }  ///< extent of the tile along y, tile units
    /// Texels of the map a tile unit, along x and y.
    [[nodiscard]] glm::dvec2 texels() const { return {levels_.front().size.x, levels_.front().size.y / rows_}; }
    [[nodiscard]] uint64_t bytes() const;
    /// Takes what was read of levels in files out of main memory.
    void letGo() const;

    /// Returns the height of a level at a place in tile units, bilinear.
    template <class Real>
    [[nodiscard]] Real height(int level, glm::vec<2, Real> at) const;
    /// Returns the height at a place for a footprint of `texels` texels' edge: of the two levels whose texels are as
    /// large, by the logarithm.
    template <class Real>
    [[nodiscard]] Real height(glm::vec<2, Real> at, Real texels) const;

private:
    std::vector<HeightLevel> levels_;
    std::vector<LevelVolume> volumes_;
    int used_ = 1;
    double rows_ = 1;
};

/// Returns the means of a level around the corners of a coarser one, by the weights with which they count there.
/// Errors: Io.
Result<HeightLevel> averagedLevel(const HeightLevel& from, glm::ivec2 size, const HeightStore& store = {});

/// Fits one level of a map's level 0: LevelFit::Printed or Least. `volume` gets what was done. Errors: Io.
Result<HeightLevel> fitLevel(const HeightLevel& map, glm::ivec2 size, const LevelFitOptions& options,
                             LevelVolume& volume);

/// Returns the mean distance between a level and the map, at the map's texels.
double levelVolume(const HeightLevel& map, const HeightLevel& level);

/// Levels as remesh_heights.h reads them.
template <class Real>
struct StoredLevels {
    struct RemeshLevel {
        const uint16_t* texels16;
        glm::ivec2 size;
        glm::vec<2, Real> texels;
    };
    const HeightLevels* from;

    [[nodiscard]] RemeshLevel remeshLevel(int level) const {
        const HeightLevel& of = from->levels()[size_t(level)];
        return {of.texels.data(), of.size, {Real(of.size.x), Real(double(of.size.y) / from->rows())}};
    }
    [[nodiscard]] int remeshLevels() const { return from->used(); }
    [[nodiscard]] static const RemeshLevel& remeshThere(const RemeshLevel& level, const glm::vec<2, Real>&) {
        return level;
    }
    [[nodiscard]] static glm::uvec4 remeshTexels(const RemeshLevel& level, glm::ivec2 at) {
        const uint16_t *low = level.texels16 + size_t(level.size.x) * size_t(at.y),
                       *high = at.y + 1 < level.size.y ? low + level.size.x : level.texels16;
        const int after = at.x + 1 < level.size.x ? at.x + 1 : 0;
        return {low[at.x], low[after], high[at.x], high[after]};
    }
};

template <class Real>
using RemeshHeights = remeshing::RemeshHeights<Real, StoredLevels<Real>>;

template <class Real>
Real HeightLevels::height(int level, glm::vec<2, Real> at) const {
    RemeshHeights<Real> heights{{this}};
    return heights.remeshLevelHeight(heights.remeshLevel(level), at);
}

template <class Real>
Real HeightLevels::height(glm::vec<2, Real> at, Real texels) const {
    RemeshHeights<Real> heights{{this}};
    return heights.remeshHeight(heights.remeshFootprint(texels), at);
}

}  // namespace vcp::meso
