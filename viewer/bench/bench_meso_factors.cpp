// How well factors stand for the distances of a displacement map: the published ones and clustered ones of as many
// bytes, at the table's own entries, before anything is filtered.
#include <algorithm>
#include <cmath>

#include "mesostructure/gdm_map.h"
#include "viewer/bench/bench_meso.h"

namespace vcp {

namespace {

using namespace meso;

constexpr glm::ivec3 kPoints{32, 32, 9};

/// Compares what factors say with a table, entry by entry.
template <class Value>
MesoFactors compared(const DistanceTable& table, const Value& value) {
    MesoFactors made;
    const double point = table.extent.x / table.nodes.x, top = table.extent.z;
    double squares = 0, off = 0, wrong = 0, entries = 0;
    for (int phi = 0; phi < table.directions.phis; ++phi)
        for (int y = 0; y < table.nodes.y; ++y)
            for (int x = 0; x < table.nodes.x; ++x)
                for (int theta = 0; theta < table.directions.thetas; ++theta)
                    for (int z = 0; z < table.nodes.z; ++z) {
                        const size_t row = table.row(x, y, phi), column = table.column(theta, phi, z);
                        const double said = value(row, column),
                                     error = std::abs(said - double(table.distance(row, column))) / point;
                        const double rise = table.directions.direction(theta, phi).z, height = table.point(x, y, z).z,
                                     out = rise > 0 ? (top - height) / rise : height / -rise;
                        squares += error * error, off += error > 1, ++entries;
                        wrong += (said < out - 0.5 * point) != table.isHit(row, column);
                    }
    made.rmsPoints = std::sqrt(squares / entries);
    made.offByPoint = off / entries, made.wrongHits = wrong / entries;
    return made;
}

}  // namespace

Result<std::vector<MesoFactors>> compareMesoFactors(const Asset& asset, const Shape& shape) {
    VCP_TRY_ASSIGN(const auto table,
                   traceTable(asset, shape, {.points = {kPoints.x, kPoints.y, int(kPoints.x * shape.extent().z) + 1}}));
    const RowSource source = meso::rowsOf(table);
    std::vector<MesoFactors> all;
    const auto add = [&](MesoFactors made, const char* form, int rank, int clusters, uint64_t bytes) {
        made.asset = asset.name, made.form = form, made.rank = rank, made.clusters = clusters, made.bytes = bytes;
        all.push_back(made);
    };
    for (const int rank : {8, 16, 32}) {
        VCP_TRY_ASSIGN(const auto factors, factorize(source, rank));
        for (const int bits : {16, 8}) {
            VCP_TRY_ASSIGN(const auto packed, packFactors(factors, rank, bits));
            add(compared(table, [&](size_t row, size_t column) { return packed.value(row, column); }),
                bits == 16 ? "factors" : "factors, 8 bits", rank, 1, packed.bytes());
        }
        // A term less, and a byte for the cluster's number, leave a byte a row for the clusters' own columns.
        const size_t rows = source.rows, columns = source.columns, own = columns * size_t(rank) * 2;
        const int clusters = int(std::clamp<size_t>((rows + own) / own, 1, 256)), terms = rank - 1;
        VCP_TRY_ASSIGN(const auto made, factorizeClusters(source, terms, clusters, 6));
        const auto value = [&](size_t row, size_t column) {
            const size_t at = made.cluster[row] * columns + column;
            double sum = double(made.means[at]);
            for (size_t k = 0; k < size_t(terms); ++k)
                sum += double(made.weights[row * size_t(terms) + k]) * double(made.eigen[at * size_t(terms) + k]);
            return sum;
        };
        add(compared(table, value), "clustered", terms, clusters,
            rows * size_t(2 * terms + 1) + size_t(clusters) * own);
    }
    return all;
}

}  // namespace vcp
