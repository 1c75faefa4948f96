#include "viewer/bench/bench_remesh.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/remesh/certified_cells.h"
#include "mesostructure/remesh/remesher.h"
#include "mesostructure/solids.h"
#include "render/remesh_meter.h"
#include "viewer/scene/meso_scene.h"

namespace vcp {

using namespace meso;
using glm::dvec2, glm::dvec3;

namespace {

constexpr double kWidth = 1920, kHeight = 1200;
constexpr int kColumns = 480, kRounds = 3;

struct Place {
    const char* name;
    dvec3 eye, at;
};
constexpr std::array<Place, 2> kPlaces{Place{"near", {-1.3, 0.1, 0.35}, {0.2, 0, 0.05}},
                                       Place{"45", {-1.7, 0.2, 1.9}, {0, 0, 0}}};

struct Filter {
    const char* name;
    LevelFit fit;
    HeightAccess access;
};
constexpr std::array<Filter, 5> kFilters{Filter{"none", LevelFit::Sampled, HeightAccess::Sample},
                                         Filter{"averaged", LevelFit::Averaged, HeightAccess::Sample},
                                         Filter{"printed, most", LevelFit::Printed, HeightAccess::Most},
                                         Filter{"least", LevelFit::Least, HeightAccess::Sample},
                                         Filter{"least, most", LevelFit::Least, HeightAccess::Most}};

RemeshCamera cameraAt(const Place& place) {
    RemeshCamera camera;
    camera.eye = place.eye;
    camera.forward = glm::normalize(place.at - place.eye);
    camera.right = glm::normalize(glm::cross(camera.forward, dvec3(0, 0, 1)));
    camera.up = glm::cross(camera.right, camera.forward);
    const double tangent = std::tan(0.5 * 0.7);
    camera.focal = 0.5 * kHeight / tangent;
    camera.seen = {-tangent * kWidth / kHeight, -tangent, tangent * kWidth / kHeight, tangent};
    camera.nearest = 1e-4;
    return camera;
}

/// The height field on the quad [-1, 1]^2, one tile.
class Truth {
public:
    Truth(const HeightLevels& levels, double height, const RemeshCamera& camera)
        : levels_(levels), height_(height), camera_(camera) {}

    [[nodiscard]] double heightAt(dvec2 uv) const { return height_ * levels_.height(0, uv); }
    /// Returns a place of the tile in eye space.
    [[nodiscard]] dvec3 eyeSpace(dvec2 uv) const {
        const dvec3 d = dvec3(2 * uv.x - 1, 2 * uv.y - 1, heightAt(uv)) - camera_.eye;
        return {glm::dot(d, camera_.right), glm::dot(d, camera_.up), glm::dot(d, camera_.forward)};
    }
    [[nodiscard]] dvec2 pixel(dvec3 p) const { return camera_.focal * dvec2(p) / p.z; }
    [[nodiscard]] double worldHeight(dvec3 p) const {
        return camera_.eye.z + p.x * camera_.right.z + p.y * camera_.up.z + p.z * camera_.forward.z;
    }

private:
    const HeightLevels& levels_;
    double height_;
    const RemeshCamera& camera_;
};

/// The highest point of each column.
class Horizon {
public:
    Horizon() : tops_(kColumns, -1e300) {}
    void add(dvec2 a, dvec2 b) {
        const double first = columnOf(std::min(a.x, b.x)), last = columnOf(std::max(a.x, b.x));
        for (int i = std::max(0, int(std::ceil(first))); i <= std::min(kColumns - 1, int(std::floor(last))); ++i) {
            const double x = (i + 0.5) * kWidth / kColumns - 0.5 * kWidth,
                         part = b.x != a.x ? (x - a.x) / (b.x - a.x) : 0;
            tops_[size_t(i)] = std::max(tops_[size_t(i)], a.y + part * (b.y - a.y));
        }
    }
    /// Returns by how many pixels the other one is lower, averaged over the columns that both have.
    [[nodiscard]] double lossOf(const Horizon& other) const {
        double sum = 0;
        int count = 0;
        for (size_t i = 0; i < tops_.size(); ++i)
            if (tops_[i] > -1e299 && other.tops_[i] > -1e299) sum += tops_[i] - other.tops_[i], ++count;
        return count > 0 ? sum / count : 0;
    }

private:
    static double columnOf(double x) { return (x + 0.5 * kWidth) * kColumns / kWidth - 0.5; }
    std::vector<double> tops_;
};

Horizon horizonOf(const Truth& truth, int texels) {
    Horizon horizon;
    const int n = 2 * texels;
    const auto pixelAt = [&](int i, int j) {
        const dvec3 p = truth.eyeSpace(dvec2(i, j) / double(n));
        return p.z > 0.01 ? truth.pixel(p) : dvec2(1e9, -1e9);
    };
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) {
            const dvec2 at = pixelAt(i, j);
            if (at.x > 1e8) continue;
            for (const glm::ivec2 step : {glm::ivec2(1, 0), glm::ivec2(0, 1)})
                if (i + step.x <= n && j + step.y <= n)
                    if (const dvec2 next = pixelAt(i + step.x, j + step.y); next.x < 1e8) horizon.add(at, next);
        }
    return horizon;
}

void judge(const RemeshMesh<double>& mesh, const Truth& truth, const Horizon& horizon, RemeshRow& row) {
    std::vector<double> errors;
    double bias = 0;
    Horizon ours;
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const RemeshVertex<double>* v[3];
        for (int k = 0; k < 3; ++k) v[k] = &mesh.vertices[mesh.indices[i + size_t(k)]];
        if (std::min({v[0]->position.z, v[1]->position.z, v[2]->position.z}) < 0.01) continue;
        for (int k = 0; k < 3; ++k) ours.add(truth.pixel(v[k]->position), truth.pixel(v[(k + 1) % 3]->position));
        for (const dvec3 w : {dvec3(1.0 / 3), dvec3(0.6, 0.2, 0.2), dvec3(0.2, 0.6, 0.2), dvec3(0.2, 0.2, 0.6)}) {
            const dvec3 on = w.x * v[0]->position + w.y * v[1]->position + w.z * v[2]->position;
            const dvec2 uv = w.x * v[0]->uv + w.y * v[1]->uv + w.z * v[2]->uv;
            const dvec3 there = truth.eyeSpace(uv);
            if (there.z < 0.01) continue;
            const dvec2 at = truth.pixel(on);
            if (std::abs(at.x) > 0.5 * kWidth || std::abs(at.y) > 0.5 * kHeight) continue;
            errors.push_back(glm::distance(at, truth.pixel(there)));
            bias += truth.worldHeight(on) - truth.heightAt(uv);
        }
    }
    if (errors.empty()) return;
    std::ranges::sort(errors);
    const auto at = [&](double part) { return errors[size_t(part * double(errors.size() - 1))]; };
    row.p50 = at(0.5), row.p95 = at(0.95), row.max = errors.back();
    row.bias = bias / double(errors.size());
    row.horizonLoss = horizon.lossOf(ours);
}

void judgePixels(const std::vector<glm::vec4>& hits, const Truth& truth, const RemeshCamera& camera,
                 RemeshDrawnRow& row) {
    std::vector<double> errors;
    for (size_t i = 0; i < hits.size(); ++i) {
        if (hits[i].w == 0) continue;
        const dvec2 at(double(i % size_t(kWidth)) + 0.5, double(i / size_t(kWidth)) + 0.5);
        const dvec2 tangents(glm::mix(camera.seen.x, camera.seen.z, at.x / kWidth),
                             glm::mix(camera.seen.w, camera.seen.y, at.y / kHeight));
        const dvec3 there = truth.eyeSpace(dvec2(hits[i].y, hits[i].z));
        if (there.z < 0.01) continue;
        errors.push_back(glm::distance(camera.focal * tangents, truth.pixel(there)));
    }
    row.pixels = errors.size();
    if (errors.empty()) return;
    std::ranges::sort(errors);
    row.p50 = errors[errors.size() / 2], row.p95 = errors[size_t(0.95 * double(errors.size() - 1))];
    row.max = errors.back();
}

double seconds(std::chrono::steady_clock::time_point since) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

/// What is remeshed: a surface with cells of one size, or certified cells.
struct Remeshed {
    const RemeshSurface& surface;
    CertifiedCells* cells = nullptr;

    template <class Real>
    Result<void> mesh(const RemeshCamera& camera, const RemeshOptions& options, RemeshMesh<Real>& mesh) const {
        return cells != nullptr ? remesh(*cells, camera, options, mesh) : remesh(surface, camera, options, mesh);
    }
    Result<RemeshTimes> measure(RemeshMeter& meter, const RemeshCamera& camera, const RemeshOptions& options) const {
        return cells != nullptr ? meter.measure(*cells, camera, options, kRounds)
                                : meter.measure(surface, camera, options, kRounds);
    }
};

/// Times one thread of the processor, and the device where there is one.
Result<void> timeFrame(const Remeshed& what, const RemeshCamera& camera, const RemeshOptions& options,
                       RemeshMeter* meter, RemeshRow& row) {
    std::array<double, kRounds> times{};
    RemeshMesh<float> drawn;
    for (double& time : times) {
        drawn.clear();
        const auto start = std::chrono::steady_clock::now();
        VCP_TRY(what.mesh(camera, options, drawn));
        time = seconds(start);
    }
    std::ranges::sort(times);
    row.ms = 1e3 * times[kRounds / 2];
    row.vertices = drawn.vertices.size(), row.triangles = drawn.indices.size() / 3, row.bytes = drawn.bytes();
    if (meter == nullptr) return {};
    VCP_TRY_ASSIGN(const auto there, what.measure(*meter, camera, options));
    row.device = meter->device().name;
    row.piecesMs = there.piecesMs, row.sweepMs = there.sweepMs, row.sweepProcessorMs = there.sweepProcessorMs;
    return {};
}

/// Judges and times one view.
Result<void> measureView(const Remeshed& what, const Truth& truth, const Horizon& horizon, const RemeshCamera& camera,
                         const RemeshOptions& options, RemeshMeter* meter, RemeshRow& row) {
    RemeshMesh<double> mesh;
    RemeshOptions bounded = options;
    bounded.bounds = true;
    VCP_TRY(what.mesh(camera, bounded, mesh));
    row.boundPixels = mesh.counts.boundPixels, row.uncertified = mesh.counts.uncertified;
    judge(mesh, truth, horizon, row);
    return timeFrame(what, camera, options, meter, row);
}

Result<void> measure(const std::string& name, const HeightMap& map, const BaseSurface& quad, const Filter& filter,
                     RemeshMeter* meter, std::vector<RemeshRow>& rows) {
    // The printed fit takes hundreds of steps; it is measured where it ends.
    VCP_TRY_ASSIGN(auto built, HeightLevels::build(map, {.fit = filter.fit}));
    const auto levels = std::make_shared<const HeightLevels>(std::move(built));
    const double height = 2 * map.range;
    VCP_TRY_ASSIGN(const auto surface, buildRemeshSurface(quad, levels, height));
    VCP_TRY_ASSIGN(auto cells, CertifiedCells::create(surface));
    for (const Place& place : kPlaces) {
        const RemeshCamera camera = cameraAt(place);
        const Truth truth(*levels, height, camera);
        const Horizon horizon = horizonOf(truth, map.size.x);
        for (const double cell : {1.0, 5.0, 20.0}) {
            RemeshRow row{.asset = name, .view = place.name, .filter = filter.name, .cell = cell};
            VCP_TRY(
                measureView({surface}, truth, horizon, camera, {.cell = cell, .access = filter.access}, meter, row));
            rows.push_back(row);
        }
        // Certified cells take the map itself, so that how levels are fitted changes nothing but normals.
        if (filter.fit != LevelFit::Least || filter.access != HeightAccess::Sample) continue;
        for (const double error : {0.5, 1.0, 4.0}) {
            RemeshRow row{.asset = name, .view = place.name, .filter = fmt::format("error {:g}", error), .cell = 1};
            VCP_TRY(measureView({surface, &cells}, truth, horizon, camera, {.cell = row.cell, .errorPixels = error},
                                meter, row));
            rows.push_back(row);
        }
    }
    return {};
}

}  // namespace

Result<std::vector<RemeshRow>> benchRemesh(const std::vector<std::string>& assets,
                                           const std::optional<std::string>& device) {
    VCP_TRY_ASSIGN(const auto quad, makeBaseSurface("quad", 1));
    std::unique_ptr<RemeshMeter> meter;
    if (device) {
        VCP_TRY_ASSIGN(meter, RemeshMeter::create(*device));
    }
    std::vector<RemeshRow> rows;
    for (const std::string& name : assets) {
        VCP_TRY_ASSIGN(const auto asset, openMesoAsset(name));
        if (!asset.heights) continue;
        for (const Filter& filter : kFilters) VCP_TRY(measure(name, *asset.heights, quad, filter, meter.get(), rows));
    }
    return rows;
}

Result<std::vector<RemeshDrawnRow>> benchTessellation(const std::vector<std::string>& assets,
                                                      const std::string& device) {
    VCP_TRY_ASSIGN(const auto quad, makeBaseSurface("quad", 1));
    VCP_TRY_ASSIGN(const auto meter, RemeshMeter::create(device));
    std::vector<RemeshDrawnRow> rows;
    for (const std::string& name : assets) {
        VCP_TRY_ASSIGN(const auto asset, openMesoAsset(name));
        if (!asset.heights) continue;
        VCP_TRY_ASSIGN(auto built, HeightLevels::build(*asset.heights));
        const auto levels = std::make_shared<const HeightLevels>(std::move(built));
        const double height = 2 * asset.heights->range;
        VCP_TRY_ASSIGN(const auto surface, buildRemeshSurface(quad, levels, height));
        for (const Place& place : kPlaces)
            for (const double cell : {1.0, 5.0, 20.0})
                for (const auto& [way, text] :
                     {std::pair(RemeshWay::Sweep, "sweep"), std::pair(RemeshWay::Tessellation, "tessellation")}) {
                    const RemeshCamera camera = cameraAt(place);
                    VCP_TRY_ASSIGN(const auto drawn, meter->draw(surface, camera, {.cell = cell}, way, uint32_t(kWidth),
                                                                 uint32_t(kHeight), kRounds));
                    RemeshDrawnRow row{.asset = name, .view = place.name, .way = text, .cell = cell};
                    judgePixels(drawn.hits, Truth(*levels, height, camera), camera, row);
                    row.vertices = drawn.vertices, row.triangles = drawn.triangles;
                    row.ms = drawn.ms, row.processorMs = drawn.processorMs;
                    rows.push_back(row);
                }
    }
    return rows;
}

Result<std::vector<MesoPublished>> remeshPublished() {
    std::vector<MesoPublished> published;
    for (const char* name : {"fbm", "ridged", "hemispheres", "blocks"}) {
        VCP_TRY_ASSIGN(const auto map, makeHeightField(name, 256, 1));
        for (const auto& [fit, text] :
             {std::pair(LevelFit::Printed, "volume of a level over that of averages, as printed"),
              std::pair(LevelFit::Least, "volume of a level over that of averages, least")}) {
            VCP_TRY_ASSIGN(const auto levels, HeightLevels::build(map, {.fit = fit, .mostIterations = 1000}));
            double ratio = 0;
            for (size_t level = 1; level <= 3; ++level)
                ratio += levels.volumes()[level].fitted / levels.volumes()[level].averaged / 3;
            published.push_back({text, name, "volume, levels 1 to 3", 0.7, 0.7, ratio, 0});
        }
    }
    // A mesh of 512 x 512 corners with two bytes a coordinate against two bytes a texel, and a strip's base.
    const double map = 512.0 * 512 * 2, base = 34 * 12;
    published.push_back(
        {"storage of a mesh over a map's", "512 x 512", "bytes", 6, 6, 512.0 * 512 * 6 * 2 / (map + base), 0});
    VCP_TRY_ASSIGN(const auto quad, makeBaseSurface("quad", 1));
    VCP_TRY_ASSIGN(const auto heights, makeHeightField("fbm", 64, 1));
    VCP_TRY_ASSIGN(auto levels, HeightLevels::build(heights, {.fit = LevelFit::Averaged}));
    VCP_TRY_ASSIGN(const auto surface,
                   buildRemeshSurface(quad, std::make_shared<const HeightLevels>(std::move(levels)), 0.1));
    RemeshMesh<float> mesh;
    VCP_TRY(remesh(surface, cameraAt(kPlaces[1]), {.mostCells = 1024}, mesh));
    // The printed walk adds twice a quad, and for each column the primary edge's step, the base's and the side edge's.
    const double quads = double(mesh.counts.quads), additions = 2 * quads + 3 * double(mesh.counts.strips);
    published.push_back({"additions of the printed walk a quad", "quad", "additions", 2, 2.1, additions / quads, 0});
    // Depth of a cell over its width, the most over the least, between depths 1 and 100 (figure 7).
    const double focal = 150, step = std::log1p(1 / focal);
    double least = 1e300, most = 0;
    for (double z = 1; z < 100; z *= 1.1) {
        const double deep = z * std::expm1(step) / (z / focal);
        least = std::min(least, deep), most = std::max(most, deep);
    }
    published.push_back({"depth of a cell of grid space over its width", "figure 7", "lengths", 1, 1, most / least, 0});
    return published;
}

}  // namespace vcp
