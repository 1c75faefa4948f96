// Maps from prisms to tile space.
#include "mesostructure/prism_maps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/base/subdivision.h"

namespace vcp::meso {
namespace {

using glm::dvec3;

constexpr dvec3 kTile{1, 1, 0.25};

struct Prisms {
    Prisms(const BaseSurface& surface, double height) : pieces(shellPieces(surface, height, kTile, 0, shell)) {}
    explicit Prisms(const char* name, double height = 0.2) : Prisms(*makeBaseSurface(name, 4), height) {}

    [[nodiscard]] size_t count() const { return pieces.size() / 3; }
    [[nodiscard]] std::span<const ShellPiece, 3> own(size_t i) const {
        return std::span<const ShellPiece, 3>(&pieces[3 * i], 3);
    }

    Shell shell;
    std::vector<ShellPiece> pieces;
};

class Places {
public:
    dvec3 direction() {
        const double up = 2 * unit() - 1, turn = 2 * 3.14159265358979 * unit(), flat = std::sqrt(1 - up * up);
        return {flat * std::cos(turn), flat * std::sin(turn), up};
    }
    dvec3 weights() {
        const double a = std::sqrt(unit()), b = unit();
        return {1 - a, a * (1 - b), a * b};
    }
    double unit() { return unit_(random_); }

private:
    std::mt19937_64 random_{7};
    std::uniform_real_distribution<double> unit_{0, 1};
};

TEST(PrismMaps, AreOneOverAFlatBase) {
    const Prisms prisms("quad");
    Places places;
    for (int i = 0; i < 500; ++i) {
        const size_t at = size_t(i) % prisms.count();
        const PrismCorners corners = prismOf(prisms.own(at));
        const PrismPlace place = curvedPlace(corners, places.weights(), places.unit());
        const auto linear = linearPlace(prisms.own(at), place.world);
        const auto straight = straightPassage(corners, place.world, places.direction());
        ASSERT_TRUE(linear && straight) << i;
        EXPECT_LT(glm::distance(*linear, place.tile), 1e-12) << i;
        EXPECT_LT(glm::distance(straight->tile(), place.tile), 1e-9) << i;
        EXPECT_NEAR(straight->printedLeave, straight->leave, 1e-9) << i;
    }
}

TEST(PrismMaps, AgreeAtCornersAndOnTheFaces) {
    // One line has the tetrahedra's places where a ray enters and leaves: the sides are the same triangles.
    const Prisms prisms("torus");
    Places places;
    int compared = 0;
    for (int i = 0; i < 2000; ++i) {
        const size_t at = size_t(places.unit() * double(prisms.count()));
        const PrismCorners corners = prismOf(prisms.own(at));
        const dvec3 world = curvedPlace(corners, places.weights(), places.unit()).world, d = places.direction();
        const auto straight = straightPassage(corners, world, d);
        if (!straight) continue;
        for (const auto& [t, tile] :
             {std::pair(straight->enter, straight->enterTile), std::pair(straight->leave, straight->leaveTile)}) {
            const auto linear = linearPlace(prisms.own(at), world + t * (1 - 1e-9) * d);
            ASSERT_TRUE(linear) << i;
            EXPECT_LT(glm::distance(*linear, tile), 1e-6) << i;
        }
        ++compared;
    }
    EXPECT_GT(compared, 1900);
    const PrismCorners corners = prismOf(prisms.own(5));
    for (int k = 0; k < 6; ++k) {
        dvec3 weights(0);
        weights[k % 3] = 1;
        const PrismPlace place = curvedPlace(corners, weights, k / 3);
        EXPECT_EQ(place.world, corners.world[k]);
        EXPECT_EQ(place.tile, corners.tile[k]);
    }
}

TEST(PrismMaps, BothPrismsAtASideCutItAlike) {
    // Whatever the order of a triangle's corners: each triangle of a side is one of two prisms, or on a border.
    for (const char* name : {"torus", "teapot", "tree"}) {
        BaseSurface surface = *makeBaseSurface(name, 4);
        for (size_t i = 0; i < surface.triangles.size(); ++i) {
            std::rotate(surface.triangles[i].begin(), surface.triangles[i].begin() + std::ptrdiff_t(i % 3),
                        surface.triangles[i].end());
            std::rotate(surface.uvs[i].begin(), surface.uvs[i].begin() + std::ptrdiff_t(i % 3), surface.uvs[i].end());
        }
        const Prisms prisms(surface, 0.02);
        ASSERT_EQ(prisms.pieces.size(), 3 * surface.triangles.size()) << name;
        using Key = std::array<double, 3>;
        std::map<std::set<Key>, int> uses;   // of each triangle of a side
        std::map<std::set<Key>, int> sides;  // of each side, by the edge of the base
        for (size_t i = 0; i < prisms.count(); ++i) {
            const PrismCorners corners = prismOf(prisms.own(i));
            const auto key = [&](int k) { return Key{corners.world[k].x, corners.world[k].y, corners.world[k].z}; };
            for (size_t face = 2; face < 8; ++face)
                ++uses[{key(kPrismFaces[face][0]), key(kPrismFaces[face][1]), key(kPrismFaces[face][2])}];
            for (int k = 0; k < 3; ++k) ++sides[{key(k), key((k + 1) % 3)}];
        }
        EXPECT_EQ(uses.size(), 2 * sides.size()) << name << ": a side that is cut in two ways has four triangles";
        for (const auto& [triangle, count] : uses) EXPECT_LE(count, 2) << name;
    }
}

TEST(PrismMaps, DistortLessTheLessAPrismTurns) {
    // The curved map differs from a linear one by terms of second order.
    const auto worst = [](int times) {
        // The flat faces of a box stay out of this: a sphere's triangles all turn.
        const Prisms prisms(*subdivided(*makeBaseSurface("sphere", 1), times), 0.2);
        Places places;
        std::array<std::vector<double>, 2> off;
        for (int i = 0; i < 4000; ++i) {
            const size_t at = size_t(places.unit() * double(prisms.count()));
            const PrismCorners corners = prismOf(prisms.own(at));
            const PrismPlace place = curvedPlace(corners, places.weights(), places.unit());
            const auto linear = linearPlace(prisms.own(at), place.world);
            const auto straight = straightPassage(corners, place.world, places.direction());
            if (!linear || !straight) continue;
            off[0].push_back(glm::distance(*linear, place.tile));
            off[1].push_back(glm::distance(straight->tile(), place.tile));
        }
        std::array<double, 2> all{};
        for (size_t k = 0; k < 2; ++k) {
            std::ranges::nth_element(off[k], off[k].begin() + std::ptrdiff_t(off[k].size() / 2));
            all[k] = off[k][off[k].size() / 2];
        }
        return all;
    };
    const auto coarse = worst(0), fine = worst(1);
    for (size_t k = 0; k < 2; ++k) {
        EXPECT_GT(coarse[k], 0) << k;
        EXPECT_LT(fine[k], 0.6 * coarse[k]) << k;
    }
}

}  // namespace
}  // namespace vcp::meso
