// Marchers: the methods that find where a ray meets a mesostructure, on the CPU, by the code that the shaders compile
// (mesostructure/shared/): flat arrays, single precision, integer cells, every fetch counted. They are compared with
// truths in double precision, devices are compared with them, ray by ray, and `vcp bench meso` measures them.
//
// A ray starts in the slab of a tile (mesostructure/tile_grid.h) and travels 0 <= t <= tMax, in tile units. It hits
// where it enters the solid from outside. A ray that starts inside sees nothing before it has left. Rays leave by the
// slab's top or bottom and are misses; one that used up its iterations is unresolved, never a hit or a miss.
//
// The state of a walk is the cell, in integers: a ray leaves a cell through the wall it meets first, by one cell along
// that axis. There is no epsilon, and parallel rays divide by nothing. A ray meets a cell from wall to wall, whatever
// steps brought it there, so what is hit does not depend on the lengths that were skipped.
//
// A fetch is one read of a word or texel, or of a footprint that a sampler reads at once (2 x 2 texels by a gather or a
// bilinear sampler, 2 x 2 x 2 by a trilinear one; 2 gathers where the eight values themselves are needed).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "mesostructure/compressed_map.h"
#include "mesostructure/gdm_map.h"
#include "mesostructure/octant_boxes.h"
#include "mesostructure/patches.h"
#include "mesostructure/relief_layers.h"
#include "mesostructure/sampled_field.h"

namespace vcp::meso {

struct MarchRay {
    glm::dvec3 origin{0};     ///< in the slab; any tile
    glm::dvec3 direction{0};  ///< unit vector
    double tMax = 1e6;        ///< tile units
    /// How much a ray along the slab would bend upwards at the origin, in the direction of this one, over a base that
    /// bends: the second derivative of its height over its way along the tile. View-dependent maps with curvatures read
    /// it; to others rays are straight.
    double bend = 0;
};

enum class MarchState : uint8_t { Hit, Miss, Unresolved };

struct MarchResult {
    MarchState state = MarchState::Miss;
    double t = 0;             ///< time of a hit
    glm::vec3 normal{0};      ///< unit normal of a hit, where the method knows it
    uint32_t iterations = 0;  ///< steps, refinements included
    uint32_t fetches = 0;
    uint32_t surfaceTests = 0;  ///< cells, texels or patches that were solved; for relief mapping the refinements
};

class Marcher {
public:
    virtual ~Marcher() = default;
    /// Marches one ray. Any thread. The ray's numbers must be finite.
    [[nodiscard]] virtual MarchResult march(const MarchRay& ray) const = 0;
    /// Bytes of all arrays that a ray may read.
    [[nodiscard]] virtual uint64_t bytes() const = 0;
    /// Whether no ray may pass the method's own stored surface unseen.
    [[nodiscard]] virtual bool isConservative() const = 0;
};

/// How a walk skips empty cells.
struct Skipping {
    const Occupancy* occupancy = nullptr;  ///< cell by cell
    const DistanceMap* distances = nullptr;
    const CompressedMap* compressed = nullptr;
    const OctantBoxes* boxes = nullptr;
    const SafeFactors* guesses = nullptr;  ///< beside boxes, of the same cells
    int mostGuesses = 1;                   ///< of a ray
};

/// What a walk does in an occupied cell; none: the cell itself is the hit, where the ray enters it.
struct Surface {
    const PatchSet* patches = nullptr;
    const HeightMap* heights = nullptr;   ///< bilinear texels; the grid's cells along x and y must divide the texels
    const SampledField* field = nullptr;  ///< trilinear samples; the grid's cells must divide the field's
};

/// Makes a walk over a grid: with one of Skipping, and at most one of Surface, of which it keeps a copy. Errors: Usage
/// (none or several, grids that do not match), Limit (8 GiB).
Result<std::unique_ptr<Marcher>> gridMarcher(const Skipping& skipping, const Surface& surface);

enum class Refinement { None, Binary, Secant, SecantAsPrinted, Illinois };

/// Relief mapping: `steps` uniform steps down the height field, then refinement (Policarpo et al. 2005; Risser et al.
/// 2007). Secant is the bracketed false position that the paper describes; as printed, the listing's branch replaces
/// the wrong end and the output is the last sample's height over the ray's slope.
struct ReliefOptions {
    int steps = 32;  ///< between the top and the bottom of the slab, 1 to 4096
    Refinement refinement = Refinement::Binary;
    int refinements = 10;     ///< at most
    float tolerance = 0.01f;  ///< tolerance of |f| over the slab's height, as in the listing; 0: only the count ends it
};
std::unique_ptr<Marcher> reliefMarcher(const HeightMap& map, const ReliefOptions& options);
/// The same for solids: f is above 0 where an even number of bounds is above the ray.
std::unique_ptr<Marcher> reliefMarcher(const ReliefLayers& layers, const ReliefOptions& options);

/// The maxima of a height map's bilinear cells, halved until one is left (Tevs et al. 2008).
struct MaxPyramid {
    struct Level {
        glm::ivec2 size{0};
        std::vector<uint16_t> most;  ///< x fastest
    };
    std::vector<Level> levels;  ///< level 0: an entry a texel, for the cell from it to the next
};
MaxPyramid buildMaxPyramid(const HeightMap& map);

/// Makes a marcher that skips by the pyramid; each texel cell is solved in closed form.
std::unique_ptr<Marcher> pyramidMarcher(const HeightMap& map);

/// Sphere tracing on a plain distance map: signed distances at the cells' centres, 16 bits each, trilinear between them
/// (the published ones are 0 inside, which pulls hits into the solid); the hit is where the distance is below
/// `threshold` cells (Donnelly 2005). No bound holds.
struct SphereOptions {
    glm::ivec3 cells{64, 64, 16};
    float threshold = 0.05f;  ///< in cells
    int steps = 256;          ///< at most; then the ray is unresolved
};
struct SphereMap {
    SphereOptions options;
    TileGrid grid;
    float cap = 0;        ///< tile units of 32767 steps
    float threshold = 0;  ///< tile units
    std::vector<int16_t> steps;
};
/// Builds the map. Errors: Usage (no cells, too many).
Result<SphereMap> buildSphereMap(const Shape& shape, const SphereOptions& options);
std::unique_ptr<Marcher> sphereMarcher(const SphereMap& map);

/// Makes marchers of displacement maps and of slices (mesostructure/shared/march_gdm.h). No bound holds. Errors: Limit
/// (8 GiB).
Result<std::unique_ptr<Marcher>> gdmMarcher(const GdmMap& map);
std::unique_ptr<Marcher> slicesMarcher(const PropertyVolume& volume);

/// Traces in double precision, with no skipping and every cell solved: the truth about a method's own stored data. Its
/// walk is its own, and shares no code with the marchers'.
TruthHit traceField(const SampledField& field, const MarchRay& ray);

}  // namespace vcp::meso
