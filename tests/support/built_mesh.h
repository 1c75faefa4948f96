// A mesh, built, with all its pages: what tests of the whole builder look at.
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>

#include <gtest/gtest.h>

#include "builder/build.h"
#include "builder/measure/mesh_bvh.h"
#include "builder/measure/surface_distance.h"
#include "octree/reference_caster.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"

namespace vcp::test {

/// A build that fails, fails the test; ok() is false then.
class BuiltMesh {
public:
    BuiltMesh(const IndexedMesh& mesh, double cell) : mesh_(mesh), bvh_(mesh_) {
        writeObj(mesh, folder_ / "mesh.obj");
        BuildOptions options;
        options.inputs = {folder_ / "mesh.obj"};
        options.output = file();
        options.cell = cell;
        options.threads = 2;
        auto report = buildOctree(options);
        EXPECT_TRUE(report.ok()) << report.error().line();
        if (!report) return;
        report_ = *report;
        auto cache = PageCache::open(file());
        EXPECT_TRUE(cache.ok()) << cache.error().line();
        if (!cache) return;
        cache_ = std::make_unique<PageCache>(std::move(*cache));
        const auto loaded = cache_->loadAll();
        EXPECT_TRUE(loaded.ok()) << loaded.error().line();
    }

    [[nodiscard]] bool ok() const { return cache_ != nullptr; }
    [[nodiscard]] std::filesystem::path file() const { return folder_ / "mesh.vcp"; }
    [[nodiscard]] const PageCache& cache() const { return *cache_; }
    [[nodiscard]] const BuildReport& report() const { return report_; }
    [[nodiscard]] const MeshBvh& bvh() const { return bvh_; }
    [[nodiscard]] uint32_t levels() const { return cache_->dataset().header.levels; }

private:
    static std::string folderName() {
        static std::atomic<int> made = 0;
        return fmt::format("vcp_built_mesh_{}", ++made);
    }

    IndexedMesh mesh_;
    MeshBvh bvh_;
    TestFolder folder_{folderName()};
    BuildReport report_;
    std::unique_ptr<PageCache> cache_;
};

/// Nothing lies farther from the other surface than is certified, at any level. `samples`: at each.
inline void expectWithinCertified(const BuiltMesh& built, uint64_t samples) {
    ASSERT_TRUE(built.ok());
    for (uint32_t level = 0; level < built.levels(); ++level) {
        SCOPED_TRACE(testing::Message() << "level " << level << " of " << built.levels());
        SurfaceDistanceOptions options;
        options.samples = samples;
        options.level = level;
        const auto d = measureSurfaceDistance(built.cache(), built.bvh(), options);
        ASSERT_TRUE(d.ok()) << d.error().line();
        EXPECT_LE(d->meshToSurface.max, d->certifiedErrorMax * 1.000001);
        EXPECT_LE(d->surfaceToMesh.max, d->certifiedErrorMax * 1.000001);
    }
}

}  // namespace vcp::test
