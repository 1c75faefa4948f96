#include "mesostructure/method.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace vcp::meso {

namespace {

constexpr std::string_view kLayersName = "relief-layers";
constexpr std::array<std::string_view, 22> kMethodNames = {"relief-linear",
                                                           "relief-binary",
                                                           "relief-secant",
                                                           "relief-secant-printed",
                                                           "relief-illinois",
                                                           "pyramid",
                                                           "sphere",
                                                           "dm",
                                                           "ddm",
                                                           "ddm-quadric",
                                                           "ddm-quadric-fitted",
                                                           "ddm-compressed",
                                                           "ddm-cells",
                                                           "quadric",
                                                           "boxes",
                                                           "cells",
                                                           "gdm",
                                                           "gdm-visibility",
                                                           "gdm-safe",
                                                           "vdm",
                                                           "slices",
                                                           kLayersName};
constexpr std::array<Refinement, 5> kRefinements = {Refinement::None, Refinement::Binary, Refinement::Secant,
                                                    Refinement::SecantAsPrinted, Refinement::Illinois};
constexpr int kDefaultCells = 64, kDefaultPoints = 32, kDefaultTexels = 256, kDefaultLayers = 4;

template <class T>
Result<void> take(Result<T> made, std::unique_ptr<T>& to) {
    if (!made) return made.error();
    to = std::make_unique<T>(*std::move(made));
    return {};
}

glm::ivec3 cellsOf(const Asset& asset, glm::dvec3 extent, int n) {
    if (n == 0 && asset.occupancy) return asset.occupancy->grid.cells;
    if (n == 0) n = kDefaultCells;
    const glm::ivec3 cubes(n, std::max(1, int(std::lround(n * extent.y))), std::max(1, int(std::ceil(extent.z * n))));
    if (asset.heights) return {cubes.x, cubes.y, std::clamp(cubes.z, 4, 256)};
    return cubes;
}

/// Adds the grid, its occupied cells, and for solids the samples that the exact cells solve.
Result<void> addCells(Method& method, const Asset& asset, const Shape& shape, glm::ivec3 cells, bool isExact) {
    const bool isOwn = asset.occupancy && asset.occupancy->grid.cells == cells;
    if (isOwn)
        method.occupancy = std::make_unique<Occupancy>(*asset.occupancy);
    else
        VCP_TRY(take(occupy(shape, cells), method.occupancy));
    if (!isExact) return {};
    if (asset.heights) {
        method.heights = &*asset.heights;
        return {};
    }
    if (isOwn && asset.field) {
        method.field = std::make_unique<SampledField>(*asset.field);
        return {};
    }
    VCP_TRY(take(sampleField(shape, cells * 2), method.field));
    occupyField(*method.field, *method.occupancy);
    return {};
}

/// Returns the points of a map or of slices: as many along z as the slab is high, and one more, but not fewer than 4.
glm::ivec3 pointsOf(glm::dvec3 extent, const MethodOptions& options) {
    const int n = options.cells != 0 ? options.cells : kDefaultPoints;
    const int layers = options.layers != 0 ? options.layers : std::clamp(int(std::lround(n * extent.z)) + 1, 4, 512);
    return {n, std::max(2, int(std::lround(n * extent.y))), layers};
}

/// Whether bits say what is hit. Over bases that bend, rays that leave by the top again are what silhouettes are.
bool hasVisibility(const MethodOptions& options, Curvatures curvatures) {
    return options.name == "gdm-visibility" || curvatures.samples > 1;
}

/// Returns the asset's map where it is what is asked for; any map of the asset's where no size is.
const GdmMap* storedMap(const Asset& asset, const GdmOptions& traced, const MethodOptions& options) {
    const std::optional<GdmMap>& stored = traced.ofTop ? asset.vdm : asset.gdm;
    if (!stored || options.table != nullptr) return nullptr;
    const GdmMap& map = *stored;
    const bool isThere = map.withVisibility || !hasVisibility(options, map.table.curvatures);
    const int rank = map.factors ? map.factors->rank : 0;
    const glm::ivec2 directions(map.table.directions.thetas, map.table.directions.phis);
    const glm::ivec3 points = {traced.points.x, traced.points.y, traced.ofTop ? 1 : traced.points.z};
    const bool isAlike = map.table.nodes == points && directions == traced.directions &&
                         map.table.curvatures == traced.curvatures && rank == (options.rank + 3) / 4 * 4 &&
                         map.bits == options.bits;
    return isThere && (isAlike || (options.cells == 0 && options.layers == 0)) ? &map : nullptr;
}

Result<Method> displacementMethod(const Asset& asset, const Shape& shape, const MethodOptions& options) {
    if (options.rank < 0 || options.rank > kMostRank)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("a rank of {}; it must be from 0 to {}", options.rank, kMostRank)};
    Method method;
    method.kind = WalkKind::Displacement;
    const GdmOptions traced = tracedBy(shape, options);
    if (const GdmMap* stored = storedMap(asset, traced, options)) {
        method.gdm = std::make_unique<GdmMap>(*stored);
        method.gdm->withVisibility = hasVisibility(options, stored->table.curvatures);
        return method;
    }
    VCP_TRY_ASSIGN(auto properties, sampleProperties(shape, traced.points));
    DistanceTable table;
    if (options.table != nullptr) {
        table = *options.table;
    } else {
        VCP_TRY_ASSIGN(table, traceTable(asset, shape, traced));
    }
    VCP_TRY(take(packMap(std::move(table), options.rank, options.bits, hasVisibility(options, traced.curvatures),
                         std::move(properties)),
                 method.gdm));
    return method;
}

}  // namespace

Skipping Method::skipping() const {
    if (boxes) return {.boxes = boxes.get(), .guesses = guesses.get(), .mostGuesses = mostGuesses};
    if (compressed) return {.compressed = compressed.get()};
    if (distances) return {.distances = distances.get()};
    return {.occupancy = occupancy.get()};
}

Result<MarchArrays> Method::arrays() const {
    const bool isComplete = kind == WalkKind::Sphere         ? sphere != nullptr
                            : kind == WalkKind::Displacement ? gdm != nullptr
                            : kind == WalkKind::Slices       ? volume != nullptr
                            : kind == WalkKind::Layers       ? layers != nullptr
                            : kind != WalkKind::Grid         ? heights != nullptr
                                                             : boxes || compressed || distances || occupancy;
    if (!isComplete) return Error{.code = ErrorCode::Usage, .message = "a mesostructure method without its arrays"};
    switch (kind) {
        case WalkKind::Relief:
            return reliefArrays(*heights, relief);
        case WalkKind::Layers:
            return layeredArrays(*layers, relief);
        case WalkKind::Pyramid:
            return pyramidArrays(*heights);
        case WalkKind::Sphere:
            return sphereArrays(*sphere);
        case WalkKind::Displacement:
            return gdmArrays(*gdm);
        case WalkKind::Slices:
            return slicesArrays(*volume);
        default:
            return gridArrays(skipping(), surface());
    }
}

Result<std::unique_ptr<Marcher>> Method::marcher() const {
    switch (kind) {
        case WalkKind::Relief:
            return reliefMarcher(*heights, relief);
        case WalkKind::Layers:
            return reliefMarcher(*layers, relief);
        case WalkKind::Pyramid:
            return pyramidMarcher(*heights);
        case WalkKind::Sphere:
            return sphereMarcher(*sphere);
        case WalkKind::Displacement:
            return gdmMarcher(*gdm);
        case WalkKind::Slices:
            return slicesMarcher(*volume);
        default:
            return gridMarcher(skipping(), surface());
    }
}

std::span<const std::string_view> methodNames() { return kMethodNames; }

bool methodFits(std::string_view name, const Asset& asset) {
    return asset.heights.has_value() || name == kLayersName || !(name.starts_with("relief") || name == "pyramid");
}

GdmOptions tracedBy(const Shape& shape, const MethodOptions& options) {
    GdmOptions traced;
    traced.points = pointsOf(shape.extent(), options), traced.directions = options.directions;
    traced.ofTop = options.name == "vdm", traced.shareOut = options.shareOut;
    if (traced.ofTop) traced.curvatures = options.curvatures;
    return traced;
}

Result<Method> buildMethod(const Asset& asset, const Shape& shape, const MethodOptions& options) {
    const std::string& name = options.name;
    const auto known = std::ranges::find(kMethodNames, name);
    if (known == kMethodNames.end())
        return Error{
            .code = ErrorCode::Usage,
            .message = fmt::format("there is no method \"{}\"; there are {}", name, fmt::join(kMethodNames, ", "))};
    if (!methodFits(name, asset))
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("{} is for height fields; {} is a solid", name, asset.name)};
    Method method;
    if (name == kLayersName) {
        method.kind = WalkKind::Layers;
        method.relief = {.steps = options.steps,
                         .refinement = Refinement::Binary,
                         .refinements = options.refinements,
                         .tolerance = options.tolerance};
        const int n = options.cells != 0 ? options.cells : kDefaultTexels;
        VCP_TRY(take(traceLayers(shape, {n, std::max(1, int(std::lround(n * shape.extent().y)))},
                                 options.layers != 0 ? options.layers : kDefaultLayers),
                     method.layers));
        return method;
    }
    if (name.starts_with("relief") || name == "pyramid") {
        method.kind = name == "pyramid" ? WalkKind::Pyramid : WalkKind::Relief;
        method.heights = &*asset.heights;
        if (name != "pyramid")
            method.relief = {.steps = options.steps,
                             .refinement = kRefinements[size_t(known - kMethodNames.begin())],
                             .refinements = options.refinements,
                             .tolerance = options.tolerance};
        return method;
    }
    if (name == "slices") {
        method.kind = WalkKind::Slices;
        VCP_TRY(take(sampleProperties(shape, pointsOf(shape.extent(), options)), method.volume));
        return method;
    }
    if (name == "gdm" || name == "gdm-visibility" || name == "vdm") return displacementMethod(asset, shape, options);
    const glm::ivec3 cells = cellsOf(asset, shape.extent(), options.cells);
    const bool withBoxes = name == "boxes" || name == "gdm-safe",
               isExact = withBoxes || name == "cells" || name == "ddm-cells";
    if (isExact && asset.heights && (asset.heights->size.x % cells.x != 0 || asset.heights->size.y % cells.y != 0))
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("a grid of {} x {} cells does not divide the height map's {} x {} texels",
                                            cells.x, cells.y, asset.heights->size.x, asset.heights->size.y)};
    if (name == "sphere") {
        method.kind = WalkKind::Sphere;
        VCP_TRY(take(buildSphereMap(shape, {.cells = cells}), method.sphere));
        return method;
    }
    VCP_TRY(addCells(method, asset, shape, cells, isExact));
    const bool isOwn = asset.occupancy && asset.occupancy->grid.cells == cells;
    if (withBoxes)
        method.boxes =
            std::make_unique<OctantBoxes>(isOwn && asset.boxes ? *asset.boxes : buildOctantBoxes(*method.occupancy));
    if (method.boxes && method.field) markSmallCells(*method.field, *method.boxes);
    if (name == "gdm-safe") {
        method.mostGuesses = options.mostGuesses;
        if (isOwn && asset.guesses)
            method.guesses = std::make_unique<SafeFactors>(*asset.guesses);
        else
            VCP_TRY(take(buildGuesses(*method.occupancy, options.guesses), method.guesses));
    }
    if (withBoxes || name == "cells") return method;
    const auto addPatches = [&](CrossingRule rule) {
        return take(buildPatches(shape, *method.occupancy, rule), method.patches);
    };
    if (name == "quadric") {
        VCP_TRY(addPatches(CrossingRule::Direct));
        return method;
    }
    const Cones cones = name == "dm" ? Cones{1, 1} : options.cones;
    const double cap = options.cap > 0 ? options.cap : cones.areSigns() ? 0.25 : 0.125;
    if (isOwn && asset.distances && asset.distances->cones.azimuth == cones.azimuth &&
        asset.distances->cones.elevation == cones.elevation && options.cap <= 0 &&
        options.distances == DistanceRule::AnyPoint)
        method.distances = std::make_unique<DistanceMap>(*asset.distances);
    else
        VCP_TRY(
            take(buildDistanceMap(*method.occupancy, {.cones = cones, .rule = options.distances, .cap = cap}, &shape),
                 method.distances));
    const bool isQuadric = name.starts_with("ddm-quadric");
    if (isQuadric) VCP_TRY(addPatches(name == "ddm-quadric" ? CrossingRule::Direct : CrossingRule::Fitted));
    if (isQuadric || name == "ddm-compressed")
        VCP_TRY(take(compressMap(*method.distances, std::array{4}), method.compressed));
    return method;
}

}  // namespace vcp::meso
