// Light over base surfaces: transfer of the base against answers that are known, and all of it, with the mesostructure,
// against a path tracer on the shell.
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/packing.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include "builder/measure/mesh_bvh.h"
#include "mesostructure/base_transfer.h"
#include "mesostructure/harmonics.h"
#include "mesostructure/shell_paths.h"
#include "mesostructure/tile_paths.h"
#include "tests/support/groove_light.h"
#include "tests/support/meso_rays.h"

namespace vcp::meso {
namespace {

using glm::dvec2, glm::dvec3, f64::Harmonics, f64::harmonicsOf;

HeightMap flat() { return {{8, 8}, 0.25, std::vector<uint16_t>(64, 39321)}; }

/// Traces all vertices of a scene against its triangles.
Result<std::vector<BaseTransfer>> tracedOf(const BaseScene& scene, BaseTransferOptions options) {
    const IndexedMesh mesh{scene.positions, scene.triangles, {}};
    const MeshBvh bvh(mesh);
    options.cast = [&](dvec3 origin, dvec3 direction) -> std::optional<BaseHit> {
        const auto hit = bvh.nearestHit(origin, direction);
        if (!hit) return std::nullopt;
        return BaseHit{hit->triangle, hit->t};
    };
    const std::array all{std::pair(0u, uint32_t(scene.positions.size()))};
    return traceBaseTransfer(scene, all, options);
}

BaseTransfer transferOf(const BaseScene& scene, const BaseTransferOptions& options = {}) {
    auto made = tracedOf(scene, options);
    EXPECT_TRUE(made) << made.error().line();
    return std::move((*made)[0]);
}

/// Returns the light over a vertex, by the change that the transfer holds of it.
Harmonics lightOver(const BaseTransfer& transfer, size_t vertex, const Harmonics& light) {
    Harmonics over = light;
    if (const uint32_t number = transfer.numbers[vertex]; number > 0)
        for (size_t j = 0; j < 16; ++j)
            for (size_t i = 0; i < 16; ++i)
                over.c[i] += double(transfer.changes[BaseTransfer::kValues * (number - 1) + 16 * j + i]) * light.c[j];
    return over;
}

double dot(const Harmonics& a, const Harmonics& b) {
    double sum = 0;
    for (int i = 0; i < 16; ++i) sum += a.c[i] * b.c[i];
    return sum;
}

/// Light of radiance 1 from everywhere.
Harmonics evenLight() {
    Harmonics light{};
    light.c[0] = 1 / double(f64::kBand0);
    return light;
}

/// A strip of triangles along y from a polyline in x and z, which outside is to the left of.
BaseSurface extruded(const std::vector<dvec2>& line, double reach) {
    BaseSurface made;
    for (const dvec2 p : line)
        for (const double y : {-reach, 0.0, reach}) made.positions.emplace_back(p.x, y, p.y);
    for (uint32_t i = 0; i + 1 < line.size(); ++i)
        for (uint32_t k = 0; k < 2; ++k) {
            const uint32_t a = 3 * i + k, b = a + 3, c = a + 4, d = a + 1;
            made.triangles.push_back({a, b, c}), made.triangles.push_back({a, c, d});
        }
    made.uvs.assign(made.triangles.size(), {dvec2(0, 0), dvec2(1, 0), dvec2(1, 1)});
    return made;
}

/// A floor that a wall of height 1 ends at x = 2.
std::vector<dvec2> floorAndWall() {
    std::vector<dvec2> line;
    for (int i = 0; i <= 20; ++i) line.emplace_back(0.1 * i, 0);
    for (int i = 1; i <= 10; ++i) line.emplace_back(2, 0.1 * i);
    return line;
}

TEST(BaseTransfer, WhatIsConvexIsOpen) {
    for (const char* name : {"quad", "box", "sphere", "cylinder"}) {
        BaseScene scene;
        scene.add(*makeBaseSurface(name, 2), 0.05, 0.5);
        const BaseTransfer transfer = transferOf(scene, {.rays = 64});
        EXPECT_EQ(transfer.vertices(), scene.positions.size()) << name;
        EXPECT_TRUE(transfer.changes.empty()) << name;
    }
    BaseScene scene;
    scene.add(*makeBaseSurface("torus", 2), 0.05, 0.5);
    EXPECT_FALSE(transferOf(scene, {.rays = 64}).changes.empty());
}

TEST(BaseTransfer, AWallTakesItsPartOfTheSky) {
    BaseScene scene;
    scene.add(extruded(floorAndWall(), 300), 0, 0);
    const BaseTransfer transfer = transferOf(scene, {.rays = 4096});
    for (int i = 2; i < 19; ++i) {
        // Of a wall without ends that is 1 high, at a distance, a floor sees (1 - cos) / 2.
        const double distance = 2 - 0.1 * i, seen = 1 - (1 - distance / std::hypot(distance, 1.0)) / 2;
        const Harmonics over = lightOver(transfer, size_t(3 * i + 1), evenLight());
        EXPECT_NEAR(dot(f64::clampedCosine({0, 0, 1}), over), seen, 0.004) << "at " << distance;
    }
}

TEST(BaseTransfer, KeepsTheLightOfAFlatSurface) {
    // Under any light of four bands what a flat mesostructure gets is the mean over the rays: here by quadrature over
    // the half of the floor's sphere that the wall does not hide.
    BaseScene scene;
    scene.add(extruded(floorAndWall(), 300), 0, 0);
    const BaseTransfer transfer = transferOf(scene, {.rays = 4096});
    std::mt19937 random(2);
    std::normal_distribution<double> bell;
    Harmonics light;
    for (double& c : light.c) c = bell(random);
    for (const int i : {4, 10, 16}) {
        const double distance = 2 - 0.1 * i;
        double sum = 0;
        constexpr int kCount = 200000;
        for (int k = 0; k < kCount; ++k) {
            const dvec3 d = directionByCosine({0, 0, 1}, evenPoint(uint64_t(k)));
            const bool isHidden = d.x > 0 && d.z * distance < d.x;
            if (!isHidden) sum += dot(harmonicsOf(d), light) / kCount;
        }
        const Harmonics over = lightOver(transfer, size_t(3 * i + 1), light);
        EXPECT_NEAR(dot(f64::clampedCosine({0, 0, 1}), over), sum, 0.01) << "at " << distance;
        // The test can fail: the wall takes more than that.
        EXPECT_GT(std::abs(dot(f64::clampedCosine({0, 0, 1}), light) - sum), 0.02);
    }
}

TEST(BaseTransfer, GroovesAreAsRadiosityHasThem) {
    constexpr int kStrips = 64;
    std::vector<dvec2> line;
    for (int i = -kStrips; i <= kStrips; ++i) line.push_back(dvec2(i, std::abs(i)) / double(kStrips));
    for (const double albedo : {0.0, 0.5, 1.0}) {
        BaseScene scene;
        scene.add(extruded(line, 300), 0, albedo);
        const BaseTransfer transfer = transferOf(scene, {.rays = 2048, .bounces = 40});
        const std::vector<double> known = vcp::test::grooveLight(kStrips, albedo);
        for (const int i : {8, 20, 40, 60}) {
            // A vertex lies between two strips; its normal is that of the wall.
            const double light = (known[size_t(i - 1)] + known[size_t(i)]) / 2;
            const Harmonics over = lightOver(transfer, size_t(3 * (kStrips + i) + 1), evenLight());
            EXPECT_NEAR(dot(f64::clampedCosine(glm::normalize(dvec3(-1, 0, 1))), over), light, 0.01)
                << "strip " << i << ", albedo " << albedo;
        }
    }
}

TEST(BaseTransfer, TurnsWithTheScene) {
    BaseSurface torus = *makeBaseSurface("torus", 2);
    const glm::dquat turn = glm::normalize(glm::dquat(0.3, -0.5, 0.7, 0.2));
    const glm::dmat3 frame = glm::mat3_cast(turn);
    BaseScene scene, turned;
    scene.add(torus, 0.05, 0.5);
    for (dvec3& p : torus.positions) p = turn * p;
    turned.add(torus, 0.05, 0.5);
    const BaseTransfer a = transferOf(scene, {.rays = 256}), b = transferOf(turned, {.rays = 256});
    std::mt19937 random(7);
    std::normal_distribution<double> bell;
    Harmonics light;
    for (double& c : light.c) c = bell(random);
    const Harmonics turnedLight = turnedHarmonics(light, frame);
    double most = 0, change = 0;
    for (size_t v = 0; v < a.vertices(); v += 7) {
        const dvec3 n = scene.normals[v];
        const double before = dot(f64::clampedCosine(n), lightOver(a, v, light)),
                     after = dot(f64::clampedCosine(turn * n), lightOver(b, v, turnedLight));
        most = std::max(most, std::abs(before - after));
        change = std::max(change, std::abs(before - dot(f64::clampedCosine(n), light)));
    }
    // Rays are others, as their frames are.
    EXPECT_LT(most, 0.05);
    EXPECT_GT(change, 0.1);
}

TEST(BaseTransfer, DoesNotDependOnHowItIsSharedOut) {
    BaseScene scene;
    scene.add(*makeBaseSurface("torus", 2), 0.05, 0.5);
    BaseTransferOptions options{.rays = 32};
    const BaseTransfer whole = transferOf(scene, options);
    double done = 0;
    options.shareOut = [&](size_t count, const auto& fill, BaseTransferOptions::Part part) {
        EXPECT_GE(part.before, done) << "progress goes forward";
        EXPECT_GT(part.after, part.before);
        done = part.after;
        for (size_t i = count; i > 0; --i) fill(i - 1, i);
        return true;
    };
    const BaseTransfer parts = transferOf(scene, options);
    EXPECT_EQ(whole.numbers, parts.numbers);
    EXPECT_EQ(whole.changes, parts.changes);
    EXPECT_EQ(done, 1);
    // It can be cancelled in each of its stages: rays, bounces, and what comes of them.
    for (const double until : {0.0, 0.6, 0.74, 0.75}) {
        options.shareOut = [&](size_t count, const auto& fill, BaseTransferOptions::Part part) {
            fill(0, count);
            return part.before < until;
        };
        EXPECT_EQ(tracedOf(scene, options).error().code, ErrorCode::Cancelled) << until;
    }
    EXPECT_EQ(traceBaseTransfer(scene, {}, {.memoryBytes = 1000}).error().code, ErrorCode::Limit);
    EXPECT_EQ(traceBaseTransfer(scene, {}, {.rays = 0}).error().code, ErrorCode::Usage);
    EXPECT_EQ(traceBaseTransfer(scene, {}, {.rays = 1000000}).error().code, ErrorCode::Usage);
}

TEST(BaseTransfer, TexelsHoldTheLightOverVertices) {
    BaseScene scene;
    scene.add(extruded(floorAndWall(), 300), 0, 0.5);
    const BaseTransfer transfer = transferOf(scene, {.rays = 64});
    std::mt19937 random(3);
    std::uniform_real_distribution<float> unit(-1, 1);
    std::array<glm::vec4, 16> light;
    for (glm::vec4& l : light) l = {unit(random), unit(random), unit(random), 9};
    const std::vector<uint64_t> texels = transfer.lightTexels(light);
    ASSERT_EQ(texels.size(), transfer.vertices() * BaseTransfer::kTexels);
    for (size_t v = 0; v < transfer.vertices(); ++v)
        for (int channel = 0; channel < 3; ++channel) {
            Harmonics from;
            for (size_t i = 0; i < 16; ++i) from.c[i] = light[i][channel];
            const Harmonics over = lightOver(transfer, v, from);
            for (size_t i = 0; i < 16; ++i) {
                const glm::vec4 texel =
                    glm::unpackHalf4x16(texels[v * BaseTransfer::kTexels + size_t(channel) * 4 + i / 4]);
                EXPECT_NEAR(texel[int(i % 4)], over.c[i], 2e-3 * (1 + std::abs(over.c[i])));
            }
        }
}

TEST(TileReflection, IsThatOfPlanesAndGrooves) {
    const HeightMap plane = flat();
    const auto shape = test::heights(plane);
    const TileReflection ofPlane = tileReflection(TilePaths(*shape, 0.6));
    EXPECT_NEAR(ofPlane.height, 0.15, 1e-9);
    EXPECT_NEAR(ofPlane.albedo, 0.6, 0.02);
    std::vector<uint16_t> heights;
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) heights.push_back(uint16_t(65535 * (x < 4 ? x : 8 - x) / 4));
    const HeightMap grooved{{8, 8}, 0.5, std::move(heights)};
    const auto grooves = test::heights(grooved);
    for (const double albedo : {0.3, 0.8, 1.0}) {
        // What is not given back is what the walls keep, whose area is the root of 2.
        const std::vector<double> light = vcp::test::grooveLight(64, albedo);
        double mean = 0;
        for (const double l : light) mean += l / 64;
        const TileReflection found = tileReflection(TilePaths(*grooves, albedo), 1 << 15);
        EXPECT_NEAR(found.albedo, 1 - (1 - albedo) * std::sqrt(2.0) * mean, 0.01) << albedo;
        EXPECT_NEAR(found.height, 0.25, 0.002);
    }
}

TEST(ShellPaths, OnAPlaneAreThoseOfTheTile) {
    const auto hills = *makeHeightField("hemispheres", 32, 1);
    const auto shape = test::heights(hills);
    const double edge = 2.0 / 40, height = edge * shape->extent().z;
    const ShellPaths paths({{shape.get(), *makeBaseSurface("quad", 40), height}}, 0.6);
    const TilePaths tile(*shape, 0.6);
    const auto sky = [](dvec3 d) { return 1 + 0.5 * d.x + 0.3 * d.z; };
    const dvec3 down = glm::normalize(dvec3(0.3, 0.2, -1));
    for (int i = 0; i < 6; ++i) {
        const dvec2 place = evenPoint(uint64_t(i));
        // Tile space of the quad begins at a corner of it.
        const dvec3 eye = dvec3(place * edge, height) - down;
        const TileMeeting seen = paths.meet(eye, down), known = tile.see(-down, place);
        ASSERT_EQ(seen.kind, TileMeeting::Kind::Surface);
        EXPECT_NEAR(seen.point.at.z / edge, known.point.at.z, 1e-6);
        EXPECT_GT(glm::dot(seen.point.normal, known.point.normal), 1 - 1e-9);
        const double expected = tile.lightAt(
                                        known.point, [&](dvec3 d) { return dvec3(sky(d)); }, 4000, 1)
                                    .x;
        PathRandom random(2);
        double light = 0;
        for (uint32_t k = 0; k < 4000; ++k) {
            const TileEscape escape =
                paths.follow(seen.point, directionByCosine(seen.point.normal, evenPoint(k)), random);
            light += escape.weight * sky(escape.direction) / 4000;
        }
        EXPECT_NEAR(light, expected, 0.015) << i;
    }
}

TEST(ShellPaths, WhiteInWhiteIsWhite) {
    const auto hills = *makeHeightField("hemispheres", 32, 1);
    const auto shape = test::heights(hills);
    const ShellPaths paths({{shape.get(), *makeBaseSurface("torus", 6), 0.1}}, 1);
    double sum = 0;
    int count = 0;
    for (int i = 0; i < 200; ++i) {
        const dvec2 p = evenPoint(uint64_t(i));
        const dvec3 eye(2.4 * p.x - 1.2, 2.4 * p.y - 1.2, 2);
        const TileMeeting seen = paths.meet(eye, {0.1, 0.1, -1});
        if (seen.kind != TileMeeting::Kind::Surface) continue;
        PathRandom random(uint64_t(i) + 1);
        for (uint32_t k = 0; k < 8; ++k, ++count)
            sum += paths.follow(seen.point, directionByCosine(seen.point.normal, evenPoint(k)), random).weight;
    }
    EXPECT_GT(count, 500);
    EXPECT_LE(sum / count, 1 + 1e-12);
    EXPECT_GT(sum / count, 0.99);
}

}  // namespace
}  // namespace vcp::meso
