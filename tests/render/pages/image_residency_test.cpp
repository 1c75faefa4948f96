// Which levels of images are in memory: what pages in view need, within what is allowed, and no more.
#include "render/pages/image_residency.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "octree/image_needs.h"
#include "tests/support/analytic_page.h"
#include "tests/support/image_file.h"

namespace vcp {
namespace {

/// A dataset of one page, 64 cells wide, whose triangles show some of three images: 1024 x 1024, 512 x 512, 256 x 256.
class ImageResidencyTest : public ::testing::Test {
protected:
    ImageResidencyTest() {
        test::AnalyticOptions options;
        options.levels = 1;
        made_ = test::analyticDataset(test::sphere(glm::dvec3(32.1, 31.9, 32.2), 25), options);
        ImageTables tables;
        for (const uint32_t edge : {1024u, 512u, 256u}) {
            const auto levels = imageLevels(edge, edge, tables.tiles.size());
            tables.images.push_back({edge, edge, uint32_t(levels.size()), kLosslessTiles, tables.tiles.size()});
            tables.tiles.resize(tables.tiles.size() + tilesOf(levels));
        }
        tables.materials = {{0}, {1}, {2}};
        pieces_ = std::make_shared<const ImagePieces>(std::move(tables));
    }

    /// Sees the page's box from a distance at which a pixel is so many of its cells wide.
    [[nodiscard]] SelectionView pixelsOf(double cells) const {
        const Dataset& dataset = made_.dataset;
        const glm::dvec3 low = dataset.originOf(dataset.pages[0]);
        SelectionView view;
        view.eye = low + glm::dvec3(0.5, 0.5, -1) * dataset.edgeOf(dataset.pages[0]);
        const double distance = low.z - view.eye.z;
        view.pixelsPerUnit = distance / (cells * dataset.cellOf(0));
        return view;
    }
    /// What a page needs that shows all of an image.
    [[nodiscard]] ImageNeed need(uint32_t image, float texelsPerCell) const {
        const uint32_t across = blocksAcross(pieces_->tables().images[image]);
        ImageNeed need{image, texelsPerCell, {}, glm::vec3(0), glm::vec3(64)};
        for (uint32_t block = 0; block < across * across; ++block) need.blocks.push_back(uint16_t(block));
        return need;
    }
    void look(ImageResidency& images, const SelectionView& view, ViewNumber number = 0) const {
        images.look(made_.dataset, view, {0}, number);
    }
    /// Delivers all that is wished for, the most urgent piece first, one at a time. Returns how many came.
    uint64_t settle(ImageResidency& images, uint64_t most = ~uint64_t{0}) const {
        uint64_t delivered = 0;
        for (auto wishes = images.wishes(); !wishes.empty() && delivered < most; wishes = images.wishes()) {
            const auto urgent = std::max_element(wishes.begin(), wishes.end(),
                                                 [](const Wish& a, const Wish& b) { return a.priority < b.priority; });
            EXPECT_EQ(urgent->request.kind, Request::Kind::ImagePiece);
            const uint64_t piece = urgent->request.number;
            images.take(piece, std::vector<uint32_t>(pieces_->texelsOf(pieces_->piece(piece)), uint32_t(piece)));
            EXPECT_LE(images.shown()->bytes(), images.mostBytes());
            ++delivered;
        }
        return delivered;
    }
    [[nodiscard]] static std::vector<uint32_t> finest(const ImageResidency& images) {
        std::vector<uint32_t> finest;
        for (const ImageSet::Image& image : images.shown()->images()) finest.push_back(image.finest);
        return finest;
    }

    /// Whether the first tile of a piece is shown.
    [[nodiscard]] bool isThere(const ImageResidency& images, uint64_t number) const {
        const ImagePiece piece = pieces_->piece(number);
        const auto place = pieces_->placeOf(piece, 0);
        const ImageSet::Level& level = images.shown()->images()[piece.image].levels[place.level];
        return level.tiles[place.tile.y * level.tilesX + place.tile.x] != nullptr;
    }
    /// How many tiles of a level are shown.
    [[nodiscard]] static int64_t tilesShown(const ImageResidency& images, uint32_t image, uint32_t level) {
        const auto& tiles = images.shown()->images()[image].levels[level].tiles;
        return int64_t(tiles.size()) - std::count(tiles.begin(), tiles.end(), nullptr);
    }

    test::AnalyticDataset made_;
    std::shared_ptr<const ImagePieces> pieces_;
};

constexpr uint64_t kAll = 4 * (1024 * 1024 + 512 * 512 + 256 * 256) * 4 / 3;

TEST_F(ImageResidencyTest, NothingIsReadThatNoPageShows) {
    ImageResidency images(pieces_, kAll);
    look(images, pixelsOf(1));
    EXPECT_TRUE(images.wishes().empty());
    EXPECT_TRUE(images.isComplete());
    EXPECT_EQ(images.shown()->bytes(), 0u);
}

TEST_F(ImageResidencyTest, LevelsAreAsFineAsPixels) {
    ImageResidency images(pieces_, kAll);
    images.learn(0, {need(0, 8.0f), need(2, 1.0f)});
    // 8 texels a cell, half a pixel wide: from 16 cells a pixel on, 64 texels are one, which is level 6.
    look(images, pixelsOf(16.1));
    EXPECT_FALSE(images.wishes().empty());
    EXPECT_FALSE(images.isComplete());
    EXPECT_GT(settle(images), 0u);
    EXPECT_TRUE(images.isComplete());
    EXPECT_EQ(finest(images), (std::vector<uint32_t>{4, 10, 2})) << "what has at most 64 texels comes as one";
    // Nearer, finer ones come, and stay.
    look(images, pixelsOf(1.01));
    settle(images);
    EXPECT_EQ(finest(images), (std::vector<uint32_t>{2, 10, 0}));
    look(images, pixelsOf(16.1));
    EXPECT_EQ(settle(images), 0u);
    EXPECT_TRUE(images.isComplete());
    EXPECT_EQ(finest(images), (std::vector<uint32_t>{2, 10, 0}));
}

TEST_F(ImageResidencyTest, CoarseLevelsOfAllImagesComeFirst) {
    ImageResidency images(pieces_, kAll);
    images.learn(0, {need(0, 0.0f), need(1, 0.0f), need(2, 0.0f)});
    look(images, pixelsOf(1));
    EXPECT_EQ(settle(images, 3), 3u);
    static_cast<void>(images.wishes());
    EXPECT_EQ(finest(images), (std::vector<uint32_t>{4, 3, 2})) << "a tile each";
}

TEST_F(ImageResidencyTest, AreCopiedFourTimesAtMost) {
    ImageResidency images(pieces_, kAll);
    images.learn(0, {need(0, 0.0f), need(1, 0.0f), need(2, 0.0f)});
    look(images, pixelsOf(1));
    uint64_t copied = 0, version = 0;
    while (settle(images, 1) > 0) {
        if (images.version() == version) continue;
        version = images.version();
        copied += images.shown()->bytes();
    }
    EXPECT_EQ(finest(images), (std::vector<uint32_t>{0, 0, 0}));
    EXPECT_LE(copied, 4 * images.shown()->bytes());
}

TEST_F(ImageResidencyTest, MemoryGoesToWhatIsSeen) {
    const uint64_t most = 4 * 1024 * 1024 * 4 / 3 + 4 * 64 * 64;
    ImageResidency images(pieces_, most);
    images.learn(0, {need(0, 0.0f)});
    look(images, pixelsOf(1));
    settle(images);
    EXPECT_EQ(finest(images)[0], 0u);
    // What is not needed any more makes room, as far as that is lacking.
    images.learn(0, {need(0, 64.0f), need(1, 0.0f)});
    look(images, pixelsOf(1.01));
    settle(images);
    EXPECT_TRUE(images.isComplete());
    EXPECT_FALSE(images.isLimited());
    EXPECT_EQ(finest(images), (std::vector<uint32_t>{0, 0, 9}));
    EXPECT_EQ(tilesShown(images, 0, 0), 128) << "half of the level had to go";
    // Where all that is seen has no room, something of the finest levels is left out.
    images.learn(0, {need(0, 0.0f), need(1, 0.0f), need(2, 0.0f)});
    look(images, pixelsOf(1.02));
    settle(images);
    EXPECT_TRUE(images.isComplete());
    EXPECT_TRUE(images.isLimited());
    EXPECT_EQ(finest(images), (std::vector<uint32_t>{0, 1, 1}));
    EXPECT_EQ(tilesShown(images, 0, 0), 192);
    EXPECT_EQ(settle(images), 0u);
}

TEST_F(ImageResidencyTest, WhereMemoryLacksAllIsCoarserByAsMuch) {
    // Slices of the page show each image, from 2 to 4 cells a pixel.
    std::vector<ImageNeed> slices;
    for (uint32_t image = 0; image < 3; ++image)
        for (uint16_t i = 0; i < 16; ++i) {
            slices.push_back({image, 0.4f, {}, glm::vec3(0, 0, 4 * i), glm::vec3(64, 64, 4 * i + 4)});
            for (uint16_t block = 0; block < 256; ++block)
                if (block % blocksAcross(pieces_->tables().images[image]) == i) slices.back().blocks.push_back(block);
        }
    const SelectionView view = pixelsOf(2);
    for (uint64_t most = kAll; most > 1 << 14; most = most * 2 / 3) {
        SCOPED_TRACE(most);
        ImageResidency images(pieces_, most);
        images.learn(0, slices);
        look(images, view);
        settle(images);
        EXPECT_TRUE(images.isComplete());
        const std::vector<float> needs = images.needsOn(made_.dataset, view, {0});
        float leastThere = 100, mostMissing = 0;
        for (uint64_t piece = 0; piece < needs.size(); ++piece)
            if (isThere(images, piece))
                leastThere = std::min(leastThere, needs[piece]);
            else
                mostMissing = std::max(mostMissing, needs[piece]);
        EXPECT_EQ(images.isLimited(), mostMissing > 0);
        EXPECT_GE(leastThere, mostMissing - 0.25f);
        EXPECT_GT(leastThere, 0.0f);
    }
}

TEST_F(ImageResidencyTest, WhatIsNotInViewAnyMoreIsNotRead) {
    ImageResidency images(pieces_, kAll);
    images.learn(0, {need(0, 0.0f)});
    look(images, pixelsOf(1));
    EXPECT_FALSE(images.wishes().empty());
    settle(images, 2);
    const auto there = images.shown()->bytes();
    SelectionView away = pixelsOf(1.01);
    away.planes[0] = {0, 0, 0, -1};
    look(images, away);
    EXPECT_TRUE(images.wishes().empty());
    EXPECT_TRUE(images.isComplete());
    EXPECT_GE(images.shown()->bytes(), there) << "what came stays";
    look(images, pixelsOf(1.02));
    EXPECT_FALSE(images.wishes().empty());
}

TEST_F(ImageResidencyTest, OnlyThePartsThatAreSeenAreRead) {
    // A piece is half of the image across; the other levels are read as a whole.
    const auto corner = [&](uint16_t block) { return ImageNeed{0, 0.0f, {block}, glm::vec3(0), glm::vec3(64)}; };
    ImageResidency images(pieces_, 4 * 4 * 512 * 512);
    const auto isThere = [&](uint32_t column, uint32_t row) {
        return images.shown()->images()[0].levels[0].tileOf(column, row) != nullptr;
    };
    images.learn(0, {corner(0)});
    look(images, pixelsOf(1));
    settle(images);
    EXPECT_TRUE(isThere(0, 0) && isThere(511, 511));
    EXPECT_EQ(tilesShown(images, 0, 0), 64);
    EXPECT_EQ(tilesShown(images, 0, 1), 64);
    images.learn(0, {corner(15)});
    look(images, pixelsOf(1.01));
    EXPECT_EQ(settle(images), 1u);
    EXPECT_TRUE(isThere(1023, 0) && isThere(0, 0)) << "there is room for two, with the coarser levels";
    // What was seen before that goes, and nothing else: an eighth is free then.
    images.learn(0, {corner(255)});
    look(images, pixelsOf(1.02));
    EXPECT_EQ(settle(images), 1u);
    EXPECT_TRUE(isThere(1023, 1023) && isThere(1023, 0) && !isThere(0, 0));
    EXPECT_FALSE(images.isLimited());
}

TEST_F(ImageResidencyTest, APartOfAPageIsSeenByItself) {
    // Both show all of the image. One is far behind the other, and the third is not in view.
    ImageResidency images(pieces_, kAll);
    ImageNeed near = need(0, 8.0f), far = need(1, 8.0f), beside = need(2, 8.0f);
    near.high.z = 1;
    far.low.z = 62;
    beside.low.x = 50;
    images.learn(0, {near, far, beside});
    SelectionView view = pixelsOf(2.01);
    const Dataset& dataset = made_.dataset;
    const double edge = dataset.originOf(dataset.pages[0]).x + 40 * dataset.cellOf(0) - view.eye.x;
    view.planes[0] = {-1, 0, 0, edge};
    look(images, view);
    settle(images);
    // A pixel is two cells wide in front, and nearly four behind.
    EXPECT_EQ(finest(images), (std::vector<uint32_t>{3, 3, 9}));
    EXPECT_TRUE(images.isComplete());
}

TEST_F(ImageResidencyTest, EveryViewHasWhatItNeeds) {
    ImageResidency images(pieces_, kAll);
    images.learn(0, {need(0, 8.0f)});
    look(images, pixelsOf(16.1), 3);
    look(images, pixelsOf(1.01), 7);
    settle(images);
    EXPECT_EQ(finest(images)[0], 2u);
    images.forgetView(7);
    look(images, pixelsOf(32.1), 3);
    EXPECT_EQ(settle(images), 0u);
    EXPECT_TRUE(images.isComplete(3));
}

TEST_F(ImageResidencyTest, WhatCannotBeReadIsLeftOut) {
    ImageResidency images(pieces_, kAll);
    images.learn(0, {need(0, 0.0f), need(1, 0.0f)});
    look(images, pixelsOf(1));
    static_cast<void>(images.wishes());
    images.giveUp(pieces_->piecesOf(0, 1).first);
    images.giveUp(pieces_->piecesOf(1, 8).first);
    settle(images);
    EXPECT_TRUE(images.isComplete());
    EXPECT_EQ(finest(images), (std::vector<uint32_t>{0, 10, 9})) << "the others have 10 and 9 levels";
    EXPECT_EQ(tilesShown(images, 0, 1), 0);
    EXPECT_EQ(tilesShown(images, 0, 0), 256) << "a finer level does without";
}

}  // namespace
}  // namespace vcp
