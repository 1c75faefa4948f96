#include "mesostructure/march_arrays.h"

#include <algorithm>
#include <cstring>

namespace vcp::meso {

namespace {

using namespace f32;

static_assert(kMesoHit == uint32_t(MarchState::Hit) && kMesoMiss == uint32_t(MarchState::Miss) &&
              kMesoUnresolved == uint32_t(MarchState::Unresolved));
static_assert(kMesoMaxLevels >= 13, "a pyramid over kMaxGridEdge texels, or 64 = 2^6 cells of a compressed map");

class ArrayMarcher final : public Marcher {
public:
    ArrayMarcher(MarchArrays arrays, uint64_t bytes, bool isConservative)
        : arrays_(std::move(arrays)), bytes_(bytes), isConservative_(isConservative) {}

    MarchResult march(const MarchRay& ray) const override {
        const MarchConstants& c = arrays_.constants;
        ArrayMarch one{arrays_.record, arrays_.words.data(), c.walk, c.skip, c.surface, c.refinement};
        const MesoResult found = one.marchMeso(rayInTile(ray, arrays_));
        return {MarchState(found.state), found.t, found.normal, found.iterations, found.fetches, found.tests};
    }
    uint64_t bytes() const override { return bytes_; }
    bool isConservative() const override { return isConservative_; }

private:
    MarchArrays arrays_;
    uint64_t bytes_;
    bool isConservative_;
};

/// Appends values of any type, low bytes first, and returns the first word's number.
template <class Values>
uint32_t add(const Values& values, std::vector<uint32_t>& words) {
    const size_t first = words.size();
    const size_t bytes = values.size() * sizeof(values[0]);
    words.resize(first + (bytes + 3) / 4);
    if (bytes > 0) std::memcpy(words.data() + first, values.data(), bytes);
    return uint32_t(first);
}

void align(std::vector<uint32_t>& words) { words.resize((words.size() + 3) / 4 * 4); }

void setExtent(glm::dvec3 extent, MarchArrays& arrays) {
    arrays.extent = extent;
    arrays.record.extent = extent;
}

void addGrid(const TileGrid& grid, MarchArrays& arrays) {
    setExtent(grid.extent(), arrays);
    arrays.record.cell = grid.cell;
    arrays.record.cells = grid.cells;
    arrays.record.cellCount = int(grid.count());
}

void addHeights(const HeightMap& map, MarchArrays& arrays) {
    arrays.record.fine = {map.size, 1};
    arrays.record.step = float(map.range / 65535);
    arrays.record.height = float(map.range);
    arrays.record.data = add(map.texels, arrays.words);
}

void addCones(Cones cones, MesoRecord& record) {
    record.azimuths = cones.azimuth, record.elevations = cones.elevation;
    const ConeBorders borders(cones);
    std::ranges::copy(borders.borders, record.borders);
}

void addCompressed(const CompressedMap& map, MarchArrays& arrays) {
    MesoRecord& record = arrays.record;
    record.unit = map.unit;
    addCones(map.cones, record);
    record.levelCount = int(map.levels.size());
    record.top = map.top;
    for (size_t i = 0; i < map.levels.size(); ++i) {
        const auto& level = map.levels[i];
        const uint32_t first = level.edge > 1 ? add(level.blocks, arrays.words) : add(level.steps, arrays.words);
        record.levels[i] = {first, level.entries, uint32_t(level.edge) << 16 | uint32_t(level.factor), 0};
    }
}

/// Appends groups of four words and returns the first group's number.
uint32_t addQuads(const std::vector<uint32_t>& values, std::vector<uint32_t>& words) {
    align(words);
    return add(values, words) / 4;
}

void addGuesses(const SafeFactors& factors, int most, MarchArrays& arrays) {
    MesoRecord& record = arrays.record;
    arrays.constants.skip = kMesoGuess;
    addCones({factors.azimuths, factors.elevations}, record);
    record.unit = factors.unit, record.product = factors.product;
    record.levelCount = factors.quads, record.clusters = factors.clusters;
    record.columnCount = int(factors.columnCount());
    record.guesses = most;
    record.guessRows = addQuads(factors.rows, arrays.words);
    record.guessColumns = addQuads(factors.columns, arrays.words);
}

void addProperties(const PropertyVolume& volume, MarchArrays& arrays) {
    setExtent(volume.extent, arrays);
    arrays.record.volume = volume.points;
    arrays.record.cells = volume.points;
    arrays.record.cell = volume.extent / glm::dvec3(volume.points);
    arrays.record.patches = add(volume.texels, arrays.words);
}

/// Returns the table's values in bytes, rounded.
std::vector<uint8_t> inBytes(const DistanceTable& table) {
    std::vector<uint8_t> bytes(table.steps.size());
    for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = uint8_t((table.steps[i] + 128) / 257);
    return bytes;
}

void addSkipping(const Skipping& skipping, MarchArrays& arrays) {
    MesoRecord& record = arrays.record;
    if (skipping.boxes != nullptr) {
        arrays.constants.skip = kMesoBoxes;
        addGrid(skipping.boxes->grid, arrays);
        record.skipping = add(skipping.boxes->boxes, arrays.words);
        if (skipping.guesses != nullptr) addGuesses(*skipping.guesses, skipping.mostGuesses, arrays);
    } else if (skipping.compressed != nullptr) {
        arrays.constants.skip = kMesoCompressed;
        addGrid(skipping.compressed->grid, arrays);
        addCompressed(*skipping.compressed, arrays);
    } else if (skipping.distances != nullptr) {
        arrays.constants.skip = kMesoDistances;
        addGrid(skipping.distances->grid, arrays);
        record.unit = skipping.distances->unit;
        addCones(skipping.distances->cones, record);
        record.skipping = add(skipping.distances->steps, arrays.words);
    } else {
        arrays.constants.skip = kMesoOccupancy;
        addGrid(skipping.occupancy->grid, arrays);
        record.skipping = add(skipping.occupancy->cells, arrays.words);
    }
}

/// A patch is five groups of four words: the quadric, the forms u and v, whether it is a triangle. Its normals are one.
void addPatches(const PatchSet& set, MarchArrays& arrays) {
    std::vector<uint32_t>& words = arrays.words;
    arrays.record.data = add(set.ranks, words);
    arrays.record.rows = add(set.rows, words);
    align(words);
    arrays.record.patches = uint32_t(words.size() / 4);
    words.reserve(words.size() + 20 * set.patches.size());
    for (const Patch& patch : set.patches) {
        uint32_t quads[20] = {};
        std::memcpy(quads, &patch, sizeof patch);
        words.insert(words.end(), std::begin(quads), std::end(quads));
    }
    if (!set.normals.empty()) arrays.record.patchNormals = add(set.normals, words) / 4;
}

void addSurface(const Surface& surface, MarchArrays& arrays) {
    MesoRecord& record = arrays.record;
    if (surface.patches != nullptr) {
        arrays.constants.surface = kMesoPatches;
        addPatches(*surface.patches, arrays);
    } else if (surface.heights != nullptr) {
        arrays.constants.surface = kMesoHeights;
        addHeights(*surface.heights, arrays);
        record.ratio = {surface.heights->size / ivec2(record.cells), 1};
    } else if (surface.field != nullptr) {
        arrays.constants.surface = kMesoField;
        record.fine = surface.field->grid.cells;
        record.ratio = record.fine / record.cells;
        record.data = add(surface.field->steps, arrays.words);
    }
}

/// Returns what relief mapping over any data has in common.
MarchArrays steppedArrays(glm::dvec3 extent, const ReliefOptions& options) {
    constexpr uint32_t kRefinements[] = {kMesoUnrefined, kMesoBinary, kMesoSecant, kMesoAsPrinted, kMesoIllinois};
    MarchArrays arrays;
    arrays.constants = {.walk = kMesoRelief, .refinement = kRefinements[size_t(options.refinement)]};
    setExtent(extent, arrays);
    arrays.record.mostSteps = options.steps;
    arrays.record.mostRefinements = options.refinements;
    arrays.record.tolerance = options.tolerance;
    return arrays;
}

}  // namespace

Result<MarchArrays> gridArrays(const Skipping& skipping, const Surface& surface) {
    MarchArrays arrays;
    addSkipping(skipping, arrays);
    addSurface(surface, arrays);
    align(arrays.words);
    if (arrays.words.size() >= size_t{1} << 31)
        return Error{.code = ErrorCode::Limit, .message = "mesostructure arrays above 8 GiB"};
    return arrays;
}

MarchArrays reliefArrays(const HeightMap& map, const ReliefOptions& options) {
    MarchArrays arrays = steppedArrays(map.extent(), options);
    addHeights(map, arrays);
    align(arrays.words);
    return arrays;
}

MarchArrays layeredArrays(const ReliefLayers& layers, const ReliefOptions& options) {
    MarchArrays arrays = steppedArrays(layers.extent, options);
    arrays.constants.surface = kMesoLayers;
    arrays.record.fine = {layers.size, 1};
    arrays.record.height = float(layers.extent.z);
    arrays.record.levelCount = layers.layers;
    arrays.record.data = add(layers.bounds, arrays.words);
    align(arrays.words);
    return arrays;
}

MarchArrays pyramidArrays(const HeightMap& map) {
    MarchArrays arrays;
    arrays.constants.walk = kMesoPyramid;
    setExtent(map.extent(), arrays);
    addHeights(map, arrays);
    const MaxPyramid pyramid = buildMaxPyramid(map);
    arrays.record.levelCount = int(pyramid.levels.size());
    for (size_t i = 0; i < pyramid.levels.size(); ++i) {
        const auto& level = pyramid.levels[i];
        arrays.record.levels[i] = {add(level.most, arrays.words), uint32_t(level.size.x), 0, 0};
    }
    align(arrays.words);
    return arrays;
}

MarchArrays sphereArrays(const SphereMap& map) {
    MarchArrays arrays;
    arrays.constants.walk = kMesoSphere;
    addGrid(map.grid, arrays);
    arrays.record.reach = map.threshold;
    arrays.record.mostSteps = map.options.steps;
    arrays.record.step = map.cap / 32767;
    arrays.record.data = add(map.steps, arrays.words);
    align(arrays.words);
    return arrays;
}

Result<MarchArrays> gdmArrays(const GdmMap& map) {
    MarchArrays arrays;
    MesoRecord& record = arrays.record;
    const DistanceTable& table = map.table;
    arrays.constants = {.walk = table.isOfTop() ? kMesoVdm : kMesoGdm,
                        .skip = map.factors ? kMesoFactored : kMesoTable,
                        .surface = map.withVisibility ? kMesoVisibilityBit : kMesoDensity,
                        .refinement = table.curvatures.samples > 1 ? kMesoBent : kMesoStraight};
    addProperties(map.properties, arrays);
    record.fine = table.nodes;
    record.elevations = table.directions.thetas, record.azimuths = table.directions.phis;
    record.cellCount = int(table.rows()), record.columnCount = int(table.columns());
    record.valueBits = map.bits;
    record.curvatures = table.curvatures.samples;
    record.mostCurvature = float(table.curvatures.most / table.extent.z);
    if (map.factors) {
        record.levelCount = map.factors->rank / 4;
        record.step = map.factors->unit;
        record.data = add(map.factors->weights, arrays.words);
        record.rows = add(map.factors->eigen, arrays.words);
    } else {
        record.step = map.bits == 8 ? table.unit * 257 : table.unit;
        record.data = map.bits == 8 ? add(inBytes(table), arrays.words) : add(table.steps, arrays.words);
    }
    if (map.withVisibility) record.skipping = add(table.hits, arrays.words);
    align(arrays.words);
    if (arrays.words.size() >= size_t{1} << 31)
        return Error{.code = ErrorCode::Limit, .message = "mesostructure arrays above 8 GiB"};
    return arrays;
}

MarchArrays slicesArrays(const PropertyVolume& volume) {
    MarchArrays arrays;
    arrays.constants.walk = kMesoSlices;
    addProperties(volume, arrays);
    align(arrays.words);
    return arrays;
}

f32::MesoRay rayInTile(const MarchRay& ray, const MarchArrays& arrays) {
    return {glm::vec3(inFirstTile(ray.origin, arrays.extent)),
            glm::vec3(ray.direction),
            std::min(float(ray.tMax), kMostReach),
            float(ray.origin.z) >= arrays.record.extent.z,
            false,
            float(ray.bend)};
}

std::unique_ptr<Marcher> arrayMarcher(MarchArrays arrays, uint64_t bytes, bool isConservative) {
    return std::make_unique<ArrayMarcher>(std::move(arrays), bytes, isConservative);
}

}  // namespace vcp::meso
