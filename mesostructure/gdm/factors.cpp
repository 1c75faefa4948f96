#include "mesostructure/gdm/factors.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Dense>

namespace vcp::meso {

namespace {

using RowBlock = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Solver = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

constexpr size_t kBlock = 1024;  ///< rows that are read at once

/// Calls `use(first row, rows)` block by block. Returns false when cancelled.
template <class Use>
bool readAll(const RowSource& matrix, const FactorProgress& progress, double from, double to, const Use& use) {
    RowBlock block;
    for (size_t first = 0; first < matrix.rows; first += kBlock) {
        const size_t count = std::min(kBlock, matrix.rows - first);
        block.resize(Eigen::Index(count), Eigen::Index(matrix.columns));
        matrix.read(first, count, block.data());
        use(first, block);
        if (progress && !progress(from + (to - from) * double(first + count) / double(matrix.rows))) return false;
    }
    return true;
}

Result<void> check(const RowSource& matrix, int rank) {
    const size_t most = std::min<size_t>(matrix.columns, kMostRank);
    if (rank >= 1 && size_t(rank) <= most && matrix.rows > 0) return {};
    return Error{.code = ErrorCode::Usage, .message = fmt::format("a rank of {}; it must be from 1 to {}", rank, most)};
}

/// Solves a Gram matrix of which the lower half is given. The values come greatest first, none below 0.
struct Eigenpairs {
    Eigen::VectorXd values;
    Eigen::MatrixXd vectors;
};
Eigenpairs solve(const Eigen::MatrixXd& gram) {
    const Solver solver(gram);
    return {solver.eigenvalues().reverse().cwiseMax(0.0), solver.eigenvectors().rowwise().reverse()};
}

/// The clusters while they are found: each row's, and each cluster's mean and unit eigenvectors.
struct Clusters {
    std::vector<Eigen::VectorXf> means;
    std::vector<RowBlock> axes;  ///< rank x columns
};

/// The sums over the rows of a cluster.
struct Sums {
    double count = 0;
    Eigen::VectorXd sum;
    Eigen::MatrixXd gram;
};

Clusters solveClusters(const std::vector<Sums>& sums, const Clusters& before, int rank) {
    Clusters clusters = before;
    for (size_t c = 0; c < sums.size(); ++c) {
        // What no row chose stays as it was.
        if (sums[c].count == 0) continue;
        const Eigen::VectorXd mean = sums[c].sum / sums[c].count;
        Eigen::MatrixXd centred = sums[c].gram;
        centred.selfadjointView<Eigen::Lower>().rankUpdate(mean, -sums[c].count);
        const Eigenpairs pairs = solve(centred);
        clusters.means[c] = mean.cast<float>();
        clusters.axes[c] = pairs.vectors.leftCols(rank).transpose().cast<float>();
    }
    return clusters;
}

/// Returns for each row of a block the cluster that leaves the least of it.
std::vector<uint8_t> nearestOf(const RowBlock& block, const Clusters& clusters) {
    std::vector<uint8_t> nearest(size_t(block.rows()), 0);
    Eigen::VectorXf least = Eigen::VectorXf::Constant(block.rows(), INFINITY);
    for (size_t c = 0; c < clusters.means.size(); ++c) {
        const RowBlock centred = block.rowwise() - clusters.means[c].transpose();
        const RowBlock weights = centred * clusters.axes[c].transpose();
        const Eigen::VectorXf rest = centred.rowwise().squaredNorm() - weights.rowwise().squaredNorm();
        for (Eigen::Index i = 0; i < block.rows(); ++i)
            if (rest[i] < least[i]) least[i] = rest[i], nearest[size_t(i)] = uint8_t(c);
    }
    return nearest;
}

/// Starts from rows that lie far from each other, among some hundreds: each next is the one farthest from all before.
Clusters farApart(const RowSource& matrix, int clusters, int rank) {
    const auto n = Eigen::Index(matrix.columns);
    const size_t step = std::max<size_t>(1, matrix.rows / (32 * size_t(clusters)));
    std::vector<Eigen::VectorXf> samples;
    for (size_t row = 0; row < matrix.rows; row += step) matrix.read(row, 1, samples.emplace_back(n).data());
    Clusters start;
    std::vector<float> nearest(samples.size(), INFINITY);
    for (size_t next = 0; start.means.size() < size_t(clusters);) {
        start.means.push_back(samples[next]);
        start.axes.emplace_back(RowBlock::Zero(rank, n));
        for (size_t i = 0; i < samples.size(); ++i)
            nearest[i] = std::min(nearest[i], (samples[i] - samples[next]).squaredNorm());
        next = size_t(std::ranges::max_element(nearest) - nearest.begin());
    }
    return start;
}

}  // namespace

namespace {

/// Sets the singular values, and what the dropped ones leave.
void setSingular(const Eigenpairs& pairs, int rank, Factors& factors) {
    for (Eigen::Index k = 0; k < pairs.values.size(); ++k) {
        factors.singular.push_back(std::sqrt(pairs.values[k]));
        if (k >= rank) factors.squaredResidual += pairs.values[k];
    }
}

/// Returns singular vectors times the root of their values, and over it in `inverse`: a value of 0 has none. There may
/// be fewer than the rank; what is missing is 0.
Eigen::MatrixXd rooted(const Eigenpairs& pairs, int rank, Eigen::MatrixXd& inverse) {
    Eigen::MatrixXd times = Eigen::MatrixXd::Zero(pairs.vectors.rows(), rank);
    inverse = times;
    for (Eigen::Index k = 0; k < std::min<Eigen::Index>(rank, pairs.values.size()); ++k) {
        const double root = std::sqrt(std::sqrt(pairs.values[k]));
        times.col(k) = pairs.vectors.col(k) * root;
        if (root > 0) inverse.col(k) = pairs.vectors.col(k) / root;
    }
    return times;
}

/// A matrix of fewer rows than columns is held whole, and solved by the Gram matrix of its rows.
Result<void> factorizeRows(const RowSource& matrix, const FactorProgress& progress, Factors& factors) {
    RowBlock whole(Eigen::Index(matrix.rows), Eigen::Index(matrix.columns));
    if (!readAll(matrix, progress, 0, 0.6, [&](size_t first, const RowBlock& block) {
            whole.middleRows(Eigen::Index(first), block.rows()) = block;
        }))
        return Error::cancelled();
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(whole.rows(), whole.rows()), toEigen;
    const Eigen::MatrixXd exact = whole.cast<double>();
    gram.selfadjointView<Eigen::Lower>().rankUpdate(exact);
    const Eigenpairs pairs = solve(gram);
    setSingular(pairs, factors.rank, factors);
    const RowBlock weights = rooted(pairs, factors.rank, toEigen).cast<float>(),
                   eigen = (exact.transpose() * toEigen).cast<float>();
    factors.weights.assign(weights.data(), weights.data() + weights.size());
    factors.eigen.assign(eigen.data(), eigen.data() + eigen.size());
    factors.squaredResidualSeen = double((whole - weights * eigen.transpose()).squaredNorm());
    if (progress && !progress(1)) return Error::cancelled();
    return {};
}

}  // namespace

Result<Factors> factorize(const RowSource& matrix, int rank, const FactorProgress& progress) {
    VCP_TRY(check(matrix, rank));
    Factors factors{matrix.rows, matrix.columns, rank, {}, {}, {}, 0, 0};
    if (matrix.rows < matrix.columns) {
        VCP_TRY(factorizeRows(matrix, progress, factors));
        return factors;
    }
    const auto n = Eigen::Index(matrix.columns);
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
    Eigen::MatrixXd rows;
    if (!readAll(matrix, progress, 0, 0.6, [&](size_t, const RowBlock& block) {
            rows = block.cast<double>();
            gram.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
        }))
        return Error::cancelled();
    // W = A V / sqrt(sigma), E = V sqrt(sigma).
    const Eigenpairs pairs = solve(gram);
    setSingular(pairs, rank, factors);
    Eigen::MatrixXd toWeights;
    const RowBlock eigen = rooted(pairs, rank, toWeights).cast<float>();
    factors.eigen.assign(eigen.data(), eigen.data() + eigen.size());
    factors.weights.resize(matrix.rows * size_t(rank));
    if (!readAll(matrix, progress, 0.6, 1, [&](size_t first, const RowBlock& block) {
            Eigen::Map<RowBlock> weights(factors.weights.data() + first * size_t(rank), block.rows(), rank);
            weights = (block.cast<double>() * toWeights).cast<float>();
            factors.squaredResidualSeen += double((block - weights * eigen.transpose()).squaredNorm());
        }))
        return Error::cancelled();
    return factors;
}

Result<ClusteredFactors> factorizeClusters(const RowSource& matrix, int rank, int clusters, int rounds,
                                           const FactorProgress& progress) {
    VCP_TRY(check(matrix, rank));
    if (clusters < 1 || clusters > 256 || size_t(clusters) > matrix.rows)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("{} clusters; there must be from 1 to 256, and no more than the {} rows",
                                            clusters, matrix.rows)};
    const auto n = Eigen::Index(matrix.columns);
    ClusteredFactors result{
        matrix.rows, matrix.columns, rank, clusters, std::vector<uint8_t>(matrix.rows), {}, {}, {}, 0};
    Clusters found = farApart(matrix, clusters, rank);
    Eigen::MatrixXd own;
    for (int round = 0; round < std::max(1, rounds); ++round) {
        std::vector<Sums> sums(size_t(clusters), {0, Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)});
        const double from = double(round) / (rounds + 1), to = double(round + 1) / (rounds + 1);
        if (!readAll(matrix, progress, from, to, [&](size_t first, const RowBlock& block) {
                std::ranges::copy(nearestOf(block, found), result.cluster.begin() + long(first));
                for (size_t c = 0; c < size_t(clusters); ++c) {
                    std::vector<Eigen::Index> members;
                    for (Eigen::Index i = 0; i < block.rows(); ++i)
                        if (result.cluster[first + size_t(i)] == c) members.push_back(i);
                    if (members.empty()) continue;
                    own = block(members, Eigen::all).cast<double>();
                    sums[c].count += double(members.size());
                    sums[c].sum += own.colwise().sum().transpose();
                    sums[c].gram.selfadjointView<Eigen::Lower>().rankUpdate(own.transpose());
                }
            }))
            return Error::cancelled();
        found = solveClusters(sums, found, rank);
    }
    result.weights.resize(matrix.rows * size_t(rank));
    if (!readAll(matrix, progress, double(rounds) / (rounds + 1), 1, [&](size_t first, const RowBlock& block) {
            std::ranges::copy(nearestOf(block, found), result.cluster.begin() + long(first));
            for (Eigen::Index i = 0; i < block.rows(); ++i) {
                const size_t row = first + size_t(i), c = result.cluster[row];
                const Eigen::VectorXf centred = block.row(i).transpose() - found.means[c];
                const Eigen::VectorXf weights = found.axes[c] * centred;
                std::copy_n(weights.data(), rank, result.weights.begin() + long(row * size_t(rank)));
                result.squaredResidual += double((centred - found.axes[c].transpose() * weights).squaredNorm());
            }
        }))
        return Error::cancelled();
    for (size_t c = 0; c < size_t(clusters); ++c) {
        result.means.insert(result.means.end(), found.means[c].data(), found.means[c].data() + n);
        const RowBlock byColumn = found.axes[c].transpose();
        result.eigen.insert(result.eigen.end(), byColumn.data(), byColumn.data() + byColumn.size());
    }
    return result;
}

}  // namespace vcp::meso
