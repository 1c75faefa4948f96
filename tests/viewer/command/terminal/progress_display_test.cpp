#include "viewer/command/terminal/progress_display.h"

#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace vcp {
namespace {

/// What a display writes on the way from 0 to 1 in 1000 steps, half of it in each of two stages.
std::string written(ProgressStyle style) {
    char* text = nullptr;
    size_t size = 0;
    std::FILE* out = open_memstream(&text, &size);
    {
        ProgressDisplay display(style, out);
        for (int i = 0; i <= 1000; ++i) display.update(i < 500 ? "reading \"x\"" : "writing", i / 1000.0);
        display.update("writing", 7);
    }
    std::fclose(out);
    std::string result(text, size);
    std::free(text);
    return result;
}

std::vector<std::string> linesOf(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

TEST(ProgressDisplay, NamesOfStyles) {
    EXPECT_EQ(progressStyleNamed("bar"), ProgressStyle::Bar);
    EXPECT_EQ(progressStyleNamed("plain"), ProgressStyle::Plain);
    EXPECT_EQ(progressStyleNamed("json"), ProgressStyle::Json);
    EXPECT_EQ(progressStyleNamed("none"), ProgressStyle::None);
    EXPECT_FALSE(progressStyleNamed("loud"));
    EXPECT_FALSE(progressStyleNamed(""));
}

TEST(ProgressDisplay, NoneWritesNothing) { EXPECT_EQ(written(ProgressStyle::None), ""); }

TEST(ProgressDisplay, PlainIsALineATenth) {
    const auto lines = linesOf(written(ProgressStyle::Plain));
    ASSERT_EQ(lines.size(), 11u);
    EXPECT_EQ(lines.front().substr(0, 19), "  0 % reading \"x\" (");
    EXPECT_EQ(lines.back().substr(0, 14), "100 % writing ");
}

TEST(ProgressDisplay, JsonIsAnObjectALine) {
    const auto lines = linesOf(written(ProgressStyle::Json));
    ASSERT_GE(lines.size(), 100u);
    double last = 0;
    for (const std::string& line : lines) {
        const auto json = nlohmann::json::parse(line);
        EXPECT_GE(json["fraction"].get<double>(), last);
        last = json["fraction"].get<double>();
        EXPECT_GE(json["seconds"].get<double>(), 0);
    }
    EXPECT_EQ(last, 1);
    EXPECT_EQ(nlohmann::json::parse(lines.front())["stage"], "reading \"x\"");
}

TEST(ProgressDisplay, WhatIsLeftIsCountedFromWhereTheRunBegan) {
    char* text = nullptr;
    size_t size = 0;
    std::FILE* out = open_memstream(&text, &size);
    double now = 1000;
    {
        ProgressDisplay display(ProgressStyle::Json, out, [&] { return now; });
        const ProgressDetails resumed{.triangles = 1000000, .tempBytes = 1, .begun = 0.5};
        now = 1004;
        display.update("level 1", 0.5, resumed);
        now = 1010;
        display.update("level 1", 0.6, resumed);
        now = 1040;
        display.update("level 1", 0.9, resumed);
        display.update("anew", 0.8);
    }
    std::fclose(out);
    const auto lines = linesOf(text);
    std::free(text);
    ASSERT_EQ(lines.size(), 4u);
    EXPECT_FALSE(nlohmann::json::parse(lines[0]).contains("seconds_left")) << "nothing was done in this run";
    const auto early = nlohmann::json::parse(lines[1]), late = nlohmann::json::parse(lines[2]);
    EXPECT_NEAR(early["seconds_left"].get<double>(), 40, 1e-9) << "a tenth of the whole took 10 s";
    EXPECT_NEAR(late["seconds_left"].get<double>(), 10, 1e-9);
    EXPECT_NEAR(late["triangles_per_second"].get<double>(), 10000, 1e-6);
    EXPECT_NEAR(nlohmann::json::parse(lines[3])["seconds_left"].get<double>(), 10, 1e-9) << "0.8 took 40 s";
}

TEST(ProgressDisplay, BarStaysOnItsLineAndCleansUp) {
    const std::string text = written(ProgressStyle::Bar);
    EXPECT_EQ(text.find('\n'), std::string::npos);
    EXPECT_EQ(text.substr(text.size() - 4), "\r\x1b[K");
    EXPECT_NE(text.find("100 % [========================================] writing"), std::string::npos);
}

}  // namespace
}  // namespace vcp
