// vcp bench rays from the outside: the rows that programs rely on, methods and knobs, and the report's other forms.
#include <filesystem>
#include <map>
#include <random>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "render/view/renderer.h"
#include "tests/support/test_meshes.h"
#include "tests/support/vcp_program.h"
#include "viewer/bench/rays/analytic_models.h"
#include "viewer/bench/rays/bench_cameras.h"
#include "viewer/bench/rays/bench_methods.h"
#include "viewer/bench/rays/bench_rays.h"
#include "viewer/bench/rays/bench_stability.h"
#include "viewer/bench/rays/levels_saved.h"
#include "viewer/bench/rays/paper_tables.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class BenchRays : public testing::Test {
protected:
    BenchRays() : folder_("vcp_bench_rays_test"), ball_((folder_ / "ball.ply").string()) {
        EXPECT_TRUE(writePly(test::sphereMesh({3, 4, 5}, 1, 48), ball_));
    }

    [[nodiscard]] Ran run(const std::string& arguments) const {
        return VcpProgram(folder_).runWords("bench rays " + arguments);
    }

    static constexpr const char* kQuick = " --repetitions 1 --size 48x32 --cell 0.1 --json";

    TestFolder folder_;
    std::string ball_;
};

/// What DESIGN and docs/measuring.md promise, and that a row agrees with itself.
void expectRow(const Json& row) {
    for (const char* field :
         {"model",           "camera",    "method",    "knob",         "device",      "rays",        "ns_per_ray",
          "ratio_to_embree", "hit",       "miss",      "missed",       "false",       "wrong_sheet", "unresolved",
          "p50_cells",       "p95_cells", "p99_cells", "max_cells",    "steps_mean",  "steps_p95",   "steps_p99",
          "cells_mean",      "cells_p95", "cells_p99", "fetches_mean", "fetches_p95", "fetches_p99", "bytes"})
        ASSERT_TRUE(row.contains(field)) << field;
    double sum = 0;
    for (const char* part : {"hit", "miss", "missed", "false", "wrong_sheet", "unresolved"})
        sum += row[part].get<double>();
    EXPECT_NEAR(sum, 1, 1e-9);
    EXPECT_EQ(row["rays"], 48 * 32);
    EXPECT_GT(row["ns_per_ray"], 0);
    EXPECT_GT(row["bytes"], 0);
    EXPECT_LE(row["p50_cells"], row["p95_cells"]);
    EXPECT_LE(row["p95_cells"], row["p99_cells"]);
    EXPECT_LE(row["p99_cells"], row["max_cells"]);
    const bool counts = !row["method"].get<std::string>().starts_with("embree");
    EXPECT_EQ(row["steps_p99"].is_null(), !counts) << row["method"];
    if (counts) {
        EXPECT_GT(row["steps_mean"], 0);
        EXPECT_LE(row["steps_p95"], row["steps_p99"]);
        EXPECT_LE(row["cells_p95"], row["cells_p99"]);
        EXPECT_LE(row["cells_mean"], row["steps_mean"]);
        EXPECT_LE(row["fetches_p95"], row["fetches_p99"]);
    }
}

TEST_F(BenchRays, EveryPeerWithItsOwnError) {
    const Ran ran =
        run(ball_ + " --cameras whole --methods reference,paper,sdf,sdf-analytic,voxel,svo-contours" + kQuick);
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json rows = Json::parse(ran.out)["rows"];
    ASSERT_EQ(rows.size(), 6u);
    std::map<std::string, double> p50, hit;
    for (const Json& row : rows) {
        expectRow(row);
        p50[row["method"]] = row["p50_cells"];
        hit[row["method"]] = row["hit"];
        EXPECT_EQ(row["unresolved"], 0);
    }
    EXPECT_NEAR(p50["paper"], 0.24, 0.05);
    EXPECT_LT(p50["sdf"], 0.1);
    EXPECT_LT(p50["sdf-analytic"], 0.02);
    EXPECT_GT(p50["voxel"], 0.3);
    EXPECT_LT(p50["svo-contours"], 0.1);
    EXPECT_LT(p50["reference"], 0.02);
    for (const auto& [method, part] : hit) EXPECT_GT(part, 0.15) << method;
}

TEST_F(BenchRays, ASweepHasARowForEachValueAndPlots) {
    const std::string out = (folder_ / "out").string();
    const Ran ran =
        run(ball_ + " --cameras close --sweep --methods paper,sdf,voxel,svo-contours --out " + out + kQuick);
    ASSERT_EQ(ran.status, 0) << ran.err;
    std::map<std::string, std::set<std::string>> knobs;
    std::map<std::string, double> bytes, p50;
    const Json report = Json::parse(ran.out);
    for (const Json& row : report["rows"]) {
        expectRow(row);
        knobs[row["method"]].insert(row["knob"]);
        const std::string key = row["method"].get<std::string>() + " " + row["knob"].get<std::string>();
        bytes[key] = row["bytes"];
        p50[key] = row["p50_cells"];
    }
    EXPECT_EQ(knobs["paper"], (std::set<std::string>{"eps 0.5", "eps 0.25", "eps 0.1"}));
    EXPECT_EQ(knobs["sdf"], (std::set<std::string>{"cell 2", "cell 1", "cell 0.5"}));
    EXPECT_EQ(knobs["voxel"], (std::set<std::string>{"cell 1", "cell 0.5", "cell 0.25"}));
    EXPECT_EQ(bytes["paper eps 0.1"], bytes["paper eps 0.5"]);
    EXPECT_GT(p50["paper eps 0.5"], p50["paper eps 0.1"]);
    EXPECT_GT(bytes["sdf cell 0.5"], bytes["sdf cell 2"]);
    EXPECT_GT(p50["voxel cell 1"], p50["voxel cell 0.25"]);
    for (const char* file : {"bench_rays.json", "bench_rays.csv", "bench_rays.md", "bench_rays_ball_p50_time.svg",
                             "bench_rays_ball_p99_bytes.svg", "bench_rays_ball_wrong_time.svg"})
        EXPECT_TRUE(fs::exists(fs::path(out) / file)) << file;
    // The rows that the paper's tables need are there.
    const std::string markdown = contentOf(out + "/bench_rays.md");
    EXPECT_NE(markdown.find("| here: ball | 1.00 | 1.00 |"), std::string::npos) << markdown;
}

TEST_F(BenchRays, FramesBesideEmbreesShowTheSame) {
    if (!benchHasEmbree()) GTEST_SKIP() << "this build has no Embree";
    const std::string out = (folder_ / "frames").string();
    const Ran ran =
        run(ball_ + " --frames --cameras whole,close --repetitions 1 --size 160x100 --cell 0.1 --json --out " + out);
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json rows = Json::parse(ran.out)["rows"];
    ASSERT_EQ(rows.size(), 8u);
    const char* const kFrames[] = {"trace", "light", "shadows", "occlusion"};
    for (size_t i = 0; i < rows.size(); ++i) {
        const Json& row = rows[i];
        SCOPED_TRACE(row.dump());
        EXPECT_EQ(row["frame"], kFrames[i % 4]);
        EXPECT_EQ(row["camera"], i < 4 ? "whole" : "close");
        EXPECT_EQ(row["rays"], 160 * 100);
        const uint64_t hits = row["hits"], lightRays = row["light_rays"];
        EXPECT_GT(hits, 3000u);
        EXPECT_LE(row["other_hits"].get<uint64_t>(), hits / 200);
        EXPECT_LT(row["difference_mean"].get<double>(), 0.5);
        const uint64_t least[] = {0, 0, hits / 4, 8 * hits}, most[] = {0, 0, hits, 8 * hits};
        EXPECT_GE(lightRays, least[i % 4]);
        EXPECT_LE(lightRays, most[i % 4]);
        for (const char* field :
             {"wall_ms", "cpu_ms", "embree_wall_ms", "embree_cpu_ms", "ratio_to_embree", "cpu_ratio_to_embree"})
            EXPECT_GT(row[field].get<double>(), 0) << field;
    }
    for (const char* file : {"bench_frames.json", "bench_frames.csv", "bench_frames.md"})
        EXPECT_TRUE(fs::exists(fs::path(out) / file)) << file;
    EXPECT_EQ(run("--frames").status, 2);
    EXPECT_EQ(run(ball_ + " --frames --cameras nowhere").status, 2);
}

TEST_F(BenchRays, ThePapersRulesAreOptions) {
    const auto row = [&](const std::string& options) {
        const Ran ran = run(ball_ + " --cameras whole --methods paper " + options + kQuick);
        EXPECT_EQ(ran.status, 0) << ran.err;
        const Json report = Json::parse(ran.out, nullptr, false);
        return report.is_discarded() ? Json() : report["rows"][0];
    };
    const Json plain = row(""), nearer = row("--paper-epsilon 0.1 --paper-merge 0.5");
    const Json slow = row("--paper-step distance --paper-scheme trilinear --paper-packing octahedral --paper-band 1.5");
    const Json forgetful = row("--paper-cache off --paper-k exact --paper-back off --paper-empty safe");
    EXPECT_GT(forgetful["fetches_mean"], plain["fetches_mean"]);
    EXPECT_LT(forgetful["p50_cells"], plain["p50_cells"]) << "hits are not moved back to epsilon";
    EXPECT_LT(row("--paper-k 0")["hit"], plain["hit"]);
    EXPECT_EQ(nearer["knob"], "eps 0.1");
    EXPECT_LT(nearer["p50_cells"], plain["p50_cells"]);
    EXPECT_LT(nearer["bytes"], plain["bytes"]);
    EXPECT_LT(slow["bytes"], plain["bytes"]);
    EXPECT_NE(slow["steps_mean"], plain["steps_mean"]);
    EXPECT_EQ(run(ball_ + " --methods paper --paper-scheme cubic" + kQuick).status, 2);
    EXPECT_EQ(run(ball_ + " --methods paper --paper-k many" + kQuick).status, 2);
}

TEST_F(BenchRays, OneRuleOfThePaperAtATime) {
    const Ran ran = run(ball_ + " --cameras whole --methods paper-rules" + kQuick);
    ASSERT_EQ(ran.status, 0) << ran.err;
    std::map<std::string, Json> rules;
    const Json report = Json::parse(ran.out);
    for (const Json& row : report["rows"]) {
        expectRow(row);
        rules[row["knob"]] = row;
    }
    ASSERT_EQ(rules.size(), rayMethodKnobs("paper-rules", false).size());
    const Json& plain = rules["as published"];
    EXPECT_GT(rules["step distance"]["steps_mean"], plain["steps_mean"]);
    EXPECT_GT(rules["cache off"]["fetches_mean"], plain["fetches_mean"]);
    EXPECT_GE(rules["merge never"]["bytes"], plain["bytes"]);
    EXPECT_LT(rules["band halved"]["bytes"], rules["merge never"]["bytes"]);
    EXPECT_LT(rules["merge 0.2"]["bytes"], plain["bytes"]);
}

TEST_F(BenchRays, TheDeviceShowsThePaperAndCountsRayByRay) {
    if (!listDevices()) GTEST_SKIP() << "no Vulkan device";
    const Ran ran = run(ball_ + " --cameras whole --methods certified,reference,paper,paper-gpu" + kQuick);
    ASSERT_EQ(ran.status, 0) << ran.err;
    std::map<std::string, Json> rows;
    const Json report = Json::parse(ran.out);
    for (const Json& row : report["rows"]) {
        expectRow(row);
        rows[row["method"]] = row;
    }
    const Json &cpu = rows["paper"], &gpu = rows["paper-gpu"];
    EXPECT_EQ(gpu["bytes"].get<uint64_t>() / 16384, (cpu["bytes"].get<uint64_t>() + 64 + 16383) / 16384)
        << "in units of the pool";
    EXPECT_NEAR(gpu["p50_cells"], cpu["p50_cells"].get<double>(), 0.01);
    EXPECT_NEAR(gpu["hit"], cpu["hit"].get<double>(), 0.01);
    EXPECT_NEAR(gpu["steps_mean"], cpu["steps_mean"].get<double>(), 0.02 * cpu["steps_mean"].get<double>());
    EXPECT_NEAR(gpu["fetches_mean"], cpu["fetches_mean"].get<double>(), 0.02 * cpu["fetches_mean"].get<double>());
    EXPECT_LE(rows["certified"]["cells_p99"], rows["reference"]["cells_p99"])
        << "the reference looks at leaves that it could skip";
}

TEST_F(BenchRays, AnotherCellIsBuiltAnew) {
    const std::string out = " --out " + (folder_ / "cells").string();
    const auto cellOf = [&](const std::string& cell) {
        const Ran ran = run(ball_ + " --cameras whole --methods reference --repetitions 1 --size 16x12 --json --cell " +
                            cell + out);
        EXPECT_EQ(ran.status, 0) << ran.err;
        const Json report = Json::parse(ran.out, nullptr, false);
        return report.is_discarded() ? 0.0 : report["rows"][0]["cell"].get<double>();
    };
    EXPECT_EQ(cellOf("0.25"), 0.25);
    EXPECT_EQ(cellOf("0.5"), 0.5);
    EXPECT_EQ(cellOf("0.25"), 0.25);
}

TEST(BenchStability, FloatsStayWithDoubles) {
    if (!listDevices()) GTEST_SKIP() << "no Vulkan device";
    const TestFolder folder("vcp_stability_test");
    StabilityOptions options;
    options.cells = {1e-6, 1e6};
    options.originCells = {1e7};
    options.width = 64;
    options.height = 40;
    options.folder = folder / ".";
    const auto rows = benchStability(options);
    ASSERT_TRUE(rows) << rows.error().line();
    ASSERT_EQ(rows->size(), 2u);
    for (const StabilityRow& row : *rows) {
        EXPECT_EQ(row.rays, 64u * 40);
        EXPECT_GT(row.doubles.hits, 500u);
        EXPECT_EQ(row.doubles.depthCells.max, 0);
        for (const PrecisionRow* single : {&row.floats, &row.device}) {
            EXPECT_LE(single->otherOutcome, 2u);
            EXPECT_EQ(single->holes, 0u);
            EXPECT_LT(single->depthCells.p99, 1e-3);
            EXPECT_GT(single->depthCells.max, 0);
        }
    }
    EXPECT_TRUE(fs::is_empty(folder / "."));
    EXPECT_NE(stabilityMarkdown(*rows).find("| 1e+06 | 1e+07 |"), std::string::npos) << stabilityMarkdown(*rows);
}

/// A plain half, whose pages stay coarse, beside one full of balls and posts, whose pages do not.
IndexedMesh plainBesideDetail() {
    std::mt19937_64 random(3);
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    IndexedMesh mesh = test::boxMesh({-2.5, -1.1, -0.053}, {2.5, 1.1, 0}, 1);
    for (int i = 0; i < 60; ++i) {
        const double x = between(-2.4, -0.6), y = between(-0.95, 0.95), radius = between(0.01, 0.05);
        test::append(mesh, test::sphereMesh({x, y, 0.6 * radius}, radius, 5));
    }
    for (int i = 0; i < 40; ++i) {
        const double x = between(-2.4, -0.6), y = between(-0.9, 0.9);
        test::append(mesh, test::boxMesh({x, y, -0.02}, {x + 0.06, y + 0.04, 0.11}, 1));
    }
    return mesh;
}

TEST_F(BenchRays, NothingLeaksWherePagesAndLevelsMeet) {
    if (!listDevices()) GTEST_SKIP() << "no Vulkan device";
    BenchRaysOptions options;
    options.models = {folder_ / "steps.ply"};
    ASSERT_TRUE(writePly(plainBesideDetail(), options.models[0]));
    options.methods = {"certified", "host"};
    options.cameras = {"lattice", "grazing"};
    options.views = 13;
    options.size = {160, 100};
    options.repetitions = 1;
    options.cell = 0.01;
    options.out = folder_ / "report";
    const auto report = benchRays(options);
    ASSERT_TRUE(report) << report.error().line();
    ASSERT_EQ(report->rows.size(), 4u);
    for (const BenchRaysRow& row : report->rows) {
        const std::string of = row.method + " " + row.camera;
        EXPECT_EQ(row.classes.judged, 13u * 160 * 100) << of;
        EXPECT_EQ(row.classes.holes, 0u) << of;
        EXPECT_EQ(row.classes.beyondCertified, 0u) << of << ", " << row.classes.maxOverCertified;
    }
}

TEST_F(BenchRays, TheHostHitsWhatTheReferenceHits) {
    const Ran ran = run(ball_ + " --cameras whole,close,lattice,grazing --methods host,reference" + kQuick);
    ASSERT_EQ(ran.status, 0) << ran.err;
    std::map<std::string, Json> rows;
    const Json report = Json::parse(ran.out);
    for (const Json& row : report["rows"]) {
        EXPECT_EQ(row["holes"], 0) << row;
        EXPECT_EQ(row["beyond_certified"], 0) << row;
        expectRow(row);
        rows[row["method"].get<std::string>() + row["camera"].get<std::string>()] = row;
    }
    for (const std::string camera : {"close", "lattice", "grazing"})
        EXPECT_NEAR(rows["host" + camera]["hit"], rows["reference" + camera]["hit"].get<double>(), 0.001) << camera;
    EXPECT_GT(rows["hostwhole"]["hit"], 0.3);
}

TEST_F(BenchRays, UnknownMethodsAndCamerasAreNamed) {
    const Ran method = run(ball_ + " --methods magic" + kQuick);
    EXPECT_EQ(method.status, 2);
    EXPECT_NE(method.err.find("sdf-analytic"), std::string::npos) << method.err;
    EXPECT_EQ(run(ball_ + " --cameras nowhere" + kQuick).status, 2);
    EXPECT_NE(run("--help").out.find("svo-contours"), std::string::npos);
}

TEST(RayMethods, KnobsAreSweptAboutTheDefault) {
    for (const std::string& method : rayMethodNames()) {
        if (method == "paper-rules") continue;  // no knob: all of them, always
        const auto one = rayMethodKnobs(method, false), all = rayMethodKnobs(method, true);
        ASSERT_EQ(one.size(), 1u) << method;
        EXPECT_NE(std::find(all.begin(), all.end(), one[0]), all.end()) << method;
    }
}

TEST(PaperTables, RatiosToThePaper) {
    BenchRaysReport report;
    const auto add = [&](const std::string& method, const std::string& knob, uint64_t bytes, double ns) {
        BenchRaysRow row;
        row.model = "shape";
        row.method = method;
        row.knob = knob;
        row.bytes = bytes;
        row.nsPerRay = ns;
        report.rows.push_back(row);
    };
    add("paper", "eps 0.25", 1000, 100);
    EXPECT_EQ(besidePaperMarkdown(report), "");
    add("sdf", "cell 1", 500, 50);
    add("sdf", "cell 1", 500, 70);
    add("voxel", "cell 1", 1, 1);
    EXPECT_EQ(besidePaperMarkdown(report), "");
    add("voxel", "cell 0.5", 250, 90);
    const std::string text = besidePaperMarkdown(report);
    EXPECT_NE(text.find("| here: shape | 1.00 | 0.50 | 0.25 | |"), std::string::npos) << text;
    EXPECT_NE(text.find("| here: shape | 1.00 | 0.60 | 0.90 | |"), std::string::npos) << text;
    EXPECT_NE(text.find("| published: David | 1.00 | 1.00 | 0.98 | 0.79 |"), std::string::npos) << text;
}

TEST(LevelsSaved, AreInterpolatedInTheLogarithmOfTheCell) {
    const PeerPoint voxels[] = {{0.25, 0.2}, {0.5, 0.4}, {1, 0.8}};
    const auto inside = peerCellWith(voxels, 0.2 * std::sqrt(2.0));
    ASSERT_TRUE(inside);
    EXPECT_NEAR(inside->log2Cell, -1.5, 1e-12);
    EXPECT_FALSE(inside->isExtrapolated);
    for (const auto& [value, cell] : {std::pair(0.05, -4.0), std::pair(3.2, 2.0)}) {
        const auto beyond = peerCellWith(voxels, value);
        ASSERT_TRUE(beyond) << value;
        EXPECT_NEAR(beyond->log2Cell, cell, 1e-12);
        EXPECT_TRUE(beyond->isExtrapolated);
    }
    const PeerPoint normals[] = {{0.5, 30}, {1, 30.1}};
    EXPECT_FALSE(peerCellWith(normals, 4));
}

TEST(LevelsSaved, AtEqualErrorAndAtEqualBytes) {
    BenchRaysReport report;
    const auto add = [&](const char* camera, const std::string& method, const std::string& knob, uint64_t bytes,
                         double error) {
        BenchRaysRow row;
        row.model = "shape", row.camera = camera, row.method = method, row.knob = knob, row.bytes = bytes;
        row.classes.distanceCells.p50 = row.classes.distanceCells.p95 = error;
        report.rows.push_back(row);
    };
    add("whole", "paper", "eps 0.25", 4000000, 0.1);
    add("close", "paper", "eps 0.25", 4000000, 0.3);
    EXPECT_EQ(levelsSavedMarkdown(report), "");
    add("whole", "voxel", "cell 1", 1000000, 0.8);
    EXPECT_EQ(levelsSavedMarkdown(report), "") << "one cell is no curve";
    add("whole", "voxel", "cell 0.5", 4000000, 0.4);
    add("whole", "voxel", "cell 0.25", 16000000, 0.2);
    const std::string text = levelsSavedMarkdown(report);
    EXPECT_NE(text.find("| shape | eps 0.25 | p50, cells: 0.2 | | 2.0 | |"), std::string::npos) << text;
    EXPECT_NE(text.find("| shape | eps 0.25 | 4.0 | | | 1.0 | 2 | | |"), std::string::npos) << text;
}

TEST(BenchCameras, RaysOfTheLatticeCameraRunThroughCorners) {
    const MeshBvh bvh(test::sphereMesh({3, 4, 5}, 1, 24));
    const CellGrid grid{{0.3, -0.2, 0.7}, 0.0625};
    for (const glm::ivec2 size : {glm::ivec2(64, 40), glm::ivec2(33, 17)})
        for (int view = 0; view < 26; ++view) {
            const Camera camera = *benchCamera("lattice", bvh, grid, size, view, 26);
            int throughCorners = 0;
            for (int x = 0; x < size.x; ++x) {
                const CameraRay ray = cameraRay(camera, uint32_t(size.x), uint32_t(size.y), x + 0.5, size.y / 2 + 0.5);
                // The corner nearest to the mesh's middle, moved sideways by whole cells, lies on every fourth ray.
                const double t = glm::dot(glm::dvec3(3, 4, 5) - ray.origin, ray.direction);
                double nearest = 1;
                for (double s = t - 2 * grid.cell; s < t + 2 * grid.cell; s += grid.cell / 256) {
                    const glm::dvec3 p = (ray.origin + s * ray.direction - grid.origin) / grid.cell;
                    nearest = std::min(nearest, glm::distance(p, glm::round(p)));
                }
                throughCorners += nearest < 0.005 ? 1 : 0;
            }
            EXPECT_GE(throughCorners, size.x / 8) << view;
        }
}

}  // namespace
}  // namespace vcp
