#include "viewer/bench_meso.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "mesostructure/method.h"
#include "render/meso_marcher.h"
#include "viewer/meso_scene.h"

namespace vcp {

namespace {

using namespace meso;
using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct RayView {
    std::string_view name;
    double elevation;  ///< degrees below the horizon
    double part;       ///< of the tile that the rays enter
    bool isShadow = false;
};
constexpr std::array<RayView, 8> kViews = {{{"overhead", 89, 1},
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
    auto asset = openMesoAsset(name);
    if (!asset) return asset.error();
    subject->asset = *std::move(asset);
    auto shape = shapeOf(subject->asset);
    if (!shape) return shape.error();
    subject->shape = *std::move(shape);
    subject->texel = subject->asset.heights ? 1.0 / subject->asset.heights->size.x : 1.0 / 128;
    return subject;
}

/// Rays of a view, a jittered grid, the same for every method.
std::vector<MarchRay> raysOf(const Subject& subject, const RayView& view, int count) {
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

/// A method that is measured.
struct Measured {
    std::string name, knob;
    double preprocessSeconds = 0;
    meso::Method method;
    std::unique_ptr<Marcher> marcher;
};

glm::ivec3 cellsOf(const Subject& subject, int n) {
    const glm::dvec3 extent = subject.shape->extent();
    return {n, std::max(1, int(std::lround(n * extent.y))), std::max(1, int(std::ceil(extent.z * n)))};
}

struct Entry {
    std::string knob;
    bool isDefault = false;
    MethodOptions options;
};

std::vector<Entry> entries() {
    std::vector<Entry> all;
    for (const char* name : {"relief-binary", "relief-secant", "relief-secant-printed", "relief-illinois"})
        for (const int steps : {5, 10, 32, 64, 256}) all.push_back({fmt::format("steps {}", steps), steps == 32, {.name = name, .steps = steps}});
    all.push_back({"exact", true, {.name = "pyramid"}});
    for (const char* name : {"sphere", "dm"})
        for (const int cells : {32, 64, 128}) all.push_back({fmt::format("grid {}", cells), cells == 64, {.name = name, .cells = cells}});
    for (const Cones cones : {Cones{2, 1}, Cones{4, 1}, Cones{8, 1}, Cones{4, 2}})
        all.push_back({fmt::format("{}x{} grid 64", cones.azimuth, cones.elevation), cones.azimuth == 4 && cones.elevation == 1, {.name = "ddm", .cells = 64, .cones = cones}});
    for (const int cells : {32, 128}) all.push_back({fmt::format("4x1 grid {}", cells), false, {.name = "ddm", .cells = cells}});
    for (const int cells : {16, 32, 64, 128}) all.push_back({fmt::format("4x1 grid {}", cells), cells == 64, {.name = "ddm-quadric", .cells = cells}});
    for (const int cells : {16, 32, 64}) all.push_back({fmt::format("4x1 grid {}", cells), cells == 32, {.name = "ddm-quadric-fitted", .cells = cells}});
    for (const int cells : {16, 32, 64, 128}) all.push_back({fmt::format("grid {}", cells), cells == 64, {.name = "boxes", .cells = cells}});
    all.push_back({"grid 64", true, {.name = "cells", .cells = 64}});
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

Result<BenchMesoRow> measure(const Subject& subject, const Measured& method, const RayView& view, const std::vector<MarchRay>& rays, const std::vector<TruthHit>& truths,
                             int repetitions, MesoMarcher* renderer) {
    BenchMesoRow row;
    row.asset = subject.asset.name, row.view = view.name, row.method = method.name, row.knob = method.knob;
    row.rays = rays.size(), row.bytes = method.marcher->bytes(), row.preprocessSeconds = method.preprocessSeconds;
    std::vector<MarchResult> results(rays.size());
    std::vector<double> times;
    if (renderer != nullptr) {
        row.device = renderer->device().name;
        auto marched = renderer->march(method.method, rays, repetitions);
        if (!marched) return marched.error();
        results = std::move(marched->results), times = std::move(marched->nsPerRay);
    }
    for (int repetition = 0; repetition <= repetitions && renderer == nullptr; ++repetition) {
        const auto start = Clock::now();
        for (size_t i = 0; i < rays.size(); ++i) results[i] = method.marcher->march(rays[i]);
        if (repetition > 0) times.push_back(secondsSince(start) * 1e9 / double(std::max<size_t>(1, rays.size())));
    }
    row.nsPerRay = quantile(times, 0.5);
    row.shape = judge(results, truths, subject.texel);
    countWork(results, row);
    if (method.method.field) {
        std::vector<TruthHit> own;
        for (const MarchRay& ray : rays) own.push_back(traceField(*method.method.field, ray));
        row.solver = judge(results, own, subject.texel), row.hasSolver = true;
    }
    return row;
}

/// Rays from random points of empty cells: the surface must not be nearer than the map says.
Result<void> check(const Subject& subject, uint64_t rays, std::vector<MesoCheck>& checks) {
    const auto occupancy = occupy(*subject.shape, cellsOf(subject, 32));
    if (!occupancy) return occupancy.error();
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
        const auto map = buildDistanceMap(*occupancy, c.options, subject.shape.get());
        if (!map) return map.error();
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

/// Table 3: texels of the plain map over those of lookup and atlas, at the paper's resolution.
Result<void> compareCompression(std::vector<MesoPublished>& published) {
    struct Row {
        const char* asset;
        int block;
        double ratio;
    };
    for (const Row& row : {Row{"beads", 2, 4}, Row{"kitten", 4, 12.8}, Row{"ball", 8, 256}}) {
        const auto subject = subjectOf(row.asset);
        if (!subject) return subject.error();
        const auto occupancy = occupy(*(*subject)->shape, cellsOf(**subject, 256));
        if (!occupancy) return occupancy.error();
        const auto map = buildDistanceMap(*occupancy, {.cones = {1, 1}});
        if (!map) return map.error();
        const auto compressed = compressMap(*map, std::array{row.block});
        if (!compressed) return compressed.error();
        published.push_back({fmt::format("Table 3: texels, blocks of {}", row.block), row.asset, "texels", row.ratio, row.ratio, compressed->texelRatio(), 0});
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
        if (names.empty() || names.back() != entry.options.name) names.push_back(entry.options.name);
    return names;
}

std::vector<std::string> mesoViewNames() {
    std::vector<std::string> names;
    for (const RayView& view : kViews) names.emplace_back(view.name);
    return names;
}

Result<BenchMesoReport> benchMeso(const BenchMesoOptions& options) {
    VCP_TRY(knows("method", options.methods, mesoMethodNames()));
    VCP_TRY(knows("view", options.views, mesoViewNames()));
    std::vector<std::string> assets = options.assets;
    if (assets.empty()) assets = {"fbm", "hemispheres", "bricks", "maze", "needle", "beads", "chain", "weave", "ball", "scales", "kitten"};
    std::unique_ptr<MesoMarcher> renderer;
    if (options.device) {
        auto made = MesoMarcher::create({.device = *options.device});
        if (!made) return made.error();
        renderer = *std::move(made);
    }
    BenchMesoReport report;
    for (size_t a = 0; a < assets.size(); ++a) {
        const auto subject = subjectOf(assets[a]);
        if (!subject) return subject.error();
        std::vector<const RayView*> views;
        std::vector<std::vector<MarchRay>> rays;
        std::vector<std::vector<TruthHit>> truths;
        for (const RayView& view : kViews) {
            if (!isAsked(options.views, view.name)) continue;
            views.push_back(&view);
            rays.push_back(raysOf(**subject, view, options.rays));
            truths.emplace_back();
            for (const MarchRay& ray : rays.back()) truths.back().push_back((*subject)->shape->trace(ray.origin, ray.direction, ray.tMax));
        }
        for (const Entry& entry : entries()) {
            if (!isAsked(options.methods, entry.options.name) || !(options.sweep || entry.isDefault) || !methodFits(entry.options.name, (*subject)->asset)) continue;
            if (options.progress && !options.progress(assets[a] + ": " + entry.options.name, double(a) / double(assets.size())))
                return Error{.code = ErrorCode::Cancelled, .message = "cancelled"};
            Measured method;
            method.name = entry.options.name, method.knob = entry.knob;
            const auto start = Clock::now();
            auto made = buildMethod((*subject)->asset, *(*subject)->shape, entry.options);
            if (!made) return made.error();
            method.method = *std::move(made);
            auto marcher = method.method.marcher();
            if (!marcher) return marcher.error();
            method.marcher = *std::move(marcher);
            method.preprocessSeconds = secondsSince(start);
            for (size_t v = 0; v < views.size(); ++v) {
                auto row = measure(**subject, method, *views[v], rays[v], truths[v], options.repetitions, renderer.get());
                if (!row) return row.error();
                report.rows.push_back(*std::move(row));
            }
        }
        if (options.checkRays > 0) VCP_TRY(check(**subject, options.checkRays, report.checks));
    }
    if (report.rows.empty()) return Error{.code = ErrorCode::Usage, .message = "none of these methods is of these assets"};
    if (options.published) {
        report.published = publishedOf(report.rows);
        VCP_TRY(compareCompression(report.published));
    }
    return report;
}

}  // namespace vcp
