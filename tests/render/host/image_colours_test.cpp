// Colours from images: the filter against one in double precision that reads every texel by its definition, and
// pictures of walls whose colours are known in closed form.
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "builder/stream/colour_encoding.h"
#include "octree/image/image_filter.h"
#include "render/host_renderer.h"
#include "tests/support/built_walls.h"
#include "tests/support/image_file.h"
#include "tests/support/instruction_sets.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using test::LevelledImage, test::TexturedWalls;

/// Where a row goes on beyond its ends, one texel after the other.
int64_t wrapped(int64_t at, int64_t size, uint32_t wrap) {
    if (wrap == f32::kWrapClamp) return std::clamp<int64_t>(at, 0, size - 1);
    int64_t place = 0, step = 1;
    // It is walked from the first texel on.
    for (int64_t i = 0; i != at; i += at > 0 ? 1 : -1) {
        const int64_t towards = at > 0 ? step : -step;
        const int64_t next = place + towards;
        if (next >= 0 && next < size) {
            place = next;
        } else if (wrap == f32::kWrapRepeat) {
            place = next < 0 ? size - 1 : 0;
        } else {
            step = -step;  // mirrored: the texel at the end is shown twice
        }
    }
    return place;
}

/// The filter as its definition says, in double precision.
glm::dvec4 oracle(const LevelledImage& image, ImageWraps wraps, glm::dvec2 at, const f64::ImageFootprint& footprint) {
    const auto levels = imageLevels(image.width, image.height, 0);
    const int places = std::clamp(int(std::floor(footprint.longAxis / std::max(footprint.shortAxis, 1.0) + 0.5)), 1,
                                  f32::kMostFootprintPlaces);
    const double texels = std::max({footprint.shortAxis, footprint.longAxis / places, 1.0});
    const double level = std::min(std::log2(texels), double(levels.size() - 1));
    glm::dvec4 sum(0);
    for (int place = 0; place < places; ++place)
        for (size_t l = 0; l < levels.size(); ++l) {
            const double share = std::max(0.0, 1 - std::abs(level - double(l))) / places;
            const glm::dvec2 p = (at + ((place + 0.5) / places - 0.5) * footprint.along) *
                                     glm::dvec2(levels[l].width, levels[l].height) -
                                 0.5;
            for (int64_t y = int64_t(std::floor(p.y)); y <= int64_t(std::floor(p.y)) + 1; ++y)
                for (int64_t x = int64_t(std::floor(p.x)); x <= int64_t(std::floor(p.x)) + 1; ++x) {
                    const double weight = share * std::max(0.0, 1 - std::abs(p.x - double(x))) *
                                          std::max(0.0, 1 - std::abs(p.y - double(y)));
                    if (weight == 0) continue;
                    const uint32_t texel =
                        image.levels[l][size_t(wrapped(y, levels[l].height, wraps.v)) * levels[l].width +
                                        size_t(wrapped(x, levels[l].width, wraps.u))];
                    const double alpha = weight * double(texel >> 24) / 255;
                    for (int c = 0; c < 3; ++c) sum[c] += alpha * srgbToLinear(double(texel >> 8 * c & 255u) / 255);
                    sum.w += alpha;
                }
        }
    if (!(sum.w > 0)) return glm::dvec4(0);
    return {linearToSrgb(sum.x / sum.w), linearToSrgb(sum.y / sum.w), linearToSrgb(sum.z / sum.w), sum.w};
}

/// The image in a file, read back.
ImageSet storedSet(const LevelledImage& image) {
    const TestFolder folder("vcp_image_filter");
    test::StoredImages stored;
    stored.add(image);
    stored.tables.materials = {{}};
    test::writeImageFile(folder / "image.vcp", stored);
    const auto file = openFile(folder / "image.vcp");
    return *readAllImages(**file, readDataset(**file)->header.images);
}

TEST(ImageFilter, CoarserLevelsDoWhereMemoryIsScarce) {
    const LevelledImage image = test::randomImage(37, 21, 6);
    ImageSet set = storedSet(image);
    set.set(0, 0, {0, 0}, nullptr);
    ASSERT_EQ(set.images()[0].finest, 1u);
    for (int i = 0; i < 50; ++i) {
        const glm::dvec2 at(0.02 * i, 0.7 - 0.01 * i);
        const glm::vec4 found =
            filteredColour(set.images()[0], {}, glm::vec2(at), placesOf(set.images()[0], {{0, 0}, 0.5f, 0.5f}));
        const glm::dvec4 wanted = oracle(image, {}, at, {{0, 0}, 2, 2});
        for (int c = 0; c < 4; ++c) EXPECT_NEAR(found[c], wanted[c], 2e-3) << i;
    }
}

TEST(ImageFilter, IsItsDefinition) {
    const LevelledImage image = test::randomImage(37, 21, 5);
    const ImageSet set = storedSet(image);
    for (uint32_t seed = 0; seed < 3000; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const auto number = [&](double low, double high) {
            return low + (high - low) * double(random()) / double(std::mt19937::max());
        };
        const ImageWraps wraps{seed % 3, seed / 3 % 3};
        const glm::dvec2 at(number(-3, 3), number(-3, 3));
        f64::ImageFootprint footprint;
        footprint.shortAxis = std::exp2(number(-3, 6));
        footprint.longAxis = footprint.shortAxis * std::exp2(number(0, 4));
        const double angle = number(0, 6.28);
        footprint.along = glm::dvec2(std::cos(angle) / 37, std::sin(angle) / 21) * footprint.longAxis;
        f32::ImageFootprint single;
        single.shortAxis = float(footprint.shortAxis);
        single.longAxis = float(footprint.longAxis);
        single.along = glm::vec2(footprint.along);
        const glm::vec4 found =
            filteredColour(set.images()[0], wraps, glm::vec2(at), placesOf(set.images()[0], single));
        const glm::dvec4 wanted = oracle(image, wraps, at, footprint);
        for (int c = 0; c < 4; ++c) EXPECT_NEAR(found[c], wanted[c], 2e-3) << c;
    }
}

TEST(ImageFilter, AnyNumbersAreRead) {
    const ImageSet set = storedSet(test::randomImage(37, 21, 7));
    const ImageSet::Image& image = set.images()[0];
    constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
    const float numbers[] = {0, 0.3f, -0.3f, 1e5f, -1e5f, 3e6f, 1e30f, -1e30f, kInfinity, -kInfinity, kNan};
    for (const float u : numbers)
        for (const float v : numbers)
            for (const float along : numbers)
                for (const float width : {0.0f, 1.0f, 1e6f, 1e30f, kInfinity, kNan})
                    for (uint32_t wrap = 0; wrap < 3; ++wrap) {
                        f32::ImageFootprint footprint;
                        footprint.along = {along, u};
                        footprint.longAxis = std::abs(v);
                        footprint.shortAxis = width;
                        const glm::vec4 found =
                            filteredColour(image, {wrap, (wrap + 1) % 3}, {u, v}, placesOf(image, footprint));
                        for (int c = 0; c < 4; ++c) ASSERT_TRUE(found[c] >= 0 && found[c] <= 1.0001f) << found[c];
                    }
}

TEST(ImageFilter, FootprintsAreThoseOfThePixel) {
    // An image of 100 x 200 texels lies on a triangle in the plane z = 0: a unit is 10 texels along x, and 40 along y.
    using V = glm::dvec3;
    const f64::TextureSlope slope = f64::textureSlope(V(0, 0, 0), V(2, 0, 0), V(1, 3, 0), {0.2, 0.0}, {0.1, 0.6});
    EXPECT_NEAR(slope.u.x, 0.1, 1e-12);
    EXPECT_NEAR(slope.v.y, 0.2, 1e-12);
    EXPECT_NEAR(slope.u.y, 0, 1e-12);
    const glm::dvec2 size(100, 200);
    const auto from = [&](V direction, double pixel) {
        return f64::imageFootprint(slope, V(0, 0, 1), glm::normalize(direction), pixel, size);
    };
    const auto above = from(V(0, 0, -1), 0.5);
    EXPECT_NEAR(above.longAxis, 20, 1e-9);
    EXPECT_NEAR(above.shortAxis, 5, 1e-9);
    EXPECT_NEAR(std::abs(above.along.y), 0.1, 1e-9) << "20 of 200 texels along v";
    EXPECT_NEAR(above.along.x, 0, 1e-9);
    // From the side, along x, it is stretched by the slant.
    const auto slant = from(V(std::sqrt(3.0), 0, -1), 0.5);
    EXPECT_NEAR(slant.longAxis, 20, 1e-9);
    EXPECT_NEAR(slant.shortAxis, 10, 1e-9);
    const auto steep = from(V(0, std::sqrt(3.0), -1), 0.5);
    EXPECT_NEAR(steep.longAxis, 40, 1e-9);
    EXPECT_NEAR(steep.shortAxis, 5, 1e-9);
    EXPECT_EQ(f64::footprintPlaces(steep), 8);
    EXPECT_NEAR(f64::footprintLevel(steep, 8), std::log2(5.0), 1e-9);
    EXPECT_EQ(f64::footprintLevel(from(V(0, 0, -1), 0.001), 1), 0) << "no level is finer than the image";
}

/// Pictures of the walls, by the host, straight down on the floor.
class ImagePictures : public ::testing::Test {
protected:
    void build(const test::TexelAt& floor) {
        walls_ = test::builtWalls(folder_.path(), floor, [](uint32_t, uint32_t) { return 0x808080u; });
        ASSERT_TRUE(walls_.dataset);
        renderer_ = opened();
        ASSERT_TRUE(renderer_);
    }
    [[nodiscard]] std::unique_ptr<HostRenderer> opened() const {
        RendererOptions shown;
        shown.budgetBytes = uint64_t{64} << 20;
        auto renderer = HostRenderer::create(shown);
        EXPECT_TRUE(renderer.ok());
        const auto opened = (*renderer)->open({walls_}, {});
        EXPECT_TRUE(opened.ok()) << opened.error().line();
        return *std::move(renderer);
    }

    /// Draws a square of the floor, `edge` wide, about `middle`. Compares each pixel with `colour` of where its middle
    /// lies on the floor; returns the largest difference, of 255.
    double farthest(glm::dvec2 middle, double edge, const std::function<glm::dvec3(glm::dvec2 place)>& colour) {
        constexpr uint32_t kSize = 64;
        FrameRequest request;
        request.width = request.height = kSize;
        request.shading.mode = ShadingMode::Unlit;
        Camera& camera = request.camera;
        constexpr double kHeight = 50;
        camera.eye = {middle.x, middle.y, kHeight};
        camera.forward = {0, 0, -1};
        camera.up = {0, 1, 0};
        camera.verticalFov = 2 * std::atan(edge / 2 / kHeight);
        EXPECT_TRUE(renderer_->drawSettled(request).ok());
        const auto picture = renderer_->readPicture();
        EXPECT_TRUE(picture.ok());
        double most = 0;
        for (uint32_t y = 0; y < kSize; ++y)
            for (uint32_t x = 0; x < kSize; ++x) {
                const glm::dvec2 at = middle + edge * glm::dvec2((x + 0.5) / kSize - 0.5, 0.5 - (y + 0.5) / kSize);
                const glm::dvec2 place = TexturedWalls::floorPlace({at, 0});
                const glm::dvec3 wanted = colour({place.x, 1 - place.y});
                for (int c = 0; c < 3; ++c)
                    most = std::max(
                        most, std::abs(wanted[c] - double(picture->rgba[4 * (size_t{y} * kSize + x) + size_t(c)])));
            }
        return most;
    }

    TestFolder folder_{"vcp_image_pictures"};
    PlacedDataset walls_;
    std::unique_ptr<HostRenderer> renderer_;
};

/// The floor from above, and the walls, from so far.
FrameRequest wallsFrom(double distance) {
    FrameRequest request;
    request.width = request.height = 96;
    request.shading.mode = ShadingMode::Unlit;
    request.camera.forward = glm::normalize(glm::dvec3(-3, -2, -1));
    request.camera.eye = glm::dvec3(2, 1, 0.5) - distance * request.camera.forward;
    request.camera.up = {0, 0, 1};
    request.camera.verticalFov = 0.7;
    return request;
}

TEST_F(ImagePictures, LevelsThatNoPixelReadsChangeNothing) {
    const auto texel = [](uint32_t x, uint32_t y) { return (x * 37 + y * 91) % 256 | ((x ^ y) % 256) << 8; };
    build(texel);
    ASSERT_TRUE(renderer_->drawSettled(wallsFrom(0.4)).ok());
    const uint64_t all = renderer_->update(wallsFrom(0.4))->bytesRead;
    uint64_t before = 0;
    for (const double distance : {200.0, 60.0, 25.0, 12.0, 6.0, 3.0}) {
        const auto fresh = opened();
        ASSERT_TRUE(fresh->drawSettled(wallsFrom(distance)).ok());
        ASSERT_TRUE(renderer_->drawSettled(wallsFrom(distance)).ok());
        EXPECT_EQ(fresh->readPicture()->rgba, renderer_->readPicture()->rgba) << distance;
        const uint64_t read = fresh->update(wallsFrom(distance))->bytesRead;
        EXPECT_GE(read, before) << distance;
        before = read;
        EXPECT_TRUE(distance < 50 || read < all) << distance;
    }
    EXPECT_EQ(renderer_->update(wallsFrom(3))->bytesRead, all) << "what is there is not read again";
}

TEST_F(ImagePictures, AWrongTileLeavesTheColoursOfVertices) {
    build([](uint32_t, uint32_t) { return 0x00ff00u; });
    const FrameRequest request = wallsFrom(6);
    ASSERT_TRUE(renderer_->drawSettled(request).ok());
    std::fstream file(folder_.path() / "walls.vcp", std::ios::in | std::ios::out | std::ios::binary);
    const ImagesPlace& place = walls_.dataset->header.images;
    const auto lastByte = std::streamoff(place.offset + place.bytes - 1);
    file.seekg(lastByte);
    const char last = char(file.get());
    file.seekp(lastByte);
    file.put(char(last ^ 1)).flush();
    const auto renderer = opened();
    const auto settled = renderer->drawSettled(request);
    ASSERT_TRUE(settled.ok()) << settled.error().line();
    ASSERT_EQ(settled->update.problems.size(), 1u);
    const std::string line = settled->update.problems[0].line();
    EXPECT_NE(line.find("walls.vcp: tile "), std::string::npos) << line;
    // The floor is what it was; the wall's vertices are grey, as its image, or tinged by the floor's.
    const auto shown = renderer->readPicture()->rgba, right = renderer_->readPicture()->rgba;
    uint64_t floor = 0, grey = 0;
    for (size_t at = 0; at < right.size(); at += 4) {
        if (right[at] < 8 && right[at + 1] > 247) {
            ++floor;
            EXPECT_TRUE(std::equal(&right[at], &right[at] + 4, &shown[at]));
        } else if (right[at] == 0x80 && right[at + 1] == 0x80) {
            grey += shown[at] >= 0x40 && shown[at + 2] >= 0x40 ? 1 : 0;
        }
    }
    EXPECT_GT(floor, 500u);
    EXPECT_GT(grey, 500u);
}

TEST_F(ImagePictures, AGradientIsShownAsItIs) {
    build([](uint32_t x, uint32_t y) { return (40 + 2 * x) | (20 + 5 * y) << 8 | 90u << 16; });
    // Within one repetition, away from its ends, colours change evenly; light is blended, so between neighbours stored
    // values bend by less than one.
    const auto gradient = [](glm::dvec2 place) {
        const double x = (place.x - std::floor(place.x)) * 96 - 0.5, y = place.y * 40 - 0.5;
        return glm::dvec3(40 + 2 * x, 20 + 5 * y, 90);
    };
    test::onEveryInstructionSet([&] {
        EXPECT_LT(farthest({0.8, 1.5}, 1.2, gradient), 1.6) << "texels are as wide as a pixel";
        EXPECT_LT(farthest({0.8, 1.5}, 0.05, gradient), 1.6) << "a texel is wider than the picture";
        EXPECT_LT(farthest({2.4, 1.2}, 0.3, gradient), 1.6) << "the second repetition";
    });
}

TEST_F(ImagePictures, ACheckerboardIsSharpFromNearAndEvenFromAfar) {
    const auto isLight = [](int64_t x, int64_t y) { return (x / 8 + y / 8) % 2 == 0; };
    build([&](uint32_t x, uint32_t y) { return isLight(x, y) ? 0xffffffu : 0u; });
    // A square is 8 texels; its inner texels are as they are.
    const auto square = [&](glm::dvec2 place) {
        const double x = (place.x - std::floor(place.x)) * 96, y = place.y * 40;
        return glm::dvec3(isLight(int64_t(x), int64_t(y)) ? 255 : 0);
    };
    const glm::dvec2 inSquare(4 / TexturedWalls::kRepeats * (20.0 / 96), 3 * (20.0 / 40));
    EXPECT_LT(farthest(inSquare, 0.05, square), 1.0);
    const glm::dvec2 beside(4 / TexturedWalls::kRepeats * (28.0 / 96), 3 * (20.0 / 40));
    EXPECT_LT(farthest(beside, 0.05, square), 1.0);
    // Seen from so far that a pixel covers many squares, half of the light is there. The picture is of the floor's
    // inside, of which a pixel is all.
    const double half = 255 * linearToSrgb(0.5);
    const auto grey = [&](glm::dvec2) { return glm::dvec3(half); };
    FrameRequest request;
    request.width = request.height = 3;
    request.shading.mode = ShadingMode::Unlit;
    request.camera.eye = {2, 1.5, 500};
    request.camera.forward = {0, 0, -1};
    request.camera.up = {0, 1, 0};
    request.camera.verticalFov = 2 * std::atan(4.0 / 500);
    ASSERT_TRUE(renderer_->drawSettled(request).ok());
    const auto picture = renderer_->readPicture();
    EXPECT_NEAR(double(picture->rgba[4 * 4]), grey({}).x, 8) << "the middle of nine pixels";
}

}  // namespace
}  // namespace vcp
