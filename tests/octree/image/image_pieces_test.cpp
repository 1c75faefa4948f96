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
    /// Expects the tiles of the pieces that are there to be those that were stored, and no others.
    void expectStored(const ImageAssembly& assembly) const {
        uint64_t bytes = 0;
        for (uint32_t i = 0; i < images_.size(); ++i)
            for (uint32_t l = 0; l < images_[i].levels.size(); ++l) {
                const ImageSet::Level& level = assembly.set().images()[i].levels[l];
                for (uint32_t y = 0; y < level.height; ++y)
                    for (uint32_t x = 0; x < level.width; ++x) {
                        const uint32_t* const tile = level.tileOf(x, y);
                        const glm::uvec2 place(x >> level.log2Edge, y >> level.log2Edge);
                        ASSERT_EQ(tile != nullptr, assembly.has(pieces_->pieceOf(i, l, place)));
                        if (tile == nullptr) continue;
                        ASSERT_EQ(tile[level.placeInTile(x, y)], images_[i].levels[l][size_t{y} * level.width + x]);
                        bytes += sizeof(uint32_t);
                    }
            }
        EXPECT_EQ(assembly.set().bytes(), bytes);
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

TEST_F(Pieces, ComeInAnyOrder) {
    std::vector<uint64_t> order(pieces_->count());
    std::iota(order.begin(), order.end(), 0);
    for (uint32_t seed = 0; seed < 4; ++seed) {
        std::shuffle(order.begin(), order.end(), std::mt19937(seed));
        ImageAssembly assembly(pieces_);
        EXPECT_EQ(assembly.set().bytes(), 0u);
        for (const uint64_t piece : order) {
            EXPECT_FALSE(assembly.has(piece));
            take(assembly, piece);
            EXPECT_TRUE(assembly.has(piece));
            if (piece % 8 == seed) expectStored(assembly);
        }
        expectStored(assembly);
        for (const ImageSet::Image& image : assembly.set().images()) EXPECT_EQ(image.finest, 0u);
    }
}

TEST_F(Pieces, GoAndComeAgain) {
    ImageAssembly assembly(pieces_);
    for (uint64_t piece = 0; piece < pieces_->count(); ++piece) take(assembly, piece);
    const ImageSet before = assembly.set();
    const auto [first, end] = pieces_->piecesOf(0, 0);
    for (uint64_t piece = first; piece < end; ++piece) {
        EXPECT_EQ(assembly.set().images()[0].finest, 0u);
        assembly.drop(piece);
        assembly.drop(piece);
        expectStored(assembly);
    }
    EXPECT_EQ(assembly.set().images()[0].finest, 1u);
    assembly.drop(0);
    EXPECT_FALSE(assembly.set().images()[0].isShown());
    EXPECT_TRUE(assembly.set().images()[1].isShown());
    expectStored(assembly);
    for (uint64_t piece = 0; piece < pieces_->count(); ++piece) take(assembly, piece);
    expectStored(assembly);
    EXPECT_EQ(assembly.set().bytes(), before.bytes());
    EXPECT_EQ(test::texelsOf(before.images()[0].levels[0]), images_[0].levels[0]) << "copies keep what they have";
}

TEST_F(Pieces, ShrinkBytesFinestFirst) {
    const ImageSet all = *readAllImages(*file_, pieces_);
    EXPECT_EQ(all.bytes(), pieces_->bytes());
    for (uint64_t most = all.bytes() + 4; most > 0; most /= 3) {
        ImageSet some = all;
        some.shrinkTo(most);
        EXPECT_LE(some.bytes(), most);
        EXPECT_GT(some.bytes() + 4 * 256 * 256, std::min(most, all.bytes())) << "a tile more has no room";
        uint32_t finest = 100, coarsest = 0;  // level that something is there of, and that lacks something
        for (const ImageSet::Image& image : some.images())
            for (uint32_t l = 0; l < image.levels.size(); ++l) {
                if (image.levels[l].there > 0) finest = std::min(finest, l);
                if (image.levels[l].there < image.levels[l].tiles.size()) coarsest = std::max(coarsest, l);
            }
        EXPECT_LE(coarsest, finest);
    }
}

}  // namespace
}  // namespace vcp
