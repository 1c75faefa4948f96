// Files that keep images: what is in them of a mesh whose coordinates are known everywhere; the same bytes however they
// are built; and what becomes of images that are not there.
#include <cmath>
#include <fstream>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "builder/build.h"
#include "builder/texture/texture.h"
#include "octree/reference_caster.h"
#include "octree/surface/packing.h"
#include "octree/vcp_verify.h"
#include "tests/support/build_in_parts.h"
#include "tests/support/image_file.h"
#include "tests/support/jpeg_files.h"
#include "tests/support/mesh_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"
#include "tests/support/textured_walls.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using test::TexturedWalls;

class ImageBuild : public ::testing::Test {
protected:
    void SetUp() override { writeWalls(false); }
    void writeWalls(bool backwards) const {
        TexturedWalls::write(
            folder_.path(), [](uint32_t x, uint32_t y) { return x * 2 | y * 5 << 8 | (x + y) << 16; },
            [](uint32_t x, uint32_t y) { return (x / 4 + y / 4) % 2 == 0 ? 0xffffffu : 0x4060u; }, backwards);
    }
    [[nodiscard]] BuildOptions options() const { return test::keepingImages(folder_ / "walls.obj", output(), 0.06); }
    [[nodiscard]] fs::path output() const { return folder_ / "walls.vcp"; }
    [[nodiscard]] std::string built(const BuildOptions& options) const {
        const auto report = buildOctree(options);
        EXPECT_TRUE(report.ok()) << report.error().line();
        return report ? contentOf(output()) : std::string();
    }

    TestFolder folder_{"vcp_image_build"};
};

TEST_F(ImageBuild, KeepsImagesAndWhereTheyLie) {
    BuildOptions o = options();
    o.imageQuality = {.finest = 0, .coarser = 0};
    ASSERT_FALSE(built(o).empty());
    const auto file = openFile(output());
    ASSERT_TRUE(verifyFile(**file).ok()) << verifyFile(**file).error().line();
    auto cache = PageCache::open(output());
    ASSERT_TRUE(cache.ok() && cache->loadAll().ok());
    const Dataset& dataset = cache->dataset();
    const FileHeader& h = dataset.header;
    EXPECT_EQ(h.version, kFineSlabsFileVersion);
    EXPECT_TRUE(dataset.hasImages());
    EXPECT_EQ(h.images.images, 2u);
    EXPECT_EQ(h.images.materials, 2u);
    // Each image's levels are those that colours were filtered from.
    const auto set = readAllImages(**file, h.images);
    ASSERT_TRUE(set.ok());
    const char* names[] = {"floor.png", "wall.png"};
    for (size_t i = 0; i < 2; ++i) {
        const Texture texture(*loadImage({folder_ / names[i], nullptr}));
        ASSERT_EQ(set->images()[i].levels.size(), texture.levels().size());
        for (size_t l = 0; l < texture.levels().size(); ++l)
            EXPECT_EQ(texture.levels()[l].texels, test::texelsOf(set->images()[i].levels[l]));
    }
    // Each vertex of the finest triangles is where its place in the world says, to a quarter of 1/32 texel and the
    // lattice's rounding; and all triangles of a wall have its material.
    std::map<uint32_t, uint64_t> triangles;
    double farthest = 0;
    for (uint64_t page = 0; page < h.pages; ++page) {
        const PageEntry& entry = dataset.pages[page];
        const PageView& view = *cache->view(page);
        const double cell = dataset.cellOf(entry.level);
        const auto placeOf = [&](uint32_t v) {
            const glm::dvec3 p = f64::decodeVertex(view.vertices[v].x, view.vertices[v].y);
            return dataset.originOf(entry) + p * cell;
        };
        const auto visit = [&](uint32_t word) {
            if (nodeType(word) != kNodeHard) return;
            forEachTriangle(view.strips, word, [&](const Index3& t) {
                glm::dvec3 p[3];
                for (size_t i = 0; i < 3; ++i) p[i] = placeOf(t[i]);
                const glm::dvec3 middle = (p[0] + p[1] + p[2]) / 3.0;
                const uint32_t wanted = std::abs(middle.z) < 1e-3 ? 1u : std::abs(middle.y) < 1e-3 ? 2u : 0u;
                for (size_t i = 0; i < 3; ++i) {
                    const TexturePoint point = view.points.empty() ? TexturePoint{} : view.points[t[i]];
                    ASSERT_EQ(point.material, wanted);
                    ++triangles[wanted];
                    if (wanted == 0) continue;
                    const glm::dvec2 place =
                        wanted == 1 ? TexturedWalls::floorPlace(p[i]) : TexturedWalls::wallPlace(p[i]);
                    const glm::dvec2 found = glm::dvec2(point.u, point.v) * kTextureUnit;
                    const glm::dvec2 size = wanted == 1 ? glm::dvec2(96, 40) : glm::dvec2(64, 64);
                    const glm::dvec2 apart = glm::abs(found - glm::dvec2(place.x, 1 - place.y)) * size;
                    farthest = std::max({farthest, apart.x, apart.y});
                }
            });
        };
        visit(view.header.root);
        for (const uint32_t word : view.nodes) visit(word);
    }
    EXPECT_GT(triangles[1], 1000u);
    EXPECT_GT(triangles[2], 1000u);
    EXPECT_GT(triangles[0], 1000u);
    EXPECT_LT(farthest, 0.02) << "texels";
}

TEST_F(ImageBuild, IsTheSameHoweverItIsBuilt) {
    const std::string whole = built(options());
    BuildOptions o = options();
    o.threads = 1;
    EXPECT_TRUE(built(o) == whole) << "one thread";
    // So little memory that there are several bins.
    o = options();
    o.cell = 0.02;
    const std::string fine = built(o);
    o.memoryBytes = uint64_t{152} << 20;
    EXPECT_TRUE(built(o) == fine) << "little memory";
    writeWalls(true);
    EXPECT_EQ(built(options()).size(), whole.size()) << "another order: materials may have other numbers";
}

TEST_F(ImageBuild, IsResumedAndBuiltInParts) {
    const auto noise = [](uint32_t x, uint32_t y) { return (x * 2654435761u ^ y * 2246822519u) >> 5 & 0xffffffu; };
    TexturedWalls::write(folder_.path(), noise, noise);
    const std::string usual = built(options());
    BuildOptions coarse = options();
    coarse.imageQuality = {.finest = 3, .coarser = 3};
    const std::string whole = built(coarse);
    ASSERT_NE(whole.size(), usual.size());
    for (const std::string stage : {"level", "writing"}) {
        SCOPED_TRACE(stage);
        fs::remove(output());
        BuildOptions o = coarse;
        o.checkpointSeconds = 0;
        o.resume = true;
        bool stop = true;
        o.progress = [&](const BuildProgress& at) { return !(stop && at.stage.starts_with(stage)); };
        const auto stopped = buildOctree(o);
        ASSERT_FALSE(stopped.ok());
        EXPECT_NE(stopped.error().line().find("resumed"), std::string::npos) << stopped.error().line();
        stop = false;
        BuildOptions other = o;
        other.imageQuality = {};
        const auto refused = buildOctree(other);
        ASSERT_FALSE(refused.ok());
        EXPECT_NE(refused.error().line().find("other inputs or options"), std::string::npos) << refused.error().line();
        EXPECT_TRUE(built(o) == whole);
    }
    fs::remove(output());
    BuildOptions o = coarse;
    o.overwrite = false;
    ASSERT_NO_FATAL_FAILURE(test::buildInParts(o, 3));
    EXPECT_TRUE(contentOf(output()) == whole);
}

// What levels lose is what their quality says, and the finest level of a JPEG nothing.
TEST_F(ImageBuild, CodesImagesAsGoodAsIsAskedFor) {
    Image photograph{600, 520, {}};
    std::mt19937 random(1);
    for (uint32_t y = 0; y < photograph.height; ++y)
        for (uint32_t x = 0; x < photograph.width; ++x) {
            const uint32_t grey = uint32_t(120 + 60 * std::sin(0.02 * x) + 40 * std::cos(0.05 * y)) + random() % 16;
            photograph.texels.push_back(0xff000000u | grey | grey << 8 | (grey / 2) << 16);
        }
    const std::string jpeg = test::jpegOf(photograph, {.quality = 80, .sampling = {1, 1}});
    // A file's content says what it is, and not its name.
    std::ofstream(folder_ / "floor.png", std::ios::binary) << jpeg;
    const Texture texture(*decodeImage(jpeg));
    std::map<int, uint64_t> bytes;
    for (const ImageQuality& quality : {ImageQuality(), ImageQuality{0, 0}, ImageQuality{50, 50}}) {
        SCOPED_TRACE(quality.coarser.value_or(-1));
        BuildOptions o = options();
        o.imageQuality = quality;
        const std::string whole = built(o);
        ASSERT_FALSE(whole.empty());
        o.threads = 1;
        EXPECT_TRUE(built(o) == whole) << "one thread";
        const auto file = openFile(output());
        ASSERT_TRUE(verifyFile(**file).ok()) << verifyFile(**file).error().line();
        const auto header = readDataset(**file)->header;
        bytes[quality.coarser.value_or(-1)] = header.images.bytes;
        const auto set = readAllImages(**file, header.images);
        ASSERT_TRUE(set.ok());
        for (size_t l = 0; l < texture.levels().size(); ++l) {
            const Image& level = texture.levels()[l];
            const std::vector<uint32_t> stored = test::texelsOf(set->images()[0].levels[l]);
            double squares = 0;
            for (size_t i = 0; i < level.texels.size(); ++i)
                for (int c = 0; c < 3; ++c) {
                    const int apart = int(level.texels[i] >> 8 * c & 255u) - int(stored[i] >> 8 * c & 255u);
                    squares += apart * apart;
                }
            const double error = std::sqrt(squares / (3 * double(level.texels.size())));
            const bool isExact = (l == 0 ? quality.finest.value_or(0) : quality.coarser.value_or(80)) == 0;
            EXPECT_LE(error, isExact ? 0.0 : !quality.coarser ? 4.0 : 10.0) << "level " << l;
        }
    }
    EXPECT_LT(bytes[50], bytes[-1]);
    EXPECT_LT(bytes[-1], 3 * bytes[0] / 4);
    EXPECT_LT(bytes[-1], 2 * jpeg.size());
}

TEST_F(ImageBuild, WithoutImagesFilesAreAsEver) {
    // A ball has colours at its vertices, and no material.
    writeBall(folder_ / "ball.ply", 20, 40);
    BuildOptions o = options();
    o.inputs = {folder_ / "ball.ply"};
    const std::string with = built(o);
    o.keepImages = false;
    EXPECT_TRUE(with == built(o));
    // Materials whose images cannot be read, one line each, leave what is there without them.
    std::ofstream(folder_ / "floor.png") << "no picture";
    fs::remove(folder_ / "wall.png");
    o.inputs = options().inputs;
    const std::string plain = built(o);
    o.keepImages = true;
    const auto report = buildOctree(o);
    ASSERT_TRUE(report.ok()) << report.error().line();
    EXPECT_TRUE(contentOf(output()) == plain);
    EXPECT_EQ(report->warnings.size(), 2u);
}

TEST_F(ImageBuild, AnImageThatCannotBeReadIsLeftOut) {
    std::ofstream(folder_ / "floor.png") << "no picture";
    const auto report = buildOctree(options());
    ASSERT_TRUE(report.ok()) << report.error().line();
    EXPECT_EQ(report->warnings.size(), 1u);
    const auto dataset = readDataset(**openFile(output()));
    EXPECT_EQ(dataset->header.images.images, 1u);
    EXPECT_EQ(dataset->header.images.materials, 1u);
}

TEST_F(ImageBuild, AToleranceHasNoPlaceForImages) {
    BuildOptions o = options();
    o.error = 0.01;
    const auto report = buildOctree(o);
    ASSERT_FALSE(report.ok());
    EXPECT_EQ(report.error().code, ErrorCode::Usage);
    // Where nobody asks for them, none are kept.
    o.keepImages.reset();
    ASSERT_FALSE(built(o).empty());
    EXPECT_FALSE(readDataset(**openFile(output()))->hasImages());
}

// An image of many rows of tiles takes a few of them, however little memory there is; what has to be held as a whole is
// kept where there is room, if nobody asks for it.
TEST_F(ImageBuild, ImagesAreReadByRows) {
    BuildOptions o = options();
    o.keepImages.reset();
    const std::string whole = built(o);
    EXPECT_TRUE(whole == built(options()));
    Image large{4300, 4300, {}};
    large.texels.assign(size_t{large.width} * large.height, 0xff8090a0u);
    for (uint32_t i = 0; i < large.height; ++i) large.texels[size_t{i} * large.width + i] = 0xff000000u + i;
    const fs::path floor = folder_ / "floor.png";
    std::ofstream(floor, std::ios::binary) << test::jpegOf(large);
    o.memoryBytes = uint64_t{200} << 20;
    const std::string little = built(o);
    EXPECT_EQ(readDataset(**openFile(output()))->header.images.images, 2u);
    o.memoryBytes = uint64_t{2} << 30;
    EXPECT_TRUE(little == built(o));

    std::ofstream(floor, std::ios::binary) << test::jpegOf(large, {.progressive = true, .sampling = {1, 1}});
    o.memoryBytes = uint64_t{200} << 20;
    const auto report = buildOctree(o);
    ASSERT_TRUE(report.ok()) << report.error().line();
    ASSERT_EQ(report->warnings.size(), 1u);
    EXPECT_NE(report->warnings[0].find("let the memory cap be larger; it is left out"), std::string::npos)
        << report->warnings[0];
    EXPECT_EQ(readDataset(**openFile(output()))->header.images.images, 1u);
    o.keepImages = true;
    const auto refused = buildOctree(o);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::Limit);
    o.memoryBytes = uint64_t{600} << 20;
    EXPECT_TRUE(buildOctree(o).ok());
}

// The bytes of an image lie in the file as they do where it is coded as a whole: coarse levels first, in Morton order.
TEST_F(ImageBuild, TilesLieInTheirOrder) {
    Image image{700, 1290, {}};
    std::mt19937 random(4);
    for (uint32_t i = 0; i < image.width * image.height; ++i)
        image.texels.push_back(0xff000000u | Rgba8(random() % 7) << 8 | (i / 700 & 255));
    const std::string jpeg = test::jpegOf(image, {.sampling = {1, 1}});
    std::ofstream(folder_ / "floor.png", std::ios::binary) << jpeg;
    ASSERT_FALSE(built(options()).empty());
    const auto file = openFile(output());
    const auto place = readDataset(**file)->header.images;
    const auto tables = readImageTables(**file, place);
    ASSERT_TRUE(tables.ok());
    const auto levels = levelsOf(tables->images[0]);
    const Texture whole(*decodeImage(jpeg));
    uint64_t number = 0;
    for (size_t l = levels.size(); l-- > 0;)
        for (const glm::uvec2 tile : tileOrder(levels[l])) {
            const glm::uvec2 size = levels[l].sizeOf(tile);
            std::vector<uint32_t> expected, found(size_t{size.x} * size.y);
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x)
                    expected.push_back(
                        whole.levels()[l].texels[size_t{tile.y * 256 + y} * levels[l].width + tile.x * 256 + x]);
            const auto stored = readTiles(**file, *tables, number, 1);
            ASSERT_TRUE(stored.ok());
            ASSERT_TRUE(decodeTile("", *tables, tables->images[0], *stored, number, size, found).ok());
            // The finest level is the source's; those above it are JPEGs of 95.
            for (size_t i = 0; i < found.size(); ++i)
                for (int c = 0; c < 3; ++c)
                    ASSERT_NEAR(int(found[i] >> 8 * c & 255u), int(expected[i] >> 8 * c & 255u), l == 0 ? 0 : 24)
                        << "tile " << number;
            ++number;
        }
}

// What breaks off in its middle leaves no tile behind.
TEST_F(ImageBuild, AnImageThatBreaksOffIsLeftOut) {
    std::ofstream(folder_ / "floor.png") << "no picture";
    const std::string without = built(options());
    Image image{900, 1500, {}};
    std::mt19937 random(4);
    for (uint32_t i = 0; i < image.width * image.height; ++i) image.texels.push_back(0xff000000u | Rgba8(random()));
    const std::string jpeg = test::jpegOf(image);
    std::ofstream(folder_ / "floor.png", std::ios::binary) << jpeg.substr(0, 2 * jpeg.size() / 3);
    const auto report = buildOctree(options());
    ASSERT_TRUE(report.ok()) << report.error().line();
    ASSERT_EQ(report->warnings.size(), 1u);
    EXPECT_NE(report->warnings[0].find("floor.png: the JPEG picture is damaged"), std::string::npos);
    EXPECT_TRUE(contentOf(output()) == without);
}

TEST_F(ImageBuild, MayBeCancelledWhileImagesAreRead) {
    const std::string whole = built(options());
    fs::remove(output());
    BuildOptions o = options();
    o.resume = true;
    bool stop = true;
    o.progress = [&](const BuildProgress& at) { return !(stop && at.stage == "images"); };
    const auto stopped = buildOctree(o);
    ASSERT_FALSE(stopped.ok());
    EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
    EXPECT_FALSE(fs::exists(output()));
    stop = false;
    EXPECT_TRUE(built(o) == whole);
}

}  // namespace
}  // namespace vcp
