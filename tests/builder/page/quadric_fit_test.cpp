// The quadric that fits points best: against a fit in double that is made another way, and known shapes.
#include "builder/page/quadric_fit.h"

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

namespace vcp {
namespace {

struct FittedPoints {
    std::vector<float> x, y, z;

    void add(glm::dvec3 p) {
        x.push_back(float(p.x));
        y.push_back(float(p.y));
        z.push_back(float(p.z));
    }
    [[nodiscard]] double residual(glm::dvec3 n) const {
        return quadricResidual(x.data(), y.data(), z.data(), x.size(), n);
    }
};

struct Axes {
    glm::dvec3 u, v, n;
};

Axes axesAcross(glm::dvec3 n) {
    const glm::dvec3 aside = std::abs(n.z) < 0.7 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
    const glm::dvec3 u = glm::normalize(glm::cross(aside, n));
    return {u, glm::cross(n, u), n};
}

glm::dvec3 unitVector(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
}

/// Height over the plane across n through the middle of the unit cube.
template <class Height>
glm::dvec3 pointOver(const Axes& axes, double a, double b, const Height& height) {
    return 0.5 + a * axes.u + b * axes.v + height(a, b) * axes.n;
}

/// Mean square of what is left of the heights when they and the terms have been made orthogonal to all terms before
/// (Gram and Schmidt, twice, point by point). `ridge`: times the coefficients' squares, is added to what is least.
double referenceSquare(const FittedPoints& points, glm::dvec3 n, double ridge) {
    const Axes axes = axesAcross(n);
    const size_t count = points.x.size();
    std::array<std::vector<double>, 7> column;  // the last: heights
    for (size_t i = 0; i < count; ++i) {
        const glm::dvec3 p = glm::dvec3(points.x[i], points.y[i], points.z[i]) - 0.5;
        const double a = glm::dot(p, axes.u), b = glm::dot(p, axes.v);
        const double terms[] = {1, a, b, a * a, a * b, b * b, glm::dot(p, axes.n)};
        for (size_t k = 0; k < 7; ++k) column[k].push_back(terms[k]);
    }
    for (size_t row = 0; row < 6; ++row)
        for (size_t k = 0; k < 7; ++k) column[k].push_back(k == row ? std::sqrt(ridge * double(count)) : 0);
    const auto dot = [&](size_t k, size_t l) {
        double sum = 0;
        for (size_t i = 0; i < count + 6; ++i) sum += column[k][i] * column[l][i];
        return sum;
    };
    for (size_t k = 1; k < 7; ++k)
        for (int again = 0; again < 2; ++again)
            for (size_t l = 0; l < k; ++l) {
                const double square = dot(l, l);
                if (square < 1e-20) continue;
                const double part = dot(k, l) / square;
                for (size_t i = 0; i < count + 6; ++i) column[k][i] -= part * column[l][i];
            }
    return dot(6, 6) / double(count);
}

// The ridge, and what floats may add to a mean square.
constexpr double kRidge = 1e-6, kFloatSquare = 1e-8;

TEST(QuadricFit, AgreesWithAFitInDouble) {
    double most = 0;
    for (uint64_t seed = 0; seed < 300; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> half(-0.5, 0.5);
        const Axes axes = axesAcross(unitVector(random));
        const double noise = std::pow(10.0, -4 + double(seed % 4)), wave = 3 * half(random), bend = half(random);
        FittedPoints points;
        for (size_t count = 8 * (2 + random() % 30); count > 0; --count)
            points.add(pointOver(axes, half(random), half(random), [&](double a, double b) {
                return bend * a * b + 0.1 * std::sin(wave * 5 * a) + noise * half(random);
            }));
        const double square = std::pow(points.residual(axes.n), 2), least = referenceSquare(points, axes.n, 0);
        ASSERT_GT(square, least * (1 - 1e-4) - kFloatSquare);
        // Its ridge counts coefficients in other axes: at most twice.
        ASSERT_LT(square, referenceSquare(points, axes.n, 2 * kRidge) * (1 + 1e-4) + kFloatSquare);
        most = std::max(most, std::sqrt(least));
    }
    EXPECT_GT(most, 0.01);
}

TEST(QuadricFit, LeavesNothingOfAQuadric) {
    for (uint64_t seed = 0; seed < 100; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> half(-0.5, 0.5);
        const Axes axes = axesAcross(unitVector(random));
        double c[6];
        for (double& k : c) k = half(random);
        FittedPoints points;
        for (int i = 0; i < 64; ++i)
            points.add(pointOver(axes, half(random), half(random), [&](double a, double b) {
                return c[0] + c[1] * a + c[2] * b + c[3] * a * a + c[4] * a * b + c[5] * b * b;
            }));
        EXPECT_LT(points.residual(axes.n), 1e-3);
        EXPECT_NEAR(points.residual(-axes.n), points.residual(axes.n), 1e-4);
    }
}

// x^3 on [-1/2, 1/2] is nearest to 3/20 x: of its mean square 1/448, (3/20)^2 / 12 goes.
TEST(QuadricFit, LeavesTheKnownPartOfACubic) {
    for (const glm::dvec3 n :
         {glm::dvec3(0, 0, 1), glm::dvec3(0, -1, 0), glm::dvec3(1, 0, 0), glm::normalize(glm::dvec3(1, 2, -3))}) {
        const Axes axes = axesAcross(n);
        FittedPoints points;
        constexpr int kSteps = 64;
        for (int j = 0; j < kSteps; ++j)
            for (int i = 0; i < kSteps; ++i)
                points.add(pointOver(axes, (i + 0.5) / kSteps - 0.5, (j + 0.5) / kSteps - 0.5,
                                     [](double a, double) { return a * a * a; }));
        EXPECT_NEAR(points.residual(n), std::sqrt(1.0 / 448 - 9.0 / 400 / 12), 1e-4);
    }
}

TEST(QuadricFit, PointsThatDetermineNoQuadric) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> half(-0.5, 0.5);
    const Axes axes = axesAcross(unitVector(random));
    const auto flat = [](double, double) { return 0.25; };
    FittedPoints one, line, sheets;
    const double a = half(random), b = half(random);
    for (int i = 0; i < 32; ++i) {
        one.add(pointOver(axes, a, b, flat));
        const double along = half(random);
        line.add(pointOver(axes, a * along, b * along, flat));
        sheets.add(pointOver(axes, i / 2 * 0.01, i / 2 % 4 * 0.1, [&](double, double) { return i % 2 ? 0.2 : -0.2; }));
    }
    EXPECT_LT(one.residual(axes.n), 1e-3);
    EXPECT_LT(line.residual(axes.n), 1e-3);
    // Two points over each place: half their distance is left, whatever the quadric.
    EXPECT_NEAR(sheets.residual(axes.n), 0.2, 1e-3);
}

}  // namespace
}  // namespace vcp
