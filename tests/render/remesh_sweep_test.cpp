// Remeshing on the device: vertices and indices are those of the processor in single precision.
#include "render/passes/remesh_sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "mesostructure/remesh/remesher.h"
#include "mesostructure/solids.h"
#include "render/passes/readback.h"
#include "render/remesh_meter.h"
#include "tests/support/remeshed_views.h"

namespace vcp {
namespace {

using namespace meso;
using glm::dvec3;

using meso::test::lookFrom, meso::test::openEdges;
using Mesh = RemeshMesh<float>;

class RemeshSweeps : public testing::Test {
protected:
    void SetUp() override {
        auto instance = Instance::create(true, {});
        ASSERT_TRUE(instance) << instance.error().line();
        instance_ = std::move(*instance);
        auto device = Device::create(*instance_, {}, VK_NULL_HANDLE, false);
        ASSERT_TRUE(device) << device.error().line();
        device_ = std::move(*device);
        if (!device_->hasGraphics()) GTEST_SKIP() << "the device does not rasterize";
        auto resources = MesoResources::create(*device_);
        ASSERT_TRUE(resources) << resources.error().line();
        resources_ = std::move(*resources);
        pass_ = std::make_unique<RemeshSweepPass>(*device_);
    }
    void TearDown() override {
        if (!instance_) return;
        for (const std::string& message : instance_->log().messages()) ADD_FAILURE() << message;
    }

    static RemeshSurface surfaceOf(std::string_view base, double tiles, double height, std::string_view heights,
                                   int mostLevels = 32) {
        auto levels = std::make_shared<HeightLevels>(
            *HeightLevels::build(*makeHeightField(heights, 64, 1), {.mostLevels = mostLevels}));
        return *buildRemeshSurface(*makeBaseSurface(base, tiles), levels, height);
    }
    static Mesh onProcessor(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshOptions& options) {
        Mesh mesh;
        EXPECT_TRUE(remesh(surface, camera, options, mesh));
        return mesh;
    }

    /// Sweeps on the device; batches become one mesh. The buffers are kept from call to call.
    Mesh onDevice(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshOptions& options,
                  const RemeshBatchLimits& limits = {}) {
        EXPECT_TRUE(makeRemeshPieces(surface, camera, options, pieces_, limits));
        return sweptMesh(*surface.heights);
    }
    Mesh onDevice(CertifiedCells& cells, const RemeshCamera& camera, const RemeshOptions& options,
                  const RemeshBatchLimits& limits = {}) {
        EXPECT_TRUE(makeRemeshPieces(cells, camera, options, pieces_, limits));
        return sweptMesh(*cells.patches().heights);
    }
    Mesh sweptMesh(const HeightLevels& heights) {
        const std::shared_ptr<const HeightLevels> shared(std::shared_ptr<void>(), &heights);
        auto pool = HeightPool::create(*device_, shared);
        EXPECT_TRUE(pool) << pool.error().line();
        EXPECT_TRUE((*pool)->loadAll());
        EXPECT_TRUE(pass_->prepare(swept_, pieces_, **pool));
        EXPECT_TRUE(device_->submitAndWait([&](VkCommandBuffer commands) {
            barrierToAll(commands);
            pass_->record(commands, swept_, heights, pieces_.view);
            barrierComputeToReadback(commands);
        }));
        Mesh mesh;
        for (size_t i = 0; i < pieces_.used; ++i) {
            const auto drawn = *readWords(*device_, swept_[i].drawn, 0, 6);
            EXPECT_LE(drawn[5], pieces_.batches[i].mostVertices);
            const auto indices = *readWords(*device_, swept_[i].indices, 0, drawn[0]);
            const auto words = *readWords(*device_, swept_[i].vertices, 0, uint64_t{6} * drawn[5]);
            const uint32_t first = uint32_t(mesh.vertices.size());
            mesh.vertices.resize(first + drawn[5]);
            std::memcpy(mesh.vertices.data() + first, words.data(), words.size() * 4);
            for (const uint32_t index : indices) mesh.indices.push_back(first + index);
        }
        return mesh;
    }

    /// The same triangles of the same vertices: bit for bit on software devices, whose division is exact. Others may
    /// divide with an error of 2.5 units of the last place, after which some forty operations follow.
    void expectSame(const Mesh& expected, const Mesh& found) {
        ASSERT_EQ(found.vertices.size(), expected.vertices.size());
        uint64_t differ = 0;
        float most = 0;
        for (size_t i = 0; i < found.vertices.size(); ++i) {
            const auto &a = expected.vertices[i], &b = found.vertices[i];
            differ += std::memcmp(&a, &b, sizeof a) != 0;
            const float size = glm::length(a.position) + 1;
            most = std::max({most, glm::distance(a.position, b.position) / size, glm::distance(a.uv, b.uv)});
        }
        if (device_->info().software) {
            EXPECT_EQ(differ, 0u) << "of " << found.vertices.size() << ", by up to " << most;
            EXPECT_EQ(found.indices, expected.indices);
        } else {
            EXPECT_LT(most, 1e-5f);
            EXPECT_EQ(found.indices.size(), expected.indices.size());
        }
    }

    std::unique_ptr<Instance> instance_;
    std::unique_ptr<Device> device_;
    std::unique_ptr<MesoResources> resources_;
    std::unique_ptr<RemeshSweepPass> pass_;
    std::vector<RemeshSwept> swept_;
    RemeshPieces pieces_;
};

TEST_F(RemeshSweeps, VerticesAreTheProcessors) {
    for (const auto& [base, heights] :
         {std::pair("sphere", "ridged"), std::pair("torus", "fbm"), std::pair("box", "blocks")}) {
        const RemeshSurface surface = surfaceOf(base, 1.5, 0.2, heights);
        for (const double cell : {0.7, 3.0, 30.0})
            for (const HeightAccess access : {HeightAccess::Sample, HeightAccess::Most})
                for (const bool isParallel : {false, true}) {
                    SCOPED_TRACE(std::string(base) + " " + std::to_string(cell));
                    RemeshCamera camera = lookFrom({3, 2, 2.5}, {0, 0, 0}, 150);
                    if (isParallel) camera.isParallel = true, camera.focal = 40, camera.seen = {-2, -2, 2, 2};
                    const RemeshOptions options{.cell = cell, .access = access};
                    const Mesh mesh = onDevice(surface, camera, options);
                    expectSame(onProcessor(surface, camera, options), mesh);
                    EXPECT_EQ(openEdges(mesh), 0u);
                }
    }
}

/// Edges with fewer parts than cells, and heights of the map itself.
TEST_F(RemeshSweeps, CertifiedCellsAreTheProcessors) {
    for (const auto& [base, heights] :
         {std::pair("torus", "fbm"), std::pair("box", "ridged"), std::pair("quad", "fbm")}) {
        CertifiedCells cells = *CertifiedCells::create(surfaceOf(base, 2, 0.05, heights));
        for (const double error : {0.3, 2.0})
            for (const double distance : {1.0, 3.0}) {
                SCOPED_TRACE(std::string(base) + " " + std::to_string(error) + " " + std::to_string(distance));
                const RemeshCamera camera = lookFrom(dvec3(1, 0.7, 0.8) * distance, {0, 0, 0}, 150);
                const RemeshOptions options{.cell = 6, .errorPixels = error};
                Mesh mesh;
                ASSERT_TRUE(remesh(cells, camera, options, mesh));
                expectSame(mesh, onDevice(cells, camera, options));
                EXPECT_EQ(pieces_.counts.boundPixels, mesh.counts.boundPixels);
                EXPECT_GT(mesh.counts.boundPixels, 0);
                expectSame(mesh, onDevice(cells, camera, options, {.vertices = 20'000, .pieces = 100}));
            }
    }
}

/// An eye within the slab: pieces are halved again and again, and what is nearer than the nearest depth is swept, too.
TEST_F(RemeshSweeps, HalvedTrianglesAreTheProcessors) {
    const RemeshSurface surface = surfaceOf("quad", 1, 0.2, "ridged");
    const RemeshCamera camera = lookFrom({-0.2, 0.1, 0.3}, {1, 0.1, 0.25}, 300);
    for (const int mostCells : {2, 64, 256}) {
        const RemeshOptions options{.cell = 2, .mostCells = mostCells};
        const Mesh mesh = onProcessor(surface, camera, options);
        EXPECT_GT(mesh.counts.halvings, 20u);
        expectSame(mesh, onDevice(surface, camera, options));
    }
}

/// A map with one level only is that of an atlas.
TEST_F(RemeshSweeps, MapsWithoutCoarserLevelsAreLookedUpAsTheyAre) {
    const RemeshSurface surface = surfaceOf("sphere", 2, 0.1, "hemispheres", 1);
    const RemeshCamera camera = lookFrom({3, 2, 2.5}, {0, 0, 0}, 100);
    expectSame(onProcessor(surface, camera, {.cell = 8}), onDevice(surface, camera, {.cell = 8}));
}

/// More columns than one workgroup adds up at once, in one batch and in several; and before and after a view of few
/// pieces and one of none, in the same buffers.
TEST_F(RemeshSweeps, ViewsOfAnySizeFollowEachOther) {
    const RemeshSurface surface = surfaceOf("sphere", 2, 0.1, "ridged");
    const RemeshCamera close = lookFrom({1.4, 0.9, 1.1}, {0, 0, 0}, 900), far = lookFrom({9, 4, 5}, {0, 0, 0}, 60);
    const Mesh many = onProcessor(surface, close, {.cell = 1}), few = onProcessor(surface, far, {.cell = 4});
    expectSame(few, onDevice(surface, far, {.cell = 4}));
    const uint64_t bytes = swept_[0].vertices.bytes();
    expectSame(many, onDevice(surface, close, {.cell = 1}));
    EXPECT_GT(pieces_.batches[0].columns(), 65536u);
    EXPECT_GT(swept_[0].vertices.bytes(), 10 * bytes);
    expectSame(few, onDevice(surface, far, {.cell = 4}));
    expectSame(many, onDevice(surface, close, {.cell = 1}, {.vertices = 100'000, .pieces = 5000}));
    EXPECT_GT(pieces_.used, 4u);
    const RemeshCamera away = lookFrom({5, 0, 0}, {10, 0, 0}, 100);
    EXPECT_EQ(onDevice(surface, away, {}).vertices.size(), 0u);
    expectSame(few, onDevice(surface, far, {.cell = 4}));
}

/// The tessellator's triangles are others than the sweep's, of the same surface: nothing shows through between patches,
/// and depths differ by what levels of heights do.
TEST_F(RemeshSweeps, TessellatorsDrawTheSameSurface) {
    auto made = RemeshMeter::create({}, true);
    ASSERT_TRUE(made) << made.error().line();
    RemeshMeter& meter = **made;
    constexpr uint32_t kEdge = 200;
    for (const auto& [base, heights] : {std::pair("sphere", "ridged"), std::pair("box", "blocks")})
        for (const double cell : {1.0, 6.0}) {
            SCOPED_TRACE(std::string(base) + " " + std::to_string(cell));
            const RemeshSurface surface = surfaceOf(base, 1.5, 0.15, heights);
            const RemeshCamera camera = lookFrom({2.4, 1.8, 2}, {0, 0, 0}, kEdge);
            const auto sweep = meter.draw(surface, camera, {.cell = cell}, RemeshWay::Sweep, kEdge, kEdge, 1);
            ASSERT_TRUE(sweep) << sweep.error().line();
            EXPECT_EQ(sweep->vertices, onProcessor(surface, camera, {.cell = cell}).vertices.size());
            const auto patches = meter.draw(surface, camera, {.cell = cell}, RemeshWay::Tessellation, kEdge, kEdge, 1);
            if (!patches && patches.error().code == ErrorCode::Unsupported) GTEST_SKIP() << patches.error().line();
            ASSERT_TRUE(patches) << patches.error().line();
            EXPECT_GT(patches->triangles, sweep->triangles / 2);
            EXPECT_LT(patches->triangles, sweep->triangles * 2);
            uint64_t both = 0, one = 0, holes = 0;
            double off = 0;
            for (uint32_t y = 2; y + 2 < kEdge; ++y)
                for (uint32_t x = 2; x + 2 < kEdge; ++x) {
                    const glm::vec4 a = sweep->hits[y * kEdge + x], b = patches->hits[y * kEdge + x];
                    int around = 0;
                    for (uint32_t i = 0; i < 25; ++i)
                        around += patches->hits[(y + i / 5 - 2) * kEdge + x + i % 5 - 2].w > 0;
                    holes += b.w == 0 && around == 24;
                    one += (a.w > 0) != (b.w > 0);
                    if (a.w > 0 && b.w > 0) ++both, off += std::abs(a.x - b.x);
                }
            EXPECT_EQ(holes, 0u);
            EXPECT_GT(both, 5000u);
            EXPECT_LT(one, both / 50);
            EXPECT_LT(off / double(both), 0.02);
        }
    for (const std::string& message : meter.validationMessages()) ADD_FAILURE() << message;
}

TEST(RemeshedPieces, RoomIsKnownBeforeVerticesAreCounted) {
    const auto levels = std::make_shared<HeightLevels>(*HeightLevels::build(*makeHeightField("fbm", 32, 1)));
    RemeshPieces pieces;
    for (uint32_t seed = 0; seed < 2000; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> off(-1, 1);
        std::array<dvec3, 3> corners;
        for (dvec3& corner : corners) corner = dvec3(off(random), off(random), 3 + 1.5 * off(random));
        const BaseSurface base{{corners[0], corners[1], corners[2]},
                               {{0, 1, 2}},
                               {{glm::dvec2(0.1, 0.2), glm::dvec2(0.9, 0.3), glm::dvec2(0.4, 0.8)}}};
        const RemeshSurface surface = *buildRemeshSurface(base, levels, 0.05);
        RemeshCamera camera;
        camera.focal = 60;
        Mesh mesh;
        ASSERT_TRUE(remesh(surface, camera, {}, mesh));
        ASSERT_TRUE(makeRemeshPieces(surface, camera, {}, pieces));
        const uint64_t room = pieces.used == 0 ? 0 : pieces.batches[0].mostVertices;
        ASSERT_LE(mesh.vertices.size(), room) << seed;
        ASSERT_LE(mesh.indices.size() / 3, 2 * room) << seed;
        const uint64_t columns = room == 0 ? 0 : pieces.batches[0].columns();
        ASSERT_LE(room, mesh.vertices.size() + 2 * columns + 1) << seed;
    }
}

TEST(RemeshedPieces, TooManyVerticesAreRefusedWithOneLine) {
    const auto levels = std::make_shared<HeightLevels>(*HeightLevels::build(*makeHeightField("fbm", 32, 1)));
    const RemeshSurface surface = *buildRemeshSurface(*makeBaseSurface("quad", 1), levels, 0.05);
    RemeshCamera camera;
    camera.eye = {0, 0, -3}, camera.focal = 300;
    RemeshPieces pieces;
    const auto made = makeRemeshPieces(surface, camera, {}, pieces, {}, 1000);
    ASSERT_FALSE(made.ok());
    EXPECT_EQ(made.error().code, ErrorCode::Limit);
    EXPECT_EQ(made.error().message, "remeshing makes more than 1000 vertices: larger cells, or errors, make fewer");
    EXPECT_EQ(makeRemeshPieces(surface, camera, {.cell = 0}, pieces).error().code, ErrorCode::Usage);
}

}  // namespace
}  // namespace vcp
