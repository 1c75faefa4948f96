// Knobs that are chosen from rows of which the answer is known.
#include <gtest/gtest.h>

#include "viewer/bench/bench_meso.h"

namespace vcp {
namespace {

BenchMesoRow row(const char* method, const char* knob, const char* view, double wrong, double p95, double time,
                 double fetches) {
    BenchMesoRow made;
    made.asset = "beads", made.method = method, made.knob = knob, made.view = view;
    made.shape.fractions[size_t(MesoClass::Hit)] = 1 - wrong;
    made.shape.fractions[size_t(MesoClass::Missed)] = wrong;
    made.shape.p95 = p95, made.ratioToPeer = time, made.fetchesMean = fetches;
    return made;
}

TEST(BenchMesoGoal, TakesTheCheapestKnobThatIsAsRight) {
    const std::vector<BenchMesoRow> rows = {row("boxes", "grid 16", "45", 0.02, 0.5, 1, 8),
                                            row("boxes", "grid 16", "15", 0.02, 0.4, 3, 8),
                                            row("boxes", "grid 64", "45", 0.0008, 0.1, 3, 12),
                                            row("boxes", "grid 64", "15", 0.0008, 0.2, 5, 14),
                                            row("boxes", "grid 128", "45", 0, 0.1, 6, 20),
                                            row("boxes", "grid 128", "15", 0, 0.1, 6, 20),
                                            row("gdm", "rank 4", "45", 0.5, 1.9, 2, 9),
                                            row("gdm", "rank 4", "15", 0.3, 1.9, 2, 9),
                                            row("gdm", "rank 16", "45", 0.03, 0.5, 4, 16),
                                            row("gdm", "rank 16", "15", 0.03, 0.6, 4, 16),
                                            row("slices", "grid 256", "45", 0.0005, 0.2, 16, 80),
                                            row("slices", "grid 256", "15", 0.0005, 0.25, 16, 80),
                                            row("slices", "grid 512", "45", 0, 0.1, 40, 160),
                                            row("slices", "grid 512", "15", 0, 0.1, 40, 160),
                                            row("dm", "grid 64", "45", 0, 0, 1, 1)};
    const auto goals = goalsOf(rows);
    ASSERT_EQ(goals.size(), 2u) << "distance maps are no rival here";
    EXPECT_EQ(goals[0].rival, "gdm");
    EXPECT_EQ(goals[0].rivalKnob, "rank 16") << "the rightest";
    EXPECT_FALSE(goals[0].rivalIsRight);
    EXPECT_EQ(goals[0].oursKnob, "grid 16") << "no worse than that";
    EXPECT_DOUBLE_EQ(goals[0].time, 2.0 / 4);
    EXPECT_DOUBLE_EQ(goals[0].fetches, 8.0 / 16);
    EXPECT_EQ(goals[0].rightKnob, "grid 64");
    EXPECT_DOUBLE_EQ(goals[0].rightTime, 4.0 / 4);
    EXPECT_EQ(goals[1].rival, "slices");
    EXPECT_TRUE(goals[1].rivalIsRight);
    EXPECT_EQ(goals[1].rivalKnob, "grid 256") << "the cheapest that is right";
    EXPECT_EQ(goals[1].oursKnob, "grid 64");
    EXPECT_DOUBLE_EQ(goals[1].time, 4.0 / 16);

    const auto headlines = headlinesOf(rows);
    ASSERT_EQ(headlines.size(), 3u);
    EXPECT_EQ(headlines[0].method, "boxes");
    EXPECT_EQ(headlines[0].timeKnob, "grid 64");
    EXPECT_DOUBLE_EQ(headlines[0].fetches, 13);

    BenchMesoReport report;
    report.rows = rows;
    const std::string text = benchMesoMarkdown(report);
    EXPECT_NE(text.find("slices grid 256 (right)"), std::string::npos) << text;
}

/// Where boxes are never as right, nothing is claimed; and one view that is not right is enough for a knob not to be.
TEST(BenchMesoGoal, ClaimsNothingWithoutAKnobThatIsAsRight) {
    EXPECT_TRUE(
        goalsOf({row("boxes", "grid 16", "45", 0.02, 0.2, 1, 8), row("vdm", "table", "45", 0.01, 0.2, 2, 8)}).empty());
    const auto goals = goalsOf({row("boxes", "grid 16", "45", 0, 0.2, 1, 8), row("vdm", "table", "45", 0, 0.2, 2, 8),
                                row("vdm", "table", "15", 0, 0.3, 2, 8)});
    ASSERT_EQ(goals.size(), 1u);
    EXPECT_FALSE(goals[0].rivalIsRight);
}

}  // namespace
}  // namespace vcp
