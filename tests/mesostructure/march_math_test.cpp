// The maths that C++ and GLSL share, against plain ways to the same answers: polynomials with known roots, sampling,
// and integer arithmetic.
#include "mesostructure/march_math.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "mesostructure/tile_grid.h"

namespace vcp::meso {
namespace {

struct Fall {
    bool hit = false;
    double t = 0;
    bool outside = false;  ///< at the end
    double clearance = 0;  ///< the least |f| at the samples' local extremes: how far the answer is from another one
};

/// Finds the first fall of f through 0 in [from, to] by sampling and halving.
template <class F>
Fall sampledFall(const F& f, double from, double to, bool outside) {
    constexpr int kSamples = 2000;
    const auto at = [&](int i) { return from + (to - from) * i / kSamples; };
    Fall fall{false, 0, outside, std::numeric_limits<double>::infinity()};
    double before = f(from);
    if (before > 0) fall.outside = true;
    fall.clearance = std::abs(before);
    if (before <= 0 && outside) return {true, from, false, fall.clearance};
    for (int i = 1; i <= kSamples; ++i) {
        const double value = f(at(i)), after = i < kSamples ? f(at(i + 1)) : value;
        if ((value - before) * (after - value) <= 0) fall.clearance = std::min(fall.clearance, std::abs(value));
        if (!fall.hit && before > 0 && value <= 0) {
            double low = at(i - 1), high = at(i);
            for (int k = 0; k < 60; ++k) (f(0.5 * (low + high)) > 0 ? low : high) = 0.5 * (low + high);
            fall.hit = true, fall.t = high;
        }
        before = value;
    }
    fall.outside = before > 0;
    return fall;
}

/// Sampling cannot tell where f only touches 0, nor single precision: such cases are left out, and counted.
struct Compared {
    int compared = 0, hits = 0;

    template <class Hit>
    void add(const Fall& expected, const Hit& found, double least, double tolerance, int seed) {
        if (expected.clearance < least) return;
        ++compared, hits += expected.hit;
        ASSERT_EQ(found.hit, expected.hit) << "seed " << seed;
        if (expected.hit)
            ASSERT_NEAR(double(found.t), expected.t, tolerance) << "seed " << seed;
        else
            ASSERT_EQ(found.outside, expected.outside) << "seed " << seed;
    }
};

TEST(MarchMath, CubicsFallAtTheirFirstRoot) {
    Compared single, twice;
    for (int seed = 0; seed < 4000; ++seed) {
        std::mt19937 random{uint32_t(seed)};
        std::uniform_real_distribution<double> place(-0.5, 1.5), size(-3, 3);
        // Some have a square or a line in place of the cube.
        const int roots = 1 + seed % 3;
        double c[4] = {size(random), 0, 0, 0};
        for (int i = 0; i < roots; ++i) {
            const double root = place(random);
            for (int k = 3; k > 0; --k) c[k] = c[k - 1] - root * c[k];
            c[0] *= -root;
        }
        const bool outside = random() % 2 != 0;
        const auto f = [&](double u) { return ((c[3] * u + c[2]) * u + c[1]) * u + c[0]; };
        const Fall expected = sampledFall(f, 0, 1, outside);
        twice.add(expected, f64::firstFall(c[0], c[1], c[2], c[3], outside), 1e-4, 1e-9, seed);
        single.add(expected, f32::firstFall(float(c[0]), float(c[1]), float(c[2]), float(c[3]), outside), 1e-2, 1e-4,
                   seed);
    }
    EXPECT_GT(twice.compared, 3800);
    EXPECT_GT(single.compared, 2500);
    EXPECT_GT(single.hits, 700);
}

TEST(MarchMath, RaysEnterBilinearHeightsWhereSamplingSays) {
    Compared single, twice;
    for (int seed = 0; seed < 4000; ++seed) {
        std::mt19937 random{uint32_t(seed)};
        std::uniform_real_distribution<double> unit(0, 1);
        const glm::dvec4 h(unit(random), unit(random), unit(random), unit(random));
        const glm::dvec3 from(unit(random), unit(random), 1.5 * unit(random)),
            to(unit(random), unit(random), 1.5 * unit(random) - 0.5);
        const double ta = 0.25, tb = 0.75;
        const glm::dvec3 d = (to - from) / (tb - ta), o = from - ta * d;
        const bool outside = random() % 2 != 0;
        const auto f = [&](double t) {
            const glm::dvec3 p = o + t * d;
            return p.z -
                   (h.x * (1 - p.x) * (1 - p.y) + h.y * p.x * (1 - p.y) + h.z * (1 - p.x) * p.y + h.w * p.x * p.y);
        };
        Fall expected = sampledFall(f, ta, tb, outside);
        // A ray that comes inside leaves a texel at most once: what it enters after that is not looked for.
        if (!outside && f(ta) <= 0) expected.hit = false;
        twice.add(expected, f64::firstEntryBilinear(h, o, d, ta, tb, outside), 1e-4, 1e-9, seed);
        single.add(expected, f32::firstEntryBilinear(h, o, d, float(ta), float(tb), outside), 1e-3, 1e-4, seed);
    }
    EXPECT_GT(twice.compared, 3900);
    EXPECT_GT(single.compared, 3800);
    EXPECT_GT(single.hits, 1500);
}

TEST(MarchMath, RaysEnterTrilinearFieldsWhereSamplingSays) {
    Compared single, twice;
    for (int seed = 0; seed < 4000; ++seed) {
        std::mt19937 random{uint32_t(seed)};
        std::uniform_real_distribution<double> unit(0, 1), value(-1, 1);
        glm::dvec4 v[2];
        for (int k = 0; k < 8; ++k) v[k / 4][k % 4] = value(random);
        const glm::dvec3 from(unit(random), unit(random), unit(random)), to(unit(random), unit(random), unit(random));
        const double ta = 0.25, tb = 0.75;
        const glm::dvec3 d = (to - from) / (tb - ta), o = from - ta * d;
        const bool outside = random() % 2 != 0;
        const auto at = [&](glm::dvec3 p) {
            double sum = 0;
            for (int k = 0; k < 8; ++k)
                sum += v[k / 4][k % 4] * (k & 1 ? p.x : 1 - p.x) * (k & 2 ? p.y : 1 - p.y) * (k & 4 ? p.z : 1 - p.z);
            return sum;
        };
        const Fall expected = sampledFall([&](double t) { return at(o + t * d); }, ta, tb, outside);
        twice.add(expected, f64::firstEntryTrilinear(v[0], v[1], o, d, ta, tb, outside), 1e-4, 1e-9, seed);
        single.add(expected, f32::firstEntryTrilinear(v[0], v[1], o, d, float(ta), float(tb), outside), 1e-2, 1e-4,
                   seed);
        const glm::dvec3 gradient = f64::gradientTrilinear(v[0], v[1], from);
        for (int axis = 0; axis < 3; ++axis) {
            // The field is linear along an axis.
            glm::dvec3 low = from, high = from;
            low[axis] = 0, high[axis] = 1;
            ASSERT_NEAR(gradient[axis], at(high) - at(low), 1e-12) << "seed " << seed;
        }
        int inside = 0;
        for (int k = 0; k < 8; ++k) inside += v[k / 4][k % 4] <= 0;
        ASSERT_EQ(f64::sideTrilinear(v[0], v[1]), inside == 0 ? 1 : inside == 8 ? -1 : 0) << "seed " << seed;
    }
    EXPECT_GT(twice.compared, 3900);
    EXPECT_GT(single.compared, 3500);
    EXPECT_GT(single.hits, 1000);
}

/// The shaders' cells wrap by a rounded quotient: exact as far as a ray may travel.
TEST(MarchMath, CellsWrapAsIntegersDo) {
    std::mt19937 random(1);
    for (const int n : {1, 2, 3, 7, 64, 100, 1023, 4095, 4096}) {
        const auto same = [&](int64_t cell) {
            if (std::abs(cell) >= int64_t{1} << 31) return;
            ASSERT_EQ(f32::wrappedCell(int(cell), n), wrapped(int(cell), n)) << cell << " of " << n;
        };
        const int64_t farthest = int64_t(f32::kMostReach) * n;
        for (int i = 0; i < 2000; ++i) {
            const int64_t tile = std::uniform_int_distribution<int64_t>(-farthest / n, farthest / n)(random);
            for (const int64_t cell :
                 {tile * n, tile * n + n - 1, tile * n + int64_t(random() % uint32_t(n)), int64_t(i - 1000)})
                same(cell);
        }
        same(farthest), same(-farthest);
    }
}

}  // namespace
}  // namespace vcp::meso
