#include "mesostructure/transfer_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/packing.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include "mesostructure/base_transfer.h"
#include "mesostructure/tile_paths.h"

namespace vcp::meso {

namespace transfer_f32 {

#define INLINE inline

using uint = uint32_t;
using f32::Harmonics, f32::clampedCosine;
using glm::floor, glm::max, glm::uvec3, glm::vec3, glm::vec4;
#include "mesostructure/shared/transfer_layout.h"

namespace {

/// The shaders' lookup; what is global there is a member here.
struct TransferLookup {
    const uint64_t* texels;
    [[nodiscard]] vec4 fetchLook(int i) const { return glm::unpackHalf4x16(texels[i]); }

#include "mesostructure/shared/transfer_lookup.h"
};

}  // namespace

#undef INLINE

static_assert(kTransferTexels == TransferVolume::kTexels && kBaseLightTexels == BaseTransfer::kTexels &&
              uint64_t{kTransferHalf} * kTransferHalf - 1 == TransferVolume::kMostCells);

}  // namespace transfer_f32

namespace {

using f64::Harmonics;
using glm::dvec2, glm::dvec3, glm::dvec4;

constexpr uint32_t kPoints = 64;      // of a cell at most; its paths are shared among them
constexpr uint32_t kTries = 8;        // rays for each point that is wanted
constexpr double kSteadiness = 0.02;  // of the slope over normals, as the square of a spread of normals

/// What one point of a cell gets: the light, as coefficients, and by how much it changes with the normal.
struct PointLight {
    dvec3 normal;
    Harmonics light{};
    std::array<dvec3, 16> slope{};
};

struct CellTerms {
    std::array<dvec4, 16> terms;  ///< of each coefficient
    dvec3 normal{0};              ///< mean
};

class CellTracer {
public:
    CellTracer(const Shape& shape, const TileGrid& grid, const TransferOptions& options)
        : paths_(shape, options.albedo), grid_(grid), options_(options) {}

    [[nodiscard]] bool mayHaveSurface(size_t cell) const {
        const glm::ivec3 at = grid_.at(cell);
        return at.z == 0 || paths_.shape().mayTouch(grid_.lower(at), grid_.lower(at + 1));
    }
    /// Returns the terms of a cell; nothing where none of the rays met surface in it.
    [[nodiscard]] std::optional<CellTerms> termsOf(size_t cell) const {
        PathRandom random(PathRandom::mixed(options_.seed, cell));
        const std::vector<TilePoint> points = pointsOf(grid_.at(cell), random);
        if (points.empty()) return std::nullopt;
        std::vector<PointLight> lights;
        const dvec2 shift(random.next(), random.next());
        for (size_t i = 0; i < points.size(); ++i)
            lights.push_back(lightOf(points[i], i, points.size(), shift, random));
        return fitted(lights);
    }

private:
    /// Finds points of the surface in a cell by rays from places in it.
    [[nodiscard]] std::vector<TilePoint> pointsOf(glm::ivec3 at, PathRandom& random) const {
        const dvec3 low = grid_.lower(at);
        const uint32_t wanted = std::min(kPoints, options_.paths);
        std::vector<TilePoint> points;
        for (uint32_t i = 0; i < kTries * wanted && points.size() < wanted; ++i) {
            dvec3 from;
            for (int axis = 0; axis < 3; ++axis) from[axis] = low[axis] + random.next() * grid_.cell[axis];
            const double z = 2 * random.next() - 1, turn = 2 * std::numbers::pi * random.next(),
                         r = std::sqrt(1 - z * z);
            const dvec3 direction(r * std::cos(turn), r * std::sin(turn), z);
            double reach = std::numeric_limits<double>::infinity();
            for (int axis = 0; axis < 3; ++axis) {
                const double wall = low[axis] + (direction[axis] > 0 ? grid_.cell[axis] : 0);
                if (direction[axis] != 0) reach = std::min(reach, (wall - from[axis]) / direction[axis]);
            }
            if (!(paths_.shape().field(from) > 0)) continue;
            const TileMeeting met = paths_.meet(from, direction, reach);
            if (met.kind == TileMeeting::Kind::Surface) points.push_back(met.point);
        }
        return points;
    }

    /// Traces a point's share of the cell's paths. Half of them fall by the cosine and half alike from all sides: by
    /// the cosine alone the slope, whose paths weigh the more the flatter they are, would not settle.
    [[nodiscard]] PointLight lightOf(const TilePoint& point, size_t number, size_t count, dvec2 shift,
                                     PathRandom& random) const {
        PointLight light{.normal = point.normal};
        const uint32_t share = std::max(1u, options_.paths / uint32_t(count));
        for (uint32_t i = 0; i < share; ++i) {
            dvec2 p = evenPoint(number * share + i) + shift;
            p -= glm::floor(p);
            // The density over the cosine c is c + 1/2.
            const double c = (std::sqrt(1 + 8 * p.x) - 1) / 2, r = std::sqrt(1 - c * c),
                         turn = 2 * std::numbers::pi * p.y;
            const dvec3 direction = turnedFromZ(point.normal, {r * std::cos(turn), r * std::sin(turn), c});
            const TileEscape escape = paths_.follow(point, direction, random);
            if (escape.weight <= 0) continue;
            const double weight = 2 * escape.weight / ((c + 0.5) * share);
            const Harmonics from = f64::harmonicsOf(escape.direction);
            for (size_t k = 0; k < 16; ++k) {
                light.light.c[k] += weight * c * from.c[k];
                light.slope[k] += weight * from.c[k] * direction;
            }
        }
        return light;
    }

    /// Fits T = T0 + n . (T1, T2, T3) to a cell's points, by least squares. What the normals of the cell do not tell of
    /// the slope is told by the light that was traced.
    [[nodiscard]] static CellTerms fitted(const std::vector<PointLight>& lights) {
        const double count = double(lights.size());
        glm::dmat4 products(0);
        for (const PointLight& at : lights) {
            const dvec4 row(1, at.normal);
            products += glm::outerProduct(row, row) / count;
        }
        for (int axis = 1; axis < 4; ++axis) products[axis][axis] += kSteadiness;
        const glm::dmat4 inverse = glm::inverse(products);
        CellTerms cell;
        for (const PointLight& at : lights) cell.normal += at.normal / count;
        for (size_t k = 0; k < 16; ++k) {
            dvec3 slope(0);
            for (const PointLight& at : lights) slope += at.slope[k] / count;
            dvec4 sums(0);
            for (const PointLight& at : lights)
                sums += dvec4(1, at.normal) * (at.light.c[k] - glm::dot(slope, at.normal)) / count;
            cell.terms[k] = dvec4(0, slope) + inverse * sums;
        }
        return cell;
    }

    TilePaths paths_;
    const TileGrid& grid_;
    const TransferOptions& options_;
};

void packTerms(const CellTerms& cell, uint64_t* texels) {
    for (int term = 0; term < 4; ++term)
        for (size_t quad = 0; quad < 4; ++quad) {
            glm::vec4 values;
            for (int i = 0; i < 4; ++i) values[i] = float(cell.terms[4 * quad + size_t(i)][term]);
            texels[size_t(term) * 4 + quad] = glm::packHalf4x16(values);
        }
    texels[16] = glm::packHalf4x16({glm::vec3(cell.normal), float(glm::length(cell.normal))});
}

Result<TileGrid> gridOf(const Shape& shape, int cells) {
    const dvec3 extent = shape.extent();
    const double edge = extent.x / cells;
    const auto along = [&](double length) { return std::max(1, int(std::ceil(length / edge - 1e-9))); };
    const glm::ivec3 count(cells, along(extent.y), along(extent.z));
    if (cells < 1 || std::max(count.y, count.z) > kMaxGridEdge || cells > kMaxGridEdge)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("a volume of transfer of {} x {} x {} cells; each edge must have 1 to {}",
                                            count.x, count.y, count.z, kMaxGridEdge)};
    TileGrid grid(count, extent);
    if (grid.count() > kMaxGridCells)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format("a volume of transfer of {} cells; at most {}", grid.count(), kMaxGridCells)};
    return grid;
}

}  // namespace

Result<TransferVolume> traceTransfer(const Shape& shape, const TransferOptions& options) {
    if (!(options.albedo >= 0 && options.albedo <= 1) || options.paths < 1)
        return Error{.code = ErrorCode::Usage,
                     .message = "the albedo of transfer must be from 0 to 1, its paths 1 or more"};
    if (options.cells < 1)
        return Error{.code = ErrorCode::Usage, .message = "a volume of transfer has at least 1 cell along x"};
    VCP_TRY_ASSIGN(const TileGrid grid, gridOf(shape, options.cells));
    const CellTracer tracer(shape, grid, options);
    std::vector<size_t> cells;
    for (size_t cell = 0; cell < grid.count(); ++cell)
        if (tracer.mayHaveSurface(cell)) cells.push_back(cell);
    const uint64_t bytes = TransferVolume::texelBytes(grid.count(), cells.size());
    if (bytes > options.memoryBytes || cells.size() > TransferVolume::kMostCells)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a volume of transfer of {} cells takes {} bytes; give it fewer cells, or "
                                            "a larger memory cap",
                                            cells.size(), bytes)};
    std::vector<uint64_t> traced(cells.size() * TransferVolume::kTexels);
    std::vector<uint8_t> isThere(cells.size());
    const auto fill = [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i)
            if (const auto terms = tracer.termsOf(cells[i])) {
                packTerms(*terms, &traced[i * TransferVolume::kTexels]);
                isThere[i] = 1;
            }
    };
    if (!options.shareOut)
        fill(0, cells.size());
    else if (!options.shareOut(cells.size(), fill))
        return Error::cancelled();
    TransferVolume volume{grid, float(options.albedo), options.paths, std::vector<uint32_t>(grid.count()), {}};
    for (size_t i = 0; i < cells.size(); ++i) {
        if (isThere[i] == 0) continue;
        const auto from = traced.begin() + ptrdiff_t(i * TransferVolume::kTexels);
        volume.terms.insert(volume.terms.end(), from, from + ptrdiff_t(TransferVolume::kTexels));
        volume.numbers[cells[i]] = uint32_t(volume.cells());
    }
    return volume;
}

f32::Harmonics TransferReader::at(dvec3 place, dvec3 normal) const {
    dvec3 part = place / extent_;
    part.x -= std::floor(part.x), part.y -= std::floor(part.y);
    transfer_f32::TransferLookup lookup{texels_.data()};
    return lookup.transferAt(0, glm::uvec3(cells_), glm::vec3(part), glm::vec3(normal));
}

}  // namespace vcp::meso
