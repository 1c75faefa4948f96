// The certificate of a soft leaf: its parts against dense sampling, and the promise itself measured both ways.
#include "builder/page/leaf_certificate.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "builder/page/page_geometry.h"
#include "octree/surface/leaf_math.h"
#include "octree/surface/packing.h"
#include "tests/support/lattice_meshes.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

std::array<uint32_t, 8> randomCodes(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::array<uint32_t, 8> codes;
    for (uint32_t& code : codes) code = uint32_t(random());
    return codes;
}

/// Corners as a plane with a little noise would have them: what real leaves look like.
std::array<uint32_t, 8> tameCodes(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const auto direction = [&] { return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random))); };
    const glm::dvec3 n = direction();
    std::array<uint32_t, 8> codes;
    for (int i = 0; i < 8; ++i) {
        const double d = glm::dot(n, glm::dvec3(i & 1, i >> 1 & 1, i >> 2) - 0.5);
        const glm::dvec3 at = glm::normalize(n + 0.1 * direction());
        codes[i] = packVector(std::abs(d), d < 0 ? -at : at, d < 0);
    }
    return codes;
}

/// The leaf as a page stores it: two faces perpendicular to `axis`.
f64::LeafField asField(const std::array<uint32_t, 8>& codes, uint32_t axis) {
    uint4 face[2];
    for (uint32_t end = 0; end < 2; ++end)
        for (uint32_t c = 0; c < 4; ++c)
            face[end][c] = codes[end << axis | (c & 1) << (axis + 1) % 3 | (c >> 1) << (axis + 2) % 3];
    return f64::decodeLeaf(face[0], face[1], axis);
}

class Samples {
public:
    explicit Samples(uint64_t seed) : random_(seed) {}
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    glm::dvec3 point(double low, double high) { return {between(low, high), between(low, high), between(low, high)}; }
    glm::dvec3 direction() {
        std::normal_distribution<double> normal;
        return glm::normalize(glm::dvec3(normal(random_), normal(random_), normal(random_)));
    }

private:
    std::mt19937_64 random_;
};

TEST(LeafSurface, IsTheLeafOfThePage) {
    for (uint64_t seed = 0; seed < 500; ++seed) {
        const auto codes = randomCodes(seed);
        const LeafSurface surface(codes);
        Samples s(seed);
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const f64::LeafField field = asField(codes, axis);
            for (int i = 0; i < 20; ++i) {
                const glm::dvec3 x = s.point(-0.5, 1.5);
                ASSERT_NEAR(surface.value(x), f64::leafValue(field, x), 1e-12) << seed << " axis " << axis;
            }
        }
    }
}

TEST(LeafSurface, BatchIsWithinItsRounding) {
    double most = 0;
    for (uint64_t seed = 0; seed < 5000; ++seed) {
        const LeafSurface surface(randomCodes(seed));
        Samples s(seed);
        LeafSurface::Batch batch;
        for (int i = 0; i < 16; ++i) {
            // The extremes of the range, too.
            const glm::dvec3 p = i < 8 ? glm::dvec3(i & 1 ? 2 : -2, i & 2 ? 2 : -2, i & 4 ? 2 : -2) : s.point(-2, 2);
            batch.x[i] = float(p.x);
            batch.y[i] = float(p.y);
            batch.z[i] = float(p.z);
        }
        surface.evaluate(batch);
        for (int i = 8; i < 16; ++i)
            most = std::max(most, std::abs(batch.value[i] - surface.value({batch.x[i], batch.y[i], batch.z[i]})));
    }
    // Random codes are far wilder than a leaf that certifies.
    EXPECT_LE(most, 5 * LeafSurface::kBatchRounding);
}

TEST(LeafSurface, BatchIsWithinItsRoundingOnRealLeaves) {
    double most = 0;
    for (uint64_t seed = 0; seed < 20000; ++seed) {
        const LeafSurface surface(tameCodes(seed));
        Samples s(seed);
        LeafSurface::Batch batch;
        std::array<glm::dvec3, 16> exact;
        for (int i = 0; i < 16; ++i) {
            exact[i] = s.point(-0.125, 1.125);
            batch.x[i] = float(exact[i].x);
            batch.y[i] = float(exact[i].y);
            batch.z[i] = float(exact[i].z);
        }
        surface.evaluate(batch);
        // The rounding of the points to float is part of it: the builder gives them in double.
        for (int i = 0; i < 16; ++i) most = std::max(most, std::abs(batch.value[i] - surface.value(exact[i])));
    }
    EXPECT_LE(most, LeafSurface::kBatchRounding);
}

template <class Codes>
void expectBernsteinBounds(const Codes& codesOf, uint64_t seeds) {
    for (uint64_t seed = 0; seed < seeds; ++seed) {
        const LeafSurface surface(codesOf(seed));
        Samples s(seed);
        const double margin = s.between(0, 1);
        const double low = -margin, high = 1 + margin;
        const BernsteinCube cube(surface, low, high);
        const glm::dvec3 n = s.direction();
        const double slope = cube.minDerivative(n), curvature = cube.maxCurvature();
        constexpr double h = 1e-4;
        for (int i = 0; i < 200; ++i) {
            const glm::dvec3 x = s.point(low, high), d = s.direction();
            const double derivative = (surface.value(x + h * n) - surface.value(x - h * n)) / (2 * h);
            ASSERT_GE(derivative, slope - 1e-5) << seed;
            const double second =
                (surface.value(x + h * d) + surface.value(x - h * d) - 2 * surface.value(x)) / (h * h);
            ASSERT_LE(std::abs(second), curvature + 1e-5) << seed;
            for (int axis = 0; axis < 3; ++axis)
                for (int end = 0; end < 2; ++end) {
                    glm::dvec3 onFace = x;
                    onFace[axis] = end ? high : low;
                    const BernsteinCube::Range range = cube.faceRange(axis, end);
                    const double value = surface.value(onFace);
                    ASSERT_GE(value, range.min - 1e-12) << seed;
                    ASSERT_LE(value, range.max + 1e-12) << seed;
                }
        }
    }
}

TEST(BernsteinCube, BoundsWildLeaves) { expectBernsteinBounds(randomCodes, 400); }
TEST(BernsteinCube, BoundsRealLeaves) { expectBernsteinBounds(tameCodes, 400); }

TEST(BernsteinCube, BoundsAreNotIdle) {
    // On tame leaves the bounds are near the truth: f of a plane has slope 1 and no curvature.
    std::array<uint32_t, 8> codes;
    for (int i = 0; i < 8; ++i) {
        const double d = (i >> 2) - 0.4;
        codes[i] = packVector(std::abs(d), {0, 0, d < 0 ? -1 : 1}, d < 0);
    }
    const BernsteinCube cube(LeafSurface(codes), -0.125, 1.125);
    EXPECT_NEAR(cube.minDerivative({0, 0, 1}), 1, 0.01);
    EXPECT_LT(cube.maxCurvature(), 0.02);
    EXPECT_NEAR(cube.faceRange(2, 0).max, -0.525, 0.01);
    EXPECT_NEAR(cube.faceRange(2, 1).min, 0.725, 0.01);
}

TEST(WallCode, IsTheSmallestThatHolds) {
    EXPECT_EQ(wallCode(0), 0u);
    EXPECT_EQ(wallCode(-1), 0u);
    for (double value = 1e-6; value < 0.2; value *= 1.01) {
        const uint32_t code = wallCode(value);
        if (code > kSoftWallMask) {
            EXPECT_GT(value, wallOf(kSoftWallMask));
            continue;
        }
        EXPECT_GE(wallOf(code), value);
        if (code > 1) {
            EXPECT_LT(wallOf(code - 1), value);
        }
        // What a ray uses is what was certified.
        EXPECT_NEAR(f64::wallTolerance(code << kSoftWallShift), wallOf(code), 1e-12);
    }
    EXPECT_EQ(wallCode(1e9), kSoftWallMask + 1);
}

TEST(DipCode, CoversTheSwing) {
    for (double curvature = 1e-4; curvature < 10; curvature *= 1.1)
        EXPECT_GE(f64::dipBound(dipCode(curvature) << kSoftDipShift) * (1 + 1e-12), curvature * 3 / 8) << curvature;
    EXPECT_EQ(dipCode(0), 0u);
    EXPECT_EQ(dipCode(100), 3u);
}

/// A mesh in one page of 32 cells, and the certificates of its cells.
class OnePage {
public:
    explicit OnePage(const IndexedMesh& mesh) : mesh_(test::onLattice(mesh)), numbers_(mesh_.triangles.size()) {
        for (uint32_t i = 0; i < numbers_.size(); ++i) numbers_[i] = i;
        geometry_.emplace(mesh_, numbers_, glm::u32vec3(0), 5);
    }

    /// `touched`: how many triangles the cell has.
    Certificate certify(glm::ivec3 cell, int cells, double tolerance, size_t* touched = nullptr) {
        const NodeBox box{cell * kSubcells, cells * kSubcells};
        std::vector<uint32_t> around, inside;
        geometry_->trianglesOf(box, around, inside);
        if (touched) *touched = inside.size();
        std::vector<CertifiedTriangle> held;
        for (const uint32_t k : around) held.push_back(geometry_->triangle(k));
        std::vector<const CertifiedTriangle*> triangles;
        for (const CertifiedTriangle& t : held) triangles.push_back(&t);
        CertificateScratch scratch;
        const auto corner = [&](int i) -> const CornerVector& {
            return geometry_->corner(box.lower + box.edge * glm::ivec3(i & 1, i >> 1 & 1, i >> 2));
        };
        return certifyLeaf(box.lowerCells(), box.edgeCells(), triangles, tolerance, corner, scratch);
    }
    const LatticeMesh& mesh() const { return mesh_; }
    PageGeometry& geometry() { return *geometry_; }

private:
    LatticeMesh mesh_;
    std::vector<uint32_t> numbers_;
    std::optional<PageGeometry> geometry_;
};

/// A height field z = 16 + h(x, y) over the whole page and beyond, with `n` quads across.
template <class Height>
IndexedMesh heightField(uint32_t n, const Height& height) {
    IndexedMesh mesh;
    const auto at = [&](uint32_t i) { return -0.5 + 33.0 * i / n; };
    for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i <= n; ++i) mesh.positions.push_back({at(i), at(j), 16 + height(at(i), at(j))});
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
            mesh.triangles.push_back({a, b, d});
            mesh.triangles.push_back({a, d, c});
        }
    return mesh;
}

/// Smooth surfaces of several curvatures, in the page.
IndexedMesh smoothMesh(uint64_t seed) {
    Samples s(seed);
    switch (seed % 4) {
        case 0:
            return test::sphereMesh(s.point(14, 18), s.between(2, 12), 40);
        case 1: {
            IndexedMesh mesh = test::torusMesh(glm::dvec3(16), s.between(6, 9), s.between(2, 4), 90, 40);
            test::rotate(mesh, glm::dvec3(16), s.direction(), s.between(0, 3));
            return mesh;
        }
        case 2: {
            const double k = s.between(0.2, 0.8), a = s.between(0.1, 1.5), phase = s.between(0, 6);
            return heightField(60,
                               [=](double x, double y) { return a * std::sin(k * x + phase) * std::cos(0.7 * k * y); });
        }
        default: {
            // Noise, so that triangles are not all of one smooth surface.
            std::mt19937_64 random(seed);
            std::uniform_real_distribution<double> unit(-1, 1);
            const double noise = s.between(0, 0.15), tilt = s.between(-0.8, 0.8);
            return heightField(40, [&](double x, double) { return tilt * (x - 16) * 0.8 + noise * unit(random); });
        }
    }
}

/// Crossings of f = 0 on lines through the leaf, in leaf space.
std::vector<glm::dvec3> surfacePoints(const LeafSurface& surface, Samples& s, int lines) {
    std::vector<glm::dvec3> points;
    constexpr int kSteps = 24;
    for (int i = 0; i < lines; ++i) {
        const glm::dvec3 a = s.point(0, 1), d = s.point(0, 1) - a;
        for (int k = 0; k < kSteps; ++k) {
            double u0 = double(k) / kSteps, u1 = double(k + 1) / kSteps;
            const bool below = surface.value(a + u0 * d) < 0;
            if ((surface.value(a + u1 * d) < 0) == below) continue;
            for (int step = 0; step < 40; ++step) {
                const double middle = (u0 + u1) / 2;
                ((surface.value(a + middle * d) < 0) == below ? u0 : u1) = middle;
            }
            points.push_back(a + u0 * d);
        }
    }
    return points;
}

TEST(Certificate, HoldsBothWays) {
    constexpr double kTolerance = 0.08;
    size_t soft = 0, cells = 0;
    double worstPart = 0;
    for (uint64_t seed = 0; seed < 16; ++seed) {
        OnePage page(smoothMesh(seed));
        const IndexedMesh mesh = test::inCells(page.mesh());
        std::vector<Triangle3> all;
        for (size_t k = 0; k < mesh.triangles.size(); ++k) all.push_back(mesh.corners(k));
        Samples s(seed);
        Polygon polygon;
        for (const int edge : {1, 2}) {
            for (int z = 0; z < 32; z += edge)
                for (int y = 0; y < 32; y += edge)
                    for (int x = 0; x < 32; x += edge) {
                        size_t touched = 0;
                        const Certificate c = page.certify({x, y, z}, edge, kTolerance, &touched);
                        if (touched == 0) continue;
                        ++cells;
                        if (!c.soft || s.between(0, 1) > 0.5) continue;
                        ++soft;
                        const LeafSurface surface(c.codes);
                        const double bound = (c.maxValue + wallOf(wallCode(c.maxValue))) / c.minSlope * edge;
                        ASSERT_LE(bound, kTolerance + 1e-9);
                        const glm::dvec3 lower(x, y, z);
                        const auto where = [&] {
                            return testing::Message()
                                   << "seed " << seed << " leaf " << x << ' ' << y << ' ' << z << " edge " << edge;
                        };
                        // The surface to the mesh.
                        for (const glm::dvec3& q : surfacePoints(surface, s, 12)) {
                            const glm::dvec3 p = lower + q * double(edge);
                            double best = 1e300;
                            for (const Triangle3& t : all) {
                                if (glm::length(t[0] - p) > best + 4) continue;  // triangles are shorter than 4
                                best = std::min(best, std::sqrt(closestOnTriangle(p, t).squared));
                            }
                            worstPart = std::max(worstPart, best / bound);
                            ASSERT_LE(best, bound) << where();
                        }
                        // The mesh to the surface: within the bound f changes its sign.
                        for (const Triangle3& t : all) {
                            if (glm::length(t[0] - lower) > 8) continue;
                            clipToBox(t, lower, lower + double(edge), polygon);
                            for (size_t i = 0; i < polygon.size(); ++i) {
                                const glm::dvec3 p =
                                    ((polygon[i] + polygon[(i + 1) % polygon.size()]) / 2.0 - lower) / double(edge);
                                constexpr double h = 1e-5;
                                const double f = surface.value(p);
                                ASSERT_LE(std::abs(f), c.maxValue + 1e-9) << where();
                                glm::dvec3 gradient;
                                for (int axis = 0; axis < 3; ++axis) {
                                    glm::dvec3 step(0);
                                    step[axis] = h;
                                    gradient[axis] = (surface.value(p + step) - surface.value(p - step)) / (2 * h);
                                }
                                const glm::dvec3 q =
                                    p - gradient * (std::copysign(bound / edge, f) / glm::length(gradient));
                                ASSERT_LE(surface.value(q) * f, 1e-12) << where();
                            }
                        }
                    }
        }
    }
    EXPECT_GT(soft, 2000u);
    EXPECT_GT(worstPart, 0.2) << "the bound is far from the truth";
    RecordProperty("cells", int(cells));
    RecordProperty("soft", int(soft));
}

TEST(Certificate, FlatSheetIsSoft) {
    OnePage page(heightField(20, [](double x, double y) { return 0.2 * x - 0.1 * y; }));
    for (int x = 2; x < 30; x += 3) {
        const Certificate c = page.certify({x, 16, int(std::floor(16 + 0.2 * (x + 0.5) - 1.65))}, 1, 0.05);
        EXPECT_TRUE(c.soft) << x;
        EXPECT_LT(c.maxValue, 0.01);
        EXPECT_GT(c.minSlope, 0.9);
    }
}

TEST(Certificate, NothingIsNotSoft) {
    OnePage page(heightField(20, [](double, double) { return 0.3; }));
    EXPECT_FALSE(page.certify({3, 3, 3}, 1, 0.05).soft);
}

/// No cell of which the surface's feature is in or near is soft.
void expectRefused(const IndexedMesh& mesh, const std::function<bool(glm::dvec3 lower)>& hasFeature) {
    OnePage page(mesh);
    int refused = 0, soft = 0;
    for (int z = 0; z < 32; ++z)
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x) {
                size_t touched = 0;
                const Certificate c = page.certify({x, y, z}, 1, 0.08, &touched);
                if (touched == 0) continue;
                if (hasFeature({x, y, z})) {
                    ++refused;
                    EXPECT_FALSE(c.soft) << x << ' ' << y << ' ' << z;
                }
                soft += c.soft;
            }
    EXPECT_GT(refused, 5);
    EXPECT_GT(soft, 5) << "the rest of the mesh is smooth";
}

TEST(Certificate, BorderIsRefused) {
    // The field ends at y = 16.3: a quad's row is left out.
    IndexedMesh mesh = heightField(33, [](double x, double y) { return 0.3 + 0.05 * x + 0.02 * y; });
    std::erase_if(mesh.triangles, [&](const auto& t) {
        return std::max({mesh.positions[t[0]].y, mesh.positions[t[1]].y, mesh.positions[t[2]].y}) > 16.6;
    });
    expectRefused(mesh, [](glm::dvec3 lower) { return lower.y == 16; });
}

TEST(Certificate, CreaseIsRefused) {
    // A roof with its ridge at x = 16.5; 80 degrees.
    expectRefused(heightField(33, [](double x, double) { return 0.37 - 0.85 * std::abs(x - 16.5); }),
                  [](glm::dvec3 lower) { return lower.x == 16 && lower.z == 16; });
}

TEST(Certificate, FoldIsRefused) {
    // A sheet that turns back on itself at x = 16.5, 0.3 cells above.
    IndexedMesh mesh;
    for (uint32_t j = 0; j <= 33; ++j) {
        const double y = j - 0.5;
        mesh.positions.push_back({2.5, y, 16.5});
        mesh.positions.push_back({9.5, y, 16.5});
        mesh.positions.push_back({16.5, y, 16.6});
        mesh.positions.push_back({9.5, y, 17.8});
    }
    for (uint32_t j = 0; j < 33; ++j)
        for (uint32_t i = 0; i < 3; ++i) {
            const uint32_t a = 4 * j + i, b = a + 1, c = a + 4, d = c + 1;
            mesh.triangles.push_back({a, b, d});
            mesh.triangles.push_back({a, d, c});
        }
    expectRefused(mesh, [](glm::dvec3 lower) { return lower.x == 16; });
}

TEST(Certificate, TwoSheetsAreRefused) {
    IndexedMesh mesh = heightField(33, [](double x, double y) { return 0.2 + 0.01 * x + 0.01 * y; });
    IndexedMesh above = mesh;
    for (glm::dvec3& p : above.positions) p.z += 0.4;
    // The upper sheet covers half of the page, without its border in the cells that are looked at.
    test::append(mesh, above);
    OnePage page(mesh);
    int two = 0;
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 32; ++x) {
            const double z = 16.2 + 0.01 * (x + y);
            if (std::floor(z) != std::floor(z + 0.42)) continue;
            ++two;
            EXPECT_FALSE(page.certify({x, y, int(z)}, 1, 0.08).soft) << x << ' ' << y;
        }
    EXPECT_GT(two, 100);
}

TEST(Certificate, NonManifoldEdgeIsRefused) {
    IndexedMesh mesh = heightField(33, [](double, double) { return 0.4; });
    // A fin along the vertices at x = 16.5, lying almost in the sheet.
    IndexedMesh fin;
    for (uint32_t j = 0; j <= 33; ++j) {
        fin.positions.push_back({16.5, j - 0.5, 16.4});
        fin.positions.push_back({18.5, j - 0.5, 16.5});
    }
    for (uint32_t j = 0; j < 33; ++j) {
        fin.triangles.push_back({2 * j, 2 * j + 1, 2 * j + 3});
        fin.triangles.push_back({2 * j, 2 * j + 3, 2 * j + 2});
    }
    test::append(mesh, fin);
    expectRefused(mesh, [](glm::dvec3 lower) { return lower.x == 16 || lower.x == 18; });
}

TEST(Certificate, FarCornersAreRefused) {
    // Vectors longer than a packed distance can say.
    const LatticeMesh lattice = test::onLattice(heightField(33, [](double, double) { return 0.4; }));
    std::vector<uint32_t> numbers(lattice.triangles.size());
    for (uint32_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
    PageGeometry geometry(lattice, numbers, glm::u32vec3(0), 5);
    std::vector<uint32_t> around, inside;
    geometry.trianglesOf({glm::ivec3(10, 10, 16) * kSubcells, kSubcells}, around, inside);
    std::vector<CertifiedTriangle> held;
    for (const uint32_t k : around) held.push_back(geometry.triangle(k));
    std::vector<const CertifiedTriangle*> triangles;
    for (const CertifiedTriangle& t : held) triangles.push_back(&t);
    CornerVector far{1.8, {0, 0, 1}, 0};
    CertificateScratch scratch;
    EXPECT_FALSE(certifyLeaf(
                     {10, 10, 16}, 1, triangles, 1, [&](int) -> const CornerVector& { return far; }, scratch)
                     .soft);
}

}  // namespace
}  // namespace vcp
