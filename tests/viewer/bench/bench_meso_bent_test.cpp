// View-dependent maps over bases that bend, small: the axis of curvature makes hits right where the base bends, and
// changes nothing where it does not.
#include <algorithm>

#include <gtest/gtest.h>

#include "render/host_renderer.h"
#include "viewer/bench/bench_meso.h"

namespace vcp {
namespace {

TEST(BenchMesoBent, CurvatureCountsWhereTheBaseBends) {
    BenchMesoReport report;
    const auto rows =
        compareMesoBent("hemispheres", {.device = kHostName, .repetitions = 1, .across = 48, .down = 36, .cells = 12});
    ASSERT_TRUE(rows) << rows.error().line();
    report.bent = *rows;
    const auto row = [&](std::string_view base, std::string_view knob) {
        const auto found = std::ranges::find_if(
            *rows, [&](const MesoBent& b) { return b.base == base && b.knob == knob && b.method != "gdm"; });
        EXPECT_NE(found, rows->end()) << base << " " << knob;
        return *found;
    };
    for (const MesoBent& b : *rows) {
        SCOPED_TRACE(b.base + " by " + b.method + " " + b.knob);
        EXPECT_GT(b.rays, 48u * 36 / 4);
        EXPECT_EQ(b.shape.fraction(MesoClass::Unresolved), 0);
        EXPECT_GT(b.bytes, 0u);
        EXPECT_GT(b.timeOverGdm, 0);
        // The bases' triangles stand for the smooth ones.
        if (b.method != "boxes") continue;
        EXPECT_LT(b.shape.wrong(), b.base == "sphere" ? 0.5 : 0.3);
        EXPECT_LT(b.p50, 1.5);
    }
    for (const char* base : {"cylinder, 4 tiles round", "sphere", "torus, 4 tiles round the tube"}) {
        SCOPED_TRACE(base);
        const MesoBent with = row(base, "table curvatures 9"), without = row(base, "table curvatures 1");
        EXPECT_LT(with.iterations, 1.5) << "one question a ray";
        EXPECT_GT(without.iterations, 2 * with.iterations) << "a question a piece";
        EXPECT_LT(with.shape.wrong(), without.shape.wrong());
        // Also where rays pass from one side of the sphere's cube to the next, whose map they ask anew.
        EXPECT_LT(with.shape.fraction(MesoClass::Missed), 0.5 * without.shape.fraction(MesoClass::Missed));
    }
    const MesoBent with = row("plane", "table curvatures 9"), without = row("plane", "table curvatures 1");
    EXPECT_LT(with.p50, 1.2 * without.p50 + 0.2);
    EXPECT_NE(benchMesoJson(report).find("\"slab_over_radius\""), std::string::npos);
    EXPECT_NE(benchMesoMarkdown(report).find("| cylinder, 8 tiles round |"), std::string::npos);
}

TEST(BenchMesoBent, IsCancelled) {
    const auto rows =
        compareMesoBent("hemispheres", {.device = kHostName, .cells = 8, .progress = [](auto&&...) { return false; }});
    ASSERT_FALSE(rows);
    EXPECT_EQ(rows.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace vcp
