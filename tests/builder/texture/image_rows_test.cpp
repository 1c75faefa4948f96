// Pictures that are read by rows are what libpng and libjpeg make of them as a whole; and so are their levels.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <png.h>

#include "builder/stream/colour_encoding.h"
#include "builder/texture/level_bands.h"
#include "builder/texture/texture.h"
#include "octree/image/image_levels.h"
#include "tests/support/jpeg_files.h"
#include "tests/support/peak_memory.h"
#include "tests/support/png_files.h"

namespace vcp {
namespace {

using test::bigEndian, test::jpegOf, test::JpegKind, test::pngChunk, test::pngFile;

Image noisyImage(uint32_t width, uint32_t height, unsigned seed, Rgba8 alpha = 0xFF000000) {
    std::mt19937 random(seed);
    Image image{width, height, {}};
    for (uint32_t i = 0; i < width * height; ++i) image.texels.push_back(Rgba8(random()) | alpha);
    return image;
}

/// Returns a picture of random bytes with all filters of its rows. `extra`: as pngFile() has it.
std::string randomPng(glm::uvec2 size, int bits, int type, std::string_view extra, unsigned seed) {
    constexpr int kChannels[] = {1, 0, 3, 1, 2, 0, 4};
    std::mt19937 random(seed);
    std::string rows;
    for (uint32_t y = 0; y < size.y; ++y) {
        rows += char(y % 5);
        const size_t bytes = (size_t{size.x} * size_t(bits * kChannels[type]) + 7) / 8;
        for (size_t i = 0; i < bytes; ++i) rows += char(random());
    }
    return pngFile(size.x, size.y, bits, type, rows, extra);
}

/// Decodes a PNG by libpng's simple interface; no texels where that fails.
std::vector<Rgba8> wholePng(const std::string& file) {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    if (!png_image_begin_read_from_memory(&png, file.data(), file.size())) return {};
    png.format = PNG_FORMAT_RGBA;
    std::vector<Rgba8> texels(size_t{png.width} * png.height);
    if (!png_image_finish_read(&png, nullptr, texels.data(), 0, nullptr)) texels.clear();
    png_image_free(&png);
    return texels;
}

/// Decodes a JPEG by libjpeg's usual calls. Precondition: it is intact.
std::vector<Rgba8> wholeJpeg(const std::string& file) {
    jpeg_decompress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_decompress(&jpeg);
    jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(file.data()), file.size());
    jpeg_read_header(&jpeg, TRUE);
    jpeg.out_color_space = JCS_EXT_RGBA;
    jpeg_start_decompress(&jpeg);
    std::vector<Rgba8> texels(size_t{jpeg.output_width} * jpeg.output_height);
    while (jpeg.output_scanline < jpeg.output_height) {
        auto row = reinterpret_cast<JSAMPROW>(texels.data() + size_t{jpeg.output_scanline} * jpeg.output_width);
        jpeg_read_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_decompress(&jpeg);
    jpeg_destroy_decompress(&jpeg);
    return texels;
}

/// Reads a picture by `rows` rows at a time; no texels where that fails.
std::vector<Rgba8> byRows(const std::string& file, uint32_t rows) {
    const auto image = ImageRows::open(randomBytesAt(file));
    if (!image) return {};
    const glm::uvec2 size = (*image)->size();
    std::vector<Rgba8> texels(size_t{size.x} * size.y);
    for (uint32_t y = 0; y < size.y; y += rows)
        if (!(*image)->read(std::span(texels).subspan(size_t{y} * size.x, size_t{std::min(rows, size.y - y)} * size.x)))
            return {};
    return texels;
}

/// Returns all levels of a picture as readLevels() hands them on, and checks that rows come in their order.
std::vector<Image> levelsOf(ImageRows& rows) {
    std::vector<Image> levels;
    glm::uvec2 size = rows.size();
    for (;; size = halvedSize(size)) {
        levels.push_back({size.x, size.y, {}});
        if (size == glm::uvec2(1)) break;
    }
    const auto read = readLevels(rows, [&](size_t level, uint32_t firstRow, std::span<const Rgba8> texels) {
        Image& image = levels[level];
        EXPECT_EQ(firstRow % kLargeTileEdge, 0u);
        EXPECT_EQ(image.texels.size(), size_t{firstRow} * image.width);
        EXPECT_EQ(texels.size(), size_t{std::min(kLargeTileEdge, image.height - firstRow)} * image.width);
        image.texels.insert(image.texels.end(), texels.begin(), texels.end());
        return Result<void>();
    });
    EXPECT_TRUE(read.ok());
    return levels;
}

/// An image in memory that is read by rows.
class RowsInMemory final : public ImageRows {
public:
    explicit RowsInMemory(const Image& image) : image_(image) {}
    [[nodiscard]] glm::uvec2 size() const override { return {image_.width, image_.height}; }
    [[nodiscard]] uint64_t heldBytes() const override { return 0; }
    Result<void> read(std::span<Rgba8> texels) override {
        std::copy_n(image_.texels.begin() + std::ptrdiff_t(done_), texels.size(), texels.begin());
        done_ += texels.size();
        return {};
    }

private:
    const Image& image_;
    size_t done_ = 0;
};

TEST(PngRows, AreWhatLibpngMakesOfAnyKind) {
    const glm::uvec2 size(37, 23);
    const auto chromaticities = [] {
        std::string values;
        for (const uint32_t value : {31270u, 32900u, 64000u, 33000u, 30000u, 60000u, 15000u, 6000u})
            values += bigEndian(value);
        return pngChunk("cHRM", values);
    }();
    const std::string linear = pngChunk("gAMA", bigEndian(100000)), mac = pngChunk("gAMA", bigEndian(55556)),
                      srgb = pngChunk("sRGB", std::string(1, '\0')), depth = pngChunk("sBIT", std::string("\5\6\5", 3)),
                      ground = pngChunk("bKGD", std::string("\0\1\0\2\0\3", 6));
    unsigned seed = 0;
    for (const auto& [type, depths] : std::vector<std::pair<int, std::vector<int>>>{
             {0, {1, 2, 4, 8, 16}}, {2, {8, 16}}, {3, {1, 2, 4, 8}}, {4, {8, 16}}, {6, {8, 16}}})
        for (const int bits : depths) {
            std::string palette;
            if (type == 3) {
                for (int i = 0; i < 3 << bits; ++i) palette += char(37 * i);
                palette = pngChunk("PLTE", palette);
            }
            std::vector<std::string> transparent{""};
            if (type == 0) transparent.push_back(pngChunk("tRNS", std::string("\0\1", 2)));
            if (type == 2) transparent.push_back(pngChunk("tRNS", std::string("\0\1\0\1\0\1", 6)));
            if (type == 3) transparent.push_back(pngChunk("tRNS", std::string("\x40\xFF", 2)));
            for (const std::string& about : {std::string(), linear, mac, srgb, chromaticities + mac, depth, ground})
                for (const std::string& trns : transparent) {
                    const bool isBehindPalette = about == ground;
                    const std::string file = randomPng(
                        size, bits, type, isBehindPalette ? palette + trns + about : about + palette + trns, ++seed);
                    SCOPED_TRACE(testing::Message() << "type " << type << ", bits " << bits << ", seed " << seed);
                    const auto whole = wholePng(file);
                    for (const uint32_t rows : {1u, 7u, 23u}) EXPECT_TRUE(byRows(file, rows) == whole);
                }
        }
    EXPECT_GT(seed, 100u);
}

TEST(PngRows, InterlacedPicturesAreHeldAndRead) {
    // Seven passes of one row each, or none: the rows of each pass have a filter byte.
    const glm::uvec2 size(9, 11);
    std::string rows;
    std::mt19937 random(5);
    constexpr int kFirst[7][2] = {{0, 0}, {4, 0}, {0, 4}, {2, 0}, {0, 2}, {1, 0}, {0, 1}};
    constexpr int kStep[7][2] = {{8, 8}, {8, 8}, {4, 8}, {4, 4}, {2, 4}, {2, 2}, {1, 2}};
    for (int pass = 0; pass < 7; ++pass)
        for (int y = kFirst[pass][1]; y < int(size.y); y += kStep[pass][1]) {
            rows += '\0';
            for (int x = kFirst[pass][0]; x < int(size.x); x += kStep[pass][0])
                for (int c = 0; c < 3; ++c) rows += char(random());
        }
    const std::string file = pngFile(size.x, size.y, 8, 2, rows, "", true);
    const auto whole = wholePng(file);
    ASSERT_FALSE(whole.empty());
    EXPECT_TRUE(byRows(file, 4) == whole);
    EXPECT_EQ((*ImageRows::open(randomBytesAt(file)))->heldBytes(), 9u * 11 * 4);
    EXPECT_EQ(ImageRows::open(randomBytesAt(file), {.bytes = 395}).error().code, ErrorCode::Limit);
    EXPECT_EQ((*ImageRows::open(randomBytesAt(randomPng(size, 8, 2, "", 1)), {.bytes = 395}))->heldBytes(), 0u);
}

TEST(PngRows, SizesAndSumsThatLieAreFound) {
    const auto refused = [](const std::string& file) { return ImageRows::open(randomBytesAt(file)).error(); };
    for (const bool isInterlaced : {false, true})
        EXPECT_EQ(refused(pngFile(32768, 32768, 8, 6, std::string(4'000'000, '\0'), "", isInterlaced)).code,
                  ErrorCode::InvalidInput);
    EXPECT_EQ(refused(pngFile(32769, 1, 8, 0, std::string(32770, '\0'))).code, ErrorCode::Limit);
    std::mt19937 random(1);
    std::string texels;
    for (uint32_t i = 0; i < 600 * 65; ++i) texels += i % 65 == 0 ? '\0' : char(random());
    const std::string file = pngFile(64, 600, 8, 0, texels);
    EXPECT_FALSE(byRows(file, 256).empty());
    EXPECT_TRUE(byRows(pngFile(64, 601, 8, 0, texels), 256).empty()) << "a row is missing";
    const size_t data = file.find("IDAT"), end = file.find("IEND") - 4;
    for (const size_t at : {data - 2, data + 100, (data + end) / 2, end - 2}) {
        std::string broken = file;
        broken[at] ^= 1;
        EXPECT_TRUE(byRows(broken, 256).empty()) << at - data;
    }
}

TEST(JpegRows, AreWhatLibjpegMakesOfAnyKind) {
    Image picture{131, 597, {}};
    std::mt19937 random(3);
    for (uint32_t y = 0; y < picture.height; ++y)
        for (uint32_t x = 0; x < picture.width; ++x)
            picture.texels.push_back(0xFF000000u | (x * 2 & 255) | (y & 255) << 8 | Rgba8(random() % 60) << 16);
    for (const JpegKind& kind :
         {JpegKind{}, JpegKind{.sampling = {1, 1}}, JpegKind{.sampling = {2, 1}}, JpegKind{.sampling = {1, 2}},
          JpegKind{.sampling = {4, 1}}, JpegKind{.sampling = {3, 1}}, JpegKind{.colours = JCS_RGB},
          JpegKind{.colours = JCS_GRAYSCALE}, JpegKind{.progressive = true}, JpegKind{.isArithmetic = true}}) {
        SCOPED_TRACE(testing::Message() << kind);
        const std::string file = jpegOf(picture, kind);
        const auto whole = wholeJpeg(file);
        for (const uint32_t rows : {1u, 100u, 256u, 597u}) EXPECT_TRUE(byRows(file, rows) == whole) << rows;
    }
}

// Each level is averaged as a whole image here, texel by texel, by the areas that texels share.
Image halvedSlowly(const Image& fine) {
    const glm::uvec2 size = halvedSize({fine.width, fine.height});
    Image coarse{size.x, size.y, {}};
    const auto share = [](uint32_t of, double step, uint32_t texel) {
        return std::max(std::min((of + 1) * step, texel + 1.0) - std::max(of * step, double(texel)), 0.0) / step;
    };
    const double stepX = double(fine.width) / size.x, stepY = double(fine.height) / size.y;
    for (uint32_t y = 0; y < size.y; ++y)
        for (uint32_t x = 0; x < size.x; ++x) {
            double sum[4] = {};
            for (auto j = uint32_t(y * stepY); j < std::min(uint32_t(y * stepY) + 4, fine.height); ++j)
                for (auto i = uint32_t(x * stepX); i < std::min(uint32_t(x * stepX) + 4, fine.width); ++i) {
                    const Rgba8 texel = fine.texels[size_t{j} * fine.width + i];
                    const double alpha = share(y, stepY, j) * share(x, stepX, i) * (texel >> 24) / 255;
                    for (int c = 0; c < 3; ++c) sum[c] += alpha * srgbToLinear((texel >> 8 * c & 255u) / 255.0);
                    sum[3] += alpha;
                }
            Rgba8 texel = Rgba8(std::lround(sum[3] * 255)) << 24;
            for (int c = 0; c < 3; ++c)
                texel |= Rgba8(std::lround(255 * linearToSrgb(std::min(sum[c] / sum[3], 1.0)))) << 8 * c;
            coarse.texels.push_back(texel);
        }
    return coarse;
}

TEST(LevelBands, AreTheLevelsOfTheWholeImage) {
    for (const auto& [width, height] : std::vector<std::pair<uint32_t, uint32_t>>{{1, 1},
                                                                                  {1, 777},
                                                                                  {777, 1},
                                                                                  {256, 256},
                                                                                  {64, 1024},
                                                                                  {33, 2047},
                                                                                  {21, 1535},
                                                                                  {13, 769},
                                                                                  {300, 513},
                                                                                  {5, 4099}}) {
        SCOPED_TRACE(testing::Message() << width << " by " << height);
        const Image image = noisyImage(width, height, width + height, 0x40000000);
        RowsInMemory rows(image);
        const auto levels = levelsOf(rows);
        const Texture whole(image);
        ASSERT_EQ(levels.size(), whole.levels().size());
        ASSERT_EQ(levels.size(), imageLevels(width, height, 0).size());
        uint64_t bands = 0;
        for (size_t l = 0; l < levels.size(); ++l) {
            ASSERT_TRUE(levels[l].texels == whole.levels()[l].texels) << "level " << l;
            bands += std::min(levels[l].height, 258u) * uint64_t{levels[l].width} * 4;
            if (l == 0) continue;
            const Image slow = halvedSlowly(levels[l - 1]);
            ASSERT_EQ(slow.texels.size(), levels[l].texels.size());
            for (size_t i = 0; i < slow.texels.size(); ++i)
                for (int c = 0; c < 4; ++c)
                    ASSERT_NEAR(int(slow.texels[i] >> 8 * c & 255u), int(levels[l].texels[i] >> 8 * c & 255u), 1)
                        << "level " << l << ", texel " << i;
        }
        EXPECT_EQ(levelBandBytes({width, height}), bands);
    }
}

TEST(LevelBands, PassOnWhatIsWrong) {
    const std::string file = jpegOf(noisyImage(300, 900, 1));
    const auto cut = ImageRows::open(randomBytesAt(std::string_view(file).substr(0, file.size() / 2)));
    ASSERT_TRUE(cut.ok());
    size_t rows = 0;
    const auto read = readLevels(**cut, [&](size_t level, uint32_t, std::span<const Rgba8>) {
        rows += level == 0;
        return Result<void>();
    });
    ASSERT_FALSE(read.ok());
    EXPECT_EQ(read.error().code, ErrorCode::InvalidInput);
    EXPECT_EQ(rows, 1u) << "of four";
    const Image image = noisyImage(40, 900, 2);
    RowsInMemory whole(image);
    const auto stopped = readLevels(whole, [&](size_t level, uint32_t firstRow, std::span<const Rgba8>) {
        return level == 1 && firstRow == 256 ? Error::cancelled() : Result<void>();
    });
    ASSERT_FALSE(stopped.ok());
    EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
}

// 16.8 million texels are kept; what has more begins with a coarser level, whatever the memory.
TEST(LevelBands, TexturesOfHugeImagesBeginWithACoarserLevel) {
    const Image huge{16384, 1026, std::vector<Rgba8>(size_t{16384} * 1026, 0xFF306090)};
    ASSERT_GT(huge.texels.size(), Texture::kMostTexels);
    RowsInMemory rows(huge);
    const auto texture = Texture::read(rows);
    ASSERT_TRUE(texture.ok());
    EXPECT_EQ(texture->size(), glm::uvec2(8192, 513));
    EXPECT_EQ(texture->bytes(), Texture::bytesOf({16384, 1026}));
    EXPECT_EQ(texture->sample({0.3f, 0.7f}, {}), 0xFF306090u);

    const Image small = noisyImage(300, 700, 9);
    RowsInMemory smallRows(small);
    const auto kept = Texture::read(smallRows);
    const Texture whole(small);
    ASSERT_TRUE(kept.ok());
    ASSERT_EQ(kept->levels().size(), whole.levels().size());
    for (size_t l = 0; l < whole.levels().size(); ++l)
        EXPECT_TRUE(kept->levels()[l].texels == whole.levels()[l].texels);
}

// Many textures take what the cache may have, not what they have together.
TEST(TextureCache, StaysWithinItsMemory) {
    std::vector<Material> materials(50);
    const auto file = std::make_shared<const std::string>(jpegOf(noisyImage(512, 512, 1), {.quality = 50}));
    for (Material& material : materials) material.image.bytes = file;
    constexpr uint64_t kMemory = uint64_t{8} << 20;
    TextureCache cache(kMemory);
    const uint64_t before = test::peakBytes();
    for (uint32_t i = 0; i < 2 * materials.size(); ++i) {
        ASSERT_NE(cache.textureOf(materials, i % uint32_t(materials.size())), nullptr);
        EXPECT_LE(cache.bytes(), kMemory);
    }
    if (test::kMemoryIsMeasured) {
        EXPECT_LT(test::peakBytes() - before, kMemory + (uint64_t{24} << 20)) << "of 70 MB together";
    }
}

}  // namespace
}  // namespace vcp
