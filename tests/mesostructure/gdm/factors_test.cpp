// Factors against Eigen's other decomposition, and safe factors against what they must not exceed.
#include "mesostructure/gdm/factors.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/SVD>

#include "mesostructure/gdm/packed_factors.h"
#include "mesostructure/gdm/safe_factors.h"

namespace vcp::meso {
namespace {

struct Matrix {
    size_t rows, columns;
    std::vector<float> values;

    [[nodiscard]] RowSource source() const {
        return {rows, columns, [this](size_t first, size_t count, float* out) {
                    std::copy_n(values.begin() + long(first * columns), count * columns, out);
                }};
    }
    [[nodiscard]] Eigen::MatrixXd dense() const {
        Eigen::MatrixXd made(rows, columns);
        for (size_t i = 0; i < rows; ++i)
            for (size_t j = 0; j < columns; ++j) made(Eigen::Index(i), Eigen::Index(j)) = values[i * columns + j];
        return made;
    }
};

/// A smooth part of some rank, steps, and noise.
Matrix anyMatrix(size_t rows, size_t columns, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0, 1);
    Matrix m{rows, columns, {}};
    for (size_t i = 0; i < rows; ++i)
        for (size_t j = 0; j < columns; ++j)
            m.values.push_back(2 + std::sin(float(i) * 0.01f + float(j) * 0.2f) + float((i / 50 + j / 5) % 2) +
                               0.1f * unit(random));
    return m;
}

TEST(GdmFactors, LeaveWhatTheOtherDecompositionLeaves) {
    for (const auto& [rows, columns] : {std::pair<size_t, size_t>{2500, 40}, {64, 64}, {30, 50}}) {
        const Matrix m = anyMatrix(rows, columns, uint32_t(rows));
        const Eigen::BDCSVD<Eigen::MatrixXd> svd(m.dense());
        for (const int rank : {1, 4, 16, 30}) {
            const auto factors = factorize(m.source(), rank);
            ASSERT_TRUE(factors) << factors.error().line();
            double dropped = 0;
            for (Eigen::Index k = rank; k < svd.singularValues().size(); ++k)
                dropped += svd.singularValues()[k] * svd.singularValues()[k];
            const double all = svd.singularValues().squaredNorm();
            EXPECT_NEAR(factors->squaredResidual, dropped, 1e-9 * all) << rows << " rank " << rank;
            EXPECT_NEAR(factors->squaredResidualSeen, dropped, 1e-6 * all) << rows << " rank " << rank;
            for (int k = 0; k < rank; ++k)
                EXPECT_NEAR(factors->singular[size_t(k)], svd.singularValues()[k], 1e-6 * svd.singularValues()[0]);
        }
    }
}

TEST(GdmFactors, AreOfAlikeRangesAndExactAtFullRank) {
    const Matrix m = anyMatrix(300, 12, 3);
    const auto factors = factorize(m.source(), 12);
    ASSERT_TRUE(factors) << factors.error().line();
    for (int k = 0; k < 12; ++k) {
        double weights = 0, eigen = 0;
        for (size_t i = 0; i < 300; ++i) weights += std::pow(double(factors->weights[12 * i + size_t(k)]), 2);
        for (size_t j = 0; j < 12; ++j) eigen += std::pow(double(factors->eigen[12 * j + size_t(k)]), 2);
        EXPECT_NEAR(weights, factors->singular[size_t(k)], 1e-3 * factors->singular[size_t(k)]) << k;
        EXPECT_NEAR(eigen, factors->singular[size_t(k)], 1e-3 * factors->singular[size_t(k)]) << k;
    }
    for (const int bits : {8, 16}) {
        const auto packed = packFactors(*factors, 12, bits);
        ASSERT_TRUE(packed) << packed.error().line();
        EXPECT_EQ(packed->bytes(), (300u + 12u) * 12u * unsigned(bits) / 8u);
        double worst = 0;
        for (size_t i = 0; i < 300; ++i)
            for (size_t j = 0; j < 12; ++j)
                worst = std::max(worst, std::abs(packed->value(i, j) - double(m.values[12 * i + j])));
        EXPECT_LT(worst, bits == 8 ? 0.2 : 1e-3);
    }
}

TEST(GdmFactors, ClustersLeaveNoMoreThanOneOfThem) {
    // Two kinds of rows, each of rank 1 about its own mean.
    Matrix m{400, 10, {}};
    for (size_t i = 0; i < 400; ++i)
        for (size_t j = 0; j < 10; ++j)
            m.values.push_back(i % 2 ? float(j) * (1 + 0.01f * float(i)) : float(j % 3) + 0.02f * float(i));
    const auto one = factorizeClusters(m.source(), 1, 1, 3), two = factorizeClusters(m.source(), 1, 2, 8);
    ASSERT_TRUE(one && two);
    EXPECT_GT(one->squaredResidual, 100);
    EXPECT_LT(two->squaredResidual, 0.05 * one->squaredResidual);
    // What is said to be left is what is left.
    double left = 0;
    for (size_t i = 0; i < 400; ++i)
        for (size_t j = 0; j < 10; ++j) {
            const size_t c = two->cluster[i];
            left += std::pow(
                double(two->means[c * 10 + j] + two->weights[i] * two->eigen[c * 10 + j] - m.values[10 * i + j]), 2);
        }
    EXPECT_NEAR(left, two->squaredResidual, 0.01 * two->squaredResidual + 1e-3);
}

TEST(GdmFactors, HostileNumbersAreOneLine) {
    const Matrix m = anyMatrix(20, 8, 1);
    for (const int rank : {-1, 0, 9, 1000000}) {
        EXPECT_EQ(factorize(m.source(), rank).error().code, ErrorCode::Usage) << rank;
        EXPECT_EQ(factorizeClusters(m.source(), rank, 1, 1).error().code, ErrorCode::Usage) << rank;
    }
    for (const int clusters : {-1, 0, 21, 257, 1000000})
        EXPECT_EQ(factorizeClusters(m.source(), 2, clusters, 1).error().code, ErrorCode::Usage) << clusters;
    EXPECT_EQ(factorize({0, 8, {}}, 2).error().code, ErrorCode::Usage);
    const auto factors = factorize(m.source(), 4);
    ASSERT_TRUE(factors);
    EXPECT_EQ(packFactors(*factors, 5, 16).error().code, ErrorCode::Usage);
    EXPECT_EQ(packFactors(*factors, 4, 12).error().code, ErrorCode::Usage);
    EXPECT_EQ(factorize(m.source(), 2, [](double) { return false; }).error().code, ErrorCode::Cancelled);
}

TEST(GdmFactors, SafeOnesNeverSayMore) {
    std::mt19937 random(5);
    for (const glm::ivec3 cells : {glm::ivec3(6, 5, 4), glm::ivec3(1, 9, 3)}) {
        std::vector<uint8_t> steps(size_t(cells.x) * size_t(cells.y) * size_t(cells.z) * 8 * 4);
        for (size_t i = 0; i < steps.size(); ++i)
            steps[i] = uint8_t(random() % 5 == 0 ? 255 : (i / 7 % 200) + random() % 50);
        const ConeLengths lengths{cells, 8, 4, 0.004f, steps, 255};
        for (const int quads : {1, 2, 4}) {
            if (8 * quads - 2 > 4 * cells.z) continue;
            for (const int clusters : {1, 7}) {
                const auto made = makeSafeFactors(lengths, {.quads = quads, .clusters = clusters});
                ASSERT_TRUE(made) << made.error().line();
                double said = 0;
                for (size_t row = 0; row < made->rowCount(); ++row)
                    for (size_t column = 0; column < made->columnCount(); ++column) {
                        if (lengths.step(row, column) == 255) continue;
                        ASSERT_LE(made->length(row, column), double(lengths.step(row, column)) * 0.004)
                            << row << ", " << column;
                        said += std::max(0.0, made->length(row, column));
                    }
                EXPECT_GT(said, 0);
            }
        }
        EXPECT_EQ(makeSafeFactors(lengths, {.quads = 0}).error().code, ErrorCode::Usage);
        EXPECT_EQ(makeSafeFactors(lengths, {.quads = 1000000}).error().code, ErrorCode::Usage);
    }
}

}  // namespace
}  // namespace vcp::meso
