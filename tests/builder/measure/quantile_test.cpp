// Medians and other parts of many numbers, against their definitions.
#include "builder/measure/quantile.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

TEST(Quantile, OfAnEvenNumberTheMedianIsTheLowerOfTwoOrTheUpper) {
    EXPECT_EQ(quantile({4, 1, 3, 2}, 0.5), 2);
    EXPECT_EQ(upperQuantile({4, 1, 3, 2}, 0.5), 3);
    EXPECT_EQ(quantile({3, 1, 2}, 0.5), 2);
    EXPECT_EQ(upperQuantile({3, 1, 2}, 0.5), 2);
    EXPECT_EQ(quantile({}, 0.5), 0);
    EXPECT_EQ(upperQuantile({}, 0.5), 0);
}

TEST(Quantile, SoManyValuesAreNotAbove) {
    for (uint64_t seed = 0; seed < 50; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937_64 random(seed);
        std::vector<double> values(1 + random() % 40);
        for (double& value : values) value = double(random() % 100);
        for (const double part : {0.0, 0.25, 0.5, 0.75, 0.95, 0.99, 1.0}) {
            const auto notAbove = [&](double limit) {
                return std::count_if(values.begin(), values.end(), [&](double value) { return value <= limit; });
            };
            const double wanted = part * double(values.size());
            EXPECT_GE(double(notAbove(quantile(values, part))), wanted);
            EXPECT_GE(double(notAbove(upperQuantile(values, part))), wanted);
            EXPECT_LE(quantile(values, part), upperQuantile(values, part));
        }
        EXPECT_EQ(quantile(values, 1), *std::max_element(values.begin(), values.end()));
        EXPECT_EQ(upperQuantile(values, 0), *std::min_element(values.begin(), values.end()));
    }
}

}  // namespace
}  // namespace vcp
