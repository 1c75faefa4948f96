// What no ray hits is not read, and the picture is the one with all of it, byte for byte; on a device and on the host.
#include <map>

#include <gtest/gtest.h>

#include "render/host_renderer.h"
#include "tests/support/built_mesh.h"
#include "tests/support/reference_comparison.h"

namespace vcp {
namespace {

using test::requestOf;

const glm::dvec3 kLow(-1.4, -1.3, -1.2), kHigh(1.6, 1.7, 1.8);

/// A ring around a box.
IndexedMesh ringAndBox() {
    IndexedMesh mesh = test::torusMesh({0.1, 0.2, 0.3}, 1, 0.4, 480, 240);
    test::append(mesh, test::boxMesh({-0.3, -0.3, -0.3}, {0.35, 0.25, 0.3}, 60));
    return mesh;
}

/// Its pages take so many bytes a pixel of a small picture that rays are asked.
const test::BuiltMesh& built() {
    static const test::BuiltMesh mesh(ringAndBox(), 0.01);
    return mesh;
}

PlacedDataset placed(const Similarity& placement = {}) {
    auto reader = openFile(built().file()).value();
    const auto dataset = std::make_shared<const Dataset>(readDataset(*reader).value());
    return {dataset, std::make_shared<FilePageSource>(reader, dataset), placement};
}

class HiddenPages : public testing::TestWithParam<const char*> {
protected:
    static void TearDownTestSuite() { renderers().clear(); }
    /// A renderer of the two with these options, for which nothing has been read: what it showed before is gone, and
    /// its pipelines are there.
    static PictureRenderer& renderer(bool hiddenToo, std::vector<PlacedDataset> datasets = {}) {
        auto& made = renderers()[{GetParam(), hiddenToo}];
        if (!made) made = newRenderer(hiddenToo);
        if (datasets.empty()) datasets.push_back(placed());
        EXPECT_TRUE(made->open(std::move(datasets), {}));
        return *made;
    }
    static std::unique_ptr<PictureRenderer> newRenderer(bool hiddenToo) {
        RendererOptions options;
        options.device = GetParam();
        options.hiddenToo = hiddenToo;
        return createPictureRenderer(options).value();
    }
    /// Draws with and without what is hidden, each from nothing; returns what each has in the pool.
    struct Bytes {
        uint64_t hit = 0, all = 0;
    };
    static Bytes expectTheSame(const FrameRequest& request) {
        Bytes bytes;
        const auto draw = [&](bool hiddenToo, uint64_t& resident) {
            PictureRenderer& drawing = renderer(hiddenToo);
            const auto drawn = drawing.drawSettled(request);
            EXPECT_TRUE(drawn) << drawn.error().line();
            EXPECT_TRUE(drawn->update.settled);
            EXPECT_GT(drawn->stats.hitPixels, 100u);
            resident = drawn->update.residentBytes;
            return std::pair(drawing.readPicture().value(), drawing.readDepth().value());
        };
        const auto hit = draw(false, bytes.hit), all = draw(true, bytes.all);
        EXPECT_EQ(hit, all);
        EXPECT_LE(bytes.hit, bytes.all);
        return bytes;
    }

private:
    using Renderers = std::map<std::pair<std::string, bool>, std::unique_ptr<PictureRenderer>>;
    static Renderers& renderers() {
        static Renderers made;
        return made;
    }
};

TEST_P(HiddenPages, AreNotReadAndChangeNothing) {
    Bytes sum;
    for (const test::NamedCamera& named : test::cameras(kLow, kHigh))
        for (const double errorPixels : {0.3, 3.0}) {
            SCOPED_TRACE(named.name + std::string(", ") + std::to_string(errorPixels));
            FrameRequest request = requestOf(named.camera);
            request.errorPixels = errorPixels;
            const Bytes bytes = expectTheSame(request);
            sum.hit += bytes.hit, sum.all += bytes.all;
        }
    EXPECT_LT(sum.hit, sum.all * 4 / 5);
}

TEST_P(HiddenPages, ShadowsAndOcclusionAreThoseOfAll) {
    Bytes sum;
    const auto cameras = test::cameras(kLow, kHigh);
    for (const size_t camera : {0, 3, 5, 7}) {
        SCOPED_TRACE(cameras[camera].name);
        FrameRequest request = requestOf(cameras[camera].camera, 120, 90);
        request.shading.shadows = true;
        request.shading.occlusionRays = camera == 3 ? 0 : 4;
        const Bytes bytes = expectTheSame(request);
        sum.hit += bytes.hit, sum.all += bytes.all;
    }
    EXPECT_LT(sum.hit, sum.all);
}

TEST_P(HiddenPages, SectionsOpenWhatIsBehindThem) {
    const auto cameras = test::cameras(kLow, kHigh);
    for (const size_t camera : {0, 5})
        for (const bool caps : {false, true}) {
            SCOPED_TRACE(cameras[camera].name + std::string(caps ? ", caps" : ""));
            FrameRequest request = requestOf(cameras[camera].camera);
            request.sections = {{{0.2, 0.3, -1}, -0.25}};
            request.sectionCaps = caps ? Caps::Closed : Caps::None;
            expectTheSame(request);
        }
}

TEST_P(HiddenPages, APictureDoesNotDependOnWhatWasSeenBefore) {
    const auto cameras = test::cameras(kLow, kHigh);
    const auto moved = newRenderer(false);
    ASSERT_TRUE(moved->open({placed()}, {}));
    for (const test::NamedCamera& named : cameras) ASSERT_TRUE(moved->drawSettled(requestOf(named.camera)));
    for (const test::NamedCamera& named : cameras) {
        SCOPED_TRACE(named.name);
        ASSERT_TRUE(moved->drawSettled(requestOf(named.camera)));
        PictureRenderer& fresh = renderer(false);
        ASSERT_TRUE(fresh.drawSettled(requestOf(named.camera)));
        EXPECT_EQ(moved->readPicture().value(), fresh.readPicture().value());
    }
}

TEST_P(HiddenPages, SeveralDatasetsAreAskedEachForItself) {
    const FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera);
    const Similarity beside{glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, -0.5))), 0.6, {0.5, 0.2, 0.7}};
    const auto two = [&](bool hiddenToo) -> PictureRenderer& {
        std::vector<PlacedDataset> datasets;
        datasets.push_back(placed());
        datasets.push_back(placed(beside));
        return renderer(hiddenToo, std::move(datasets));
    };
    PictureRenderer &hit = two(false), &all = two(true);
    const auto drawn = hit.drawSettled(request), drawnAll = all.drawSettled(request);
    ASSERT_TRUE(drawn && drawnAll);
    EXPECT_LT(drawn->update.residentBytes, drawnAll->update.residentBytes);
    EXPECT_EQ(hit.readPicture().value(), all.readPicture().value());
}

TEST_P(HiddenPages, ASettledViewAsksNoMore) {
    const FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera);
    PictureRenderer& drawing = renderer(false);
    UpdateResult update = drawing.update(request).value();
    int frames = 0;
    for (; !update.settled; update = drawing.update(request).value()) {
        ASSERT_LT(frames, 12) << "every frame asks for more";
        if (update.awaitsRays) {
            EXPECT_EQ(update.pagesMissing, 0u);
            ASSERT_TRUE(drawing.render(request));
            ++frames;
        } else {
            drawing.waitForPage(std::chrono::milliseconds(100));
        }
    }
    EXPECT_GT(frames, 1);
    const Picture settled = drawing.readPicture().value();
    for (int i = 0; i < 3; ++i) {
        ASSERT_TRUE(drawing.render(request));
        EXPECT_EQ(drawing.readPicture().value(), settled);
        const UpdateResult still = drawing.update(request).value();
        EXPECT_TRUE(still.settled);
        EXPECT_FALSE(still.changed);
        EXPECT_EQ(still.loads, update.loads);
    }
}

// Rays of both hit the same pages: from nothing they read the same.
TEST(HiddenPagesOfBoth, HostAndDeviceReadTheSame) {
    std::unique_ptr<PictureRenderer> both[2];
    for (const bool host : {false, true}) {
        RendererOptions options;
        options.device = host ? kHostName : "";
        both[host ? 1 : 0] = createPictureRenderer(options).value();
    }
    for (const test::NamedCamera& named : test::cameras(kLow, kHigh)) {
        SCOPED_TRACE(named.name);
        UpdateResult read[2];
        for (const size_t i : {0, 1}) {
            ASSERT_TRUE(both[i]->open({placed()}, {}));
            read[i] = both[i]->drawSettled(requestOf(named.camera)).value().update;
        }
        EXPECT_EQ(read[0].pagesResident, read[1].pagesResident);
        EXPECT_EQ(read[0].bytesRead, read[1].bytesRead);
        EXPECT_EQ(read[0].errorPixels, read[1].errorPixels);
    }
}

INSTANTIATE_TEST_SUITE_P(Devices, HiddenPages, testing::Values("", kHostName),
                         [](const auto& device) { return *device.param == 0 ? "Device" : "Host"; });

}  // namespace
}  // namespace vcp
