// Images in pieces: each tile is in one, and whatever order they come in, whole levels show what was stored.
#include "octree/image/image_pieces.h"

#include <algorithm>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "octree/dataset_reader.h"
#include "octree/image/image_assembly.h"
#include "tests/support/image_file.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

class Pieces : public ::testing::Test {
protected:
    void SetUp() override {
        for (const auto& [width, height] : {std::pair(700u, 1100u), std::pair(70u, 2u), std::pair(1u, 1u)})
            images_.push_back(test::randomImage(width, height, width));
        test::StoredImages stored;
        for (const test::LevelledImage& image : images_) stored.add(image);
        images_.push_back(test::randomImage(1100, 700, 4));
        stored.add(images_.back(), kMixedTiles);
        stored.tables.materials = {{}};
        test::writeImageFile(folder_ / "images.vcp", stored);
        file_ = *openFile(folder_ / "images.vcp");
        pieces_ = *ImagePieces::read(*file_, readDataset(*file_)->header.images);
    }
    void take(ImageAssembly& assembly, uint64_t piece) const {
        assembly.take(piece, *pieces_->readPiece(*file_, piece));
    }
    /// Expects the levels that are shown to be those that were stored.
    void expectStored(const ImageSet& set) const {
        for (size_t i = 0; i < images_.size(); ++i) {
            const ImageSet::Image& image = set.images()[i];
            ASSERT_EQ(image.finest + image.levels.size(), images_[i].levels.size());
            for (size_t l = 0; l < image.levels.size(); ++l) {
                const auto& texels = images_[i].levels[image.finest + l];
                EXPECT_EQ(image.levels[l].bytes(), texels.size() * sizeof(uint32_t));
                EXPECT_TRUE(std::equal(texels.begin(), texels.end(), image.levels[l].texels.get())) << i << ' ' << l;
            }
        }
    }

    TestFolder folder_{"vcp_image_pieces"};
    std::vector<test::LevelledImage> images_;
    std::shared_ptr<const ByteReader> file_;
    std::shared_ptr<const ImagePieces> pieces_;
};

TEST_F(Pieces, EachTileIsInOne) {
    uint64_t tile = 0;
    for (uint64_t number = 0; number < pieces_->count(); ++number) {
        const ImagePiece piece = pieces_->piece(number);
        EXPECT_EQ(piece.firstTile, tile);
        EXPECT_LE(pieces_->texelsOf(piece), kPieceTexels);
        EXPECT_EQ(pieces_->texelsOf(piece), pieces_->readPiece(*file_, number)->size());
        const auto [first, end] = pieces_->piecesOf(piece.image, piece.level);
        EXPECT_TRUE(first <= number && number < end);
        tile += piece.tiles;
    }
    EXPECT_EQ(tile, pieces_->tables().tiles.size());
    // 11 x 18 tiles, 6 x 9, 3 x 5, 2 x 3; then 43 x 68, which is two tiles, and below it a tile each.
    EXPECT_EQ(pieces_->piecesOf(0, 0).end - pieces_->piecesOf(0, 0).first, 4u);
    EXPECT_EQ(pieces_->piecesOf(0, 1).end - pieces_->piecesOf(0, 1).first, 1u);
    EXPECT_EQ(pieces_->firstLevel(0), 5u);
    EXPECT_EQ(pieces_->piecesOf(0, 5).first, 0u);
    EXPECT_EQ(pieces_->piecesOf(0, 10).first, 0u);
    EXPECT_EQ(pieces_->firstLevel(1), 1u);
    EXPECT_EQ(pieces_->firstLevel(2), 0u);
    // There are 5 x 3 larger tiles, then 3 x 2; then 275 x 175 is two tiles, and what is below it a tile each.
    EXPECT_EQ(pieces_->piecesOf(3, 0).end - pieces_->piecesOf(3, 0).first, 4u);
    EXPECT_EQ(pieces_->piecesOf(3, 1).end - pieces_->piecesOf(3, 1).first, 2u);
    EXPECT_EQ(pieces_->piecesOf(3, 3).end - pieces_->piecesOf(3, 3).first, 1u);
    EXPECT_EQ(pieces_->firstLevel(3), 5u);
}

TEST_F(Pieces, AreWholeLevelsInAnyOrder) {
    std::vector<uint64_t> order(pieces_->count());
    std::iota(order.begin(), order.end(), 0);
    for (uint32_t seed = 0; seed < 8; ++seed) {
        std::shuffle(order.begin(), order.end(), std::mt19937(seed));
        ImageAssembly assembly(pieces_);
        EXPECT_EQ(assembly.set().bytes(), 0u);
        for (const uint64_t piece : order) {
            EXPECT_FALSE(assembly.has(piece));
            take(assembly, piece);
            EXPECT_TRUE(assembly.has(piece));
            expectStored(assembly.set());
        }
        for (const ImageSet::Image& image : assembly.set().images()) EXPECT_EQ(image.finest, 0u);
    }
}

TEST_F(Pieces, OfDroppedLevelsComeAgain) {
    ImageAssembly assembly(pieces_);
    for (uint64_t piece = 0; piece < pieces_->count(); ++piece) take(assembly, piece);
    const ImageSet before = assembly.set();
    assembly.drop(0, 2);
    EXPECT_EQ(assembly.set().images()[0].finest, 2u);
    EXPECT_FALSE(assembly.has(pieces_->piecesOf(0, 1).first));
    EXPECT_TRUE(assembly.has(pieces_->piecesOf(0, 2).first));
    expectStored(assembly.set());
    // Some of the first piece's levels stay.
    assembly.drop(0, 8);
    EXPECT_FALSE(assembly.has(0));
    expectStored(assembly.set());
    for (uint64_t piece = 0; piece < pieces_->count(); ++piece) take(assembly, piece);
    expectStored(assembly.set());
    EXPECT_EQ(assembly.set().bytes(), before.bytes());
    expectStored(before);
}

}  // namespace
}  // namespace vcp
