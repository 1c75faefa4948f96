// Leak and acne of shadows by displacement maps: what each height above the surface must do to them.
#include <gtest/gtest.h>

#include "mesostructure/method.h"
#include "render/meso_surface.h"
#include "viewer/bench/bench_meso.h"

namespace vcp {
namespace {

using namespace meso;

Asset beads() {
    Asset asset;
    asset.name = asset.solid = "beads";
    return asset;
}

TEST(BenchMesoShadows, AcneFallsAndLeakGrowsWithTheHeight) {
    Asset asset = beads();
    const auto shape = *shapeOf(asset);
    asset.extent = shape->extent();
    const auto rows = compareMesoShadows(asset, *shape, 1500, {});
    ASSERT_TRUE(rows) << rows.error().line();
    EXPECT_EQ(rows->size(), 2u * 2 * 9 + 2);
    const auto of = [&](std::string_view method, double offset, bool ownHits) {
        for (const MesoShadows& row : *rows)
            if (row.method == method && row.offsetPoints == offset && row.ownHits == ownHits) return row;
        ADD_FAILURE() << method << " " << offset;
        return MesoShadows();
    };
    for (const char* method : {"gdm", "gdm-visibility"})
        for (const bool ownHits : {false, true}) {
            const MesoShadows at = of(method, 0, ownHits), above = of(method, 1.5, ownHits),
                              far = of(method, 4, ownHits);
            SCOPED_TRACE(method + std::string(ownHits ? ", its own hits" : ", the surface"));
            EXPECT_GT(at.places, 800u);
            EXPECT_EQ(at.places, far.places);
            EXPECT_GT(at.dark, 0.1);
            EXPECT_LT(at.dark, 0.5);
            EXPECT_LT(above.acne, 0.7 * at.acne);
            EXPECT_GT(far.leak, at.leak + 0.02);
            EXPECT_LE(at.leak + at.acne, 1);
        }
    EXPECT_LT(of("gdm-visibility", 1.5, false).acne, 0.3 * of("gdm-visibility", 0, false).acne);
    const MesoShadows boxes = of("boxes", 0.25, true);
    EXPECT_LT(boxes.leak + boxes.acne, 0.01) << "marched shadows are right";
}

TEST(BenchMesoShadows, AreAskedFromWhereTheyAreLeastWrong) {
    Asset asset = beads();
    const auto shape = *shapeOf(asset);
    asset.extent = shape->extent();
    MethodOptions options{.name = "gdm", .cells = 8, .rank = 0, .directions = {4, 4}};
    const auto table = traceTable(asset, *shape, tracedBy(*shape, options));
    ASSERT_TRUE(table) << table.error().line();
    options.table = &*table;
    const auto liftOf = [&](const char* name) {
        options.name = name;
        const auto method = buildMethod(asset, *shape, options);
        EXPECT_TRUE(method) << method.error().line();
        return shadowLift(*method->arrays(), 2);
    };
    EXPECT_NEAR(liftOf("gdm"), 3 * 2.0 / 8, 1e-6);
    EXPECT_NEAR(liftOf("gdm-visibility"), 1.5 * 2.0 / 8, 1e-6);
    EXPECT_NEAR(liftOf("slices"), 1.5 * 2.0 / 8, 1e-6);
}

}  // namespace
}  // namespace vcp
