// Surfaces compared in the window: what is shown, figured, saved, and how it goes again.
#include "viewer/window/comparison.h"

#include <algorithm>
#include <fstream>
#include <limits>

#include <nlohmann/json.hpp>

#include "octree/dataset_reader.h"
#include "tests/support/test_meshes.h"
#include "tests/support/viewed_ball.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

class ComparisonTest : public ViewedBall {
protected:
    /// Opens the ball twice, the second time a fiftieth larger.
    void openTwo() {
        std::ofstream("two.json") << R"({"datasets": [{"file": ")" << ball() << R"("}, {"file": ")" << ball()
                                  << R"(", "scale": 1.02}]})";
        session_->open({"two.json"});
        ASSERT_TRUE(turnUntil([&] { return !session_->opening(); }));
        ASSERT_EQ(session_->problem(), "");
        ASSERT_EQ(session_->layers().size(), 2u);
    }
    bool isCompared() {
        // Two hundred thousand points are measured: longer than other work of these tests.
        for (int i = 0; i < 20 && session_->saving(); ++i) turnUntil([&] { return !session_->saving(); });
        return !session_->saving() && session_->comparison() && session_->problem().empty();
    }
    [[nodiscard]] std::string ball() const { return (*folder_ / "ball.vcp").string(); }
    /// Returns a saved picture, without what is written over it.
    Picture saved(const std::string& name) {
        session_->savePicture({.size = {96, 96}});
        EXPECT_TRUE(isSaved()) << session_->problem();
        return picture(name);
    }
    static glm::ivec3 middleOf(const Picture& shown) {
        const uint8_t* at = &shown.rgba[size_t{4} * (shown.height / 2 * shown.width + shown.width / 2)];
        return {at[0], at[1], at[2]};
    }
};

TEST_F(ComparisonTest, TwoDatasetsAreComparedWhereTheyArePlaced) {
    openTwo();
    const Picture before = saved("picture-1.png");
    const OrbitCamera camera = session_->viewer().camera();
    session_->compare(0, 1);
    ASSERT_TRUE(session_->saving());
    EXPECT_EQ(session_->saving()->name, "");
    ASSERT_TRUE(isCompared()) << session_->problem();
    const ViewSession::ShownComparison& shown = *session_->comparison();
    // No point of the one is nearer to the other's surface than its bumps let it, nor farther than its own image.
    EXPECT_LT(shown.measured->deviation.quantile(0.99), -0.01);
    EXPECT_GT(shown.measured->deviation.distances.front(), -0.02 * 1.3);
    EXPECT_GT(shown.measured->compared.certifiedB, 1.019 * shown.measured->compared.certifiedA);
    EXPECT_EQ(session_->viewer().hidden(), std::vector<uint32_t>{1});
    EXPECT_EQ(session_->viewer().camera().position, camera.position);
    EXPECT_EQ(session_->viewer().shading().mode, ShadingMode::Lit);
    ASSERT_EQ(session_->annotations().legends.size(), 1u);
    EXPECT_EQ(session_->annotations().legends[0].title(), "Distance from ball.vcp");

    // All of it lies behind the other: blue as far as colours go, grey where they go much farther.
    session_->setComparisonRange(0.002);
    ASSERT_TRUE(isCompared()) << session_->problem();
    EXPECT_EQ(session_->comparison()->range, 0.002);
    const glm::ivec3 blue = middleOf(saved("picture-2.png"));
    EXPECT_GT(blue.z, 2 * blue.x);
    session_->setComparisonRange(100);
    ASSERT_TRUE(isCompared()) << session_->problem();
    const glm::ivec3 grey = middleOf(saved("picture-3.png"));
    EXPECT_LT(std::abs(grey.z - grey.x), 10);
    EXPECT_EQ(session_->viewer().hidden(), std::vector<uint32_t>{1}) << "also after other colours";

    session_->endComparison();
    EXPECT_FALSE(session_->comparison());
    EXPECT_TRUE(session_->viewer().hidden().empty());
    EXPECT_TRUE(session_->annotations().legends.empty());
    EXPECT_EQ(saved("picture-4.png"), before);
    EXPECT_TRUE(filesIn(*folder_ / "cache" / "vcp").empty()) << "what was coloured is gone";
}

TEST_F(ComparisonTest, TheFirstIsShownWhereItIsPlaced) {
    openTwo();
    const Box before = session_->viewer().bounds();
    session_->compare(1, 0);
    ASSERT_TRUE(isCompared()) << session_->problem();
    EXPECT_GT(session_->comparison()->measured->deviation.quantile(0.01), 0.01) << "it lies in front";
    const Box after = session_->viewer().bounds();
    EXPECT_LT(glm::distance(before.low, after.low) + glm::distance(before.high, after.high), 0.01);
}

TEST_F(ComparisonTest, AFileIsComparedAndFiguresAreWritten) {
    session_->compareWithFile(0, (*folder_ / "ball.ply").string());
    ASSERT_TRUE(isCompared()) << session_->problem();
    const Comparison::Measured& measured = *session_->comparison()->measured;
    EXPECT_LE(measured.deviation.absoluteQuantile(1), measured.compared.certifiedA);
    EXPECT_TRUE(session_->viewer().hidden().empty());
    session_->exportComparison();
    session_->exportComparison();
    ASSERT_EQ(session_->problem(), "");
    const auto json = nlohmann::json::parse(contentOf("deviation-1.json"));
    EXPECT_EQ(json["a"], "ball.vcp");
    EXPECT_EQ(json["b"], "ball.ply");
    EXPECT_EQ(json["a_to_b"]["samples"], 200'000);
    EXPECT_EQ(json["a_to_b"]["rms"], measured.deviation.rms);
    EXPECT_EQ(json["a_to_b"]["histogram"]["range"], session_->comparison()->range);
    EXPECT_TRUE(contentOf("deviation-1.csv").starts_with("quantity,from,to,value\nmean,,,"));
    EXPECT_EQ(filesIn("."),
              (std::set<std::string>{"deviation-1.csv", "deviation-1.json", "deviation-2.csv", "deviation-2.json"}));
}

// The scan of the ball, and a file of a ball and a far one: from it the scan has counterparts everywhere, but not back.
TEST_F(ComparisonTest, BothWaysAndOnlyWhatIsNear) {
    IndexedMesh two = test::sphereMesh({0, 0, 0}, 1, 24);
    test::append(two, test::sphereMesh({20, 0, 0}, 1, 24));
    test::writeObj(two, "two.obj");
    const auto figures = [&](double within) {
        session_->comparisonChoice = {.within = within, .both = true};
        session_->compareWithFile(0, "two.obj");
        EXPECT_TRUE(isCompared()) << session_->problem();
        return session_->comparison()->measured;
    };
    const auto all = figures(std::numeric_limits<double>::infinity());
    ASSERT_TRUE(all->back);
    EXPECT_EQ(all->back->withoutCounterpart(), 0u);
    EXPECT_GT(all->back->absoluteQuantile(1), 17);
    const auto near = figures(1);
    ASSERT_TRUE(near->back);
    EXPECT_EQ(near->deviation.withoutCounterpart(), 0u);
    EXPECT_LT(near->back->absoluteQuantile(1), 1);
    // Half of the area is the far ball's.
    EXPECT_NEAR(double(near->back->withoutCounterpart()) / double(near->back->samples), 0.5, 0.01);
    session_->exportComparison();
    const auto json = nlohmann::json::parse(contentOf("deviation-1.json"));
    EXPECT_EQ(json["b_to_a"]["rms"], near->back->rms);
    EXPECT_EQ(json["a_to_b"]["rms"], near->deviation.rms);
}

TEST_F(ComparisonTest, WhatCannotBeComparedIsSaidAndChangesNothing) {
    std::ofstream("scene.json") << R"({"datasets": [{"file": "x.vcp"}]})";
    std::ofstream("broken.ply") << "ply\nformat ascii 1.0\n";
    for (const std::string name : {"scene.json", "broken.ply", "missing.vcp"}) {
        session_->dismissProblem();
        session_->compareWithFile(0, name);
        ASSERT_TRUE(turnUntil([&] { return !session_->saving(); }));
        EXPECT_FALSE(session_->comparison());
        EXPECT_NE(session_->problem().find(name), std::string::npos) << session_->problem();
        EXPECT_EQ(session_->problem().find('\n'), std::string::npos);
    }
    session_->exportComparison();
    EXPECT_NE(session_->note(), "");
    EXPECT_TRUE(session_->viewer().isOpen());
}

TEST_F(ComparisonTest, ItCanBeCancelledAndEndsWithWhatIsOpenedNext) {
    session_->compareWithFile(0, (*folder_ / "ball.ply").string());
    session_->cancelSaving();
    EXPECT_FALSE(session_->saving());
    EXPECT_FALSE(session_->comparison());
    turn();
    EXPECT_EQ(session_->problem(), "");
    session_->compareWithFile(0, (*folder_ / "ball.ply").string());
    ASSERT_TRUE(isCompared()) << session_->problem();
    session_->open({ball()});
    ASSERT_TRUE(turnUntil([&] { return !session_->opening(); }));
    EXPECT_FALSE(session_->comparison());
    EXPECT_TRUE(session_->annotations().legends.empty());
    EXPECT_EQ(session_->problem(), "");
}

TEST_F(ComparisonTest, AColourOfItsOwnGivesWayAndComesBack) {
    const DatasetLook look{.dataset = 0, .colour = glm::vec3(0, 1, 0), .opacity = 0.5f};
    session_->viewer().setLook(look);
    Shading shading = session_->viewer().shading();
    shading.mode = ShadingMode::Clay;
    session_->viewer().setShading(shading);
    session_->compareWithFile(0, (*folder_ / "ball.ply").string());
    ASSERT_TRUE(isCompared()) << session_->problem();
    EXPECT_FALSE(session_->viewer().lookOf(0).colour);
    EXPECT_EQ(session_->viewer().lookOf(0).opacity, 0.5f);
    EXPECT_EQ(session_->viewer().shading().mode, ShadingMode::Lit);
    session_->saveScene();
    EXPECT_NE(contentOf("scene-1.json").find("\"colour\""), std::string::npos) << "a scene keeps what comes back";
    session_->endComparison();
    EXPECT_EQ(session_->viewer().lookOf(0), look);
    EXPECT_EQ(session_->viewer().shading().mode, ShadingMode::Clay);
}

TEST_F(ComparisonTest, OfLargeDatasetsACoarserLevelIsHeld) {
    const auto reader = openFile(*folder_ / "ball.vcp");
    const auto dataset = readDataset(**reader);
    ASSERT_TRUE(dataset);
    ASSERT_GT(dataset->header.levels, 1u);
    EXPECT_EQ(finestHeldLevel(*dataset, dataset->header.triangles), dataset->header.levels - 1);
    EXPECT_EQ(finestHeldLevel(*dataset, 1), 0u);
    uint32_t last = 0;
    for (uint64_t most = 1; most < dataset->header.triangles; most *= 2) {
        const uint32_t level = finestHeldLevel(*dataset, most);
        EXPECT_GE(level, last);
        last = level;
    }
}

TEST(DistanceLegend, HasTheColoursAndNumbersOfBothSides) {
    const Legend legend = distanceLegend(0.002, "b.ply", unitNamed("m"));
    EXPECT_EQ(legend.title(), "Distance from b.ply, mm");
    ASSERT_EQ(legend.ticks.size(), 5u);
    EXPECT_EQ(legend.ticks.front().text, "-2");
    EXPECT_EQ(legend.ticks[2].text, "0");
    EXPECT_EQ(legend.ticks.back().text, "2");
    EXPECT_GT(legend.colourAt(0).z, legend.colourAt(0).x);
    EXPECT_GT(legend.colourAt(1).x, legend.colourAt(1).z);
    EXPECT_LT(std::abs(legend.colourAt(0.5).x - legend.colourAt(0.5).z), 0.01f);
    EXPECT_EQ(distanceLegend(1, std::string(200, 'n'), {}).title(), "Distance");
}

}  // namespace
}  // namespace vcp
