// Images that are shown once pages are there: they are those that are shown from the beginning.
#include <algorithm>

#include <gtest/gtest.h>

#include "render/frame_setup.h"
#include "render/pages/host_page_memory.h"
#include "render/renderer_options.h"
#include "render/residencies.h"
#include "tests/support/built_walls.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

class LateImagesTest : public ::testing::Test {
protected:
    void SetUp() override {
        const auto texel = [](uint32_t x, uint32_t y) { return x * 5 + y * 1031; };
        walls_ = test::builtWalls(folder_.path(), texel, texel);
        ASSERT_TRUE(walls_.dataset);
        request_.camera.eye = {9, 8, 7};
        request_.camera.forward = glm::normalize(glm::dvec3(-7, -7, -6));
        request_.camera.up = {0, 0, 1};
        request_.camera.verticalFov = 0.7;
        request_.width = request_.height = 200;
    }

    static std::vector<PlacedResidency> opened(const PlacedDataset& walls, DatasetImages images = {}) {
        RendererOptions options;
        options.hiddenToo = true;
        auto opened = openResidencies(hostPageMemory(), options, {walls}, std::move(images));
        EXPECT_TRUE(opened);
        return *std::move(opened);
    }
    /// Updates what a view shows until nothing is missing.
    void settle(std::vector<PlacedResidency>& opened) const {
        double errorPixels = 0;
        const ShownResidency shown{opened[0].residency.get(), {}, &errorPixels};
        for (int round = 0; round < 1000; ++round) {
            const auto update = updateShown({&shown, 1}, request_);
            ASSERT_TRUE(update && *update);
            ASSERT_TRUE((*update)->problems.empty());
            if ((*update)->settled) return;
            waitForPage(opened, std::chrono::milliseconds(100));
        }
        FAIL() << "it does not settle";
    }
    static std::vector<uint32_t> finest(const Residency& residency) {
        std::vector<uint32_t> finest;
        for (const ImageSet::Image& image : residency.images()->images()) finest.push_back(image.finest);
        return finest;
    }

    TestFolder folder_{"vcp_late_images_test"};
    PlacedDataset walls_;
    FrameRequest request_;
};

TEST_F(LateImagesTest, PagesThatWereThereShowThem) {
    const DatasetImages images = *findImages({&walls_, 1}, true, 64 << 20);
    auto early = opened(walls_, images);
    settle(early);
    // A source that was not asked for images does not say what pages need of them.
    PlacedDataset other = walls_;
    other.source = std::make_shared<FilePageSource>(*openFile(walls_.source->name()), walls_.dataset);
    auto late = opened(other);
    settle(late);
    Residency& residency = *late[0].residency;
    EXPECT_EQ(residency.images(), nullptr);
    const uint64_t before = residency.cutNumber(), pages = residency.pagesNumber();
    const DatasetImages found = *findImages({&other, 1}, true, 64 << 20);
    ASSERT_TRUE(residency.scene().showImages(0, found.pieces[0], found.mostBytes[0]));
    settle(late);
    EXPECT_GT(residency.images()->bytes(), 0u);
    EXPECT_EQ(finest(residency), finest(*early[0].residency));
    EXPECT_NE(residency.cutNumber(), before) << "the picture is another one";
    EXPECT_EQ(residency.pagesNumber(), pages) << "of the same pages";
}

TEST_F(LateImagesTest, APartOfTheViewReadsWhatItsPagesShow) {
    auto images = opened(walls_, *findImages({&walls_, 1}, true, 64 << 20));
    settle(images);
    Residency& residency = *images[0].residency;
    const SelectionView view = selectionView(request_);
    // All that is there was needed, and nothing without pages.
    uint64_t bytes = 0;
    const std::vector<float> needs = residency.needsOn(view, residency.cut());
    for (uint64_t piece = 0; piece < needs.size(); ++piece)
        if (needs[piece] > 0) bytes += residency.pieces().bytesOf(piece);
    EXPECT_EQ(bytes, residency.images()->bytes());
    EXPECT_GT(bytes, 0u);
    EXPECT_EQ(residency.needsOn(view, {}), std::vector<float>(needs.size()));
}

}  // namespace
}  // namespace vcp
