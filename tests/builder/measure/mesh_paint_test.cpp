// The colours of a mesh in memory, against texels worked out by hand and against the build's own filter; and the
// distance of colours, against published values.
#include <cmath>

#include <gtest/gtest.h>
#include <png.h>

#include "builder/measure/mesh_paint.h"
#include "builder/stream/colour_difference.h"
#include "builder/stream/colour_encoding.h"
#include "builder/texture/texture.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

Rgba8 rgba(uint32_t r, uint32_t g, uint32_t b, uint32_t a = 255) { return r | g << 8 | b << 16 | a << 24; }

TEST(ColourDifference, OkLabIsAsPublished) {
    // Ottosson 2020, and the values that CSS Color 4 gives for white and red.
    const glm::dvec3 white = okLabOf({1, 1, 1}), red = okLabOf({1, 0, 0});
    EXPECT_NEAR(white.x, 1, 1e-6);
    EXPECT_NEAR(white.y, 0, 1e-6);
    EXPECT_NEAR(white.z, 0, 1e-6);
    EXPECT_NEAR(red.x, 0.62796, 1e-5);
    EXPECT_NEAR(red.y, 0.22486, 1e-5);
    EXPECT_NEAR(red.z, 0.12585, 1e-5);
    EXPECT_NEAR(colourDifference({0, 0, 0}, {1, 1, 1}), 100, 1e-4);
    EXPECT_EQ(colourDifference({0.2, 0.3, 0.4}, {0.2, 0.3, 0.4}), 0);
    EXPECT_EQ(colourDifference({0.2, 0.3, 0.4}, {0.5, 0.3, 0.1}), colourDifference({0.5, 0.3, 0.1}, {0.2, 0.3, 0.4}));
}

Material painted(Rgba8 factor) {
    Material material;
    material.factor = factor;
    return material;
}

Material withImage(const std::filesystem::path& path, Wrap wrap = Wrap::Repeat) {
    Material material;
    material.image.path = path;
    material.wrapU = material.wrapV = wrap;
    return material;
}

/// A stream of nothing but materials.
class MaterialsOnly final : public MeshStream {
public:
    explicit MaterialsOnly(std::vector<Material> materials) : materials_(std::move(materials)) {}
    [[nodiscard]] const MeshInfo& info() const override { return info_; }
    Result<bool> next(MeshChunk&) override { return false; }
    [[nodiscard]] uint64_t bytesRead() const override { return 0; }
    [[nodiscard]] std::span<const Material> materials() const override { return materials_; }

private:
    MeshInfo info_;
    std::vector<Material> materials_;
};

class MeshPaintTest : public testing::Test {
protected:
    MeshPaintTest() : folder_("vcp_mesh_paint_test") {}

    [[nodiscard]] std::filesystem::path writePng(const Image& image) const {
        const auto path = folder_ / "image.png";
        png_image png{};
        png.version = PNG_IMAGE_VERSION;
        png.width = image.width;
        png.height = image.height;
        png.format = PNG_FORMAT_RGBA;
        EXPECT_NE(png_image_write_to_file(&png, path.c_str(), 0, image.texels.data(), 0, nullptr), 0);
        return path;
    }

    /// One triangle whose corners have these texture coordinates.
    MeshChunk triangleWith(std::array<glm::vec2, 3> uvs, uint32_t material = 0) {
        MeshChunk chunk;
        chunk.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
        chunk.triangles = {{0, 1, 2}};
        chunk.uvs = {uvs};
        chunk.materials = {material};
        return chunk;
    }

    TestFolder folder_;
    IndexedMesh triangle_{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}};
};

TEST_F(MeshPaintTest, IsTheTexelAtItsCentre) {
    const Image image{2, 2, {rgba(255, 0, 0), rgba(0, 255, 0), rgba(0, 0, 255), rgba(10, 20, 30, 51)}};
    const MaterialsOnly stream({withImage(writePng(image))});
    MeshPaint paint;
    paint.add(0, stream, triangleWith({glm::vec2(0.25f, 0.25f), {0.75f, 0.25f}, {0.75f, 0.75f}}));
    paint.loadImages();
    ASSERT_TRUE(paint.warnings().empty());
    EXPECT_TRUE(paint.hasColour());
    const auto at = [&](glm::dvec3 weights) { return paint.lightAt(triangle_, 0, weights); };
    EXPECT_EQ(at({1, 0, 0}).light, glm::dvec3(1, 0, 0));
    EXPECT_EQ(at({0, 1, 0}).light, glm::dvec3(0, 1, 0));
    EXPECT_NEAR(at({0, 0, 1}).cover, 0.2, 1e-12) << "what is cut out";
    EXPECT_NEAR(at({0, 0, 1}).light.z / 0.2, srgbToLinear(30 / 255.0), 1e-12);
    EXPECT_NEAR(at({0.5, 0.5, 0}).light.x, 0.5, 1e-12) << "light is blended, not bytes";
}

TEST_F(MeshPaintTest, AgreesWithTheBuildsFilterAtTheFinestTexels) {
    Image image{5, 3, {}};
    for (uint32_t i = 0; i < 15; ++i) image.texels.push_back(rgba(i * 17 % 256, i * 53 % 256, i * 91 % 256));
    for (const Wrap wrap : {Wrap::Repeat, Wrap::Clamp, Wrap::Mirror}) {
        const MaterialsOnly stream({withImage(writePng(image), wrap)});
        const Texture texture(image, wrap, wrap);
        MeshPaint paint;
        paint.add(0, stream, triangleWith({glm::vec2(-2.3f, -1.7f), {2.9f, 0.4f}, {0.1f, 3.2f}}));
        paint.loadImages();
        for (int i = 0; i <= 20; ++i)
            for (int j = 0; i + j <= 20; ++j) {
                const glm::dvec3 w((20 - i - j) / 20.0, i / 20.0, j / 20.0);
                const glm::dvec2 uv =
                    w.x * glm::dvec2(-2.3f, -1.7f) + w.y * glm::dvec2(2.9f, 0.4f) + w.z * glm::dvec2(0.1f, 3.2f);
                const glm::dvec3 light = paint.lightAt(triangle_, 0, w).light;
                const Rgba8 other = texture.sample(glm::vec2(uv), {});
                for (int c = 0; c < 3; ++c)
                    EXPECT_NEAR(255 * linearToSrgb(light[c]), double(other >> 8 * c & 255u), 0.6)
                        << int(wrap) << " " << i << " " << j;
            }
    }
}

TEST_F(MeshPaintTest, FactorsAndVertexColoursMultiply) {
    const MaterialsOnly stream({painted(rgba(255, 0, 128))});
    MeshPaint paint;
    MeshChunk chunk = triangleWith({});
    chunk.colours = {rgba(128, 255, 255, 0), rgba(128, 255, 255, 0), rgba(0, 0, 0)};
    paint.add(0, stream, chunk);
    paint.loadImages();
    const PaintedLight corner = paint.lightAt(triangle_, 0, {1, 0, 0});
    EXPECT_NEAR(corner.light.x, srgbToLinear(128 / 255.0), 1e-12);
    EXPECT_EQ(corner.light.y, 0);
    EXPECT_NEAR(corner.light.z, srgbToLinear(128 / 255.0), 1e-12);
    EXPECT_EQ(corner.cover, 1) << "the alpha of vertices does not count";
    // Halfway to black the stored value is halved.
    EXPECT_NEAR(paint.lightAt(triangle_, 0, {0.5, 0, 0.5}).light.x, srgbToLinear(64 / 255.0), 1e-12);
}

TEST_F(MeshPaintTest, WhatAFileDoesNotSayIsWhite) {
    MeshPaint paint;
    MeshChunk plain = triangleWith({});
    plain.uvs.clear();
    plain.materials.clear();
    const MaterialsOnly none(std::vector<Material>{}), red({painted(rgba(255, 0, 0))}),
        blue({painted(rgba(0, 0, 255))});
    paint.add(0, none, plain);
    EXPECT_FALSE(paint.hasColour());
    paint.add(1, red, triangleWith({}));
    paint.add(2, blue, triangleWith({}));
    paint.add(3, none, plain);
    IndexedMesh mesh;
    for (uint32_t i = 0; i < 4; ++i) {
        mesh.positions.insert(mesh.positions.end(), triangle_.positions.begin(), triangle_.positions.end());
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    const glm::dvec3 middle(1 / 3.0);
    EXPECT_EQ(paint.lightAt(mesh, 0, middle).light, glm::dvec3(1));
    EXPECT_EQ(paint.lightAt(mesh, 1, middle).light, glm::dvec3(1, 0, 0));
    EXPECT_EQ(paint.lightAt(mesh, 2, middle).light, glm::dvec3(0, 0, 1));
    EXPECT_EQ(paint.lightAt(mesh, 3, middle).light, glm::dvec3(1));
}

TEST_F(MeshPaintTest, AMissingImageIsAWarning) {
    const MaterialsOnly stream({withImage(folder_ / "missing.png")});
    MeshPaint paint;
    paint.add(0, stream, triangleWith({}));
    paint.loadImages();
    ASSERT_EQ(paint.warnings().size(), 1u);
    EXPECT_NE(paint.warnings()[0].find("missing.png"), std::string::npos);
    EXPECT_EQ(paint.lightAt(triangle_, 0, {1, 0, 0}).light, glm::dvec3(1));
}

}  // namespace
}  // namespace vcp
