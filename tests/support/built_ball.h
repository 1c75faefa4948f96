// The ball of test_folder.h as a dataset, built once a suite, for tests of what shows it.
#pragma once

#include <memory>

#include <gtest/gtest.h>

#include "builder/build.h"
#include "tests/support/test_folder.h"

namespace vcp {

class BuiltBall : public testing::Test {
protected:
    static void SetUpTestSuite() {
        folder_ = std::make_unique<TestFolder>("vcp_built_ball_test");
        writeBall(*folder_ / "ball.ply", 60, 120);
        BuildOptions options;
        options.inputs = {*folder_ / "ball.ply"};
        options.output = *folder_ / "ball.vcp";
        options.cell = 0.05;  // several pages
        const auto report = buildOctree(options);
        ASSERT_TRUE(report) << report.error().line();
    }
    static void TearDownTestSuite() { folder_.reset(); }

    static inline std::unique_ptr<TestFolder> folder_;
};

}  // namespace vcp
