#include "viewer/bench/bench_meso.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "builder/measure/quantile.h"
#include "mesostructure/method.h"
#include "render/meso_marcher.h"
#include "viewer/bench/bench_remesh.h"
#include "viewer/scene/meso_scene.h"

namespace vcp {

namespace {

using namespace meso;
using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct RayView {
    std::string_view name;
    double elevation;  ///< degrees below the horizon
    double part;       ///< part of the tile that the rays enter
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

    struct Traced {
        GdmOptions options;
        double seconds = 0;
        DistanceTable table;
    };
    std::vector<std::unique_ptr<Traced>> traced;  ///< tables, which methods share
};

Result<std::unique_ptr<Subject>> subjectOf(const std::string& name) {
    auto subject = std::make_unique<Subject>();
    VCP_TRY_ASSIGN(auto asset, openMesoAsset(name));
    subject->asset = std::move(asset);
    VCP_TRY_ASSIGN(subject->shape, shapeOf(subject->asset));
    // The measured arrays are built here, not copied from the file.
    Asset& a = subject->asset;
    a.field.reset(), a.occupancy.reset(), a.distances.reset(), a.compressed.reset(), a.boxes.reset(), a.patches.reset();
    subject->texel = subject->asset.heights ? 1.0 / subject->asset.heights->size.x : 1.0 / 128;
    return subject;
}

/// Returns the rays of a view, a jittered grid, the same for every method.
std::vector<MarchRay> raysOf(const Subject& subject, const RayView& view, int count) {
    std::mt19937 random(29);
    std::uniform_real_distribution<double> unit(0, 1);
    const glm::dvec3 extent = subject.shape->extent();
    const int side = std::max(1, int(std::sqrt(count)));
    std::vector<MarchRay> rays;
    for (int i = 0; i < side * side; ++i) {
        const double x = (i % side + unit(random)) / side, y = (i / side + unit(random)) / side;
        // The rays spread as a camera's: half a right angle across, a little up and down.
        const double turn = (0.3 + 0.8 * x + (view.part > 1 ? 5 * unit(random) : 0)),
                     elevation = view.elevation * (0.9 + 0.2 * y) * std::numbers::pi / 180;
        const double down = std::min(elevation, 0.4999 * std::numbers::pi);
        MarchRay ray{{view.part * x * extent.x, view.part * y * extent.y, extent.z},
                     {std::cos(down) * std::cos(turn), std::cos(down) * std::sin(turn), -std::sin(down)},
                     64};
        if (view.isShadow) {
            // The ray starts at what a steep ray from above hits, and goes towards a light.
            const TruthHit hit = subject.shape->trace(ray.origin, glm::normalize(glm::dvec3(0.1, 0.2, -1)), 64);
            if (!hit.hit) continue;
            const glm::dvec3 from =
                ray.origin + hit.t * glm::normalize(glm::dvec3(0.1, 0.2, -1)) + 1.5 * subject.texel * hit.normal;
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

/// Adds displacement maps, slices, and guesses. Tables of one size are traced once.
void addDisplacementMaps(std::vector<Entry>& all) {
    for (const char* name : {"gdm", "gdm-visibility", "vdm"}) {
        const bool isOfTop = name == std::string_view("vdm");
        for (const int rank : {4, 8, 16, 32})
            all.push_back(
                {fmt::format("rank {} grid 32", rank), rank == 16, {.name = name, .cells = 32, .rank = rank}});
        all.push_back({"rank 16 8 bits grid 32", false, {.name = name, .cells = 32, .rank = 16, .bits = 8}});
        for (const int bits : {8, 16})
            all.push_back({fmt::format("table {} bits grid 32", bits),
                           false,
                           {.name = name, .cells = 32, .rank = 0, .bits = bits}});
        all.push_back(
            {"rank 16 grid 32 directions 8x16", false, {.name = name, .cells = 32, .rank = 16, .directions = {8, 16}}});
        all.push_back({"rank 16 grid 16", false, {.name = name, .cells = 16, .rank = 16}});
        if (!isOfTop) {
            all.push_back({"table 16 bits grid 64", false, {.name = name, .cells = 64, .rank = 0}});
            continue;
        }
        for (const int cells : {64, 128, 256}) {
            all.push_back({fmt::format("rank 16 grid {}", cells), false, {.name = name, .cells = cells, .rank = 16}});
            all.push_back(
                {fmt::format("table 16 bits grid {}", cells), false, {.name = name, .cells = cells, .rank = 0}});
        }
    }
    for (const int layers : {16, 32})
        all.push_back({fmt::format("rank 16 grid 32 layers {}", layers),
                       false,
                       {.name = "gdm", .cells = 32, .rank = 16, .layers = layers}});
    for (const int cells : {32, 64, 128, 256})
        all.push_back({fmt::format("grid {}", cells), cells == 64, {.name = "slices", .cells = cells}});
    for (const int layers : {16, 32})
        all.push_back(
            {fmt::format("grid 64 layers {}", layers), false, {.name = "slices", .cells = 64, .layers = layers}});
    for (const int cells : {16, 32, 64})
        for (const int guesses : {1, 2})
            all.push_back({fmt::format("grid {} guesses {}", cells, guesses),
                           cells == 32 && guesses == 1,
                           {.name = "gdm-safe", .cells = cells, .mostGuesses = guesses}});
}

std::vector<Entry> entries() {
    std::vector<Entry> all;
    constexpr std::array kSteps = {5, 10, 32, 64, 256};
    for (const int steps : kSteps)
        all.push_back({fmt::format("steps {}", steps), steps == 32, {.name = "relief-linear", .steps = steps}});
    for (const char* name : {"relief-binary", "relief-secant", "relief-secant-printed", "relief-illinois"})
        for (const int steps : kSteps) {
            all.push_back({fmt::format("steps {}", steps), steps == 32, {.name = name, .steps = steps}});
            // The tolerance of the listing ends the refinement early.
            for (const float tolerance : {1e-3f, 0.0f})
                all.push_back({fmt::format("steps {} tolerance {}", steps, tolerance),
                               false,
                               {.name = name, .steps = steps, .tolerance = tolerance}});
        }
    for (const int steps : kSteps)
        all.push_back({fmt::format("steps {} once", steps),
                       false,
                       {.name = "relief-secant", .steps = steps, .refinements = 1, .tolerance = 0}});
    // The two pictures that Risser et al. print side by side.
    for (const char* name : {"relief-binary", "relief-secant", "relief-illinois"})
        all.push_back({"steps 5 refinements 2", false, {.name = name, .steps = 5, .refinements = 2, .tolerance = 0}});
    for (const int steps : {32, 64, 128, 256})
        for (const int layers : {4, 8})
            for (const float tolerance : {0.01f, 0.0f})
                all.push_back({fmt::format("steps {} layers {}{}", steps, layers, tolerance == 0 ? " tolerance 0" : ""),
                               steps == 32 && layers == 4 && tolerance > 0,
                               {.name = "relief-layers", .steps = steps, .tolerance = tolerance, .layers = layers}});
    all.push_back({"exact", true, {.name = "pyramid"}});
    for (const char* name : {"sphere", "dm"})
        for (const int cells : {32, 64, 128})
            all.push_back({fmt::format("grid {}", cells), cells == 64, {.name = name, .cells = cells}});
    for (const Cones cones : {Cones{2, 1}, Cones{4, 1}, Cones{8, 1}, Cones{4, 2}})
        all.push_back({fmt::format("{}x{} grid 64", cones.azimuth, cones.elevation),
                       cones.azimuth == 4 && cones.elevation == 1,
                       {.name = "ddm", .cells = 64, .cones = cones}});
    for (const int cells : {32, 128})
        all.push_back({fmt::format("4x1 grid {}", cells), false, {.name = "ddm", .cells = cells}});
    for (const char* name : {"dm", "ddm"})
        for (const double cap : {0.5, 1.0})
            all.push_back({fmt::format("{}grid 128 cap {}", name == std::string_view("ddm") ? "4x1 " : "", cap),
                           false,
                           {.name = name, .cells = 128, .cap = cap}});
    all.push_back({"4x1 grid 64 paper", false, {.name = "ddm", .cells = 64, .distances = DistanceRule::Paper}});
    for (const int cells : {16, 32, 64, 128})
        all.push_back({fmt::format("4x1 grid {}", cells), cells == 64, {.name = "ddm-quadric", .cells = cells}});
    for (const int cells : {16, 32, 64, 128})
        all.push_back({fmt::format("grid {}", cells), cells == 64, {.name = "quadric", .cells = cells}});
    for (const char* name : {"ddm-compressed", "ddm-cells"})
        for (const int cells : {64, 128})
            all.push_back({fmt::format("4x1 grid {}", cells), cells == 64, {.name = name, .cells = cells}});
    for (const int cells : {16, 32, 64})
        all.push_back({fmt::format("4x1 grid {}", cells), cells == 32, {.name = "ddm-quadric-fitted", .cells = cells}});
    for (const int cells : {16, 32, 64, 128})
        all.push_back({fmt::format("grid {}", cells), cells == 64, {.name = "boxes", .cells = cells}});
    all.push_back({"grid 64", true, {.name = "cells", .cells = 64}});
    addDisplacementMaps(all);
    return all;
}

/// Marches in rounds over the methods, one after the other, so that whatever else the machine does falls on all; the
/// first round is a warm-up.
std::vector<MesoMarched> marchHere(const std::vector<Measured>& methods, const std::vector<MarchRay>& rays,
                                   int rounds) {
    std::vector<MesoMarched> all(methods.size());
    for (int round = 0; round <= rounds; ++round)
        for (size_t m = 0; m < methods.size(); ++m) {
            all[m].results.resize(rays.size());
            const double start = processorNs();
            for (size_t i = 0; i < rays.size(); ++i) all[m].results[i] = methods[m].marcher->march(rays[i]);
            if (round > 0)
                all[m].nsPerRay.push_back((processorNs() - start) / double(std::max<size_t>(1, rays.size())));
        }
    return all;
}

Result<std::vector<MesoMarched>> march(MesoMarcher* renderer, const std::vector<Measured>& methods,
                                       const std::vector<MarchRay>& rays, int rounds) {
    if (renderer == nullptr) return marchHere(methods, rays, rounds);
    std::vector<const meso::Method*> all;
    for (const Measured& m : methods) all.push_back(&m.method);
    return renderer->march(all, rays, rounds);
}

BenchMesoRow rowOf(const Subject& subject, const Measured& method, const RayView& view,
                   const std::vector<MarchRay>& rays, const std::vector<TruthHit>& truths, const MesoMarched& marched,
                   const std::vector<double>& peer) {
    BenchMesoRow row;
    row.asset = subject.asset.name, row.view = view.name, row.method = method.name, row.knob = method.knob;
    row.rays = rays.size(), row.bytes = method.marcher->bytes(), row.preprocessSeconds = method.preprocessSeconds;
    row.nsPerRay = upperQuantile(marched.nsPerRay, 0.5);
    std::vector<double> ratios;
    for (size_t i = 0; i < peer.size(); ++i) ratios.push_back(peer[i] > 0 ? marched.nsPerRay[i] / peer[i] : 0);
    row.ratioToPeer = upperQuantile(ratios, 0.5), row.ratioLow = upperQuantile(ratios, 0.25),
    row.ratioHigh = upperQuantile(ratios, 0.75);
    row.shape = judgeMeso(marched.results, truths, subject.texel);
    countWork(marched.results, row);
    if (method.method.field) {
        std::vector<TruthHit> own;
        for (const MarchRay& ray : rays) own.push_back(traceField(*method.method.field, ray));
        row.solver = judgeMeso(marched.results, own, subject.texel), row.hasSolver = true;
    }
    return row;
}

Result<const Subject::Traced*> tracedOf(Subject& subject, const GdmOptions& options) {
    for (const auto& t : subject.traced)
        if (t->options.points == options.points && t->options.directions == options.directions &&
            t->options.ofTop == options.ofTop && t->options.curvatures == options.curvatures)
            return t.get();
    auto made = std::make_unique<Subject::Traced>();
    made->options = options;
    const auto start = Clock::now();
    VCP_TRY_ASSIGN(made->table, traceTable(subject.asset, *subject.shape, options));
    made->seconds = secondsSince(start);
    subject.traced.push_back(std::move(made));
    return subject.traced.back().get();
}

Result<Measured> measuredOf(Subject& subject, const Entry& entry) {
    Measured method;
    method.name = entry.options.name, method.knob = entry.knob;
    MethodOptions options = entry.options;
    // The tile lies flat.
    options.curvatures = {};
    double traceSeconds = 0;
    if (options.name == "gdm" || options.name == "gdm-visibility" || options.name == "vdm") {
        VCP_TRY_ASSIGN(const auto* traced, tracedOf(subject, tracedBy(*subject.shape, options)));
        options.table = &traced->table;
        traceSeconds = traced->seconds;
    }
    const auto start = Clock::now();
    VCP_TRY_ASSIGN(method.method, buildMethod(subject.asset, *subject.shape, options));
    method.preprocessSeconds = traceSeconds + secondsSince(start);
    VCP_TRY_ASSIGN(method.marcher, method.method.marcher());
    return method;
}

/// Compares with the data sizes of Wang et al. 2004, Fig. 7: 8 bits an entry over factors of 16, 16 and 8 bytes a row.
void compareFactors(std::vector<MesoPublished>& published) {
    struct Row {
        glm::ivec3 points;
        int bytes;
        double ratio;
    };
    for (const Row& row : {Row{{64, 64, 32}, 16, 32}, Row{{32, 32, 16}, 16, 16}, Row{{128, 128, 16}, 8, 32}}) {
        const double rows = 32.0 * row.points.x * row.points.y, columns = 16.0 * row.points.z;
        published.push_back({fmt::format("Wang Fig. 7: bytes of a table over its factors, {} x {} x {}", row.points.x,
                                         row.points.y, row.points.z),
                             "any", "bytes", row.ratio, row.ratio, rows * columns / ((rows + columns) * row.bytes), 0});
    }
}

/// Compares with Table 3: texels of the plain map over those of lookup and atlas, at the paper's resolution.
Result<void> compareCompression(std::vector<MesoPublished>& published) {
    struct Row {
        const char* asset;
        int block;
        double ratio;
    };
    for (const Row& row : {Row{"beads", 2, 4}, Row{"kitten", 4, 12.8}, Row{"ball", 8, 256}}) {
        VCP_TRY_ASSIGN(const auto subject, subjectOf(row.asset));
        VCP_TRY_ASSIGN(const auto occupancy, occupy(*subject->shape, cellsOf(*subject, 256)));
        VCP_TRY_ASSIGN(const auto map, buildDistanceMap(occupancy, {.cones = {1, 1}}));
        VCP_TRY_ASSIGN(const auto compressed, compressMap(map, std::array{row.block}));
        published.push_back({fmt::format("Table 3: texels, blocks of {}", row.block), row.asset, "texels", row.ratio,
                             row.ratio, compressed.texelRatio(), 0});
    }
    return {};
}

template <class Names>
Result<void> knows(const char* what, const std::vector<std::string>& asked, const Names& known) {
    for (const std::string& name : asked)
        if (std::ranges::find(known, name) == known.end())
            return Error{.code = ErrorCode::Usage, .message = fmt::format("there is no {} \"{}\"", what, name)};
    return {};
}

bool isAsked(const std::vector<std::string>& asked, std::string_view name) {
    return asked.empty() || std::ranges::find(asked, name) != asked.end();
}

/// Measures all requested methods over all views; the rows of a method stand together.
Result<std::vector<BenchMesoRow>> rowsOf(Subject& subject, const BenchMesoOptions& options, MesoMarcher* renderer,
                                         const std::function<bool(const std::string&)>& told) {
    const auto isMeasured = [&](const Entry& e) {
        return isAsked(options.methods, e.options.name) &&
               (options.sweep || e.isDefault || (options.published && isOfPublished(e.options.name, e.knob))) &&
               methodFits(e.options.name, subject.asset);
    };
    // The peer is measured with them, requested or not.
    const std::string_view peerName = mesoPeer(subject.asset.heights.has_value());
    std::vector<Measured> methods;
    std::vector<bool> isShown;
    size_t peer = 0;
    for (const Entry& entry : entries()) {
        const bool isPeer = entry.options.name == peerName && entry.isDefault;
        if (!isPeer && !isMeasured(entry)) continue;
        if (!told(entry.options.name)) return Error::cancelled();
        VCP_TRY_ASSIGN(auto made, measuredOf(subject, entry));
        if (isPeer) peer = methods.size();
        methods.push_back(std::move(made));
        isShown.push_back(isMeasured(entry));
    }
    std::vector<std::vector<BenchMesoRow>> byMethod(methods.size());
    for (const RayView& view : kViews) {
        if (!isAsked(options.views, view.name)) continue;
        if (!told(std::string(view.name))) return Error::cancelled();
        const std::vector<MarchRay> rays = raysOf(subject, view, options.rays);
        std::vector<TruthHit> truths;
        for (const MarchRay& ray : rays) truths.push_back(subject.shape->trace(ray.origin, ray.direction, ray.tMax));
        VCP_TRY_ASSIGN(const auto marched, march(renderer, methods, rays, options.repetitions));
        for (size_t m = 0; m < methods.size(); ++m) {
            if (!isShown[m]) continue;
            byMethod[m].push_back(rowOf(subject, methods[m], view, rays, truths, marched[m], marched[peer].nsPerRay));
            if (renderer != nullptr) byMethod[m].back().device = renderer->device().name;
        }
    }
    std::vector<BenchMesoRow> rows;
    for (const auto& each : byMethod) rows.insert(rows.end(), each.begin(), each.end());
    return rows;
}

}  // namespace

std::string_view mesoPeer(bool isHeightField) { return isHeightField ? "relief-binary" : "dm"; }

std::vector<std::string> mesoMethodNames() {
    std::vector<std::string> names;
    for (const Entry& entry : entries())
        if (std::ranges::find(names, entry.options.name) == names.end()) names.push_back(entry.options.name);
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
    if (assets.empty())
        assets = {"fbm",   "hemispheres", "bricks", "maze", "needle", "bead",
                  "beads", "chain",       "weave",  "ball", "scales", "kitten"};
    std::unique_ptr<MesoMarcher> renderer;
    if (options.device) {
        VCP_TRY_ASSIGN(renderer, MesoMarcher::create({.device = *options.device}));
    }
    BenchMesoReport report;
    if (options.prisms) report.prisms = compareMesoPrisms(uint64_t(options.rays));
    std::vector<MesoPublished> ofModels;
    if (options.bases) {
        for (const std::string& asset : assets) {
            VCP_TRY_ASSIGN(const auto rows, compareMesoBent(asset, {.device = options.device.value_or(kHostName),
                                                                    .repetitions = options.repetitions,
                                                                    .progress = options.progress}));
            report.bent.insert(report.bent.end(), rows.begin(), rows.end());
        }
    }
    if (options.models) {
        VCP_TRY_ASSIGN(report.models, compareMesoModels({.device = options.device.value_or(kHostName),
                                                         .repetitions = options.repetitions,
                                                         .progress = options.progress},
                                                        ofModels));
    }
    for (size_t a = 0; a < assets.size(); ++a) {
        const auto told = [&](const std::string& what) {
            return !options.progress || options.progress(assets[a] + ": " + what, double(a) / double(assets.size()));
        };
        VCP_TRY_ASSIGN(const auto subject, subjectOf(assets[a]));
        VCP_TRY_ASSIGN(auto rows, rowsOf(*subject, options, renderer.get(), told));
        report.rows.insert(report.rows.end(), rows.begin(), rows.end());
        if (options.factors) {
            if (!told("factors")) return Error::cancelled();
            VCP_TRY_ASSIGN(const auto factors, compareMesoFactors(subject->asset, *subject->shape));
            report.factors.insert(report.factors.end(), factors.begin(), factors.end());
        }
        if (options.shadows) {
            VCP_TRY_ASSIGN(const auto shadows,
                           compareMesoShadows(subject->asset, *subject->shape, uint64_t(options.rays),
                                              [&](double) { return told("shadows"); }));
            report.shadows.insert(report.shadows.end(), shadows.begin(), shadows.end());
        }
        if (options.light) {
            const auto lit = [&](double part) {
                return !options.progress ||
                       options.progress(assets[a] + ": light", (double(a) + part) / double(assets.size()));
            };
            VCP_TRY_ASSIGN(const auto lights, compareMesoLight(assets[a], subject->asset, *subject->shape, lit));
            report.lights.insert(report.lights.end(), lights.begin(), lights.end());
        }
        if (options.checkRays == 0) continue;
        if (!told("conservative maps")) return Error::cancelled();
        VCP_TRY_ASSIGN(const auto checks,
                       checkMesoMaps(subject->asset.name, *subject->shape, subject->texel, options.checkRays));
        report.checks.insert(report.checks.end(), checks.begin(), checks.end());
    }
    if (report.rows.empty())
        return Error{.code = ErrorCode::Usage, .message = "none of these methods is of these assets"};
    if (options.published) {
        report.published = publishedOf(report.rows);
        report.published.insert(report.published.end(), ofModels.begin(), ofModels.end());
        VCP_TRY(compareCompression(report.published));
        compareFactors(report.published);
        VCP_TRY_ASSIGN(const auto remeshed, remeshPublished());
        report.published.insert(report.published.end(), remeshed.begin(), remeshed.end());
    }
    if (options.remesh) {
        VCP_TRY_ASSIGN(report.remeshed, benchRemesh(assets, options.device));
        if (options.tessellation) {
            VCP_TRY_ASSIGN(report.remeshedPictures, benchTessellation(assets, options.device.value_or("")));
        }
    }
    return report;
}

}  // namespace vcp
