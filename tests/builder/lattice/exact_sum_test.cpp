// Sums that do not depend on the order.
#include "builder/lattice/exact_sum.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace vcp {
namespace {

double sumOf(const std::vector<double>& values) {
    const auto sum = std::make_unique<ExactSum>();
    for (const double v : values) sum->add(v);
    return sum->value();
}

TEST(ExactSum, SmallIntegersAreExact) {
    EXPECT_EQ(sumOf({}), 0);
    EXPECT_EQ(sumOf({0, 0}), 0);
    EXPECT_EQ(sumOf({1, 2, 3, 0.5}), 6.5);
    std::vector<double> values;
    for (int i = 1; i <= 1000; ++i) values.push_back(i);
    EXPECT_EQ(sumOf(values), 500500);
}

TEST(ExactSum, OrderDoesNotMatter) {
    for (uint64_t seed = 0; seed < 20; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> exponent(seed % 2 ? -300 : -8, seed % 2 ? 300 : 8), unit(0, 1);
        std::vector<double> values(2000);
        for (double& v : values) v = unit(random) * std::exp2(exponent(random));
        const double first = sumOf(values);
        int naiveDiffers = 0;
        const double naive = std::accumulate(values.begin(), values.end(), 0.0);
        for (int i = 0; i < 10; ++i) {
            std::shuffle(values.begin(), values.end(), random);
            ASSERT_EQ(sumOf(values), first) << seed;
            naiveDiffers += std::accumulate(values.begin(), values.end(), 0.0) != naive;
        }
        if (seed % 2 == 0) {
            EXPECT_GT(naiveDiffers, 0) << "the numbers are no test";
        }
        EXPECT_NEAR(first, naive, 1e-12 * naive);
    }
}

TEST(ExactSum, SmallOnesAreNotLost) {
    // Beside 1, 2^-53 is lost by doubles; a million of them are not.
    std::vector<double> values(1 << 20, std::exp2(-53));
    values.insert(values.begin(), 1);
    EXPECT_EQ(sumOf(values), 1 + std::exp2(-33));
}

TEST(ExactSum, Extremes) {
    using L = std::numeric_limits<double>;
    EXPECT_EQ(sumOf({L::denorm_min(), L::denorm_min()}), 2 * L::denorm_min());
    EXPECT_EQ(sumOf({L::min(), L::denorm_min()}), L::min() + L::denorm_min());
    EXPECT_EQ(sumOf({L::max()}), L::max());
    EXPECT_EQ(sumOf({L::max(), L::max()}), L::infinity());
}

}  // namespace
}  // namespace vcp
