// A matrix as the product of two thin ones (Wang et al. 2004, 4.1): A ~ sum over k of W_k(row) E_k(column), by the
// singular value decomposition. A that has many rows and few columns is solved by the Gram matrix A^T A, which is
// summed in double over rows that are read once, and its symmetric eigenproblem; a second reading gives the weights. A
// of fewer rows than columns is held whole and solved by A A^T. The root of each singular value is in both factors, so
// that they have alike ranges.
//
// Clustered factors (clustered principal components, Sloan et al. 2003) part the rows into clusters, each with a mean
// and factors of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "octree/io/result.h"

namespace vcp::meso {

/// A matrix that is read by rows. `read` puts rows from `first` on into `out`, row by row; it may be called again.
struct RowSource {
    size_t rows = 0, columns = 0;
    std::function<void(size_t first, size_t count, float* out)> read;
};

/// Told how much is done, from 0 to 1; false cancels. May be empty.
using FactorProgress = std::function<bool(double part)>;

struct Factors {
    size_t rows = 0, columns = 0;
    int rank = 0;
    std::vector<float> weights;      ///< W: `rank` a row
    std::vector<float> eigen;        ///< E: `rank` a column
    std::vector<double> singular;    ///< as many as A has rows or columns, greatest first
    double squaredResidual = 0;      ///< of the factors before they are rounded: the sum of the dropped squares
    double squaredResidualSeen = 0;  ///< of the float factors, summed over the entries
};

/// Factors a matrix. Errors: Usage (rank below 1 or above the columns or kMostRank), Cancelled.
Result<Factors> factorize(const RowSource& matrix, int rank, const FactorProgress& progress = {});
inline constexpr int kMostRank = 256;

struct ClusteredFactors {
    size_t rows = 0, columns = 0;
    int rank = 0, clusters = 0;
    std::vector<uint8_t> cluster;  ///< of each row
    std::vector<float> weights;    ///< `rank` a row
    std::vector<float> means;      ///< cluster by cluster, one a column
    std::vector<float> eigen;      ///< cluster by cluster, column by column, `rank` each
    double squaredResidual = 0;    ///< summed over the entries
};

/// Factors by clusters, which are found in `rounds` rounds from rows that lie far apart: rows go to the cluster that
/// leaves the least of them, clusters are solved again. Errors: as factorize's; Usage (clusters below 1 or above 256,
/// or more than rows).
Result<ClusteredFactors> factorizeClusters(const RowSource& matrix, int rank, int clusters, int rounds,
                                           const FactorProgress& progress = {});

}  // namespace vcp::meso
