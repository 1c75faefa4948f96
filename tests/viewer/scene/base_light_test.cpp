// What bases of a scene do to each other's light, and the folder that keeps it.
#include "viewer/scene/base_light.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <thread>

#include <gtest/gtest.h>

#include "mesostructure/transfer_volume.h"
#include "tests/support/test_folder.h"
#include "viewer/scene/meso_scene.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using meso::makeBaseSurface;

/// Two boxes side by side.
std::vector<SceneBase> boxes() {
    std::vector<SceneBase> bases;
    for (int i = 0; i < 2; ++i) {
        bases.push_back({*makeBaseSurface("box", 2), 0.05, 0.5, i == 0});
        for (glm::dvec3& p : bases.back().surface.positions) p.x += 2.5 * i;
    }
    return bases;
}

std::vector<fs::path> filesIn(const fs::path& folder) {
    std::vector<fs::path> all;
    for (const auto& each : fs::directory_iterator(folder)) all.push_back(each.path());
    return all;
}

TEST(BaseLight, OthersStandInTheLight) {
    // A sphere is open; a box beside it shades it, and takes no transfer that it does not ask for.
    std::vector<SceneBase> bases;
    bases.push_back({*makeBaseSurface("sphere", 2), 0, 0.5, true});
    const auto alone = traceBases(bases);
    ASSERT_TRUE(alone) << alone.error().line();
    EXPECT_TRUE((*alone)[0]->changes.empty());
    bases.push_back({*makeBaseSurface("box", 2), 0, 0.5, false});
    for (glm::dvec3& p : bases[1].surface.positions) p.x += 2.5;
    const auto beside = traceBases(bases);
    ASSERT_TRUE(beside) << beside.error().line();
    EXPECT_FALSE((*beside)[0]->changes.empty());
    EXPECT_EQ((*beside)[1], nullptr);
    EXPECT_EQ((*beside)[0]->vertices(), bases[0].surface.positions.size());
}

TEST(BaseLight, IsTracedOnceAndKept) {
    const TestFolder folder("base_light");
    const fs::path cache = folder / "cache";
    int told = 0;
    const auto traced = [&](const std::vector<SceneBase>& bases) {
        told = 0;
        const auto made = traceBases(bases, cache, [&](double) { return ++told > 0; });
        EXPECT_TRUE(made) << made.error().line();
        return (*made)[0];
    };
    const auto first = traced(boxes());
    EXPECT_GT(told, 0);
    ASSERT_EQ(filesIn(cache).size(), 1u);
    const fs::path kept = filesIn(cache)[0];
    EXPECT_EQ(kept.extension(), kBaseLightExtension);
    const auto again = traced(boxes());
    EXPECT_EQ(told, 0);
    EXPECT_EQ(again->numbers, first->numbers);
    EXPECT_EQ(again->changes, first->changes);
    // Other walls are another light.
    auto darker = boxes();
    darker[1].albedo = 0.1;
    EXPECT_NE(traced(darker)->changes, first->changes);
    EXPECT_GT(told, 0);
    EXPECT_EQ(filesIn(cache).size(), 2u);
    // What is damaged is traced again: any bit, any end.
    std::ifstream file(kept, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    const auto damaged = [&](const std::string& with) {
        std::ofstream(kept, std::ios::binary) << with;
        EXPECT_EQ(traced(boxes())->changes, first->changes);
        EXPECT_GT(told, 0);
    };
    for (const size_t at : {size_t{0}, size_t{9}, size_t{17}, bytes.size() / 2, bytes.size() - 1}) {
        std::string flipped = bytes;
        flipped[at] = char(flipped[at] ^ 4);
        damaged(flipped);
    }
    for (const size_t length : {size_t{0}, size_t{20}, bytes.size() / 2, bytes.size() - 1})
        damaged(bytes.substr(0, length));
    damaged(bytes + "x");
}

TEST(BaseLight, IsCancelled) {
    const auto stopped = traceBases(boxes(), {}, [](double) { return false; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
}

/// A torus in transferred light, opened as the window does, with a cache of its own.
class SceneInLight : public ::testing::Test {
protected:
    void SetUp() override {
        if (const char* value = std::getenv("XDG_CACHE_HOME")) before_ = value;
        setenv("XDG_CACHE_HOME", (folder_ / "cache").c_str(), 1);
        meso::Asset asset = *openMesoAsset("hemispheres");
        const auto shape = *meso::shapeOf(asset);
        asset.transfer = std::make_shared<const meso::TransferVolume>(
            *meso::traceTransfer(*shape, {.cells = 8, .paths = 16, .shareOut = {}}));
        ASSERT_TRUE(meso::writeAsset(folder_ / "hemispheres.meso", asset));
        std::ofstream(scene_) << R"({"mesostructure": [{"asset": "hemispheres.meso", "surface": "torus",)"
                              << R"( "transfer": true}], "environment": {"source": "studio"}})";
    }
    void TearDown() override {
        if (before_)
            setenv("XDG_CACHE_HOME", before_->c_str(), 1);
        else
            unsetenv("XDG_CACHE_HOME");
    }
    Result<OpenedScene> opened(const std::function<bool(const BuildProgress&)>& told) {
        BuildOptions build;
        build.progress = told;
        SceneOpening opening({scene_.string()}, build, {});
        while (!opening.isDone()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return opening.take();
    }

    const TestFolder folder_{"scene_in_light"};
    const fs::path scene_ = folder_ / "torus.json";
    std::optional<std::string> before_;
};

TEST_F(SceneInLight, TellsHowFarTheLightIsAndCanBeCancelled) {
    const std::string light = "light of bases";
    // It is cancelled while the light is traced, and then nothing is kept.
    const auto stopped = opened([&](const BuildProgress& at) { return at.stage != light || at.fraction < 0.01; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
    EXPECT_FALSE(fs::exists(folder_ / "cache" / "vcp") && !filesIn(folder_ / "cache" / "vcp").empty());
    std::vector<double> parts;
    const auto keep = [&](const BuildProgress& at) {
        if (at.stage == light) parts.push_back(at.fraction);
        return true;
    };
    const auto scene = opened(keep);
    ASSERT_TRUE(scene) << scene.error().line();
    EXPECT_NE(scene->surfaces.surfaces[0].baseTransfer, nullptr);
    ASSERT_GT(parts.size(), 2u);
    EXPECT_TRUE(std::ranges::is_sorted(parts));
    EXPECT_LE(parts.back(), 1);
    // What is kept takes no time, and nothing is told.
    parts.clear();
    ASSERT_TRUE(opened(keep));
    EXPECT_TRUE(parts.empty());
}

}  // namespace
}  // namespace vcp
