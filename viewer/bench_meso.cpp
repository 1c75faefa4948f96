#include "viewer/bench_meso.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "mesostructure/solids.h"

namespace vcp {

namespace {

using namespace meso;
using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct View {
    std::string_view name;
    double elevation;  ///< degrees below the horizon
    double part;       ///< of the tile that the rays enter
    bool isShadow = false;
};
constexpr std::array<View, 8> kViews = {{{"overhead", 89, 1},
                                         {"45", 45, 1},
                                         {"15", 15, 1},
                                         {"5", 5, 1},
                                         {"1", 1, 1},
                                         {"close", 35, 0.05},
                                         {"far", 35, 40},
                                         {"shadow", 30, 1, true}}};

/// An asset with the data that methods share.
struct Subject {
    Asset asset;
    std::unique_ptr<Shape> shape;
    double texel = 0;  ///< tile units
};

Result<std::unique_ptr<Subject>> subjectOf(const std::string& name) {
    auto subject = std::make_unique<Subject>();
    Asset& asset = subject->asset;
    const auto isIn = [&](const auto& names) { return std::ranges::find(names, name) != names.end(); };
    asset.name = name;
    if (isIn(heightFieldNames())) {
        auto map = makeHeightField(name, 256, 1);
        if (!map) return map.error();
        asset.heights = *std::move(map);
    } else if (isIn(solidNames())) {
        asset.solid = name, asset.seed = 1;
    } else {
        if (!name.ends_with(".meso"))
            return Error{.code = ErrorCode::Usage, .message = fmt::format("\"{}\" is neither a procedural height field or solid nor an asset (.meso)", name)};
        auto read = readAsset(name);
        if (!read) return read.error();
        asset = *std::move(read);
    }
    auto shape = shapeOf(asset);
    if (!shape) return shape.error();
    subject->shape = *std::move(shape);
    asset.extent = subject->shape->extent();
    subject->texel = asset.heights ? 1.0 / asset.heights->size.x : 1.0 / 128;
    return subject;
}

/// Rays of a view, a jittered grid, the same for every method.
std::vector<MarchRay> raysOf(const Subject& subject, const View& view, int count) {
    std::mt19937 random(29);
    std::uniform_real_distribution<double> unit(0, 1);
    const glm::dvec3 extent = subject.shape->extent();
    const int side = std::max(1, int(std::sqrt(count)));
    std::vector<MarchRay> rays;
    for (int i = 0; i < side * side; ++i) {
        const double x = (i % side + unit(random)) / side, y = (i / side + unit(random)) / side;
        // A camera's spread: half a right angle across, a little up and down.
        const double turn = (0.3 + 0.8 * x + (view.part > 1 ? 5 * unit(random) : 0)), elevation = view.elevation * (0.9 + 0.2 * y) * std::numbers::pi / 180;
        const double down = std::min(elevation, 0.4999 * std::numbers::pi);
        MarchRay ray{{view.part * x * extent.x, view.part * y * extent.y, extent.z},
                     {std::cos(down) * std::cos(turn), std::cos(down) * std::sin(turn), -std::sin(down)},
                     64};
        if (view.isShadow) {
            // From above what a steep ray hits, towards a light.
            const TruthHit hit = subject.shape->trace(ray.origin, glm::normalize(glm::dvec3(0.1, 0.2, -1)), 64);
            if (!hit.hit) continue;
            const glm::dvec3 from = ray.origin + hit.t * glm::normalize(glm::dvec3(0.1, 0.2, -1)) + 1.5 * subject.texel * hit.normal;
            ray = {from, -ray.direction, 64};
            if (from.z >= extent.z || subject.shape->field(from) <= 0) continue;
        }
        rays.push_back(ray);
    }
    return rays;
}

/// A marcher with what it reads.
struct Method {
    std::string name, knob;
    double preprocessSeconds = 0;
    std::unique_ptr<Occupancy> occupancy;
    std::unique_ptr<SampledField> field;
    std::unique_ptr<DistanceMap> distances;
    std::unique_ptr<CompressedMap> compressed;
    std::unique_ptr<OctantBoxes> boxes;
    std::unique_ptr<PatchSet> patches;
    std::unique_ptr<Marcher> marcher;
};

template <class T>
Result<void> take(Result<T> made, std::unique_ptr<T>& to) {
    if (!made) return made.error();
    to = std::make_unique<T>(*std::move(made));
    return {};
}

glm::ivec3 cellsOf(const Subject& subject, int n) {
    const glm::dvec3 extent = subject.shape->extent();
    if (subject.asset.heights) return gridFor(subject.asset, {n, std::max(1, int(std::lround(n * extent.y))), std::clamp(int(std::ceil(extent.z * n)), 4, 256)});
    return {n, std::max(1, int(std::lround(n * extent.y))), std::max(1, int(std::ceil(extent.z * n)))};
}

using Build = std::function<Result<void>(const Subject&, Method&)>;

struct Entry {
    std::string name, knob;
    bool isDefault = false;
    bool forHeights = true, forSolids = true;
    Build build;
};

Build reliefOf(int steps, Refinement refinement, int refinements) {
    return [=](const Subject& s, Method& m) -> Result<void> {
        m.marcher = reliefMarcher(*s.asset.heights, {.steps = steps, .refinement = refinement, .refinements = refinements});
        return {};
    };
}

Build distancesOf(int cells, Cones cones, bool isCompressed, bool withPatches, CrossingRule rule) {
    return [=](const Subject& s, Method& m) -> Result<void> {
        VCP_TRY(take(occupy(*s.shape, cellsOf(s, cells)), m.occupancy));
        VCP_TRY(take(buildDistanceMap(*m.occupancy, {.cones = cones, .cap = cones.areSigns() ? 0.25 : 0.125}), m.distances));
        if (withPatches) VCP_TRY(take(buildPatches(*s.shape, *m.occupancy, rule), m.patches));
        if (isCompressed) VCP_TRY(take(compressMap(*m.distances, std::array{4}), m.compressed));
        Skipping skipping{.distances = m.distances.get()};
        if (isCompressed) skipping = {.compressed = m.compressed.get()};
        auto marcher = gridMarcher(skipping, {.patches = m.patches.get()});
        if (!marcher) return marcher.error();
        m.marcher = *std::move(marcher);
        return {};
    };
}

/// Octant boxes, or no skipping at all, with exact cells.
Build exactOf(int cells, bool withBoxes) {
    return [=](const Subject& s, Method& m) -> Result<void> {
        const bool isHeights = s.asset.heights.has_value();
        const glm::ivec3 grid = cellsOf(s, cells);
        VCP_TRY(take(occupy(*s.shape, grid), m.occupancy));
        if (!isHeights) {
            VCP_TRY(take(sampleField(*s.shape, grid * 2), m.field));
            occupyField(*m.field, *m.occupancy);
        }
        if (withBoxes) m.boxes = std::make_unique<OctantBoxes>(buildOctantBoxes(*m.occupancy));
        Skipping skipping{.occupancy = m.occupancy.get()};
        if (withBoxes) skipping = {.boxes = m.boxes.get()};
        auto marcher = gridMarcher(skipping, {.heights = isHeights ? &*s.asset.heights : nullptr, .field = m.field.get()});
        if (!marcher) return marcher.error();
        m.marcher = *std::move(marcher);
        return {};
    };
}

Build sphereOf(int cells) {
    return [=](const Subject& s, Method& m) -> Result<void> {
        auto marcher = sphereMarcher(*s.shape, {.cells = cellsOf(s, cells)});
        if (!marcher) return marcher.error();
        m.marcher = *std::move(marcher);
        return {};
    };
}

std::vector<Entry> entries() {
    std::vector<Entry> all;
    const std::pair<const char*, Refinement> refinements[] = {{"relief-binary", Refinement::Binary},
                                                              {"relief-secant", Refinement::Secant},
                                                              {"relief-secant-printed", Refinement::SecantAsPrinted},
                                                              {"relief-illinois", Refinement::Illinois}};
    for (const auto& [name, refinement] : refinements)
        for (const int steps : {5, 10, 32, 64, 256}) all.push_back({name, fmt::format("steps {}", steps), steps == 32, true, false, reliefOf(steps, refinement, 10)});
    all.push_back({"pyramid", "exact", true, true, false, [](const Subject& s, Method& m) -> Result<void> {
                       m.marcher = pyramidMarcher(*s.asset.heights);
                       return {};
                   }});
    for (const int cells : {32, 64, 128}) all.push_back({"sphere", fmt::format("grid {}", cells), cells == 64, true, true, sphereOf(cells)});
    for (const int cells : {32, 64, 128})
        all.push_back({"dm", fmt::format("grid {}", cells), cells == 64, true, true, distancesOf(cells, {1, 1}, false, false, CrossingRule::Direct)});
    for (const Cones cones : {Cones{2, 1}, Cones{4, 1}, Cones{8, 1}, Cones{4, 2}})
        all.push_back({"ddm", fmt::format("{}x{} grid 64", cones.azimuth, cones.elevation), cones.azimuth == 4 && cones.elevation == 1, true, true,
                       distancesOf(64, cones, false, false, CrossingRule::Direct)});
    for (const int cells : {32, 128})
        all.push_back({"ddm", fmt::format("4x1 grid {}", cells), false, true, true, distancesOf(cells, {4, 1}, false, false, CrossingRule::Direct)});
    for (const int cells : {16, 32, 64, 128})
        all.push_back({"ddm-quadric", fmt::format("4x1 grid {}", cells), cells == 64, true, true, distancesOf(cells, {4, 1}, true, true, CrossingRule::Direct)});
    for (const int cells : {16, 32, 64})
        all.push_back({"ddm-quadric-fitted", fmt::format("4x1 grid {}", cells), cells == 32, true, true, distancesOf(cells, {4, 1}, true, true, CrossingRule::Fitted)});
    for (const int cells : {16, 32, 64}) all.push_back({"boxes", fmt::format("grid {}", cells), cells == 64, true, true, exactOf(cells, true)});
    all.push_back({"cells", "grid 64", true, true, true, exactOf(64, false)});
    return all;
}

/// The value that this part of the sorted values does not exceed.
double quantile(std::vector<double>& values, double part) {
    if (values.empty()) return 0;
    std::ranges::sort(values);
    return values[std::min(values.size() - 1, size_t(part * double(values.size())))];
}

MesoJudged judge(const std::vector<MarchResult>& results, const std::vector<TruthHit>& truths, double texel) {
    MesoJudged judged;
    std::vector<double> errors, angles;
    double counted = 0;
    std::array<double, 6> counts{};
    for (size_t i = 0; i < results.size(); ++i) {
        const MarchResult& found = results[i];
        const TruthHit& truth = truths[i];
        if (!truth.resolved) continue;
        ++counted;
        MesoClass c = MesoClass::Unresolved;
        if (found.state == MarchState::Miss) c = truth.hit ? MesoClass::Missed : MesoClass::Miss;
        if (found.state == MarchState::Hit) {
            const double error = std::abs(found.t - truth.t) / texel;
            c = !truth.hit ? MesoClass::False : error > 2 ? MesoClass::WrongFeature : MesoClass::Hit;
            if (c == MesoClass::Hit) {
                errors.push_back(error);
                if (found.normal != glm::vec3(0)) angles.push_back(std::acos(std::clamp(glm::dot(glm::dvec3(found.normal), truth.normal), -1.0, 1.0)) * 180 / std::numbers::pi);
            }
        }
        ++counts[size_t(c)];
    }
    for (size_t i = 0; i < counts.size(); ++i) judged.fractions[i] = counted > 0 ? counts[i] / counted : 0;
    judged.p50 = quantile(errors, 0.5), judged.p95 = quantile(errors, 0.95), judged.p99 = quantile(errors, 0.99), judged.max = quantile(errors, 1);
    judged.normalP50 = quantile(angles, 0.5), judged.normalP95 = quantile(angles, 0.95);
    return judged;
}

void countWork(const std::vector<MarchResult>& results, BenchMesoRow& row) {
    std::vector<double> iterations;
    for (const MarchResult& r : results) {
        row.fetchesMean += r.fetches, row.iterationsMean += r.iterations, row.surfaceTestsMean += r.surfaceTests;
        row.iterationBins[r.iterations <= 10 ? 0 : r.iterations <= 34 ? 1 : r.iterations <= 59 ? 2 : 3] += 1;
        iterations.push_back(r.iterations);
    }
    const double n = std::max<double>(1, double(results.size()));
    for (double* sum : {&row.fetchesMean, &row.iterationsMean, &row.surfaceTestsMean, &row.iterationBins[0], &row.iterationBins[1], &row.iterationBins[2], &row.iterationBins[3]}) *sum /= n;
    int groups = 0;
    for (size_t i = 0; i + 8 <= iterations.size(); i += 8, ++groups) {
        double most = 0, sum = 0;
        for (size_t k = i; k < i + 8; ++k) most = std::max(most, iterations[k]), sum += iterations[k];
        row.divergence8 += most / (sum / 8);
    }
    if (groups > 0) row.divergence8 /= groups;
    row.iterationsP95 = quantile(iterations, 0.95);
}

BenchMesoRow measure(const Subject& subject, const Method& method, const View& view, const std::vector<MarchRay>& rays, const std::vector<TruthHit>& truths, int repetitions) {
    BenchMesoRow row;
    row.asset = subject.asset.name, row.view = view.name, row.method = method.name, row.knob = method.knob;
    row.rays = rays.size(), row.bytes = method.marcher->bytes(), row.preprocessSeconds = method.preprocessSeconds;
    std::vector<MarchResult> results(rays.size());
    std::vector<double> times;
    for (int repetition = 0; repetition <= repetitions; ++repetition) {
        const auto start = Clock::now();
        for (size_t i = 0; i < rays.size(); ++i) results[i] = method.marcher->march(rays[i]);
        if (repetition > 0) times.push_back(secondsSince(start) * 1e9 / double(std::max<size_t>(1, rays.size())));
    }
    row.nsPerRay = quantile(times, 0.5);
    row.shape = judge(results, truths, subject.texel);
    countWork(results, row);
    if (method.field) {
        std::vector<TruthHit> own;
        for (const MarchRay& ray : rays) own.push_back(traceField(*method.field, ray));
        row.solver = judge(results, own, subject.texel), row.hasSolver = true;
    }
    return row;
}

/// Rays from random points of empty cells: the surface must not be nearer than the map says.
Result<void> check(const Subject& subject, uint64_t rays, std::vector<MesoCheck>& checks) {
    std::unique_ptr<Occupancy> occupancy;
    VCP_TRY(take(occupy(*subject.shape, cellsOf(subject, 32)), occupancy));
    const glm::dvec3 extent = subject.shape->extent();
    struct Case {
        std::string name;
        DistanceOptions options;
    };
    const Case cases[] = {{"1x1", {.cones = {1, 1}}},
                          {"4x2", {.cones = {4, 2}}},
                          {"8x1", {.cones = {8, 1}, .cap = 0.125}},
                          {"4x2 paper", {.cones = {4, 2}, .rule = DistanceRule::Paper}}};
    for (const Case& c : cases) {
        std::unique_ptr<DistanceMap> map;
        VCP_TRY(take(buildDistanceMap(*occupancy, c.options, subject.shape.get()), map));
        MesoCheck result{subject.asset.name, c.name};
        std::mt19937 random(31);
        std::uniform_real_distribution<double> unit(0, 1);
        std::normal_distribution<double> bell;
        while (result.rays < rays) {
            const glm::dvec3 from(unit(random) * extent.x, unit(random) * extent.y, unit(random) * extent.z);
            const glm::dvec3 direction = glm::normalize(glm::dvec3(bell(random), bell(random), bell(random)));
            const glm::ivec3 cell(glm::floor(from / map->grid.cell));
            const int cone = coneOf(map->cones, glm::vec3(direction));
            ++result.rays;
            if (cell.z >= map->grid.cells.z || map->steps[map->slot(cone, cell)] == kOccupied || subject.shape->field(from) <= 0) continue;
            const double length = map->length(cone, cell);
            const TruthHit truth = subject.shape->trace(from, direction, length);
            if (truth.hit && truth.t < length) ++result.oversteps, result.worstTexels = std::max(result.worstTexels, (length - truth.t) / subject.texel);
        }
        checks.push_back(result);
    }
    return {};
}

template <class Names>
Result<void> knows(const char* what, const std::vector<std::string>& asked, const Names& known) {
    for (const std::string& name : asked)
        if (std::ranges::find(known, name) == known.end()) return Error{.code = ErrorCode::Usage, .message = fmt::format("there is no {} \"{}\"", what, name)};
    return {};
}

bool isAsked(const std::vector<std::string>& asked, std::string_view name) { return asked.empty() || std::ranges::find(asked, name) != asked.end(); }

}  // namespace

std::vector<std::string> mesoMethodNames() {
    std::vector<std::string> names;
    for (const Entry& entry : entries())
        if (names.empty() || names.back() != entry.name) names.push_back(entry.name);
    return names;
}

std::vector<std::string> mesoViewNames() {
    std::vector<std::string> names;
    for (const View& view : kViews) names.emplace_back(view.name);
    return names;
}

Result<BenchMesoReport> benchMeso(const BenchMesoOptions& options) {
    VCP_TRY(knows("method", options.methods, mesoMethodNames()));
    VCP_TRY(knows("view", options.views, mesoViewNames()));
    std::vector<std::string> assets = options.assets;
    if (assets.empty()) assets = {"fbm", "hemispheres", "bricks", "maze", "needle", "beads", "chain", "weave", "ball", "scales", "kitten"};
    BenchMesoReport report;
    for (size_t a = 0; a < assets.size(); ++a) {
        const auto subject = subjectOf(assets[a]);
        if (!subject) return subject.error();
        std::vector<const View*> views;
        std::vector<std::vector<MarchRay>> rays;
        std::vector<std::vector<TruthHit>> truths;
        for (const View& view : kViews) {
            if (!isAsked(options.views, view.name)) continue;
            views.push_back(&view);
            rays.push_back(raysOf(**subject, view, options.rays));
            truths.emplace_back();
            for (const MarchRay& ray : rays.back()) truths.back().push_back((*subject)->shape->trace(ray.origin, ray.direction, ray.tMax));
        }
        for (const Entry& entry : entries()) {
            if (!isAsked(options.methods, entry.name) || !(options.sweep || entry.isDefault) || !((*subject)->asset.heights ? entry.forHeights : entry.forSolids)) continue;
            if (options.progress && !options.progress(assets[a] + ": " + entry.name, double(a) / double(assets.size()))) return Error{.code = ErrorCode::Cancelled, .message = "cancelled"};
            Method method;
            method.name = entry.name, method.knob = entry.knob;
            const auto start = Clock::now();
            VCP_TRY(entry.build(**subject, method));
            method.preprocessSeconds = secondsSince(start);
            for (size_t v = 0; v < views.size(); ++v) report.rows.push_back(measure(**subject, method, *views[v], rays[v], truths[v], options.repetitions));
        }
        if (options.checkRays > 0) VCP_TRY(check(**subject, options.checkRays, report.checks));
    }
    return report;
}

}  // namespace vcp
