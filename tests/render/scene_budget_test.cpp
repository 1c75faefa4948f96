// Many datasets in one scene share pool, memory and loader as one file that holds all of them would.
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "tests/support/host_comparison.h"

namespace vcp {
namespace {

using test::BuiltMesh;
using test::channelsApart;
using test::drawnBy;
using test::Planes;
using test::requestOf;

constexpr double kCell = 0.05;
constexpr int kAcross = 10;

/// Bodies in ten rows of ten, two units apart.
glm::dvec3 placeOf(int body) { return {2.0 * (body % kAcross), 2.0 * (body / kAcross), 0}; }

IndexedMesh bodyAt(glm::dvec3 place) { return test::torusMesh(place, 0.6, 0.25, 60, 30); }

class SceneBudget : public test::HostRendererTest {
protected:
    /// A hundred datasets: the one body, placed.
    [[nodiscard]] static std::vector<PlacedDataset> hundred(const BuiltMesh& body) {
        std::vector<PlacedDataset> all;
        for (int i = 0; i < kAcross * kAcross; ++i) all.push_back(placed(body.file(), {.translation = placeOf(i)}));
        return all;
    }
    static FrameRequest seenFrom(glm::dvec3 low, glm::dvec3 high, glm::dvec3 forward = {0.2, 0.5, -0.8}) {
        FrameRequest request = requestOf(fitCamera(low, high, forward, {0, 1, 0}, 0.6, 4.0 / 3), 320, 240);
        request.errorPixels = 0.25;
        return request;
    }
};

const glm::dvec3 kLow(-0.85, -0.85, -0.25), kHigh(18.85, 18.85, 0.25);

TEST_F(SceneBudget, AHundredDatasetsTakeWhatOneFileOfThemTakes) {
    const BuiltMesh body(bodyAt(glm::dvec3(0)), kCell);
    IndexedMesh together;
    for (int i = 0; i < kAcross * kAcross; ++i) test::append(together, bodyAt(placeOf(i)));
    const BuiltMesh one(together, kCell);
    ASSERT_TRUE(body.ok() && one.ok());
    for (const FrameRequest& request :
         {seenFrom(kLow, kHigh), seenFrom(placeOf(44) - glm::dvec3(1), placeOf(55) + glm::dvec3(1))}) {
        ASSERT_TRUE(host_->open(hundred(body), {}));
        const Planes apart = drawnBy(*host_, request);
        ASSERT_TRUE(host_->open({placed(one.file())}, {}));
        const Planes whole = drawnBy(*host_, request);
        EXPECT_TRUE(apart.update.settled && whole.update.settled);
        EXPECT_LE(apart.update.errorPixels, request.errorPixels);
        EXPECT_FALSE(apart.update.relaxed);
        // Slots are whole units, and each dataset has a coarsest page.
        EXPECT_LE(apart.update.bytesRead, whole.update.bytesRead * 5 / 4 + 100 * kPoolUnitBytes);
        EXPECT_EQ(apart.update.reloads, 0u);
        uint64_t differing = 0, hits = 0;
        for (size_t i = 0; i < whole.depth.size(); ++i) {
            hits += std::isfinite(whole.depth[i]) ? 1 : 0;
            differing += channelsApart(apart.picture, whole.picture, i) > 24 ? 1 : 0;
        }
        EXPECT_GT(hits, 10000u);
        EXPECT_LE(differing, hits / 50);
    }
}

TEST_F(SceneBudget, ThePoolGoesToWhatIsSeen) {
    const BuiltMesh body(bodyAt(glm::dvec3(0)), kCell / 4);
    ASSERT_TRUE(body.ok());
    // Seen from above, no other is in view.
    const FrameRequest close = seenFrom(placeOf(0) - glm::dvec3(0.4), placeOf(0) + glm::dvec3(0.4), {0, 0, -1});
    ASSERT_TRUE(host_->open({placed(body.file())}, {}));
    const Planes alone = drawnBy(*host_, close);
    ASSERT_FALSE(alone.update.relaxed);
    // The budget is what the one in view takes, and a coarsest page for each of the others.
    ASSERT_TRUE(host_->open(hundred(body), {}));
    FrameRequest nothing = close;
    nothing.camera.eye.z += 1e6;
    const uint64_t coarsest = host_->settle(nothing).value().residentBytes;
    RendererOptions options;
    options.budgetBytes = coarsest + alone.update.residentBytes + (1 << 20);
    host_ = HostRenderer::create(options).value();
    ASSERT_TRUE(host_->open(hundred(body), {}));
    const Planes together = drawnBy(*host_, close);
    EXPECT_FALSE(together.update.relaxed);
    EXPECT_LE(together.update.residentBytes, options.budgetBytes);
    EXPECT_LE(together.update.errorPixels, close.errorPixels);
    // Equal shares would have left each dataset a hundredth.
    EXPECT_GT(alone.update.residentBytes, options.budgetBytes / 50);
}

// A page that is larger than a hundredth of the memory for pages is read all the same.
TEST_F(SceneBudget, MemoryForPagesIsNotSharedOut) {
    const BuiltMesh body(bodyAt(glm::dvec3(0)), kCell);
    ASSERT_TRUE(body.ok());
    uint64_t largest = 0;
    for (const PageEntry& page : body.cache().dataset().pages)
        largest = std::max<uint64_t>(largest, page.pageBytes + 2 * uint64_t{page.storedBytes});
    RendererOptions options;
    options.ramBytes = 3 * largest;
    host_ = HostRenderer::create(options).value();
    ASSERT_TRUE(host_->open(hundred(body), {}));
    const Planes drawn = drawnBy(*host_, seenFrom(kLow, kHigh));
    EXPECT_TRUE(drawn.update.problems.empty());
    EXPECT_LE(drawn.update.heldBytesMax, options.ramBytes);
    EXPECT_LE(drawn.update.errorPixels, 0.5);
}

}  // namespace
}  // namespace vcp
