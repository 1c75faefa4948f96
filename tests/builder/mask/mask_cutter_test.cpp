// What masks leave of triangles, against bilinear alpha that is computed here, point by point.
#include "builder/mask/mask_cutter.h"

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "octree/surface/vertex_normal.h"
#include "tests/support/png_files.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

using Uv = std::array<glm::vec2, 3>;
using AlphaAt = std::function<uint8_t(uint32_t x, uint32_t y)>;

// The two triangles of a square.
constexpr Uv kLower{{{0, 0}, {1, 0}, {1, 1}}}, kUpper{{{0, 0}, {1, 1}, {0, 1}}};

struct Picture {
    uint32_t width, height;
    AlphaAt alpha;
    Wrap wrap = Wrap::Repeat;
    double cutoff = 0.5;

    [[nodiscard]] double texel(double x, double y) const {
        const auto place = [&](double at, double size) {
            if (wrap == Wrap::Clamp) return std::min(std::max(at, 0.0), size - 1);
            double in = std::fmod(std::fmod(at, 2 * size) + 2 * size, 2 * size);
            if (in >= size) in = wrap == Wrap::Mirror ? 2 * size - 1 - in : in - size;
            return in;
        };
        return alpha(uint32_t(place(x, width)), uint32_t(place(y, height)));
    }
    /// Bilinear alpha, 0 to 255, at a place in texels.
    [[nodiscard]] double at(glm::dvec2 p) const {
        const double x = std::floor(p.x - 0.5), y = std::floor(p.y - 0.5), fx = p.x - 0.5 - x, fy = p.y - 0.5 - y;
        return (1 - fy) * ((1 - fx) * texel(x, y) + fx * texel(x + 1, y)) +
               fy * ((1 - fx) * texel(x, y + 1) + fx * texel(x + 1, y + 1));
    }
    [[nodiscard]] bool isKept(glm::dvec2 p) const { return at(p) >= 255 * cutoff - 1e-9; }
    /// Whether all within half a texel is as the point is, as far as 32 samples say.
    [[nodiscard]] bool isSure(glm::dvec2 p) const {
        for (int k = 0; k < 32; ++k) {
            const double angle = k * 0.39269908, radius = k < 16 ? 0.5 : 0.25;
            if (isKept(p + radius * glm::dvec2(std::cos(angle), std::sin(angle))) != isKept(p)) return false;
        }
        return true;
    }
};

class MaskCutterTest : public ::testing::Test {
protected:
    [[nodiscard]] Material materialOf(const Picture& picture) {
        std::string rows;
        for (uint32_t y = 0; y < picture.height; ++y) {
            rows += '\0';
            for (uint32_t x = 0; x < picture.width; ++x) rows += std::string(3, 'a') + char(picture.alpha(x, y));
        }
        Material material;
        material.name = "leaf";
        material.mask.image.bytes =
            std::make_shared<const std::string>(test::pngFile(picture.width, picture.height, 8, 6, rows));
        material.mask.cutoff = picture.cutoff;
        material.wrapU = material.wrapV = picture.wrap;
        return material;
    }
    const MaskParts* cut(const Picture& picture, const Uv& uv) {
        materials_ = {materialOf(picture)};
        cutter_.emplace(uint64_t{64} << 20);
        return cutter_->partsOf(materials_, 0, uv);
    }
    /// Checks parts at random points of the triangle, and returns the area of what they leave of it, from 0 to 1.
    double check(const Picture& picture, const Uv& uv, const MaskParts& parts, int samples = 5000) {
        std::mt19937 random(7);
        std::uniform_real_distribution<double> unit(0, 1);
        const glm::dvec2 size(picture.width, picture.height);
        int sure = 0;
        for (int k = 0; k < samples; ++k) {
            double b = unit(random), c = unit(random);
            if (b + c > 1) b = 1 - b, c = 1 - c;
            const glm::dvec2 at =
                (glm::dvec2(uv[0]) + b * glm::dvec2(uv[1] - uv[0]) + c * glm::dvec2(uv[2] - uv[0])) * size;
            if (!picture.isSure(at)) continue;
            ++sure;
            EXPECT_EQ(coverOf(parts, {b, c}), picture.isKept(at) ? 1 : 0) << "texel " << at.x << ' ' << at.y;
            if (HasFailure()) return 0;
        }
        EXPECT_GT(sure, samples / 2);
        return areaOf(parts);
    }
    static glm::dvec2 placeOf(const Weights& w) { return glm::dvec2(w.of[1], w.of[2]) / double(Weights::kOne); }
    static double cross(glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; }
    /// How many parts have a point; points on edges aside.
    static int coverOf(const MaskParts& parts, glm::dvec2 p) {
        int count = 0;
        for (const auto& t : parts.triangles) {
            bool isIn = true;
            for (size_t i = 0; i < 3; ++i) {
                const glm::dvec2 a = placeOf(parts.points[t[i]]), b = placeOf(parts.points[t[(i + 1) % 3]]);
                isIn = isIn && cross(b - a, p - a) > 0;
            }
            count += isIn;
        }
        return count;
    }
    static double areaOf(const MaskParts& parts) {
        double area = 0;
        for (const auto& t : parts.triangles) {
            const glm::dvec2 a = placeOf(parts.points[t[0]]);
            area += cross(placeOf(parts.points[t[1]]) - a, placeOf(parts.points[t[2]]) - a);
        }
        return area;
    }
    /// Where the parts' outline lies on the triangle's edges, in the world.
    static std::set<std::array<double, 3>> pointsOnEdge(const MaskParts& parts, int without,
                                                        const std::array<MaskCorner, 3>& corners) {
        std::set<std::array<double, 3>> found;
        for (const auto& t : parts.triangles)
            for (const uint32_t p : t)
                if (parts.points[p].of[without] == 0) {
                    const glm::dvec3 at = blend(corners, parts.points[p]).position;
                    found.insert({at.x, at.y, at.z});
                }
        return found;
    }

    std::vector<Material> materials_;
    std::optional<MaskCutter> cutter_;
};

/// A disc whose alpha falls from 255 to 0 over two texels.
AlphaAt disc(double x, double y, double radius) {
    return [=](uint32_t i, uint32_t j) {
        const double inside = radius - std::hypot(i + 0.5 - x, j + 0.5 - y);
        return uint8_t(std::clamp(127.5 + 127.5 * inside, 0.0, 255.0));
    };
}
AlphaAt noise(uint32_t seed) {
    return [=](uint32_t x, uint32_t y) {
        uint32_t h = (x * 73856093u ^ y * 19349663u ^ seed) * 2654435761u;
        h = (h ^ h >> 15) * 2246822519u;
        return uint8_t(h >> 24);
    };
}
uint8_t checker(uint32_t x, uint32_t y) { return (x / 16 + y / 16) % 2 == 0 ? 255 : 0; }

TEST_F(MaskCutterTest, ADiscHasItsArea) {
    const Picture picture{256, 256, disc(128, 128, 100)};
    double area = 0;
    for (const Uv& uv : {kLower, kUpper}) {
        const MaskParts* const parts = cut(picture, uv);
        ASSERT_NE(parts, nullptr);
        EXPECT_LE(parts->triangles.size(), 128u);
        area += check(picture, uv, *parts) / 2 * 256 * 256;
    }
    // An outline within half a texel.
    EXPECT_NEAR(area, 3.14159265 * 100 * 100, 0.5 * 2 * 3.14159265 * 100);
}

TEST_F(MaskCutterTest, HolesAndIslands) {
    const auto outer = disc(90, 100, 80), inner = disc(100, 90, 40), island = disc(95, 95, 9);
    const Picture picture{200, 180, [&](uint32_t x, uint32_t y) {
                              return std::max(std::min(outer(x, y), uint8_t(255 - inner(x, y))), island(x, y));
                          }};
    for (const Uv& uv : {kLower, kUpper, Uv{{{0.1f, 0.2f}, {0.9f, 0.15f}, {0.45f, 0.95f}}}}) {
        const MaskParts* const parts = cut(picture, uv);
        ASSERT_NE(parts, nullptr);
        check(picture, uv, *parts);
    }
}

TEST_F(MaskCutterTest, WrapsAndRepeats) {
    for (const Wrap wrap : {Wrap::Repeat, Wrap::Mirror, Wrap::Clamp}) {
        const Picture picture{48, 80, disc(20, 30, 15), wrap};
        for (const Uv& uv : {Uv{{{-1.3f, 0.2f}, {2.1f, -0.7f}, {0.4f, 1.9f}}}, Uv{{{5, 5}, {5, 7}, {7, 5}}},
                             Uv{{{0.9f, 0.1f}, {0.1f, 0.1f}, {0.1f, 0.9f}}}}) {
            const MaskParts* const parts = cut(picture, uv);
            if (parts == nullptr) {
                EXPECT_EQ(wrap, Wrap::Clamp);
                continue;
            }
            check(picture, uv, *parts);
        }
    }
}

TEST_F(MaskCutterTest, CheckersAndStripes) {
    for (const AlphaAt& alpha :
         {AlphaAt(checker), AlphaAt([](uint32_t x, uint32_t) { return x % 20 < 7 ? 200 : 20; })}) {
        const Picture picture{64, 80, alpha};
        for (const Uv& uv : {kLower, kUpper}) {
            const MaskParts* const parts = cut(picture, uv);
            ASSERT_NE(parts, nullptr);
            check(picture, uv, *parts);
        }
    }
}

TEST_F(MaskCutterTest, TheMasksCoordinatesMayBeScaledAndMoved) {
    const Picture picture{64, 64, disc(20, 30, 15)};
    materials_ = {materialOf(picture)};
    materials_[0].mask.uvScale = {2, -1};
    materials_[0].mask.uvOffset = {0.25f, 1};
    MaskCutter cutter(1 << 20);
    const MaskParts* const parts = cutter.partsOf(materials_, 0, kLower);
    ASSERT_NE(parts, nullptr);
    Uv moved = kLower;
    for (glm::vec2& uv : moved) uv = uv * glm::vec2(2, -1) + glm::vec2(0.25f, 1);
    check(picture, moved, *parts);
}

TEST_F(MaskCutterTest, CutoffsAtTheEnds) {
    Picture picture{64, 64, disc(30, 30, 20)};
    picture.cutoff = 0;
    EXPECT_EQ(cut(picture, kLower), nullptr) << "all alpha is at least 0";
    picture.cutoff = 1;
    const MaskParts* parts = cut(picture, kLower);
    ASSERT_NE(parts, nullptr);
    check(picture, kLower, *parts);
    picture.cutoff = 1.5;
    parts = cut(picture, kLower);
    ASSERT_NE(parts, nullptr);
    EXPECT_TRUE(parts->triangles.empty());
}

TEST_F(MaskCutterTest, WhatIsAllThereOrNotAtAllIsNotLookedAt) {
    const Picture picture{256, 256, [](uint32_t x, uint32_t) { return x < 128 ? 255 : 0; }};
    EXPECT_EQ(cut(picture, {{{0.1f, 0}, {0.4f, 0}, {0.1f, 1}}}), nullptr);
    EXPECT_EQ(cutter_->cutTriangles(), 0u);
    const MaskParts* const none = cutter_->partsOf(materials_, 0, {{{0.6f, 0}, {0.9f, 0}, {0.6f, 1}}});
    ASSERT_NE(none, nullptr);
    EXPECT_TRUE(none->triangles.empty());
    EXPECT_EQ(cutter_->cutTriangles(), 1u);
}

TEST_F(MaskCutterTest, GlassStaysAndGreyMasks) {
    const AlphaAt thin = [](uint32_t x, uint32_t) { return x < 8 ? 60 : 90; };
    materials_ = {materialOf({16, 16, thin}), materialOf({16, 16, thin})};
    materials_[0].mask.sparesGlass = true;
    MaskCutter cutter(1 << 20);
    EXPECT_EQ(cutter.partsOf(materials_, 0, kLower), nullptr);
    ASSERT_NE(cutter.partsOf(materials_, 1, kLower), nullptr);
    EXPECT_TRUE(cutter.partsOf(materials_, 1, kLower)->triangles.empty());
    // A grey picture, without alpha.
    std::string rows;
    for (int y = 0; y < 16; ++y) rows += '\0' + std::string(8, char(250)) + std::string(8, char(5));
    materials_[0].mask.image.bytes = std::make_shared<const std::string>(test::pngFile(16, 16, 8, 0, rows));
    materials_[0].mask.mayBeGrey = true;
    MaskCutter grey(1 << 20);
    const MaskParts* const parts = grey.partsOf(materials_, 0, kLower);
    ASSERT_NE(parts, nullptr);
    check({16, 16, [](uint32_t x, uint32_t) { return x < 8 ? 250 : 5; }}, kLower, *parts);
    materials_[0].mask.mayBeGrey = false;
    MaskCutter opaque(1 << 20);
    EXPECT_EQ(opaque.partsOf(materials_, 0, kLower), nullptr);
}

TEST_F(MaskCutterTest, SharedEdgesHaveTheSamePoints) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1e6, 1e6);
    const auto leaf = disc(40, 60, 33);
    int compared = 0;
    for (uint32_t seed = 0; seed < 40; ++seed) {
        const auto grain = noise(seed);
        const Picture picture{96, 128, [&](uint32_t x, uint32_t y) {
                                  return seed % 4 == 0 ? grain(x / 3, y / 3)
                                                       : std::max(leaf(x, y), grain(x / 9, y / 7));
                              }};
        std::array<MaskCorner, 4> corner;
        for (MaskCorner& c : corner)
            c = {{unit(random), unit(random), unit(random)},
                 {float(unit(random) / 1e6), float(unit(random) / 1e6)},
                 kWhite,
                 kUnknownNormal};
        // Triangles 0 1 2 and 2 1 3, the second beginning with any corner.
        const std::array<MaskCorner, 3> first{corner[0], corner[1], corner[2]};
        std::array<MaskCorner, 3> second{corner[2], corner[1], corner[3]};
        std::rotate(second.begin(), second.begin() + seed % 3, second.end());
        const int opposite = seed % 3 == 0 ? 2 : seed % 3 == 1 ? 1 : 0;
        const auto uvOf = [](const std::array<MaskCorner, 3>& t) { return Uv{t[0].uv, t[1].uv, t[2].uv}; };
        const MaskParts* parts = cut(picture, uvOf(first));
        if (parts == nullptr) continue;  // one that is too busy stays whole
        const auto one = pointsOnEdge(*parts, 0, first);
        parts = cutter_->partsOf(materials_, 0, uvOf(second));
        if (parts == nullptr) continue;
        ++compared;
        EXPECT_EQ(one, pointsOnEdge(*parts, opposite, second)) << "seed " << seed;
        EXPECT_FALSE(one.empty());
    }
    EXPECT_GT(compared, 15);
}

TEST_F(MaskCutterTest, NoPointLiesOnAnothersEdge) {
    const auto leaf = disc(60, 60, 50), hole = disc(70, 50, 20);
    const Picture picture{128, 128,
                          [&](uint32_t x, uint32_t y) { return std::min(leaf(x, y), uint8_t(255 - hole(x, y))); }};
    for (const Uv& uv : {kLower, kUpper, Uv{{{-1, 0.1f}, {1.4f, -0.3f}, {0.2f, 1.7f}}}}) {
        const MaskParts* const parts = cut(picture, uv);
        ASSERT_NE(parts, nullptr);
        std::map<std::pair<uint32_t, uint32_t>, int> edges;
        for (const auto& t : parts->triangles)
            for (size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
        for (const auto& [edge, times] : edges) {
            EXPECT_EQ(times, 1) << "two parts are on one side of an edge";
            const Weights &a = parts->points[edge.first], &b = parts->points[edge.second];
            for (const Weights& p : parts->points) {
                const auto along = [&](int k) {
                    return std::pair(int64_t{b.of[k]} - a.of[k], int64_t{p.of[k]} - a.of[k]);
                };
                const auto [bx, px] = along(1);
                const auto [by, py] = along(2);
                const bool isOn = bx * py == by * px && bx * px + by * py > 0 && bx * px + by * py < bx * bx + by * by;
                EXPECT_FALSE(isOn);
            }
        }
    }
}

TEST_F(MaskCutterTest, WorkAndPartsAreBounded) {
    const Picture grains{512, 512, noise(5)};
    for (const float repeats : {0.3f, 1.0f, 4.0f, 37.0f, 1000.0f, 3e5f}) {
        const Uv uv{{{0, 0}, {repeats, 0}, {0.3f * repeats, repeats}}};
        const MaskParts* const parts = cut(grains, uv);
        if (parts == nullptr) continue;
        EXPECT_LE(parts->triangles.size(), 2 * 4096u);
        if (repeats < 0.5f) {
            EXPECT_LE(parts->triangles.size(), 2 * 128u);
        }
    }
    // A strip of many texels' length and hardly a width.
    const MaskParts* const strip = cut(grains, {{{0, 0}, {20, 0.001f}, {20, 0}}});
    if (strip != nullptr) {
        EXPECT_LE(strip->triangles.size(), 2 * 128u);
    }
}

TEST_F(MaskCutterTest, CoordinatesWithoutSense) {
    const Picture picture{64, 64, disc(30, 30, 20)};
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    EXPECT_EQ(cut(picture, {{{nan, 0}, {1, 0}, {0, 1}}}), nullptr);
    for (const float wild : {inf, -3e38f, 1e20f, 1e7f})
        EXPECT_EQ(cutter_->partsOf(materials_, 0, {{{0, 0}, {wild, 0}, {0, wild}}}), nullptr) << wild;
    // All corners in one place, or in a line.
    const MaskParts* parts = cutter_->partsOf(materials_, 0, {{{0.9f, 0.9f}, {0.9f, 0.9f}, {0.9f, 0.9f}}});
    ASSERT_NE(parts, nullptr);
    EXPECT_TRUE(parts->triangles.empty());
    EXPECT_EQ(cutter_->partsOf(materials_, 0, {{{0.5f, 0.5f}, {0.5f, 0.5f}, {0.5f, 0.5f}}}), nullptr);
    const Uv line{{{0, 0.5f}, {0.5f, 0.5f}, {1, 0.5f}}};
    parts = cutter_->partsOf(materials_, 0, line);
    ASSERT_NE(parts, nullptr);
    check(picture, line, *parts);
    EXPECT_EQ(cutter_->partsOf(materials_, 7, kLower), nullptr) << "there is no such material";
}

TEST_F(MaskCutterTest, AMaskThatCannotBeReadIsOneWarning) {
    Material material = materialOf({16, 16, disc(8, 8, 5)});
    std::string broken = *material.mask.image.bytes;
    broken.resize(broken.size() - 30);
    material.mask.image.bytes = std::make_shared<const std::string>(broken);
    materials_ = {material};
    MaskCutter cutter(1 << 20);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(cutter.partsOf(materials_, 0, kLower), nullptr);
    ASSERT_EQ(cutter.warnings().size(), 1u);
    EXPECT_NE(cutter.warnings()[0].find("material 'leaf' is not cut"), std::string::npos) << cutter.warnings()[0];
}

TEST_F(MaskCutterTest, LittleMemoryReadsACoarserMaskAndSaysSo) {
    const Picture picture{512, 512, disc(256, 256, 200)};
    materials_ = {materialOf(picture)};
    MaskCutter cutter(1 << 17);
    const MaskParts* const parts = cutter.partsOf(materials_, 0, kLower);
    ASSERT_NE(parts, nullptr);
    ASSERT_EQ(cutter.warnings().size(), 1u);
    EXPECT_NE(cutter.warnings()[0].find("512 by 512 texels; for lack of memory 256 by 256"), std::string::npos)
        << cutter.warnings()[0];
    const double half = 3.14159265 * 200 * 200 / 2;
    EXPECT_NEAR(areaOf(*parts) / 2 * 512 * 512, half, 0.01 * half);
}

TEST_F(MaskCutterTest, PartsDoNotDependOnWhatWasAskedBefore) {
    materials_ = {materialOf({128, 128, noise(9)}), materialOf({128, 128, disc(60, 60, 50)})};
    MaskCutter little(1 << 16), much(1 << 26);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<Uv> places(20);
    for (Uv& uv : places)
        for (glm::vec2& corner : uv) corner = {unit(random), unit(random)};
    for (int k = 0; k < 100; ++k) {
        const auto number = uint32_t(random() % 2);
        const Uv& uv = places[random() % places.size()];
        const MaskParts *const a = little.partsOf(materials_, number, uv), *const b =
                                                                               much.partsOf(materials_, number, uv);
        ASSERT_EQ(a == nullptr, b == nullptr);
        if (a == nullptr) continue;
        EXPECT_EQ(a->points, b->points);
        EXPECT_EQ(a->triangles, b->triangles);
    }
}

TEST(MaskCorners, BlendTheSameFromBothSidesAndKeepWhatIsEqual) {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int k = 0; k < 1000; ++k) {
        const double z = unit(random);
        const auto corner = [&] {
            return MaskCorner{{unit(random) * 1e6, unit(random), z},
                              {float(unit(random)), 0},
                              Rgba8(random()),
                              packDirection({unit(random), unit(random), unit(random)})};
        };
        const MaskCorner a = corner(), b = corner(), c = corner(), d = corner();
        const int32_t part = k == 0 ? Weights::kOne / 2 : int32_t(random() % Weights::kOne);
        const MaskCorner one = blend({a, b, c}, Weights::onEdge(0, part));
        const MaskCorner other = blend({d, b, a}, Weights::onEdge(1, Weights::kOne - part));
        EXPECT_EQ(one.position, other.position);
        EXPECT_EQ(one.position.z, z);
        EXPECT_EQ(one.uv, other.uv);
        EXPECT_EQ(one.colour, other.colour);
        EXPECT_EQ(one.normal, other.normal);
    }
}

}  // namespace
}  // namespace vcp
