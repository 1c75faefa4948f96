// vcp bench colour from the outside: the rows that programs rely on, and what they must say of textures that are known.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "render/picture.h"
#include "tests/support/test_meshes.h"
#include "tests/support/vcp_program.h"
#include "viewer/bench/picture/bench_colour.h"
#include "viewer/bench/rays/analytic_models.h"
#include "viewer/bench/rays/bench_rays.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class BenchColour : public testing::Test {
protected:
    BenchColour() : folder_("vcp_bench_colour_test") {}
    void SetUp() override {
        if (!benchHasEmbree()) GTEST_SKIP() << "this build has no Embree";
    }

    [[nodiscard]] Ran run(const std::string& arguments) const {
        return VcpProgram(folder_).runWords("bench colour " + arguments);
    }

    /// Writes a square of `quads` x `quads` with a picture whose bytes `channelAt` says.
    template <class Channel>
    fs::path writeSquare(int quads, uint32_t texels, const Channel& channelAt) const {
        Picture picture{texels, texels, {}};
        for (uint32_t y = 0; y < texels; ++y)
            for (uint32_t x = 0; x < texels; ++x)
                for (int channel = 0; channel < 4; ++channel)
                    picture.rgba.push_back(channel == 3 ? uint8_t{255} : channelAt(x, y, channel));
        EXPECT_TRUE(writePng(picture, folder_ / "square.png"));
        std::ofstream(folder_ / "square.mtl") << "newmtl m\nKd 1 1 1\nmap_Kd square.png\n";
        const fs::path model = folder_ / "square.obj";
        std::ofstream obj(model);
        obj << "mtllib square.mtl\nusemtl m\n";
        for (int j = 0; j <= quads; ++j)
            for (int i = 0; i <= quads; ++i)
                obj << fmt::format("v {} {} 0\nvt {} {}\n", double(i) / quads, double(j) / quads, double(i) / quads,
                                   double(j) / quads);
        for (int j = 0; j < quads; ++j)
            for (int i = 0; i < quads; ++i) {
                const int a = j * (quads + 1) + i + 1, b = a + 1, c = b + quads + 1, d = a + quads + 1;
                obj << fmt::format("f {0}/{0} {1}/{1} {2}/{2}\nf {0}/{0} {2}/{2} {3}/{3}\n", a, b, c, d);
            }
        return model;
    }

    /// The rows by camera and method.
    std::map<std::string, Json> rowsOf(const fs::path& model, const std::string& more = "") const {
        const Ran ran = run(model.string() + " --repetitions 1 --size 96x64 --picture-samples 2 --json " + more);
        EXPECT_EQ(ran.status, 0) << ran.err;
        std::map<std::string, Json> rows;
        const Json report = Json::parse(ran.out);
        for (const Json& row : report["rows"])
            rows[row["camera"].get<std::string>() + " " + row["method"].get<std::string>()] = row;
        EXPECT_FALSE(rows.empty());
        return rows;
    }

    TestFolder folder_;
};

TEST_F(BenchColour, RowsHaveTheFieldsThatProgramsRelyOn) {
    const auto rows = rowsOf(writeSquare(16, 64, [](uint32_t x, uint32_t, int) { return uint8_t(4 * x); }));
    EXPECT_EQ(rows.size(), 9u);
    for (const auto& [name, row] : rows) {
        for (const char* field :
             {"model",           "camera",          "method",       "knob",           "device",       "pixels",
              "compared_pixels", "cell_px",         "delta_e_mean", "delta_e_p50",    "delta_e_p95",  "delta_e_p99",
              "delta_e_max",     "flip_mean",       "cpu_ms",       "geometry_bytes", "colour_bytes", "bytes_read",
              "resident_bytes",  "coarsest_level",  "finest_level", "pop_mean",       "pop_p99",      "pop_max",
              "change_mean",     "mesh_change_mean"})
            EXPECT_TRUE(row.contains(field)) << field;
        EXPECT_EQ(row["pixels"], 96 * 64);
        EXPECT_GT(row["compared_pixels"], 0);
        EXPECT_GT(row["colour_bytes"], 0);
        EXPECT_GT(row["geometry_bytes"], 0);
        EXPECT_LE(row["delta_e_p50"], row["delta_e_p95"]);
        EXPECT_LE(row["delta_e_p99"], row["delta_e_max"]);
    }
    // Close to it the square fills the picture.
    EXPECT_EQ(rows.at("close certified")["compared_pixels"], 96 * 64);
    EXPECT_EQ(rows.at("close vertex")["colour_bytes"], 4 * 17 * 17);
    EXPECT_EQ(rows.at("close texture")["colour_bytes"], fs::file_size(folder_ / "square.png"));
}

TEST_F(BenchColour, OneColourIsExact) {
    const auto rows =
        rowsOf(writeSquare(8, 16, [](uint32_t, uint32_t, int channel) { return uint8_t(40 + 70 * channel); }));
    for (const auto& [name, row] : rows) EXPECT_LT(row["delta_e_max"], 0.3) << name;
}

TEST_F(BenchColour, ASlopeIsKeptByCornersAlone) {
    const auto rows =
        rowsOf(writeSquare(16, 64,
                           [](uint32_t x, uint32_t y, int channel) {
                               return uint8_t(channel == 0 ? 40 + 3 * x : channel == 1 ? 200 - 2 * y : 128);
                           }),
               "--no-images");
    for (const auto& [name, row] : rows) {
        EXPECT_LT(row["delta_e_mean"], 0.5) << name;
        // A corner of the border has triangles on one side alone; `vertex` takes more of them.
        EXPECT_LT(row["delta_e_p99"], row["method"] == "vertex" ? 4 : 2) << name;
    }
}

TEST_F(BenchColour, StripesFinerThanCornersAreTheirMeanAndTheMeasureSeesIt) {
    // Two black and two white texels in turn, four turns between two corners.
    const fs::path square = writeSquare(8, 128, [](uint32_t x, uint32_t, int) { return uint8_t(x / 2 % 2 ? 255 : 0); });
    const auto rows = rowsOf(square, "--cameras close --no-images");
    // Half the light is 73.5 of lightness: black differs by as much, white by 26.5; together about 50.
    for (const char* name : {"close certified", "close vertex"}) {
        EXPECT_GT(rows.at(name)["delta_e_mean"], 30) << name;
        EXPECT_LT(rows.at(name)["delta_e_mean"], 60) << name;
    }
    EXPECT_LT(rows.at("close texture")["delta_e_mean"], 15);
    EXPECT_LT(rowsOf(square, "--cameras close --methods certified").at("close certified")["delta_e_mean"], 1)
        << "an image that is kept shows them";
}

TEST_F(BenchColour, CornersAreNoWorseThanColoursOfTheMeshsVertices) {
    const auto rows =
        rowsOf(writeSquare(32, 128,
                           [](uint32_t x, uint32_t y, int channel) {
                               return uint8_t(128 + 100 * std::sin(0.1 * x + channel) * std::cos(0.13 * y));
                           }),
               "--no-images");
    for (const char* camera : {"whole", "half", "close"}) {
        const double certified = rows.at(std::string(camera) + " certified")["delta_e_mean"];
        const double vertex = rows.at(std::string(camera) + " vertex")["delta_e_mean"];
        EXPECT_LT(certified, 1.15 * vertex + 0.1) << camera;
    }
}

TEST_F(BenchColour, ADiveSaysWhatPops) {
    const fs::path square = writeSquare(16, 1024, [](uint32_t x, uint32_t y, int channel) {
        return uint8_t((x * 37 + y * 91 + uint32_t(channel) * 50) * 2654435761u >> 24);
    });
    const auto rows = rowsOf(square, "--cameras dive --dive-steps 3 --methods certified,texture");
    ASSERT_EQ(rows.size(), 6u);
    EXPECT_TRUE(rows.at("dive-1 certified")["pop_mean"].is_null()) << "nothing was there before";
    EXPECT_TRUE(rows.at("dive-2 texture")["pop_mean"].is_null());
    // The first step shows two texels a sample, so the finest level comes with the second.
    EXPECT_GT(rows.at("dive-2 certified")["pop_mean"], 1);
    EXPECT_LT(rows.at("dive-3 certified")["pop_max"], 0.01) << "all was there";
    EXPECT_NEAR(rows.at("dive-3 certified")["change_mean"], rows.at("dive-3 certified")["mesh_change_mean"], 2);
    EXPECT_NEAR(rows.at("dive-3 certified")["cell_px"], 200, 2);
}

TEST_F(BenchColour, WritesReportAndPictures) {
    const fs::path model = writeSquare(4, 8, [](uint32_t x, uint32_t, int) { return uint8_t(30 * x); });
    const fs::path out = folder_ / "out";
    rowsOf(model, "--cameras whole --pictures --out " + out.string());
    for (const char* name :
         {"bench_colour.json", "bench_colour.csv", "bench_colour.md", "bench_colour_square_time.svg",
          "bench_colour_square_bytes.svg", "square_whole_0_mesh.png", "square_whole_0_vertex-samples-4.png"})
        EXPECT_GT(fs::exists(out / name) ? fs::file_size(out / name) : 0, 0u) << name;
}

TEST_F(BenchColour, WhatCannotBeComparedIsWrongUsage) {
    const fs::path plain = folder_ / "plain.ply";
    ASSERT_TRUE(writePly(test::sphereMesh({0, 0, 0}, 1, 8), plain));
    const Ran ran = run(plain.string());
    EXPECT_EQ(ran.status, 2);
    EXPECT_NE(ran.err.find("has no colour to compare"), std::string::npos) << ran.err;
    EXPECT_EQ(run(plain.string() + " --cameras nowhere").status, 2);
    EXPECT_EQ(run(plain.string() + " --methods none").status, 2);
}

}  // namespace
}  // namespace vcp
