// Frames of the six models, small: every model and surface is drawn, completely, and stands beside what is printed.
#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "render/host_renderer.h"
#include "viewer/bench/bench_meso.h"

namespace vcp {
namespace {

TEST(BenchMesoModels, DrawsSixModelsAndTheSurfacesOfTable2) {
    BenchMesoReport report;
    const auto models = compareMesoModels(
        {.device = kHostName, .repetitions = 1, .across = 80, .down = 60, .cells = 8, .paths = 4}, report.published);
    ASSERT_TRUE(models) << models.error().line();
    report.models = *models;
    const auto count = [&](auto holds) { return std::ranges::count_if(*models, holds); };
    EXPECT_EQ(count([](const MesoModel& m) { return m.light == "everywhere"; }), 4) << "teapot and tree";
    EXPECT_EQ(count([](const MesoModel& m) { return m.asset == "hemispheres"; }), 16) << "four surfaces and methods";
    std::set<std::string> local;
    for (const MesoModel& m : *models) {
        SCOPED_TRACE(m.asset + " on " + m.base + " by " + m.method + ", " + m.light);
        if (m.asset != "hemispheres" && m.light == "local") local.insert(m.base + " " + m.method);
        EXPECT_GT(m.pixels, 80u * 60 / 20) << "the model is in the picture";
        EXPECT_LT(m.pixels, 80u * 60);
        EXPECT_EQ(m.unresolved, 0u);
        EXPECT_GT(m.prisms, 0u);
        EXPECT_DOUBLE_EQ(m.nsPixel * double(m.pixels), m.nsPrism * double(m.prisms));
        // How much is covered hangs on the base, a little on how rightly a method sees what stands on it, and not at
        // all on the light.
        for (const MesoModel& other : *models) {
            if (other.base != m.base || other.asset != m.asset) continue;
            const double apart = other.method == m.method ? 0 : 0.25 * double(m.pixels);
            EXPECT_NEAR(double(other.pixels), double(m.pixels), apart) << other.method;
        }
    }
    EXPECT_EQ(local.size(), 12u);
    // Table 2: three ratios a surface. Fig. 7: four models over the teapot by two methods, and in light from everywhere
    // the tree over the teapot and the teapot over itself in local light.
    const auto published = [&](std::string_view what) {
        return std::ranges::count_if(report.published,
                                     [&](const MesoPublished& p) { return p.what.find(what) != std::string::npos; });
    };
    EXPECT_EQ(published("Table 2: frames of"), 12);
    EXPECT_EQ(published("Fig. 7: time a prism"), 10);
    EXPECT_EQ(published("global over local"), 2);
    const std::string text = benchMesoMarkdown(report);
    for (const char* base : {"teapot", "vase", "torus", "bird", "dinosaur", "tree"})
        EXPECT_NE(text.find(std::string("on ") + base), std::string::npos) << text;
    EXPECT_NE(benchMesoJson(report).find("\"models\""), std::string::npos);
}

TEST(BenchMesoModels, IsCancelledBetweenFrames) {
    std::vector<MesoPublished> published;
    MesoModelOptions options{.device = kHostName, .across = 16, .down = 12, .cells = 8, .paths = 1};
    options.progress = [](const std::string&, double) { return false; };
    const auto models = compareMesoModels(options, published);
    ASSERT_FALSE(models);
    EXPECT_EQ(models.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace vcp
