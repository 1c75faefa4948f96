// The figures of a motion follow from its frames; that there are frames of the sizes that were asked for.
#include "viewer/bench/motion_bench.h"

#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "builder/build.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

TEST(MotionBench, QuantilesAndRates) {
    MotionReport report;
    EXPECT_EQ(report.quantileMs(0.5), 0);
    report.seconds = 2;
    report.frameMs = {30, 10, 20, 40};
    report.byReduction = {{1, 1}, {2, 3}};
    EXPECT_EQ(report.framesPerSecond(), 2);
    EXPECT_EQ(report.quantileMs(0.5), 20);
    EXPECT_EQ(report.quantileMs(0.95), 40);
    EXPECT_EQ(report.quantileMs(1), 40);
    const auto json = nlohmann::json::parse(motionJson(report));
    EXPECT_EQ(json["frames_by_size"]["1/2"], 3);
    EXPECT_EQ(json["frames"], 4);
    EXPECT_NE(motionText(report).find("3 at 1/2"), std::string::npos) << motionText(report);
}

TEST(MotionBench, SlowFramesAreSmaller) {
    if (!listDevices()) GTEST_SKIP() << "no Vulkan device";
    TestFolder folder("vcp_motion_bench_test");
    writeBall(folder / "ball.ply", 20, 40);
    BuildOptions build;
    build.inputs = {folder / "ball.ply"};
    build.output = folder / "ball.vcp";
    ASSERT_TRUE(buildOctree(build));
    const auto scene = openScene({folder / "ball.vcp"}, {}, {});
    ASSERT_TRUE(scene) << scene.error().line();
    MotionOptions options;
    options.size = {64, 48};
    options.seconds = 1.5;
    options.viewer.movingFrameMs = 1e-6;
    options.viewer.renderer.budgetBytes = 16 << 20;
    const auto report = measureMotion(*scene, options);
    ASSERT_TRUE(report) << report.error().line();
    ASSERT_GT(report->frameMs.size(), 0u);
    EXPECT_GT(report->byReduction.count(8), 0u);
    EXPECT_TRUE(report->fullSizeAfterMs) << "full size never came back";
    options.cancel = [] { return true; };
    EXPECT_EQ(measureMotion(*scene, options).error().code, ErrorCode::Cancelled);
}

TEST(MotionBench, ScenesMoveInTheirOwnLight) {
    if (!listDevices()) GTEST_SKIP() << "no Vulkan device";
    TestFolder folder("vcp_motion_bench_test");
    std::ofstream(folder / "quad.json") << R"({"mesostructure": [{"asset": "blocks", "tiles": 2}],)"
                                        << R"( "environment": {"source": "studio"}})";
    const auto scene = openScene({folder / "quad.json"}, {}, {});
    ASSERT_TRUE(scene) << scene.error().line();
    MotionOptions options;
    options.size = {64, 48};
    options.seconds = 0.5;
    options.viewer.renderer.budgetBytes = 16 << 20;
    options.viewer.renderer.hostRays = true;
    const auto report = measureMotion(*scene, options);
    ASSERT_TRUE(report) << report.error().line();
    EXPECT_GT(report->frameMs.size(), 0u);
    EXPECT_TRUE(report->fullSizeAfterMs) << "full size never came back";
}

}  // namespace
}  // namespace vcp
