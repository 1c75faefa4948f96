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

#include "builder/mask/mask_outline.h"
#include "builder/mask/outline_simplifier.h"
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
    /// Whether all within 1.5 texels is as the point is, as far as 32 samples say.
    [[nodiscard]] bool isSure(glm::dvec2 p) const {
        for (int k = 0; k < 32; ++k) {
            const double angle = k * 0.39269908, radius = k < 16 ? 1.5 : 0.75;
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
        return cutter_->partsOf(materials_, 0, uv, 0);
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
    // An outline whose corners lie on the disc's, and whose edges are within 1.5 texels.
    EXPECT_NEAR(area, 3.14159265 * 100 * 100, 2 * 3.14159265 * 100);
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
    const MaskParts* const parts = cutter.partsOf(materials_, 0, kLower, 0);
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
    const MaskParts* const none = cutter_->partsOf(materials_, 0, {{{0.6f, 0}, {0.9f, 0}, {0.6f, 1}}}, 0);
    ASSERT_NE(none, nullptr);
    EXPECT_TRUE(none->triangles.empty());
    EXPECT_EQ(cutter_->cutTriangles(), 1u);
}

TEST_F(MaskCutterTest, GlassStaysAndGreyMasks) {
    const AlphaAt thin = [](uint32_t x, uint32_t) { return x < 8 ? 60 : 90; };
    materials_ = {materialOf({16, 16, thin}), materialOf({16, 16, thin})};
    materials_[0].mask.sparesGlass = true;
    MaskCutter cutter(1 << 20);
    EXPECT_EQ(cutter.partsOf(materials_, 0, kLower, 0), nullptr);
    ASSERT_NE(cutter.partsOf(materials_, 1, kLower, 0), nullptr);
    EXPECT_TRUE(cutter.partsOf(materials_, 1, kLower, 0)->triangles.empty());
    // A grey picture, without alpha.
    std::string rows;
    for (int y = 0; y < 16; ++y) rows += '\0' + std::string(8, char(250)) + std::string(8, char(5));
    materials_[0].mask.image.bytes = std::make_shared<const std::string>(test::pngFile(16, 16, 8, 0, rows));
    materials_[0].mask.mayBeGrey = true;
    MaskCutter grey(1 << 20);
    const MaskParts* const parts = grey.partsOf(materials_, 0, kLower, 0);
    ASSERT_NE(parts, nullptr);
    check({16, 16, [](uint32_t x, uint32_t) { return x < 8 ? 250 : 5; }}, kLower, *parts);
    materials_[0].mask.mayBeGrey = false;
    MaskCutter opaque(1 << 20);
    EXPECT_EQ(opaque.partsOf(materials_, 0, kLower, 0), nullptr);
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
        parts = cutter_->partsOf(materials_, 0, uvOf(second), 0);
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
    materials_ = {materialOf(grains)};
    cutter_.emplace(uint64_t{64} << 20);
    int cut = 0;
    for (const float repeats : {0.1f, 0.3f, 1.0f, 4.0f, 37.0f, 1000.0f, 3e5f}) {
        const Uv uv{{{0, 0}, {repeats, 0}, {0.3f * repeats, repeats}}};
        const MaskParts* const parts = cutter_->partsOf(materials_, 0, uv, 0);
        if (parts == nullptr) continue;
        cut += !parts->triangles.empty();
        const double texels = 0.5 * repeats * repeats * 512 * 512;
        EXPECT_LE(double(parts->triangles.size()), std::clamp(texels / 128, 256.0, 65536.0)) << repeats;
    }
    EXPECT_GT(cut, 0);
    // A strip of many texels' length and hardly a width.
    const MaskParts* const strip = cutter_->partsOf(materials_, 0, {{{0, 0}, {20, 0.001f}, {20, 0}}}, 0);
    if (strip != nullptr) {
        EXPECT_LE(strip->triangles.size(), 256u);
    }
}

/// Discs in rows and columns, each in a square of 64 texels.
uint8_t rowsOfDiscs(uint32_t x, uint32_t y) { return disc(30, 34, 25)(x % 64, y % 64); }

TEST_F(MaskCutterTest, AnAtlasIsAsSharpAsItsTexels) {
    const Picture atlas{1024, 1024, rowsOfDiscs};
    for (const Uv& uv : {kLower, kUpper}) {
        const MaskParts* const parts = cut(atlas, uv);
        ASSERT_NE(parts, nullptr);
        check(atlas, uv, *parts);
        EXPECT_GT(parts->triangles.size(), 128 * 8u) << "there are 128 rowsOfDiscs, and 16 halves";
        EXPECT_LT(parts->triangles.size(), 4096u);
    }
}

TEST_F(MaskCutterTest, WhatIsSmallInTheWorldHasFewerCornersButKeepsItsShape) {
    // Teeth of 8 texels about a disc.
    const Picture leaf{256, 256, [](uint32_t x, uint32_t y) {
                           const double dx = x + 0.5 - 120, dy = y + 0.5 - 130;
                           const double radius = 90 + 4 * std::sin(40 * std::atan2(dy, dx));
                           return uint8_t(std::clamp(127.5 + 127.5 * (radius - std::hypot(dx, dy)), 0.0, 255.0));
                       }};
    materials_ = {materialOf(leaf)};
    const double whole = 3.14159265 * 90 * 90;
    size_t before = 1000;
    // A square whose edge is 1, 10 and 1000000 times less than the mesh's thousand.
    for (const double detail : {0.001, 0.08, 1e6}) {
        MaskCutter cutter(1 << 24);
        cutter.setDetail(detail);
        double area = 0;
        size_t count = 0;
        std::set<std::array<double, 3>> diagonal[2];
        for (const Uv& uv : {kLower, kUpper}) {
            const MaskParts* const parts = cutter.partsOf(materials_, 0, uv, 0.5);
            ASSERT_NE(parts, nullptr);
            area += areaOf(*parts) / 2 * 256 * 256;
            count += parts->triangles.size();
            const auto at = [](glm::vec2 p) { return MaskCorner{{p.x, p.y, 0}, p, kWhite, kUnknownNormal}; };
            diagonal[uv == kUpper] = pointsOnEdge(*parts, uv == kLower ? 1 : 2, {at(uv[0]), at(uv[1]), at(uv[2])});
        }
        EXPECT_LT(count, before) << detail;
        EXPECT_GE(count, 10u) << detail;
        EXPECT_NEAR(area, whole, 0.15 * whole) << detail;
        before = detail > 0.001 ? std::max<size_t>(count + 1, 20) : count;
        EXPECT_EQ(diagonal[0], diagonal[1]) << "an edge is cut for itself alone";
    }
    EXPECT_LT(before, 60u);
}

TEST_F(MaskCutterTest, PartsAreDelaunayInTexels) {
    const auto leaf = disc(120, 120, 100), hole = disc(140, 100, 40);
    const Picture picture{
        256, 128, [&](uint32_t x, uint32_t y) { return std::min(leaf(x, 2 * y), uint8_t(255 - hole(x, 2 * y))); }};
    for (const Uv& uv : {kLower, Uv{{{-0.4f, 0.1f}, {1.4f, -0.3f}, {0.2f, 1.7f}}}}) {
        const MaskParts* const parts = cut(picture, uv);
        ASSERT_NE(parts, nullptr);
        std::vector<glm::dvec2> at;
        for (const Weights& w : parts->points) {
            const glm::dvec2 p = placeOf(w);
            const glm::dvec2 a(uv[0]), b(uv[1]), c(uv[2]);
            at.push_back((a + p.x * (b - a) + p.y * (c - a)) * glm::dvec2(256, 128));
        }
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> opposite;
        for (const auto& t : parts->triangles)
            for (size_t i = 0; i < 3; ++i) opposite[{t[i], t[(i + 1) % 3]}] = t[(i + 2) % 3];
        int inner = 0;
        for (const auto& each : opposite) {
            const auto edge = each.first;
            const auto other = opposite.find({edge.second, edge.first});
            if (other == opposite.end()) continue;
            ++inner;
            const auto angleAt = [&](uint32_t corner) {
                const glm::dvec2 u = at[edge.first] - at[corner], v = at[edge.second] - at[corner];
                return std::atan2(std::abs(cross(u, v)), u.x * v.x + u.y * v.y);
            };
            EXPECT_LT(angleAt(each.second) + angleAt(other->second), 3.14159265 + 1e-3);
        }
        EXPECT_GT(inner, 10);
    }
}

TEST_F(MaskCutterTest, OutlinesDoNotCrossHoweverSimple) {
    // Outlines of grains, which wind and enclose each other.
    int segments = 0;
    for (uint32_t seed = 0; seed < 6; ++seed) {
        const auto grain = noise(seed);
        const Picture picture{64, 64, [&](uint32_t x, uint32_t y) { return grain(x / 4, y / 4); }};
        materials_ = {materialOf(picture)};
        const auto mask = loadMask(materials_[0], 1 << 20);
        ASSERT_TRUE(mask.ok());
        const std::array<glm::dvec2, 3> texels{glm::dvec2(0, 0), glm::dvec2(64, 3), glm::dvec2(20, 64)};
        const auto outline = findOutline(*mask, texels);
        ASSERT_TRUE(outline.has_value());
        OutlineSimplifier simplifier(outline->loops, texels);
        const size_t before = simplifier.triangles();
        simplifier.keepWithin(3);
        simplifier.keepAreas(seed < 3 ? 50 : 1e6, seed < 3 ? 0.1 : 10);
        EXPECT_LT(simplifier.triangles(), before);
        std::vector<std::pair<Weights, Weights>> lines;
        for (const MaskLoop& loop : simplifier.loops())
            for (size_t k = 0; k < loop.points.size(); ++k)
                lines.emplace_back(loop.points[k].weights, loop.points[(k + 1) % loop.points.size()].weights);
        segments += int(lines.size());
        for (size_t i = 0; i < lines.size(); ++i)
            for (size_t j = 0; j < i; ++j) {
                const auto& [a, b] = lines[i];
                const auto& [c, d] = lines[j];
                if (a == c || a == d || b == c || b == d) continue;
                const auto sides = [](const Weights& p, const Weights& q, const Weights& r, const Weights& s) {
                    const int64_t one = turnOf(p, q, r), other = turnOf(p, q, s);
                    return (one >= 0 && other <= 0) || (one <= 0 && other >= 0);
                };
                const bool areInLine = turnOf(a, b, c) == 0 && turnOf(a, b, d) == 0;
                EXPECT_FALSE(!areInLine && sides(a, b, c, d) && sides(c, d, a, b)) << "seed " << seed;
            }
    }
    EXPECT_GT(segments, 60);
}

TEST_F(MaskCutterTest, CoordinatesWithoutSense) {
    const Picture picture{64, 64, disc(30, 30, 20)};
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    EXPECT_EQ(cut(picture, {{{nan, 0}, {1, 0}, {0, 1}}}), nullptr);
    for (const float wild : {inf, -3e38f, 1e20f, 1e7f})
        EXPECT_EQ(cutter_->partsOf(materials_, 0, {{{0, 0}, {wild, 0}, {0, wild}}}, 0), nullptr) << wild;
    // All corners in one place, or in a line.
    const MaskParts* parts = cutter_->partsOf(materials_, 0, {{{0.9f, 0.9f}, {0.9f, 0.9f}, {0.9f, 0.9f}}}, 0);
    ASSERT_NE(parts, nullptr);
    EXPECT_TRUE(parts->triangles.empty());
    EXPECT_EQ(cutter_->partsOf(materials_, 0, {{{0.5f, 0.5f}, {0.5f, 0.5f}, {0.5f, 0.5f}}}, 0), nullptr);
    const Uv line{{{0, 0.5f}, {0.5f, 0.5f}, {1, 0.5f}}};
    parts = cutter_->partsOf(materials_, 0, line, 0);
    ASSERT_NE(parts, nullptr);
    check(picture, line, *parts);
    EXPECT_EQ(cutter_->partsOf(materials_, 7, kLower, 0), nullptr) << "there is no such material";
}

TEST_F(MaskCutterTest, AMaskThatCannotBeReadIsOneWarning) {
    Material material = materialOf({16, 16, disc(8, 8, 5)});
    std::string broken = *material.mask.image.bytes;
    broken.resize(broken.size() - 30);
    material.mask.image.bytes = std::make_shared<const std::string>(broken);
    materials_ = {material};
    MaskCutter cutter(1 << 20);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(cutter.partsOf(materials_, 0, kLower, 0), nullptr);
    ASSERT_EQ(cutter.warnings().size(), 1u);
    EXPECT_NE(cutter.warnings()[0].find("material 'leaf' is not cut"), std::string::npos) << cutter.warnings()[0];
}

TEST_F(MaskCutterTest, LargeMasksAreReadMoreCoarselyWhateverTheMemory) {
    // One bit a texel, white in the first three quarters.
    std::string row(20000 / 8, '\0');
    std::fill_n(row.begin(), row.size() * 3 / 4, char(255));
    std::string rows;
    for (int y = 0; y < 900; ++y) rows += '\0' + row;
    Material material;
    material.mask.image.bytes = std::make_shared<const std::string>(test::pngFile(20000, 900, 1, 0, rows));
    material.mask.mayBeGrey = true;
    const auto mask = loadMask(material, 1 << 20);
    ASSERT_TRUE(mask.ok()) << mask.error().line();
    EXPECT_EQ(mask->size(), glm::dvec2(10000, 450));
    EXPECT_GT(mask->marginAt({7499, 225}), 0);
    EXPECT_LT(mask->marginAt({7501, 225}), 0);
    EXPECT_NEAR(mask->marginAt({7500, 225}), 0, 1);
}

TEST_F(MaskCutterTest, AMaskThatTakesMoreThanItsMemoryIsAWarning) {
    // Interlaced, so that it is held as a whole: 512 x 512 texels of 4 bytes.
    materials_ = {materialOf({16, 16, disc(8, 8, 5)})};
    std::string rows;
    constexpr std::array<std::array<uint32_t, 4>, 7> kPasses{
        {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4}, {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}}};
    for (const auto& [x, y, dx, dy] : kPasses)
        for (uint32_t j = y; j < 512; j += dy) {
            rows += '\0';
            for (uint32_t i = x; i < 512; i += dx) rows += std::string(3, 'a') + char(i < 256 ? 255 : 0);
        }
    materials_[0].mask.image.bytes = std::make_shared<const std::string>(test::pngFile(512, 512, 8, 6, rows, "", true));
    MaskCutter little(1 << 18), enough(1 << 22);
    EXPECT_EQ(little.partsOf(materials_, 0, kLower, 0), nullptr);
    ASSERT_EQ(little.warnings().size(), 1u);
    EXPECT_NE(little.warnings()[0].find("let the memory cap be larger"), std::string::npos) << little.warnings()[0];
    const MaskParts* const parts = enough.partsOf(materials_, 0, kLower, 0);
    ASSERT_NE(parts, nullptr);
    EXPECT_NEAR(areaOf(*parts), 0.25, 0.01);
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
        const MaskParts *const a = little.partsOf(materials_, number, uv, 0), *const b = much.partsOf(materials_,
                                                                                                      number, uv, 0);
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
