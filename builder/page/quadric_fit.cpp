#include "builder/page/quadric_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/geometric.hpp>

#include "builder/lattice/wider_clones.h"

namespace vcp {

namespace {

constexpr size_t kLanes = 8;

// This keeps the equations solvable where the points do not determine a quadric.
constexpr double kRidge = 1e-6;

/// The sums over all points: u^i v^j for i + j <= 4, then those up to degree 2 times the height, then its square.
struct Moments {
    double uv[5][5], h[3][3], hh;
};

/// The frame's rows are u, v and n.
WIDER_CLONES void sumMoments(const float* x, const float* y, const float* z, size_t count, const glm::vec3* frame,
                             Moments& moments) {
    const glm::vec3 u = frame[0], v = frame[1], n = frame[2];
    float sum[21][kLanes] = {};
    for (size_t first = 0; first < count; first += kLanes)
        for (size_t i = 0; i < kLanes; ++i) {
            const float px = x[first + i] - 0.5f, py = y[first + i] - 0.5f, pz = z[first + i] - 0.5f;
            const float a = u.x * px + u.y * py + u.z * pz, b = v.x * px + v.y * py + v.z * pz,
                        h = n.x * px + n.y * py + n.z * pz;
            const float aa = a * a, ab = a * b, bb = b * b;
            sum[0][i] += a, sum[1][i] += b;
            sum[2][i] += aa, sum[3][i] += ab, sum[4][i] += bb;
            sum[5][i] += aa * a, sum[6][i] += aa * b, sum[7][i] += a * bb, sum[8][i] += bb * b;
            sum[9][i] += aa * aa, sum[10][i] += aa * ab, sum[11][i] += aa * bb, sum[12][i] += ab * bb,
                sum[13][i] += bb * bb;
            sum[14][i] += h, sum[15][i] += h * a, sum[16][i] += h * b, sum[17][i] += h * aa, sum[18][i] += h * ab,
                sum[19][i] += h * bb;
            sum[20][i] += h * h;
        }
    double total[21] = {};
    for (int m = 0; m < 21; ++m)
        for (size_t i = 0; i < kLanes; ++i) total[m] += double(sum[m][i]);
    int m = 0;
    moments.uv[0][0] = double(count);
    for (int degree = 1; degree <= 4; ++degree)
        for (int j = 0; j <= degree; ++j) moments.uv[degree - j][j] = total[m++];
    for (int degree = 0; degree <= 2; ++degree)
        for (int j = 0; j <= degree; ++j) moments.h[degree - j][j] = total[m++];
    moments.hh = total[m];
}

}  // namespace

double quadricResidual(const float* x, const float* y, const float* z, size_t count, glm::dvec3 n) {
    const glm::dvec3 aside = std::abs(n.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 u = glm::normalize(aside - glm::dot(aside, n) * n);
    const glm::vec3 frame[3] = {glm::vec3(u), glm::vec3(glm::cross(n, u)), glm::vec3(n)};
    Moments moments;
    sumMoments(x, y, z, count, frame, moments);
    // The normal equations are solved by elimination; what is left of the squared heights is the residual's square.
    constexpr int kTerms = 6;
    constexpr std::array<std::array<int, 2>, kTerms> power{{{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}}};
    double a[kTerms][kTerms + 1];
    for (int r = 0; r < kTerms; ++r) {
        for (int c = 0; c < kTerms; ++c) a[r][c] = moments.uv[power[r][0] + power[c][0]][power[r][1] + power[c][1]];
        a[r][r] += kRidge * double(count);
        a[r][kTerms] = moments.h[power[r][0]][power[r][1]];
    }
    double left = moments.hh;
    for (int p = 0; p < kTerms; ++p) {
        left -= a[p][kTerms] * a[p][kTerms] / a[p][p];
        for (int r = p + 1; r < kTerms; ++r) {
            const double factor = a[r][p] / a[p][p];
            for (int c = p; c <= kTerms; ++c) a[r][c] -= factor * a[p][c];
        }
    }
    return std::sqrt(std::max(left, 0.0) / double(count));
}

}  // namespace vcp
