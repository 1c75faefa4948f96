// vcp bench build from the outside: the rows that programs rely on, and that they agree with each other.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "builder/lattice/lattice_mesh.h"
#include "tests/support/vcp_program.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class BenchBuild : public testing::Test {
protected:
    BenchBuild() : folder_("vcp_bench_build_test"), ball_((folder_ / "ball.ply").string()) { writeBall(ball_, 30, 60); }

    [[nodiscard]] Ran run(const std::string& arguments) const {
        return VcpProgram(folder_).runWords("bench build " + arguments);
    }

    static constexpr const char* kQuick = " --repetitions 1 --samples 500 --json";

    TestFolder folder_;
    std::string ball_;
};

/// What DESIGN and docs/measuring.md promise, and that a row agrees with itself.
void expectRow(const Json& row) {
    for (const char* field : {"model",
                              "triangles",
                              "seconds",
                              "triangles_per_second",
                              "peak_rss_bytes",
                              "file_bytes",
                              "embree_bvh_seconds",
                              "ratio_to_embree",
                              "generated",
                              "cpu_seconds",
                              "memory_bytes",
                              "temp_bytes",
                              "bytes_per_triangle",
                              "leaves",
                              "hard_leaves",
                              "cell",
                              "error_cells",
                              "certified_max_cells",
                              "p50_cells",
                              "p99_cells",
                              "max_cells",
                              "mesh_to_surface_p99_cells",
                              "surface_to_mesh_p99_cells",
                              "samples"})
        ASSERT_TRUE(row.contains(field)) << field;
    const double triangles = row["triangles"], seconds = row["seconds"];
    EXPECT_GT(triangles, 0);
    EXPECT_GT(seconds, 0);
    EXPECT_NEAR(row["triangles_per_second"].get<double>() * seconds, triangles, 1e-6 * triangles);
    EXPECT_NEAR(row["bytes_per_triangle"].get<double>() * triangles, row["file_bytes"].get<double>(), 1);
    EXPECT_NEAR(row["ratio_to_embree"].get<double>() * seconds, row["embree_bvh_seconds"].get<double>(), 1e-9);
    EXPECT_GT(row["peak_rss_bytes"], 1u << 20);
    EXPECT_GE(row["leaves"], row["hard_leaves"]);
    EXPECT_GT(row["cell"], 0);
    if (!row["p99_cells"].is_null()) {
        EXPECT_GT(row["samples"], 0);
        EXPECT_LE(row["p50_cells"], row["p99_cells"]);
        EXPECT_LE(row["p99_cells"], row["max_cells"]);
        EXPECT_LE(row["max_cells"].get<double>(), row["certified_max_cells"].get<double>() * (1 + 1e-6));
        for (const char* quantile : {"p50_cells", "p99_cells", "max_cells"})
            EXPECT_EQ(row[quantile], std::max(row[std::string("mesh_to_surface_") + quantile].get<double>(),
                                              row[std::string("surface_to_mesh_") + quantile].get<double>()));
    }
}

TEST_F(BenchBuild, ARowForEveryToleranceOverTheSameCells) {
    const std::string out = (folder_ / "out").string();
    const Ran ran = run(ball_ + " --errors 0.02,0.5 --out " + out + kQuick);
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json rows = Json::parse(ran.out)["rows"];
    ASSERT_EQ(rows.size(), 3u);
    const double tolerances[] = {8 * kLatticeRounding, 0.02, 0.5};
    for (size_t i = 0; i < 3; ++i) {
        SCOPED_TRACE(i);
        expectRow(rows[i]);
        EXPECT_EQ(rows[i]["model"], "ball");
        EXPECT_NEAR(rows[i]["error_cells"].get<double>(), tolerances[i], 1e-6);
        EXPECT_EQ(rows[i]["cell"], rows[0]["cell"]);
        EXPECT_EQ(rows[i]["triangles"], rows[0]["triangles"]);
        EXPECT_FALSE(rows[i]["p99_cells"].is_null());
    }
    EXPECT_LE(rows[2]["hard_leaves"], rows[1]["hard_leaves"]) << "more tolerance, fewer leaves that keep triangles";
    for (const char* file : {"ball.vcp", "ball_error_0.02.vcp", "ball_error_0.5.vcp"})
        EXPECT_TRUE(fs::exists(fs::path(out) / "built" / file)) << file;
}

TEST_F(BenchBuild, TheFormsOfTheReportAgree) {
    const fs::path out = folder_ / "out";
    const Ran ran = run(ball_ + " --errors 0.2 --out " + out.string() + kQuick);
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json said = Json::parse(ran.out);
    EXPECT_EQ(Json::parse(contentOf(out / "bench_build.json")), said);
    std::istringstream csv(contentOf(out / "bench_build.csv"));
    std::string header, line;
    ASSERT_TRUE(std::getline(csv, header));
    const auto columns = [](const std::string& text) { return std::count(text.begin(), text.end(), ',') + 1; };
    EXPECT_EQ(columns(header), long(said["rows"][0].size()));
    size_t lines = 0;
    for (; std::getline(csv, line); ++lines) EXPECT_EQ(columns(line), columns(header));
    EXPECT_EQ(lines, said["rows"].size());
    EXPECT_NE(contentOf(out / "bench_build.md").find("| ball | "), std::string::npos);
    for (const char* plot : {"bench_build_cost.svg", "bench_build_memory.svg", "bench_build_bytes.svg"})
        EXPECT_EQ(contentOf(out / plot).substr(0, 5), "<svg ") << plot;
}

TEST_F(BenchBuild, GeneratedScansAreBuiltAndRemoved) {
    const fs::path out = folder_ / "out";
    const Ran ran = run("--generated 10k,20k --memory 256M --cell 0.5 --out " + out.string() + kQuick);
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json rows = Json::parse(ran.out)["rows"];
    ASSERT_EQ(rows.size(), 2u);
    for (const Json& row : rows) {
        expectRow(row);
        EXPECT_EQ(row["generated"], true);
        EXPECT_EQ(row["memory_bytes"], 256u << 20);
        EXPECT_TRUE(row["p99_cells"].is_null());
    }
    EXPECT_EQ(rows[0]["model"], "scan_10k");
    EXPECT_EQ(rows[0]["triangles"], 10'000u);
    EXPECT_EQ(rows[1]["triangles"], 20'000u);
    std::set<std::string> files;
    for (const auto& entry : fs::directory_iterator(out)) files.insert(entry.path().filename().string());
    EXPECT_EQ(files, (std::set<std::string>{"built", "bench_build.json", "bench_build.csv", "bench_build.md",
                                            "bench_build_cost.svg", "bench_build_memory.svg"}));
    files.clear();
    for (const auto& entry : fs::directory_iterator(out / "built")) files.insert(entry.path().filename().string());
    EXPECT_EQ(files, (std::set<std::string>{"scan_10k.vcp", "scan_20k.vcp"}));
}

TEST_F(BenchBuild, AModelThatFailsDoesNotTakeTheOthersAlong) {
    std::ofstream(folder_ / "broken.ply") << "ply\nnonsense\n";
    const std::string broken = (folder_ / "broken.ply").string();
    const Ran ran = run(broken + " " + ball_ + kQuick);
    EXPECT_EQ(ran.status, 1);
    EXPECT_NE(ran.err.find("broken.ply"), std::string::npos) << ran.err;
    EXPECT_EQ(ran.errLines(), 1u) << ran.err;
    const Json rows = Json::parse(ran.out)["rows"];
    ASSERT_EQ(rows.size(), 1u);
    expectRow(rows[0]);
    EXPECT_EQ(run(broken + kQuick).out, "");
}

TEST_F(BenchBuild, WrongUsageEndsWith2) {
    for (const std::string wrong : {"", "--generated 10", "--generated 1.5", "--generated 2G", "--errors 0",
                                    "--errors x", "--memory 0", "--samples -1"}) {
        const Ran ran = run((wrong.starts_with("--gen") ? "" : wrong.empty() ? "" : ball_ + " ") + wrong);
        EXPECT_EQ(ran.status, 2) << wrong;
        EXPECT_EQ(ran.errLines(), 1u) << ran.err;
    }
}

}  // namespace
}  // namespace vcp
