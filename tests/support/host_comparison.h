// Pictures by the host and pictures by the shaders, pixel by pixel.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "render/host_renderer.h"
#include "streaming/page_source.h"
#include "tests/support/built_mesh.h"
#include "tests/support/reference_comparison.h"

namespace vcp::test {

/// What a renderer says of each pixel.
struct Planes {
    UpdateResult update;
    Picture picture;
    std::vector<float> depth;
    std::vector<glm::vec3> normals;
};

inline Planes drawnBy(PictureRenderer& renderer, const FrameRequest& request, uint32_t samples = 1) {
    Planes planes;
    planes.update = renderer.settle(request).value();
    const auto stats = renderer.render(request);
    EXPECT_TRUE(stats) << stats.error().line();
    EXPECT_TRUE(renderer.refineTo(samples, request));
    planes.picture = renderer.readPicture().value();
    planes.depth = renderer.readDepth().value();
    planes.normals = renderer.readNormals().value();
    const auto hits = std::ranges::count_if(planes.depth, [](float depth) { return std::isfinite(depth); });
    EXPECT_EQ(stats->hitPixels, uint64_t(hits));
    return planes;
}

/// How pixels of two pictures differ. Each is counted once, by the first that differs.
struct Difference {
    uint64_t pixels = 0, hits = 0;
    uint64_t state = 0;   ///< one has a hit
    uint64_t depth = 0;   ///< by more than a thousandth of a finest cell, where the surface is not seen edge-on
    uint64_t normal = 0;  ///< by more than 0.2 degrees
    uint64_t colour = 0;  ///< by more than two of 255 steps of a channel

    Difference& operator+=(const Difference& other) {
        pixels += other.pixels, hits += other.hits;
        state += other.state, depth += other.depth, normal += other.normal, colour += other.colour;
        return *this;
    }
};

inline int channelsApart(const Picture& a, const Picture& b, size_t pixel) {
    int most = 0;
    for (size_t c = 4 * pixel; c < 4 * pixel + 4; ++c) most = std::max(most, std::abs(a.rgba[c] - b.rgba[c]));
    return most;
}

inline Difference compare(const Planes& host, const Planes& device, double cell) {
    Difference d;
    for (size_t i = 0; i < device.depth.size(); ++i) {
        ++d.pixels;
        const bool isHit = std::isfinite(device.depth[i]);
        d.hits += isHit ? 1 : 0;
        if (std::isfinite(host.depth[i]) != isHit) {
            ++d.state;
            continue;
        }
        if (isHit) {
            const double apart = std::abs(double(host.depth[i]) - double(device.depth[i]));
            if (apart > 1e-3 * cell + 1e-6 * double(device.depth[i])) {
                ++d.depth;
                continue;
            }
            if (glm::distance(host.normals[i], device.normals[i]) > 0.0035f) {
                ++d.normal;
                continue;
            }
        }
        d.colour += channelsApart(host.picture, device.picture, i) > 2 ? 1 : 0;
    }
    return d;
}

/// Datasets of one level that show every kind of leaf, one of them far from the origin and small.
inline std::vector<Scene> scenesOfEveryLeaf() {
    AnalyticOptions oneLevel;
    oneLevel.levels = 1;
    oneLevel.axis = 2;
    return {sphereScene(1), sceneOf("torus", analyticDataset(torus(glm::dvec3(8.2, 7.8, 8.1), 4.8, 1.8), oneLevel)),
            cubeScene(1), wavesScene(12, 2), sphereScene(1, {483920.0, 3792000.0, 1200.0}, 1.0 / 1024)};
}

/// What two renderers pick, every few pixels of what they drew last. A pixel differs where but one has a hit, or
/// where but one is on a cap.
struct PickDifference {
    std::array<uint64_t, 2> ofDataset{};  ///< picks that agree, by dataset
    uint64_t caps = 0;                    ///< picks that agree and are on a cap
    uint64_t differing = 0;
};
inline PickDifference comparePicks(Renderer& cast, Renderer& device, const FrameRequest& request) {
    PickDifference d;
    for (uint32_t y = 2; y < request.height; y += 5)
        for (uint32_t x = 2; x < request.width; x += 5) {
            const auto a = cast.pick(x, y).value(), b = device.pick(x, y).value();
            if (!a && !b) continue;
            if (!a || !b || a->onCap != b->onCap) {
                ++d.differing;
                continue;
            }
            EXPECT_EQ(a->dataset, b->dataset);
            EXPECT_LT(glm::distance(a->position, b->position), 1e-3);
            ++d.ofDataset.at(a->dataset);
            d.caps += a->onCap ? 1 : 0;
        }
    return d;
}

class HostRendererTest : public RendererFixture {
protected:
    void SetUp() override {
        start();
        host_ = HostRenderer::create({}).value();
    }
    void open(std::vector<PlacedDataset> datasets) {
        ASSERT_TRUE(host_->open(datasets, {}));
        ASSERT_TRUE(renderer_->open(std::move(datasets)));
    }
    void open(const Scene& scene) { open({{scene.dataset, scene.source, {}}}); }
    void open(const BuiltMesh& built) { open({placed(built.file())}); }
    static PlacedDataset placed(const std::filesystem::path& file, const Similarity& placement = {}) {
        auto reader = openFile(file).value();
        const auto dataset = std::make_shared<const Dataset>(readDataset(*reader).value());
        return {dataset, std::make_shared<FilePageSource>(reader, dataset), placement};
    }
    /// `cell`: of the finest level, world units.
    Difference difference(const FrameRequest& request, double cell, uint32_t samples = 1) {
        const Planes host = drawnBy(*host_, request, samples), device = drawnBy(*renderer_, request, samples);
        EXPECT_EQ(host.update.pagesInCut, device.update.pagesInCut);
        EXPECT_EQ(host.update.errorPixels, device.update.errorPixels);
        EXPECT_EQ(host.update.residentBytes, device.update.residentBytes);
        return compare(host, device, cell);
    }
    std::unique_ptr<HostRenderer> host_;
};

/// A few pixels differ: where a ray passes an edge, or a silhouette, on one side or the other by less than both round,
/// and where it grazes the surface. 15 of 100,000 hits did at most, all in depth or normal; three times that may.
/// A colour is of as many rays as the picture has samples, each of which may differ.
inline void expectFew(const Difference& d, uint32_t samples = 1) {
    EXPECT_GT(d.hits, 10000u);
    EXPECT_LE(double(d.state + d.depth + d.normal + d.colour), 45e-5 * double(d.hits))
        << d.state << " states, " << d.depth << " depths, " << d.normal << " normals, " << d.colour << " colours of "
        << d.hits << " hits";
    EXPECT_LE(double(d.state), 5e-5 * double(d.hits)) << d.state;
    EXPECT_LE(double(d.state + d.colour), 5e-5 * samples * double(d.hits)) << d.state << ", " << d.colour;
}

inline BuiltMesh torusAndBox() {
    IndexedMesh mesh = torusMesh({0.1, 0.2, 0.3}, 1, 0.4, 90, 45);
    append(mesh, boxMesh({-0.3, -0.3, -0.3}, {0.35, 0.25, 0.3}, 4));
    return {mesh, 0.03};
}
inline const glm::dvec3 kLow(-1.4, -1.3, -1.2), kHigh(1.6, 1.7, 1.8);

/// A renderer whose software device leaves the rays to the processor.
class CastByRendererTest : public HostRendererTest {
protected:
    void SetUp() override {
        HostRendererTest::SetUp();
        if (!renderer_->device().software) GTEST_SKIP() << "the device casts rays itself";
        RendererOptions options;
        options.hostRays = true;
        casting_ = Renderer::create(options).value();
    }
    void openAll(const std::vector<PlacedDataset>& datasets) {
        open(datasets);
        ASSERT_TRUE(casting_->open(datasets));
    }
    std::unique_ptr<Renderer> casting_;
};

}  // namespace vcp::test
