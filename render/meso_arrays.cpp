#include "render/meso_arrays.h"

#include <cstring>

namespace vcp {

namespace {

using namespace frame;

class Packer {
public:
    /// Appends values of any type, low bytes first, and returns the first word's number.
    template <class T>
    uint32_t add(const std::vector<T>& values) {
        const size_t first = words.size();
        words.resize(first + (values.size() * sizeof(T) + 3) / 4);
        if (!values.empty()) std::memcpy(words.data() + first, values.data(), values.size() * sizeof(T));
        return uint32_t(first);
    }
    void align() { words.resize((words.size() + 3) / 4 * 4); }
    std::vector<uint32_t> words;
};

void addGrid(const meso::TileGrid& grid, MesoRecord& record) {
    record.extent = glm::vec4(grid.extent(), record.extent.w);
    record.cell = glm::vec4(grid.cell, record.cell.w);
    record.cells = glm::ivec4(grid.cells, int(grid.count()));
}

void addHeights(const meso::HeightMap& map, Packer& packer, MesoRecord& record) {
    record.fine = {map.size, 1, record.fine.w};
    record.scale.x = float(map.range / 65535), record.scale.y = float(map.range);
    record.at.y = packer.add(map.texels);
}

void addCones(meso::Cones cones, int levels, MesoRecord& record) {
    static_assert(kMesoMostBorders >= meso::kMostAzimuths && kMesoMostBorders >= meso::kMostElevations);
    record.cones = {cones.azimuth, cones.elevation, levels, 0};
    const meso::ConeBorders borders(cones);
    for (int k = 0; k < meso::kMostAzimuths; ++k)
        record.borders[k] =
            glm::vec4(borders.azimuths[k], k < meso::kMostElevations ? borders.elevations[k] : glm::vec2(0));
}

void addCompressed(const meso::CompressedMap& map, Packer& packer, MesoRecord& record) {
    record.extent.w = map.unit;
    addCones(map.cones, int(map.levels.size()), record);
    record.top = glm::ivec4(map.top, 0);
    for (size_t i = 0; i < map.levels.size(); ++i) {
        const auto& level = map.levels[i];
        const uint32_t steps = packer.add(level.steps);
        record.levels[i] = {steps, level.entries, uint32_t(level.edge) << 16 | uint32_t(level.factor),
                            packer.add(level.brick)};
    }
}

void addSkipping(const meso::Skipping& skipping, Packer& packer, MesoArrays& arrays) {
    MesoRecord& record = arrays.record;
    if (skipping.boxes != nullptr) {
        arrays.constants[1] = kMesoBoxes;
        addGrid(skipping.boxes->grid, record);
        record.at.x = packer.add(skipping.boxes->boxes);
    } else if (skipping.compressed != nullptr) {
        arrays.constants[1] = kMesoCompressed;
        addGrid(skipping.compressed->grid, record);
        addCompressed(*skipping.compressed, packer, record);
    } else if (skipping.distances != nullptr) {
        const meso::DistanceMap& map = *skipping.distances;
        arrays.constants[1] = kMesoDistances;
        addGrid(map.grid, record);
        record.extent.w = map.unit;
        addCones(map.cones, 0, record);
        record.at.x = packer.add(map.steps);
    } else {
        arrays.constants[1] = kMesoOccupancy;
        addGrid(skipping.occupancy->grid, record);
        record.at.x = packer.add(skipping.occupancy->cells);
    }
}

/// A patch is five groups of four words: the quadric, the forms u and v, whether it is a triangle.
void addPatches(const meso::PatchSet& set, Packer& packer, MesoRecord& record) {
    record.at.y = packer.add(set.ranks);
    record.at.z = packer.add(set.rows);
    packer.align();
    record.at.w = uint32_t(packer.words.size() / 4);
    packer.words.reserve(packer.words.size() + 20 * set.patches.size());
    for (const meso::Patch& patch : set.patches) {
        uint32_t words[20] = {};
        std::memcpy(words, &patch, sizeof patch);
        packer.words.insert(packer.words.end(), std::begin(words), std::end(words));
    }
}

void addSurface(const meso::Surface& surface, Packer& packer, MesoArrays& arrays) {
    MesoRecord& record = arrays.record;
    const glm::ivec3 cells(record.cells);
    if (surface.patches != nullptr) {
        arrays.constants[2] = kMesoPatches;
        addPatches(*surface.patches, packer, record);
    } else if (surface.heights != nullptr) {
        arrays.constants[2] = kMesoHeights;
        addHeights(*surface.heights, packer, record);
        record.ratio = {surface.heights->size.x / cells.x, surface.heights->size.y / cells.y, 1, 0};
    } else if (surface.field != nullptr) {
        arrays.constants[2] = kMesoField;
        record.fine = glm::ivec4(surface.field->grid.cells, 0);
        record.ratio = glm::ivec4(surface.field->grid.cells / cells, 0);
        record.at.y = packer.add(surface.field->steps);
    }
}

void addRelief(const meso::Method& method, Packer& packer, MesoArrays& arrays) {
    constexpr uint32_t kRefinements[] = {kMesoUnrefined, kMesoBinary, kMesoSecant, kMesoAsPrinted, kMesoIllinois};
    arrays.constants = {kMesoRelief, 0, 0, kRefinements[size_t(method.relief.refinement)]};
    arrays.record.extent = glm::vec4(method.heights->extent(), 0);
    arrays.record.fine.w = method.relief.steps;
    arrays.record.ratio.w = method.relief.refinements;
    arrays.record.scale.z = method.relief.tolerance;
    addHeights(*method.heights, packer, arrays.record);
}

void addPyramid(const meso::HeightMap& map, Packer& packer, MesoArrays& arrays) {
    arrays.constants = {kMesoPyramid, 0, 0, 0};
    arrays.record.extent = glm::vec4(map.extent(), 0);
    addHeights(map, packer, arrays.record);
    const meso::MaxPyramid pyramid = meso::buildMaxPyramid(map);
    arrays.record.cones.z = int(pyramid.levels.size());
    for (size_t i = 0; i < pyramid.levels.size(); ++i) {
        const auto& level = pyramid.levels[i];
        arrays.record.levels[i] = {packer.add(level.most), uint32_t(level.size.x), uint32_t(level.size.y), 0};
    }
}

void addSphere(const meso::SphereMap& map, Packer& packer, MesoArrays& arrays) {
    arrays.constants = {kMesoSphere, 0, 0, 0};
    arrays.record.cell.w = map.threshold;
    addGrid(map.grid, arrays.record);
    arrays.record.fine.w = map.options.steps;
    arrays.record.scale.x = map.cap / 32767;
    arrays.record.at.y = packer.add(map.steps);
}

}  // namespace

Result<MesoArrays> packMesoArrays(const meso::Method& method) {
    const auto fail = [](ErrorCode code, const char* message) { return Error{.code = code, .message = message}; };
    const bool isComplete = method.kind == meso::WalkKind::Sphere ? method.sphere != nullptr
                            : method.kind != meso::WalkKind::Grid
                                ? method.heights != nullptr
                                : method.boxes || method.compressed || method.distances || method.occupancy;
    if (!isComplete) return fail(ErrorCode::Usage, "a mesostructure method without its arrays");
    static_assert(kMesoMaxLevels >= 13, "a pyramid over kMaxGridEdge texels");
    if (method.compressed && method.compressed->levels.size() > kMesoMaxLevels)
        return fail(ErrorCode::Limit, "a compressed map of too many levels");
    MesoArrays arrays;
    Packer packer;
    switch (method.kind) {
        case meso::WalkKind::Relief:
            addRelief(method, packer, arrays);
            break;
        case meso::WalkKind::Pyramid:
            addPyramid(*method.heights, packer, arrays);
            break;
        case meso::WalkKind::Sphere:
            addSphere(*method.sphere, packer, arrays);
            break;
        default:
            arrays.constants[0] = kMesoGrid;
            addSkipping(method.skipping(), packer, arrays);
            addSurface(method.surface(), packer, arrays);
    }
    packer.align();
    arrays.words = std::move(packer.words);
    if (arrays.words.size() >= size_t{1} << 31) return fail(ErrorCode::Limit, "mesostructure arrays above 8 GiB");
    return arrays;
}

}  // namespace vcp
