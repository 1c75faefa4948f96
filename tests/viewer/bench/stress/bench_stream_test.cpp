// vcp bench stream from the outside: the rows that programs rely on, in all forms of the report.
#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/vcp_program.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class BenchStream : public testing::Test {
protected:
    BenchStream() : folder_("vcp_bench_stream_test"), ball_((folder_ / "ball.ply").string()) {
        writeBall(ball_, 60, 120);
    }

    [[nodiscard]] Ran run(const std::string& arguments) const {
        return VcpProgram(folder_).runWords("bench stream " + arguments);
    }

    /// Counts the columns of a line of CSV.
    static long columns(const std::string& line) {
        bool isQuoted = false;
        return 1 + std::count_if(line.begin(), line.end(), [&](char c) {
                   isQuoted ^= c == '"';
                   return c == ',' && !isQuoted;
               });
    }

    static constexpr const char* kQuick = " --frames 3 --size 64x40 --error-pixels 0.05 --json";

    TestFolder folder_;
    std::string ball_;
};

TEST_F(BenchStream, ARowForEveryPathAndBudget) {
    const fs::path out = folder_ / "out";
    const Ran ran = run(ball_ + " --budgets 1M,64M --paths orbit,teleport --out " + out.string() + kQuick);
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json said = Json::parse(ran.out);
    const Json& rows = said["rows"];
    ASSERT_EQ(rows.size(), 4u);
    for (size_t i = 0; i < rows.size(); ++i) {
        SCOPED_TRACE(i);
        const Json& row = rows[i];
        EXPECT_EQ(row["path"], i < 2 ? "orbit" : "teleport");
        EXPECT_EQ(row["budget_bytes"], i % 2 == 0 ? 1u << 20 : 64u << 20);
        EXPECT_LE(row["resident_bytes_max"], row["budget_bytes"]);
        EXPECT_GT(row["bytes_needed"], 0);
        EXPECT_GE(row["bytes_read"], row["bytes_needed"]);
        EXPECT_LE(row["first_picture_seconds"], row["settled_seconds"]);
        for (const char* times : {"frame_ms", "frame_ms_no_loads"}) {
            EXPECT_LE(row[times]["p50"], row[times]["p95"]);
            EXPECT_LE(row[times]["p99"], row[times]["max"]);
        }
        EXPECT_EQ(row["violations"], Json::array());
    }
    std::istringstream csv(contentOf(out / "bench_stream.csv"));
    std::vector<std::string> lines;
    for (std::string line; std::getline(csv, line);) lines.push_back(line);
    ASSERT_EQ(lines.size(), 5u);
    for (const std::string& line : lines) EXPECT_EQ(columns(line), columns(lines[0]));
    EXPECT_NE(lines[0].find("frame_ms_no_loads_p99"), std::string::npos);
    EXPECT_EQ(Json::parse(contentOf(out / "bench_stream.json")), said);
    const std::string table = contentOf(out / "bench_stream.md");
    EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 6) << table;
    for (const char* plot : {"bench_stream_frames.svg", "bench_stream_bytes.svg"})
        EXPECT_EQ(contentOf(out / plot).substr(0, 5), "<svg ") << plot;
}

TEST_F(BenchStream, WhatIsWrongIsOneLine) {
    for (const std::string& wrong : {std::string("no/such.vcp"), "--paths crawl " + ball_, "--budgets 1k " + ball_}) {
        const Ran ran = run(wrong + kQuick);
        EXPECT_NE(ran.status, 0) << wrong;
        EXPECT_EQ(ran.errLines(), 1u) << ran.err;
    }
}

}  // namespace
}  // namespace vcp
