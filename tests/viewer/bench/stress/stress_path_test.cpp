// Camera paths and faults of vcp stress.
#include "viewer/bench/stress/stress_path.h"

#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>

namespace vcp {
namespace {

StressPathOptions optionsFor(const std::string& name, int frames = 50) {
    StressPathOptions options;
    options.name = name;
    options.bounds = {{-1, -2, -3}, {3, 2, 1}};
    options.target = {1, 0, 1};
    options.cell = 0.001;
    options.frames = frames;
    return options;
}

TEST(StressPath, EveryPathHasAUsableCameraForEachFrame) {
    for (const std::string& name : stressPathNames())
        for (const int frames : {1, 2, 50}) {
            SCOPED_TRACE(fmt::format("{} {}", name, frames));
            const auto path = stressPath(optionsFor(name, frames));
            ASSERT_TRUE(path);
            ASSERT_EQ(path->size(), size_t(frames));
            for (const Camera& camera : *path) {
                EXPECT_TRUE(std::isfinite(glm::length(camera.eye)));
                EXPECT_GT(glm::length(glm::cross(camera.forward, camera.up)), 1e-3);
            }
            EXPECT_EQ(stressPath(optionsFor(name, frames)), path) << "the same each time";
        }
    EXPECT_FALSE(stressPath(optionsFor("crawl")));
}

TEST(StressPath, DoesWhatItsNameSays) {
    const auto orbit = *stressPath(optionsFor("orbit"));
    EXPECT_LT(glm::distance(orbit.front().eye, orbit.back().eye), 1e-9) << "once around";
    const auto dive = *stressPath(optionsFor("dive"));
    EXPECT_NEAR(glm::distance(dive.back().eye, {1, 0, 1}), 0.032, 1e-9);
    for (size_t i = 1; i < dive.size(); ++i)
        EXPECT_LT(glm::distance(dive[i].eye, {1, 0, 1}), glm::distance(dive[i - 1].eye, {1, 0, 1}));
    const auto fly = *stressPath(optionsFor("fly"));
    EXPECT_NEAR(glm::distance(0.5 * (fly.front().eye + fly.back().eye), optionsFor("fly").bounds.centre()), 0, 1e-9);
    const auto teleport = *stressPath(optionsFor("teleport"));
    EXPECT_EQ(teleport[3], teleport[9]);
    EXPECT_NE(teleport[9], teleport[10]);
    auto other = optionsFor("teleport");
    other.seed = 2;
    EXPECT_NE(*stressPath(other), teleport);
    const auto jitter = *stressPath(optionsFor("jitter"));
    EXPECT_NE(jitter[0], jitter[1]);
    EXPECT_LT(glm::distance(jitter[0].eye, jitter[1].eye),
              0.1 * glm::distance(jitter[0].eye, optionsFor("jitter").bounds.centre()));
}

TEST(StressPath, FaultsAsText) {
    const Faults all =
        *parseFaults("error=0.1,corrupt=0.01,stall=500ms,stalls=0.5,latency=0.05s,spread=20ms,bandwidth=2M");
    EXPECT_EQ(all, (Faults{.errorRate = 0.1,
                           .corruptRate = 0.01,
                           .stallRate = 0.5,
                           .stallSeconds = 0.5,
                           .latencySeconds = 0.05,
                           .spreadSeconds = 0.02,
                           .bytesPerSecond = 2 << 20}));
    EXPECT_EQ(*parseFaults(""), Faults{});
    EXPECT_GT(parseFaults("stall=1s")->stallRate, 0);
    for (const char* bad : {"error", "error=", "error=2", "error=-0.1", "error=nan", "stall=500", "stall=-1s",
                            "stall=1e9s", "flood=1", "error=0.1x", "bandwidth=0", "stall=ms", ","})
        EXPECT_FALSE(parseFaults(bad)) << bad;
}

}  // namespace
}  // namespace vcp
