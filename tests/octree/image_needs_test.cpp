// Which pieces of images a page needs: with these alone, every footprint on its triangles reads what it reads with all.
#include "octree/image_needs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "octree/dataset_reader.h"
#include "octree/image/image_filter.h"
#include "octree/imaged_triangle.h"
#include "octree/page/page_triangles.h"
#include "tests/support/image_file.h"
#include "tests/support/soup_page.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

constexpr double kUnit = 1 << -kLog2TextureUnit;

class ImageNeeds : public ::testing::Test {
protected:
    void SetUp() override {
        test::StoredImages stored;
        stored.add(test::randomImage(1900, 1300, 1), kMixedTiles);
        stored.add(test::randomImage(700, 1100, 2), kLosslessTiles);
        stored.tables.materials = {{0}, {1, ~0u, ImageWrap::Mirror, ImageWrap::Clamp}, {0, ~0u, ImageWrap::Clamp}};
        test::writeImageFile(folder_ / "images.vcp", stored);
        file_ = *openFile(folder_ / "images.vcp");
        pieces_ = *ImagePieces::read(*file_, readDataset(*file_)->header.images);
        for (uint64_t piece = 0; piece < pieces_->count(); ++piece)
            texels_.push_back(*pieces_->readPiece(*file_, piece));
    }

    /// Gives the vertices of a page places about (`middle`, `middle`), at most `reach` away, all in one material.
    static std::vector<TexturePoint> points(const PageView& page, uint32_t material, double middle, double reach,
                                            std::mt19937& random) {
        std::vector<TexturePoint> points;
        const auto any = [&] {
            return int32_t(kUnit * (middle + reach * (2 * double(random()) / double(std::mt19937::max()) - 1)));
        };
        for (uint32_t i = 0; i < page.header.vertices; ++i) points.push_back({any(), any(), material});
        return points;
    }
    /// A sheet whose vertices have such places, in material 1.
    struct Placed {
        Placed(const test::SoupPage& sheet, double middle, double reach) : whole(test::SoupPage(sheet).build(1)) {
            place(middle, reach);
        }
        void place(double middle, double reach) {
            places = points(whole.view(), 1, middle, reach, random);
            page = whole.view();
            page.points = places;
        }

        test::WholePage whole;
        std::mt19937 random{1};
        std::vector<TexturePoint> places;
        PageView page{};
    };
    [[nodiscard]] ImageSet setOf(const std::vector<bool>& has) const {
        ImageAssembly assembly(pieces_);
        for (uint64_t piece = 0; piece < has.size(); ++piece)
            if (has[piece]) assembly.take(piece, texels_[piece]);
        return assembly.set();
    }

    TestFolder folder_{"vcp_image_needs"};
    std::shared_ptr<const ByteReader> file_;
    std::shared_ptr<const ImagePieces> pieces_;
    std::vector<std::vector<uint32_t>> texels_;  // of each piece
};

TEST_F(ImageNeeds, AreAllThatFootprintsRead) {
    const test::WholePage whole = test::sheet(1, 2, 3, 5).build(1);
    const ImageSet all = setOf(std::vector<bool>(pieces_->count(), true));
    uint64_t left = 0;
    for (uint32_t seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const auto number = [&](double low, double high) {
            return low + (high - low) * double(random()) / double(std::mt19937::max());
        };
        PageView page = whole.view();
        const auto places = points(page, 1 + seed % 3, number(-2, 3), std::exp2(number(-7, 0.5)), random);
        page.points = places;
        const auto needs = imageNeeds(pieces_->tables(), page);
        ASSERT_GE(needs.size(), 1u);
        const uint32_t image = needs[0].image, finest = seed % 5;
        std::vector<bool> has(pieces_->count());
        for (uint32_t level = finest; level < pieces_->levelsOf(image).size(); ++level)
            for (const ImageNeed& need : needs)
                for (const uint32_t piece : piecesNeeded(*pieces_, need, level)) has[piece] = true;
        left += uint64_t(std::count(has.begin(), has.end(), false));
        const ImageSet some = setOf(has);
        forEachTriangle(page, [&](const Index3& corners) {
            const auto there = imagedTriangle(all, page, corners), here = imagedTriangle(some, page, corners);
            ASSERT_TRUE(there && here);
            for (int i = 0; i < 8; ++i) {
                const auto b = float(number(0, 1)), c = float(number(0, 1 - double(b)));
                // As wide as the finest level's texels, at least, wherever it is read.
                f32::ImageFootprint footprint;
                footprint.shortAxis = float(std::exp2(finest + number(0, 3)));
                footprint.longAxis = footprint.shortAxis * float(std::exp2(number(0, 3)));
                const double angle = number(0, 6.28);
                footprint.along = footprint.longAxis * glm::vec2(std::cos(angle) / double(there->image->width),
                                                                 std::sin(angle) / double(there->image->height));
                const glm::vec4 wanted =
                    filteredColour(*there->image, there->wraps, there->at(b, c), placesOf(*there->image, footprint));
                ASSERT_EQ(filteredColour(*here->image, here->wraps, here->at(b, c), placesOf(*here->image, footprint)),
                          wanted);
            }
        });
    }
    EXPECT_GT(left, 60 * pieces_->count() / 2) << "most pieces are of the other image, or elsewhere";
}

TEST_F(ImageNeeds, ChannelsAreNeededWhereTheColourIs) {
    const Placed sheet(test::sheet(1, 2, 3, 5), 0.4, 0.1);
    ImageTables tables = pieces_->tables();
    ASSERT_EQ(imageNeeds(tables, sheet.page).size(),
              size_t(std::ranges::count_if(imageNeeds(tables, sheet.page),
                                           [](const ImageNeed& need) { return need.image == 0; })));
    tables.channels.resize(tables.materials.size());
    tables.channels[0] = {.isGiven = 1, .normals = 2, .roughness = 1};
    float colour = std::numeric_limits<float>::infinity(), normals = colour;
    for (const ImageNeed& need : imageNeeds(tables, sheet.page)) {
        float& least = need.image == 0 ? colour : normals;
        least = std::min(least, need.texelsPerCell);
        EXPECT_FALSE(need.blocks.empty());
    }
    // The image of normals is 700 x 1100 texels, that of the colour 1900 x 1300.
    EXPECT_GT(normals, colour * 0.3f);
    EXPECT_LT(normals, colour);
}

TEST_F(ImageNeeds, WhatIsNotThereIsSeenInACoarserLevel) {
    std::vector<bool> has(pieces_->count(), true);
    const auto [first, end] = pieces_->piecesOf(0, 0);
    has[pieces_->pieceOf(0, 0, {1, 1})] = false;
    const ImageSet some = setOf(has), all = setOf(std::vector<bool>(pieces_->count(), true));
    ASSERT_EQ(some.images()[0].finest, 0u);
    EXPECT_GT(end - first, 4u);
    const ImageSet::Image &here = some.images()[0], &there = all.images()[0];
    const auto at = [](double x, double y) { return glm::vec2(x / 1900, y / 1300); };
    const auto places = placesOf(here, {{0, 0}, 1, 1});
    ImagePlaces coarser = places;
    coarser.level = 1;
    EXPECT_EQ(filteredColour(here, {}, at(300, 300), places), filteredColour(there, {}, at(300, 300), coarser));
    EXPECT_EQ(filteredColour(here, {}, at(255.9, 300), places), filteredColour(there, {}, at(255.9, 300), coarser))
        << "one of four texels is not there";
    EXPECT_EQ(filteredColour(here, {}, at(1200, 300), places), filteredColour(there, {}, at(1200, 300), places));
    // Without its coarsest level, nothing is shown of an image.
    has[0] = false;
    EXPECT_FALSE(setOf(has).images()[0].isShown());
    EXPECT_TRUE(setOf(has).images()[1].isShown());
}

TEST_F(ImageNeeds, OfASmallPartAreSmall) {
    Placed sheet(test::sheet(1, 2, 3, 5), 0.3, 0.001);
    // 1900 texels are 16 blocks across, of which four may meet there.
    EXPECT_EQ(blocksAcross(pieces_->tables().images[0]), 16u);
    for (const ImageNeed& need : imageNeeds(pieces_->tables(), sheet.page)) {
        EXPECT_LE(need.blocks.size(), 4u);
        EXPECT_LE(piecesNeeded(*pieces_, need, 0).size(), 2u);
    }
    // Twice around is all of it.
    sheet.place(0, 1.2);
    std::set<uint16_t> all;
    for (const ImageNeed& need : imageNeeds(pieces_->tables(), sheet.page))
        all.insert(need.blocks.begin(), need.blocks.end());
    EXPECT_EQ(all.size(), 256u);
}

TEST_F(ImageNeeds, EachTriangleIsInOneAsWideAndAsFine) {
    const Placed sheet(test::sheet(3, 3, 3, 12), 0.5, 0.3);
    const PageView& page = sheet.page;
    const auto needs = imageNeeds(pieces_->tables(), page);
    EXPECT_GT(needs.size(), 4u);
    forEachTriangle(page, [&](const Index3& corners) {
        const auto p = cornersOf(page, corners);
        const auto isWithin = [&](const ImageNeed& need) {
            for (const glm::vec3& corner : p)
                if (glm::any(glm::lessThan(corner, need.low)) || glm::any(glm::greaterThan(corner, need.high)))
                    return false;
            for (const uint32_t corner : corners) {
                const TexturePoint& at = page.points[corner];
                const auto block = uint16_t(int(at.v / kUnit * 16) * 16 + int(at.u / kUnit * 16));
                if (!std::binary_search(need.blocks.begin(), need.blocks.end(), block)) return false;
            }
            return true;
        };
        EXPECT_TRUE(std::any_of(needs.begin(), needs.end(), isWithin));
    });
}

}  // namespace
}  // namespace vcp
