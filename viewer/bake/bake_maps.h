// What the surface of a dataset is over a base surface, texel by texel: heights, normals and colours.
//
// A texel's point of the base, between the corners of its triangle, is moved along the direction between the
// directions of the corners, as shells and displaced surfaces have it (mesostructure/shell.h): it is the surface that
// these draw. The line is followed both ways, up to a reach; the sheet nearest to the base is taken, of two as near the
// outer one. Where the line meets nothing, the gap is filled from the texels around.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "mesostructure/base/texel_map.h"
#include "mesostructure/shape.h"
#include "octree/dataset_reader.h"
#include "octree/io/byte_reader.h"
#include "viewer/bake/base_frames.h"

namespace vcp {

/// Whether the surface is a height field over the base at a texel.
enum class TexelState : uint8_t {
    Outside,  ///< in no triangle
    Height,   ///< it is
    NoHit,    ///< the line meets nothing
    Sheets,   ///< the line meets a second sheet at most twice as far from the base
    Steep,    ///< the surface is turned away from the line by more than kSteepDegrees
};
inline constexpr double kSteepDegrees = 78;

/// Parts of the base's area in each state but Outside; their sum is 1.
struct BakedShares {
    double height = 0, noHit = 0, sheets = 0, steep = 0;
};

/// A height map and what its values are, in lengths of the directions that it counts along.
struct BakedHeights {
    std::vector<uint16_t> values;  ///< row by row, the lowest first
    double offset = 0;             ///< of value 0, world units
    double range = 1;              ///< of value 65535 over value 0, world units; above 0
};

struct BakedMaps {
    int size = 0;
    BakedHeights heights;            ///< along the shell's directions
    BakedHeights displacement;       ///< along the unit normals, as other programs have it
    std::vector<glm::vec3> normals;  ///< tangent space (BaseFrames), unit
    std::vector<glm::vec3> light;    ///< linear colours; empty without colour
    std::vector<TexelState> states;
    BakedShares shares;
    std::vector<bool> isField;  ///< of each triangle of the base: whether no texel of it says otherwise
};

struct BakeMapsOptions {
    double reach = 0;  ///< how far from the base the surface is looked for, in lengths of the directions, world units
    bool withColour = true;
    uint64_t memoryBytes = uint64_t{4} << 30;
    std::function<bool(double)> progress = {};  ///< as LineSamplerOptions
};

/// Memory for each texel while maps are made, beside the pages.
inline constexpr uint64_t kBakeBytesPerTexel = 128;

/// Makes the maps. `dataset`: as sampleLines. Errors: those of ownersOf and sampleLines; InvalidInput (a corner of the
/// base without a direction; not one line meets the surface); Limit (the memory).
Result<BakedMaps> bakeMaps(const std::shared_ptr<const ByteReader>& reader, const Dataset& dataset,
                           const meso::BaseSurface& base, const meso::TexelMap& map, const BaseFrames& frames,
                           const std::vector<glm::dvec3>& directions, const BakeMapsOptions& options);

}  // namespace vcp
