// View-dependent maps over bases that bend: with and without samples of curvature, beside other methods, against the
// truth over the smooth bases.
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "builder/measure/quantile.h"
#include "mesostructure/base_sheet.h"
#include "mesostructure/method.h"
#include "render/picture_renderer.h"
#include "viewer/asset/share_out.h"
#include "viewer/bench/bench_meso.h"
#include "viewer/scene/meso_scene.h"

namespace vcp {

namespace {

using namespace meso;
using glm::dvec2, glm::dvec3, std::numbers::pi;

constexpr double kTexels = 128;  ///< along a tile's edge
constexpr int kMostSamples = 9;  ///< of curvature

/// A smooth base, the triangles that stand for it, and where it is seen from.
struct BentBase {
    std::string name;
    BaseSurface surface;
    double overRadius = 0;  ///< slab heights over the least radius
    double edge = 1;        ///< of a tile, world units: what the slab's height is measured by
    /// Returns the place in the tile of a place in the world. What repeats may jump by whole tiles.
    std::function<dvec3(dvec3 world)> place;
    Camera camera;
};

Camera seenFrom(dvec3 direction, double height) {
    Camera camera;
    camera.projection = Projection::Orthographic, camera.orthographicHeight = height;
    camera.forward = -glm::normalize(direction), camera.eye = -8.0 * camera.forward, camera.up = {0, 0, 1};
    return camera;
}

BentBase plane(double tiles) {
    BentBase base{
        .name = "plane", .surface = {}, .edge = 8 / tiles, .place = {}, .camera = seenFrom({0.1, -1, 0.3}, 0.7)};
    const double edge = base.edge;
    addSheet(
        base.surface, 8, 8, [](double u, double v) { return dvec3(8 * u - 4, 8 * v - 4, 0); },
        [&](double u, double v) { return tiles * dvec2(u, v); });
    base.place = [edge](dvec3 p) { return (p + dvec3(4, 4, 0)) / edge; };
    return base;
}

/// A tube along z of radius 1, longer than the picture, with as many tiles round it.
BentBase cylinder(int tiles, double tileHeight) {
    const double edge = 2 * pi / tiles;
    BentBase base{.name = fmt::format("cylinder, {} tiles round", tiles),
                  .surface = {},
                  .overRadius = edge * tileHeight,
                  .edge = edge,
                  .place = {},
                  .camera = seenFrom({0.4, -1, 0.35}, 1.8)};
    constexpr int kAround = 64;
    constexpr double kHalf = 4;
    addSheet(
        base.surface, kAround, 80,
        [](double u, double v) {
            const double angle = u < 1 ? 2 * pi * u : 0;  // its ends meet to the bit
            return dvec3(std::cos(angle), std::sin(angle), kHalf * (2 * v - 1));
        },
        [=](double u, double v) { return dvec2(tiles * u, 2 * kHalf * v / edge); });
    joinPositions(base.surface);
    base.place = [edge](dvec3 p) { return dvec3(std::atan2(p.y, p.x), p.z + kHalf, std::hypot(p.x, p.y) - 1) / edge; };
    return base;
}

/// A cube's sides by equal angles (makeBaseSurface); the map is not of one length all over.
Result<BentBase> sphere(double tiles, double tileHeight) {
    BentBase base{.name = "sphere", .surface = {}, .place = {}, .camera = seenFrom({0.4, -1, 0.35}, 2.6)};
    VCP_TRY_ASSIGN(base.surface, makeBaseSurface("sphere", tiles));
    base.edge = tileEdge(base.surface), base.overRadius = base.edge * tileHeight;
    base.place = [tiles, edge = base.edge](dvec3 p) {
        const dvec3 size = glm::abs(p);
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const double u = std::atan(p[(axis + 1) % 3] / p[axis]), v = std::atan(p[(axis + 2) % 3] / size[axis]);
        return dvec3(tiles * (dvec2(u, v) * 2.0 / pi + 0.5), (glm::length(p) - 1) / edge);
    };
    return base;
}

BentBase torus(double tiles, double tileHeight) {
    BentBase base{.name = fmt::format("torus, {:g} tiles round the tube", tiles),
                  .surface = torusSurface(tiles, {154, 64}),
                  .place = {},
                  .camera = seenFrom({0.4, -1, 0.6}, 2.8)};
    base.edge = tileEdge(base.surface), base.overRadius = base.edge * tileHeight / kTorusTube;
    base.place = [tiles, edge = base.edge](dvec3 p) {
        const double ring = std::hypot(p.x, p.y) - 1;
        return dvec3(tiles / (2 * pi) * dvec2(kTorusRingTiles * std::atan2(p.y, p.x), std::atan2(p.z, ring)),
                     (std::hypot(ring, p.z) - kTorusTube) / edge);
    };
    return base;
}

/// Follows a ray over the smooth base by chords of a small part of a tile, each of them exactly. Returns nothing for a
/// ray that does not come into the slab, and t in tile edges.
std::optional<TruthHit> traceOver(const BentBase& base, const Shape& shape, const CameraRay& ray, double reach) {
    const double top = shape.extent().z, step = base.edge / 64;
    bool isOver = false;
    dvec3 from = base.place(ray.origin);
    for (double t = 0; t < reach; t += step) {
        dvec3 to = base.place(ray.origin + (t + step) * ray.direction);
        dvec2 off = dvec2(to) - dvec2(from);
        off -= shape.extent().x * glm::round(off / shape.extent().x);
        const dvec3 chord(off, to.z - from.z);
        const double length = glm::length(chord);
        // The map jumps where sides of the cube meet.
        if (std::min(from.z, to.z) <= top && length < 8 * step / base.edge) {
            isOver = true;
            const double enters = from.z > top ? (from.z - top) / (from.z - to.z) : 0;
            const TruthHit hit = shape.trace(from + enters * chord, chord / length, (1 - enters) * length * (1 + 1e-6));
            if (hit.hit) {
                TruthHit found = hit;
                found.t = (t + step * (enters + hit.t / length)) / base.edge;
                return found;
            }
            if (to.z < 0) break;
        }
        from = to;
    }
    if (!isOver) return std::nullopt;
    TruthHit miss;
    miss.hit = false;
    return miss;
}

/// A method that is drawn on a base.
struct Drawn {
    MesoBent row;
    std::unique_ptr<PictureRenderer> renderer;
    FrameRequest request;
    std::vector<double> ns;
    int queryFetches = 0;  ///< of one question to a map; 0: what is fetched is not known
};

struct BentMethod {
    std::string knob;
    MethodOptions options;
};

std::vector<BentMethod> methodsOf(const MesoBentOptions& options) {
    const int n = options.cells;
    std::vector<BentMethod> all;
    for (const int samples : {1, 3, 5, kMostSamples})
        all.push_back(
            {fmt::format("rank 16 curvatures {}", samples), {.name = "vdm", .cells = n, .curvatures = {samples, 0.5}}});
    for (const int samples : {1, kMostSamples})
        all.push_back({fmt::format("table curvatures {}", samples),
                       {.name = "vdm", .cells = n, .rank = 0, .curvatures = {samples, 0.5}}});
    all.push_back({"rank 16", {.name = "gdm", .cells = n}});
    all.push_back({"rank 16", {.name = "gdm-visibility", .cells = n}});
    all.push_back({"", {.name = "boxes"}});
    return all;
}

/// What all bases share of a method: its arrays, and what they took.
struct Built {
    std::shared_ptr<const MarchArrays> arrays;
    uint64_t bytes = 0;
    double seconds = 0;  ///< of the processor, all threads; 0: not known
};

/// Returns the table of fewer curvatures that are all in one of more.
DistanceTable withFewer(const DistanceTable& table, int samples) {
    DistanceTable fewer = table;
    fewer.curvatures.samples = samples;
    if (samples == table.curvatures.samples) return fewer;
    const size_t each = table.columns() / size_t(table.curvatures.samples);
    const auto first = [&](int layer) {
        const double middle = 0.5 * (table.curvatures.samples - 1),
                     step = samples == 1 ? 0 : (table.curvatures.samples - 1) / double(samples - 1);
        return size_t(std::lround(middle + step * (layer - 0.5 * (samples - 1)))) * each;
    };
    fewer.steps.assign(fewer.rows() * fewer.columns(), 0);
    fewer.hits.assign(fewer.rows() * fewer.hitWords(), 0);
    for (size_t row = 0; row < fewer.rows(); ++row)
        for (int layer = 0; layer < samples; ++layer)
            for (size_t i = 0; i < each; ++i) {
                const size_t from = first(layer) + i, to = size_t(layer) * each + i;
                fewer.steps[row * fewer.columns() + to] = table.steps[row * table.columns() + from];
                if (table.isHit(row, from)) fewer.hits[row * fewer.hitWords() + to / 32] |= 1u << (to % 32);
            }
    return fewer;
}

/// Builds what methods read. View-dependent maps share what is traced: once over a flat base, and over all curvatures.
class Builder {
public:
    Builder(const Asset& asset, const Shape& shape, const MesoBentOptions& options)
        : asset_(asset), shape_(shape), options_(options) {}

    Result<Built> built(MethodOptions method) {
        method.shareOut = [&](size_t count, const std::function<void(size_t, size_t)>& fill) {
            return shareOut(count, fill, [&](double part) {
                return !options_.progress || options_.progress("distances of " + method.name, part);
            });
        };
        DistanceTable table;
        double traceSeconds = 0;
        const Curvatures asked = method.curvatures;
        if (method.name == "vdm") {
            Traced& traced = asked.samples == 1 ? flat_ : bent_;
            method.curvatures.samples = asked.samples == 1 ? 1 : kMostSamples;
            if (traced.seconds == 0) VCP_TRY(trace(method, traced));
            // What was traced for more says nothing of the time for fewer.
            if (method.curvatures == asked) traceSeconds = traced.seconds;
            method.curvatures = asked;
            table = withFewer(traced.table, asked.samples);
            method.table = &table;
        }
        const double start = processorNs();
        VCP_TRY_ASSIGN(const auto made, buildMethod(asset_, shape_, method));
        const double seconds = (processorNs() - start) * 1e-9 + traceSeconds;
        VCP_TRY_ASSIGN(const auto marcher, made.marcher());
        VCP_TRY_ASSIGN(auto arrays, made.arrays());
        const bool isTimed = method.name != "vdm" || traceSeconds > 0;
        return Built{std::make_shared<const MarchArrays>(std::move(arrays)), marcher->bytes(), isTimed ? seconds : 0};
    }

private:
    struct Traced {
        DistanceTable table;
        double seconds = 0;  ///< of the processor
    };
    Result<void> trace(const MethodOptions& method, Traced& traced) {
        const double start = processorNs();
        VCP_TRY_ASSIGN(traced.table, traceTable(asset_, shape_, tracedBy(shape_, method)));
        traced.seconds = (processorNs() - start) * 1e-9;
        return {};
    }

    const Asset& asset_;
    const Shape& shape_;
    const MesoBentOptions& options_;
    Traced flat_, bent_;
};

Result<Drawn> drawnOn(const BentBase& base, const Asset& asset, const BentMethod& method, const Built& made,
                      const MesoBentOptions& options) {
    MesoSurface surface;
    surface.arrays = made.arrays;
    VCP_TRY_ASSIGN(surface.shell, buildShell(base.surface, base.edge * asset.extent.z, asset.extent));
    surface.withBase = false;
    Drawn drawn{.row = {.asset = asset.name, .base = base.name, .method = method.options.name, .knob = method.knob},
                .renderer = nullptr,
                .request = {},
                .ns = {}};
    drawn.row.overRadius = base.overRadius;
    drawn.row.bytes = made.bytes, drawn.row.preprocessSeconds = made.seconds;
    // A footprint of weights and one of eigen-maps for four terms, or the table's four; and one of the properties.
    if (method.options.name != "boxes")
        drawn.queryFetches = (method.options.rank > 0 ? method.options.rank / 2 : 4) + 1;
    if (method.options.name == "gdm-visibility" ||
        (method.options.name == "vdm" && method.options.curvatures.samples > 1))
        ++drawn.queryFetches;
    drawn.request.width = options.across, drawn.request.height = options.down;
    drawn.request.camera = base.camera;
    VCP_TRY_ASSIGN(drawn.renderer, rendererOf(surface, options.device));
    return drawn;
}

/// Draws a picture once; counted are those after the first.
Result<void> draw(Drawn& drawn, bool isCounted) {
    VCP_TRY_ASSIGN(const auto frame, timedFrame(*drawn.renderer, drawn.request));
    if (isCounted) drawn.ns.push_back(frame.ns);
    return {};
}

Result<void> judge(Drawn& drawn, const BentBase& base, const std::vector<std::optional<TruthHit>>& truths) {
    VCP_TRY_ASSIGN(const auto depths, drawn.renderer->readDepth());
    VCP_TRY_ASSIGN(const auto iterations, drawn.renderer->readIterations());
    std::vector<MarchResult> results;
    std::vector<TruthHit> expected;
    double queries = 0;
    std::vector<double> errors;
    for (size_t i = 0; i < depths.size(); ++i) {
        queries += iterations[i];
        if (!truths[i]) continue;
        const bool isHit = std::isfinite(depths[i]);
        results.push_back(
            {.state = isHit ? MarchState::Hit : MarchState::Miss, .t = isHit ? double(depths[i]) / base.edge : 0});
        expected.push_back(*truths[i]);
        if (isHit && truths[i]->hit) errors.push_back(kTexels * std::abs(results.back().t - truths[i]->t));
    }
    drawn.row.rays = results.size();
    drawn.row.shape = judgeMeso(results, expected, 1 / kTexels);
    drawn.row.p50 = upperQuantile(errors, 0.5), drawn.row.p95 = upperQuantile(errors, 0.95);
    drawn.row.iterations = queries / double(std::max<size_t>(1, results.size()));
    drawn.row.fetches = drawn.row.iterations * drawn.queryFetches;
    return {};
}

Result<std::vector<BentBase>> basesOf(double tileHeight) {
    std::vector<BentBase> bases{plane(8), cylinder(16, tileHeight), cylinder(8, tileHeight), cylinder(4, tileHeight)};
    VCP_TRY_ASSIGN(auto ball, sphere(2, tileHeight));
    bases.push_back(std::move(ball));
    bases.push_back(torus(8, tileHeight));
    bases.push_back(torus(4, tileHeight));
    return bases;
}

}  // namespace

Result<std::vector<MesoBent>> compareMesoBent(const std::string& name, const MesoBentOptions& options) {
    VCP_TRY_ASSIGN(const auto asset, openMesoAsset(name));
    VCP_TRY_ASSIGN(const auto shape, shapeOf(asset));
    const std::vector<BentMethod> methods = methodsOf(options);
    Builder builder(asset, *shape, options);
    std::vector<Built> all;
    for (const BentMethod& method : methods) {
        VCP_TRY_ASSIGN(auto made, builder.built(method.options));
        all.push_back(std::move(made));
    }
    VCP_TRY_ASSIGN(const auto bases, basesOf(shape->extent().z));
    std::vector<MesoBent> rows;
    for (const BentBase& base : bases) {
        if (options.progress && !options.progress(base.name, double(&base - bases.data()) / double(bases.size())))
            return Error::cancelled();
        std::vector<std::optional<TruthHit>> truths;
        for (uint32_t i = 0; i < options.across * options.down; ++i)
            truths.push_back(traceOver(base, *shape,
                                       cameraRay(base.camera, options.across, options.down, i % options.across + 0.5,
                                                 double(i / options.across) + 0.5),
                                       16));
        std::vector<Drawn> drawn;
        size_t peer = 0;
        for (size_t m = 0; m < methods.size(); ++m) {
            if (methods[m].options.name == "gdm") peer = m;
            VCP_TRY_ASSIGN(auto one, drawnOn(base, asset, methods[m], all[m], options));
            drawn.push_back(std::move(one));
        }
        for (int round = 0; round <= options.repetitions; ++round)
            for (Drawn& one : drawn) VCP_TRY(draw(one, round > 0));
        for (Drawn& one : drawn) {
            VCP_TRY(judge(one, base, truths));
            std::vector<double> ratios;
            for (size_t i = 0; i < one.ns.size(); ++i) ratios.push_back(one.ns[i] / drawn[peer].ns[i]);
            one.row.timeOverGdm = upperQuantile(ratios, 0.5);
            rows.push_back(one.row);
        }
    }
    return rows;
}

}  // namespace vcp
