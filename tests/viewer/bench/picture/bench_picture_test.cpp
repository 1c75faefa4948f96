// vcp bench picture from the outside: the rows that programs rely on, and what they must say of a ball.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/test_meshes.h"
#include "tests/support/vcp_program.h"
#include "viewer/bench/picture/bench_picture.h"
#include "viewer/bench/rays/analytic_models.h"
#include "viewer/bench/rays/bench_cameras.h"
#include "viewer/bench/rays/bench_rays.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class BenchPicture : public testing::Test {
protected:
    BenchPicture() : folder_("vcp_bench_picture_test"), ball_((folder_ / "ball.ply").string()) {
        EXPECT_TRUE(writePly(test::sphereMesh({3, 4, 5}, 1, 48), ball_));
    }
    void SetUp() override {
        if (!benchHasEmbree()) GTEST_SKIP() << "this build has no Embree";
    }

    [[nodiscard]] Ran run(const std::string& arguments) const {
        return VcpProgram(folder_).runWords("bench picture " + arguments);
    }

    TestFolder folder_;
    std::string ball_;
};

constexpr const char* kQuick = " --repetitions 1 --size 96x64 --cell 0.05 --dive-steps 3 --json";

TEST_F(BenchPicture, RowsHaveTheFieldsThatProgramsRelyOn) {
    const Ran ran = run(ball_ + kQuick);
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json rows = Json::parse(ran.out)["rows"];
    std::set<std::string> cameras;
    for (const Json& row : rows) {
        for (const char* field :
             {"model", "camera", "method", "knob", "rmse", "flip_mean", "flip_p99", "isolated_pixels",
              "isolated_in_mesh", "silhouette_p95_px", "silhouette_pixels", "normal_p50_degrees", "normal_p95_degrees",
              "normal_p99_degrees", "cpu_ms", "bytes_read", "resident_bytes", "coarsest_level", "finest_level"})
            EXPECT_TRUE(row.contains(field)) << field;
        cameras.insert(row["camera"]);
        EXPECT_EQ(row["pixels"], 96 * 64);
        EXPECT_GT(row["hit_pixels"], 0);
        EXPECT_GT(row["bytes_read"], 0);
        EXPECT_GT(row["resident_bytes"], 0);
        EXPECT_LE(row["normal_p50_degrees"], row["normal_p95_degrees"]);
        EXPECT_EQ(row["isolated_pixels"], 0);
        // One sample a pixel errs at the silhouette alone; a surface that is lit otherwise would err everywhere.
        EXPECT_LT(row["rmse"], 0.05) << row;
        EXPECT_LT(row["flip_mean"], 0.05) << row;
        EXPECT_LT(row["normal_p95_degrees"], 5) << row;
        EXPECT_LE(row["silhouette_p95_px"], 1) << row;
        if (row["camera"] == "dive-3") {
            EXPECT_NEAR(row["cell_px"], kDiveCellPixels, 1);
        }
    }
    EXPECT_EQ(cameras, (std::set<std::string>{"whole", "half", "close", "dive-1", "dive-2", "dive-3"}));
    EXPECT_EQ(rows.size(), 12u);
}

TEST_F(BenchPicture, ATriangleMeshComparedWithItselfIsRightInside) {
    const Ran ran = run(ball_ + kQuick + " --methods embree --cameras close");
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json row = Json::parse(ran.out)["rows"][0];
    // Close to it the ball fills the picture; one sample and 64 differ by what light changes within a pixel.
    EXPECT_EQ(row["hit_pixels"], 96 * 64);
    EXPECT_LT(row["rmse"], 1e-3);
    EXPECT_LT(row["flip_mean"], 2e-3);
}

TEST_F(BenchPicture, WritesReportAndPictures) {
    const fs::path out = folder_ / "out";
    const Ran ran = run(ball_ + kQuick + " --cameras whole --pictures --out " + out.string());
    ASSERT_EQ(ran.status, 0) << ran.err;
    for (const char* name :
         {"bench_picture.json", "bench_picture.csv", "bench_picture.md", "bench_picture_ball_flip_time.svg",
          "bench_picture_ball_rmse_bytes.svg", "ball_whole_0_mesh.png", "ball_whole_0_embree.png"})
        EXPECT_GT(fs::exists(out / name) ? fs::file_size(out / name) : 0, 0u) << name;
    std::ifstream csv(out / "bench_picture.csv");
    std::string header;
    std::getline(csv, header);
    EXPECT_TRUE(header.starts_with("model,camera,method,knob,")) << header;
}

TEST_F(BenchPicture, UnknownNamesAreWrongUsage) {
    const Ran camera = run(ball_ + kQuick + " --cameras nowhere");
    EXPECT_EQ(camera.status, 2);
    EXPECT_NE(camera.err.find("unknown camera \"nowhere\""), std::string::npos) << camera.err;
    EXPECT_EQ(run(ball_ + kQuick + " --methods none").status, 2);
}

/// A ball with waves on it, so that many rays graze it.
IndexedMesh wavyBall() {
    IndexedMesh mesh = test::sphereMesh({0, 0, 0}, 1, 128);
    for (glm::dvec3& p : mesh.positions) p *= 1 + 0.03 * std::sin(17 * p.x) * std::sin(17 * p.y) * std::sin(17 * p.z);
    return mesh;
}

TEST_F(BenchPicture, RaysThatGrazeASmoothSurfaceLeaveNoSpecks) {
    const fs::path model = folder_ / "wavy.ply";
    ASSERT_TRUE(writePly(wavyBall(), model));
    BenchPictureOptions options;
    options.models = {model};
    options.methods = {"certified"};
    options.cameras = {"whole", "half"};
    options.size = {480, 300};
    options.views = 8;
    options.samples = options.repetitions = 1;
    options.cell = 0.02;
    const auto report = benchPicture(options);
    ASSERT_TRUE(report) << report.error().line();
    ASSERT_EQ(report->rows.size(), 2u);
    for (const BenchPictureRow& row : report->rows) {
        EXPECT_EQ(row.pixels, 8u * 480 * 300);
        EXPECT_GT(row.hitPixels, row.pixels / 8);
        EXPECT_EQ(row.isolatedPixels, 0u) << row.camera;
    }
}

}  // namespace
}  // namespace vcp
