// Taubin's fit of a quadric to points: the least mean squared value under a mean squared gradient of 1.
#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "mesostructure/patches.h"

namespace vcp::meso {

namespace {

constexpr int kSize = 9;  // the constant follows from the rest
using Matrix = std::array<std::array<double, kSize>, kSize>;
using Vector = std::array<double, kSize>;

Vector monomials(glm::dvec3 p) {
    return {p.x * p.x, p.y * p.y, p.z * p.z, p.x * p.y, p.y * p.z, p.z * p.x, p.x, p.y, p.z};
}

std::array<Vector, 3> gradients(glm::dvec3 p) {
    return {{{2 * p.x, 0, 0, p.y, 0, p.z, 1, 0, 0},
             {0, 2 * p.y, 0, p.x, p.z, 0, 0, 1, 0},
             {0, 0, 2 * p.z, 0, p.y, p.x, 0, 0, 1}}};
}

void addOuter(Matrix& to, const Vector& v, double weight) {
    for (int i = 0; i < kSize; ++i)
        for (int j = 0; j < kSize; ++j) to[i][j] += weight * v[i] * v[j];
}

/// Returns the lower triangle L with L L^T = a; `a` must be positive definite.
Matrix cholesky(const Matrix& a) {
    Matrix l{};
    for (int i = 0; i < kSize; ++i)
        for (int j = 0; j <= i; ++j) {
            double sum = a[i][j];
            for (int k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
            l[i][j] = i == j ? std::sqrt(std::max(sum, 1e-30)) : sum / l[j][j];
        }
    return l;
}

/// Leaves the eigenvalues on the diagonal of `a`, the eigenvectors in the columns of `v`: Jacobi's rotations.
void diagonalise(Matrix& a, Matrix& v) {
    for (int i = 0; i < kSize; ++i)
        for (int j = 0; j < kSize; ++j) v[i][j] = i == j;
    for (int sweep = 0; sweep < 30; ++sweep) {
        double off = 0;
        for (int p = 0; p < kSize; ++p)
            for (int q = p + 1; q < kSize; ++q) {
                off += a[p][q] * a[p][q];
                if (a[p][q] == 0) continue;
                const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1)),
                             c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < kSize; ++k) {
                    const double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y, a[k][q] = s * x + c * y;
                }
                for (int k = 0; k < kSize; ++k) {
                    const double x = a[p][k], y = a[q][k];
                    a[p][k] = c * x - s * y, a[q][k] = s * x + c * y;
                    const double vx = v[k][p], vy = v[k][q];
                    v[k][p] = c * vx - s * vy, v[k][q] = s * vx + c * vy;
                }
            }
        if (off < 1e-28) return;
    }
}

}  // namespace

std::array<double, 10> fitQuadric(std::span<const glm::dvec3> points) {
    glm::dvec3 centre(0);
    for (const glm::dvec3 p : points) centre += p / double(points.size());
    Vector mean{};
    const double weight = 1.0 / double(points.size());
    for (const glm::dvec3 p : points) {
        const Vector m = monomials(p - centre);
        for (int i = 0; i < kSize; ++i) mean[i] += weight * m[i];
    }
    Matrix values{}, slopes{};
    for (const glm::dvec3 p : points) {
        Vector m = monomials(p - centre);
        for (int i = 0; i < kSize; ++i) m[i] -= mean[i];
        addOuter(values, m, weight);
        for (const Vector& g : gradients(p - centre)) addOuter(slopes, g, weight);
    }
    // Points of a plane leave the second order undecided: a small weight on it makes the plane the answer.
    for (int i = 0; i < kSize; ++i) slopes[i][i] += 1e-9, values[i][i] += i < 6 ? 1e-10 : 0;
    // values a = lambda slopes a, with slopes = L L^T: the symmetric L^-1 values L^-T.
    const Matrix l = cholesky(slopes);
    const auto solveLower = [&](Matrix b) {
        for (int column = 0; column < kSize; ++column)
            for (int i = 0; i < kSize; ++i) {
                for (int k = 0; k < i; ++k) b[i][column] -= l[i][k] * b[k][column];
                b[i][column] /= l[i][i];
            }
        return b;
    };
    const auto transposed = [](const Matrix& m) {
        Matrix t;
        for (int i = 0; i < kSize; ++i)
            for (int j = 0; j < kSize; ++j) t[i][j] = m[j][i];
        return t;
    };
    Matrix symmetric = solveLower(transposed(solveLower(values))), vectors;
    diagonalise(symmetric, vectors);
    int best = 0;
    for (int i = 1; i < kSize; ++i)
        if (symmetric[i][i] < symmetric[best][best]) best = i;
    Vector a;
    for (int i = kSize - 1; i >= 0; --i) {
        a[i] = vectors[i][best];
        for (int k = i + 1; k < kSize; ++k) a[i] -= l[k][i] * a[k];
        a[i] /= l[i][i];
    }
    // Moves the quadric back from the centre: q(x - centre).
    double constant = 0;
    for (int i = 0; i < kSize; ++i) constant -= mean[i] * a[i];
    const glm::dvec3 c = centre;
    std::array<double, 10> q{a[0], a[1], a[2], a[3], a[4], a[5], 0, 0, 0, 0};
    q[6] = a[6] - 2 * a[0] * c.x - a[3] * c.y - a[5] * c.z;
    q[7] = a[7] - 2 * a[1] * c.y - a[3] * c.x - a[4] * c.z;
    q[8] = a[8] - 2 * a[2] * c.z - a[4] * c.y - a[5] * c.x;
    const Vector m = monomials(c);
    q[9] = constant - a[6] * c.x - a[7] * c.y - a[8] * c.z;
    for (int i = 0; i < 6; ++i) q[9] += a[i] * m[i];
    return q;
}

}  // namespace vcp::meso
