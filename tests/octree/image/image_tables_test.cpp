// The section of images: what is written is read back; every truncation and every wrong bit is found; lies behind
// right hashes are refused in one line that names the image, the material or the tile, and the byte.
#include "octree/image/image_tables.h"

#include <algorithm>
#include <cstring>
#include <set>

#include <gtest/gtest.h>

#include "octree/dataset_reader.h"
#include "octree/image/image_set.h"
#include "octree/vcp_verify.h"
#include "tests/support/image_file.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

using test::LevelledImage, test::StoredImages;

class TableFile final : public ByteReader {
public:
    explicit TableFile(std::vector<std::byte> content) : bytes(std::move(content)) {}
    Result<void> read(uint64_t offset, std::span<std::byte> out) const override {
        if (offset > bytes.size() || out.size() > bytes.size() - offset)
            return Error{.code = ErrorCode::Io, .message = "read past the end", .file = name_};
        std::copy_n(bytes.begin() + static_cast<ptrdiff_t>(offset), out.size(), out.begin());
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return bytes.size(); }
    [[nodiscard]] const std::string& name() const override { return name_; }
    std::vector<std::byte> bytes;

private:
    std::string name_ = "memory.vcp";
};

TEST(ImageLevels, HalveDownToATexel) {
    const auto levels = imageLevels(300, 70, 5);
    ASSERT_EQ(levels.size(), 9u);
    EXPECT_EQ(levels[1].width, 150u);
    EXPECT_EQ(levels[1].height, 35u);
    EXPECT_EQ(levels[7].height, 1u);
    EXPECT_EQ(levels[8].width, 1u);
    EXPECT_EQ(levels[8].firstTile, 5u) << "the coarsest comes first";
    EXPECT_EQ(levels[0].tiles(), 10u);
    EXPECT_EQ(levels[0].firstTile + levels[0].tiles(), 5 + tilesOf(levels));
    EXPECT_EQ(levels[0].sizeOf({4, 1}), glm::uvec2(44, 6));
    const auto order = tileOrder(levels[0]);
    EXPECT_EQ(order.size(), 10u);
    EXPECT_EQ(order[1], glm::uvec2(1, 0));
    EXPECT_EQ(order[2], glm::uvec2(0, 1));
    EXPECT_EQ(order[4], glm::uvec2(2, 0));
    std::set<std::pair<uint32_t, uint32_t>> all;
    for (const glm::uvec2 tile : order) all.emplace(tile.x, tile.y);
    EXPECT_EQ(all.size(), 10u);
}

class ImageFile : public ::testing::Test {
protected:
    void SetUp() override {
        for (const auto& [width, height] : {std::pair(5u, 3u), std::pair(70u, 2u), std::pair(1u, 1u)})
            images_.push_back(test::randomImage(width, height, width));
        for (const LevelledImage& image : images_) stored_.add(image, image.width == 70 ? kMixedTiles : kLosslessTiles);
        stored_.tables.materials = {{.image = 0},
                                    {.image = 2, .factor = 0xff102030, .wrapU = ImageWrap::Clamp},
                                    {.image = 1, .wrapV = ImageWrap::Mirror}};
        test::writeImageFile(folder_ / "images.vcp", stored_);
        if (HasFatalFailure()) return;
        const std::string text = contentOf(folder_ / "images.vcp");
        bytes_.resize(text.size());
        std::memcpy(bytes_.data(), text.data(), text.size());
    }
    [[nodiscard]] ImagesPlace place() const {
        FileHeader header;
        std::memcpy(static_cast<void*>(&header), bytes_.data(), sizeof header);
        return header.images;
    }
    /// Changes a byte of the tables, gives them their hash again, and expects one line with `words` and the byte.
    void expectRefused(uint64_t byte, uint8_t value, const std::string& words) const {
        TableFile file(bytes_);
        ImagesPlace place = this->place();
        const uint64_t at = place.offset + byte;
        ASSERT_NE(file.bytes[at], std::byte{value}) << words;
        file.bytes[at] = std::byte{value};
        place.hash = hashBytes(std::span(file.bytes).subspan(place.offset, stored_.tables.bytes()));
        const auto tables = readImageTables(file, place);
        ASSERT_FALSE(tables.ok()) << words;
        const std::string line = tables.error().line();
        EXPECT_NE(line.find(words), std::string::npos) << line;
        EXPECT_EQ(line.find('\n'), std::string::npos);
        EXPECT_TRUE(tables.error().byte.has_value());
        EXPECT_EQ(tables.error().file, "memory.vcp");
    }

    TestFolder folder_{"vcp_images"};
    std::vector<LevelledImage> images_;
    StoredImages stored_;
    std::vector<std::byte> bytes_;
};

TEST_F(ImageFile, IsReadBack) {
    const TableFile file(bytes_);
    ASSERT_TRUE(verifyFile(file).ok()) << verifyFile(file).error().line();
    const auto dataset = readDataset(file);
    ASSERT_TRUE(dataset.ok());
    EXPECT_EQ(dataset->header.version, kImagesFileVersion);
    EXPECT_TRUE(dataset->hasImages());
    const auto set = readAllImages(file, dataset->header.images);
    ASSERT_TRUE(set.ok()) << set.error().line();
    ASSERT_EQ(set->images().size(), images_.size());
    for (size_t i = 0; i < images_.size(); ++i) {
        const ImageSet::Image& image = set->images()[i];
        ASSERT_EQ(image.levels.size(), images_[i].levels.size());
        for (size_t l = 0; l < image.levels.size(); ++l) {
            const auto& texels = images_[i].levels[l];
            EXPECT_EQ(test::texelsOf(image.levels[l]), texels);
        }
    }
    ASSERT_EQ(set->materials().size(), 3u);
    EXPECT_EQ(set->materials()[1].factor, 0xff102030u);
    EXPECT_EQ(set->materials()[1].wrapU, ImageWrap::Clamp);
    EXPECT_EQ(set->materials()[2].wrapV, ImageWrap::Mirror);
}

TEST_F(ImageFile, EveryTruncationIsFound) {
    for (size_t bytes = 0; bytes < bytes_.size(); ++bytes) {
        const TableFile file({bytes_.begin(), bytes_.begin() + std::ptrdiff_t(bytes)});
        ASSERT_FALSE(verifyFile(file).ok()) << bytes;
    }
}

TEST_F(ImageFile, EveryBitFlipIsFound) {
    TableFile file(bytes_);
    for (size_t bit = 0; bit < 8 * bytes_.size(); ++bit) {
        // A few bits of the padding within the header stand for all.
        if (bit / 8 >= sizeof(FileHeader) && bit / 8 < place().offset && bit % 64 != 3) continue;
        file.bytes[bit / 8] ^= std::byte{1} << int(bit % 8);
        ASSERT_FALSE(verifyFile(file).ok()) << bit;
        file.bytes[bit / 8] = bytes_[bit / 8];
    }
}

TEST_F(ImageFile, AWrongTileIsNamed) {
    TableFile file(bytes_);
    const uint64_t first = place().offset + stored_.tables.bytes();
    file.bytes[first] ^= std::byte{1};
    const auto verified = verifyFile(file);
    ASSERT_FALSE(verified.ok());
    EXPECT_NE(verified.error().line().find("tile 0: byte " + std::to_string(first)), std::string::npos)
        << verified.error().line();
    EXPECT_FALSE(readAllImages(file, place()).ok());
}

TEST_F(ImageFile, LiesBehindTheRightHashAreRefused) {
    constexpr uint64_t kImage = sizeof(ImageRow), kMaterials = 3 * kImage, kMaterial = sizeof(MaterialRow),
                       kTiles = kMaterials + 3 * kMaterial;
    expectRefused(0, 0, "image 0: byte");  // no width
    expectRefused(offsetof(ImageRow, width) + 3, 1, "its size is out of range");
    expectRefused(offsetof(ImageRow, height) + 2, 200, "its size is out of range");
    expectRefused(kImage + offsetof(ImageRow, levels), 6, "its levels do not suit its size");
    expectRefused(offsetof(ImageRow, coding), 9, "its coding is not known");
    expectRefused(kImage + offsetof(ImageRow, firstTile), 0, "its first tile is another image's");
    expectRefused(kMaterials + offsetof(MaterialRow, image), 3, "names an image that there is not");
    expectRefused(kMaterials + kMaterial + offsetof(MaterialRow, wrapV), 3, "its wrap modes are not known");
    expectRefused(kMaterials + offsetof(MaterialRow, reserved) + 5, 1, "reserved bytes must be zero");
    expectRefused(kTiles + offsetof(TileRow, offset) + 1, 255, "its bytes are out of range");
    expectRefused(kTiles + offsetof(TileRow, storedBytes) + 3, 255, "tile 0: byte");
    expectRefused(kTiles + offsetof(TileRow, reserved), 1, "reserved bytes must be zero");
}

/// The same file with channels: the first material has all, the second none, the third emission alone.
class ChannelFile : public ImageFile {
protected:
    void SetUp() override {
        for (const auto& [width, height] : {std::pair(5u, 3u), std::pair(70u, 2u), std::pair(1u, 1u)})
            stored_.add(test::randomImage(width, height, width));
        stored_.tables.materials = {{.image = 0}, {.image = 2}, {.image = 1, .wrapV = ImageWrap::Mirror}};
        stored_.tables.channels = {{.isGiven = 1,
                                    .normals = 2,
                                    .surface = 3,
                                    .emission = 1,
                                    .normalScale = -0.5f,
                                    .roughness = 0.25f,
                                    .metalness = 1,
                                    .emissionFactor = {1, 0, 20}},
                                   {},
                                   {.isGiven = 1, .roughness = 1, .emissionFactor = {0.5f, 0.5f, 0.5f}}};
        test::writeImageFile(folder_ / "channels.vcp", stored_);
        if (HasFatalFailure()) return;
        const std::string text = contentOf(folder_ / "channels.vcp");
        bytes_.resize(text.size());
        std::memcpy(bytes_.data(), text.data(), text.size());
    }
};

TEST_F(ChannelFile, IsReadBack) {
    const TableFile file(bytes_);
    ASSERT_TRUE(verifyFile(file).ok()) << verifyFile(file).error().line();
    const auto dataset = readDataset(file);
    ASSERT_TRUE(dataset.ok());
    EXPECT_EQ(dataset->header.version, kChannelsFileVersion);
    EXPECT_EQ(dataset->header.images.channels, 3u);
    const auto tables = readImageTables(file, dataset->header.images);
    ASSERT_TRUE(tables.ok()) << tables.error().line();
    ASSERT_EQ(tables->channels.size(), 3u);
    EXPECT_EQ(std::memcmp(tables->channels.data(), stored_.tables.channels.data(), 3 * sizeof(ChannelRow)), 0);
    std::vector<uint32_t> images;
    forEachImage(*tables, 0, [&](uint32_t image) { images.push_back(image); });
    EXPECT_EQ(images, (std::vector<uint32_t>{0, 1, 2, 0}));
    // Channels are shown with all of their images.
    const auto set = readAllImages(file, dataset->header.images);
    ASSERT_TRUE(set.ok() && set->hasChannels());
    ASSERT_NE(set->channelsOf(0), nullptr);
    EXPECT_EQ(set->channelsOf(0)->normalScale, -0.5f);
    EXPECT_EQ(set->channelsOf(1), nullptr);
    EXPECT_NE(set->channelsOf(2), nullptr);
    const ImageSet without(*tables);
    EXPECT_EQ(without.channelsOf(0), nullptr);
    EXPECT_NE(without.channelsOf(2), nullptr) << "it has no images";
}

TEST_F(ChannelFile, EveryTruncationAndEveryBitFlipIsFound) {
    for (size_t bytes = 0; bytes < bytes_.size(); ++bytes)
        ASSERT_FALSE(verifyFile(TableFile({bytes_.begin(), bytes_.begin() + std::ptrdiff_t(bytes)})).ok()) << bytes;
    TableFile file(bytes_);
    for (size_t bit = 8 * place().offset; bit < 8 * (place().offset + stored_.tables.bytes()); ++bit) {
        file.bytes[bit / 8] ^= std::byte{1} << int(bit % 8);
        ASSERT_FALSE(verifyFile(file).ok()) << bit;
        file.bytes[bit / 8] = bytes_[bit / 8];
    }
}

TEST_F(ChannelFile, LiesBehindTheRightHashAreRefused) {
    constexpr uint64_t kFirst = 3 * sizeof(ImageRow) + 3 * sizeof(MaterialRow), kRow = sizeof(ChannelRow);
    expectRefused(kFirst + offsetof(ChannelRow, isGiven), 2, "channels of material 0: byte");
    expectRefused(kFirst + kRow + offsetof(ChannelRow, roughness), 1, "there should be none");
    expectRefused(kFirst + offsetof(ChannelRow, normals), 4, "name an image that there is not");
    expectRefused(kFirst + offsetof(ChannelRow, surface) + 3, 255, "name an image that there is not");
    expectRefused(kFirst + offsetof(ChannelRow, emission), 77, "name an image that there is not");
    // The highest bytes of single-precision numbers: their signs, and infinity.
    expectRefused(kFirst + offsetof(ChannelRow, normalScale) + 3, 0x7f, "the scale of their normals is out of range");
    expectRefused(kFirst + offsetof(ChannelRow, roughness) + 3, 0xbf, "their roughness is out of range");
    expectRefused(kFirst + offsetof(ChannelRow, metalness) + 3, 0x40, "their metalness is out of range");
    expectRefused(kFirst + offsetof(ChannelRow, emissionFactor) + 3, 0x7f, "their emission is out of range");
    expectRefused(kFirst + offsetof(ChannelRow, emissionFactor) + 11, 0xc1, "their emission is out of range");
}

TEST_F(ChannelFile, AWrongNumberOfRowsIsRefused) {
    const uint64_t end = bytes_.size() - sizeof(CommitRecord);
    ImagesPlace wrong = place();
    EXPECT_EQ(wrongPlace(wrong, 8192, end), "");
    wrong.channels = 2;
    EXPECT_NE(wrongPlace(wrong, 8192, end), "");
    wrong = place();
    wrong.reserved = 1;
    EXPECT_NE(wrongPlace(wrong, 8192, end), "");
}

TEST_F(ImageFile, AWrongPlaceIsRefused) {
    const uint64_t begin = 8192, end = bytes_.size() - sizeof(CommitRecord);
    EXPECT_EQ(wrongPlace(place(), begin, end), "");
    const auto wrong = [&](const auto& change) {
        ImagesPlace changed = place();
        change(changed);
        return wrongPlace(changed, begin, end);
    };
    EXPECT_NE(wrong([](ImagesPlace& p) { p.images = 0; }), "");
    EXPECT_NE(wrong([](ImagesPlace& p) { p.materials = 0; }), "");
    EXPECT_NE(wrong([&](ImagesPlace& p) { p.offset = begin - 1; }), "");
    EXPECT_NE(wrong([](ImagesPlace& p) { p.bytes += 1; }), "");
    EXPECT_NE(wrong([](ImagesPlace& p) { p.offset = ~uint64_t{0}; }), "");
    EXPECT_NE(wrong([](ImagesPlace& p) { p.bytes = ~uint64_t{0}; }), "");
    EXPECT_NE(wrong([](ImagesPlace& p) { p.images = ~uint32_t{0}; }), "") << "more rows than bytes";
    // A claim of more tiles than there are bytes for is refused before anything is allocated by it.
    TableFile file(bytes_);
    ImageRow row{kMaxImageEdge, kMaxImageEdge, 16, kLosslessTiles, 0};
    std::memcpy(file.bytes.data() + place().offset, &row, sizeof row);
    const auto tables = readImageTables(file, place());
    ASSERT_FALSE(tables.ok());
}

}  // namespace
}  // namespace vcp
