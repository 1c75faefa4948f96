// The arrays of a method as marchers and shaders read them: one run of 32-bit words, a record of where each begins, and
// the constants that choose what marches them (mesostructure/shared/march_layout.h).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "mesostructure/march.h"
#include "mesostructure/march_math.h"

namespace vcp::meso {

/// The constants of the shaders, and of f32::ArrayMarch.
struct MarchConstants {
    uint32_t walk = f32::kMesoGrid, skip = f32::kMesoOccupancy, surface = f32::kMesoCell,
             refinement = f32::kMesoUnrefined;
};

struct MarchArrays {
    f32::MesoRecord record{};
    glm::dvec3 extent{0};  ///< of the tile
    MarchConstants constants;
    std::vector<uint32_t> words;  ///< a multiple of 4
};

/// These pack arrays. They are pure; what they are given is not referred to afterwards. Errors of gridArrays and
/// gdmArrays: Limit (2^31 words). Precondition: what gridMarcher checks.
Result<MarchArrays> gridArrays(const Skipping& skipping, const Surface& surface);
MarchArrays reliefArrays(const HeightMap& map, const ReliefOptions& options);
MarchArrays layeredArrays(const ReliefLayers& layers, const ReliefOptions& options);
MarchArrays pyramidArrays(const HeightMap& map);
MarchArrays sphereArrays(const SphereMap& map);
Result<MarchArrays> gdmArrays(const GdmMap& map);
MarchArrays slicesArrays(const PropertyVolume& volume);

/// Returns a ray as marchers take it: moved into the first tile, in single precision.
f32::MesoRay rayInTile(const MarchRay& ray, const MarchArrays& arrays);

/// Makes a marcher of any arrays; `bytes` and `isConservative` are what it says of itself.
std::unique_ptr<Marcher> arrayMarcher(MarchArrays arrays, uint64_t bytes, bool isConservative);

}  // namespace vcp::meso
