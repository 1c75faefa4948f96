#include "mesostructure/distance_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "mesostructure/gdm/beam_lengths.h"

namespace vcp::meso {

namespace {

using std::numbers::pi;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Works on one line of cells along an axis: finds the least of base[j] + (edge * gap(j - u))^2 over j >= u, for every
/// u. gap(k) is k between centres, else max(0, k - 1). It is a lower envelope of parabolas, built and queried from high
/// u to low: of two parabolas, that of the lower j wins for all lower u once it wins.
class OneSidedEnvelope {
public:
    OneSidedEnvelope(double edge, bool betweenCentres) : square_(edge * edge), shift_(betweenCentres ? 0 : 1) {}

    /// `base` has `n` cells that repeat when `wraps`. `least` gets n values, each lowered to what is found.
    void lower(const std::vector<double>& base, bool wraps, bool ascending, std::vector<double>& least) {
        const int n = int(base.size());
        queue_.clear();
        size_t front = 0;
        for (int u = wraps ? 2 * n - 1 : n - 1; u >= 0; --u) {
            const int at = ascending ? u % n : n - 1 - u % n;
            if (base[at] < kInfinity) push(u, base[at], front);
            if (u >= n) continue;
            // The gap of j = u is 0, as is that of j = u + 1.
            double best = std::min(least[at], base[at]);
            while (front + 1 < queue_.size() && value(queue_[front + 1], u) <= value(queue_[front], u)) ++front;
            if (front < queue_.size()) best = std::min(best, value(queue_[front], u));
            least[at] = best;
        }
    }

private:
    struct Parabola {
        int j;
        double base;
    };
    double value(const Parabola& p, int u) const {
        const double gap = std::max(0, p.j - u - shift_);
        return p.base + square_ * gap * gap;
    }
    /// Returns the u below which b (of the lower j) is less than a.
    double meeting(const Parabola& a, const Parabola& b) const {
        // base_a + s (j_a - shift - u)^2 = base_b + s (j_b - shift - u)^2
        return 0.5 * (a.j + b.j - 2 * shift_) + (a.base - b.base) / (2 * square_ * (a.j - b.j));
    }
    void push(int u, double base, size_t front) {
        const Parabola p{u, base};
        while (queue_.size() > front + 1 &&
               meeting(queue_[queue_.size() - 2], queue_.back()) <= meeting(queue_.back(), p))
            queue_.pop_back();
        // A parabola that starts to win no later than it would be passed is never the least.
        if (queue_.size() == front + 1 && meeting(queue_.back(), p) >= u) queue_.pop_back();
        queue_.push_back(p);
    }

    double square_;
    int shift_;
    std::vector<Parabola> queue_;
};

}  // namespace

size_t Occupancy::count() const {
    return size_t(std::count_if(cells.begin(), cells.end(), [](uint8_t c) { return c != 0; }));
}

Result<Occupancy> occupy(const Shape& shape, glm::ivec3 cells) {
    for (int axis = 0; axis < 3; ++axis)
        if (cells[axis] < 1 || cells[axis] > kMaxGridEdge)
            return Error{.code = ErrorCode::Usage,
                         .message = fmt::format("a grid of {} x {} x {} cells; each edge must be from 1 to {}", cells.x,
                                                cells.y, cells.z, kMaxGridEdge)};
    Occupancy occupancy{TileGrid(cells, shape.extent()), {}};
    const TileGrid& grid = occupancy.grid;
    if (grid.count() > kMaxGridCells)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a grid of {} cells; at most {}", grid.count(), kMaxGridCells)};
    occupancy.cells.resize(grid.count());
    const glm::dvec3 slack = kCellSlack * grid.cell;
    for (size_t i = 0; i < grid.count(); ++i) {
        const glm::dvec3 lower = grid.lower(grid.at(i));
        occupancy.cells[i] = shape.mayTouch(lower - slack, lower + grid.cell + slack);
    }
    if (occupancy.count() == 0) return Error{.message = "the surface touches no cell of the tile"};
    return occupancy;
}

namespace {

/// Returns cosine and sine of a part of a turn; exact at quarters, and alike but for signs from quarter to quarter.
glm::dvec2 onCircle(int part, int parts) {
    const int quarter = 4 * part / parts, rest = 4 * part % parts;
    const double angle = 0.5 * pi * rest / parts;
    const glm::dvec2 p(std::cos(angle), std::sin(angle));
    const glm::dvec2 turned[] = {{p.x, p.y}, {-p.y, p.x}, {-p.x, -p.y}, {p.y, -p.x}};
    return turned[quarter % 4];
}

}  // namespace

ConeBorders::ConeBorders(Cones cones) : azimuths(cones.azimuth), elevations(cones.elevation) {
    for (int k = 0; k < std::min(azimuths, kMostAzimuths); ++k) borders[k].azimuth = onCircle(k, azimuths);
    for (int k = 0; k < std::min(elevations, kMostElevations); ++k) {
        // An elevation of -90 degrees is three quarters of a turn.
        const glm::dvec2 p = onCircle(3 * elevations + 2 * k, 4 * elevations);
        borders[k].elevation = glm::vec2(p.x * p.x, p.y * std::abs(p.y));
    }
}

int coneOf(const ConeBorders& borders, glm::vec3 d) { return f32::ConeLookup<ConeBorders>{borders}.coneAlong(d); }

std::vector<float> signedConeDistances(const Occupancy& occupancy, glm::ivec3 sign, bool betweenCentres) {
    const TileGrid& grid = occupancy.grid;
    std::vector<float> squares(grid.count());
    std::vector<double> field(grid.count());
    for (size_t i = 0; i < field.size(); ++i) field[i] = occupancy.cells[i] ? 0 : kInfinity;
    const size_t stride[3] = {1, size_t(grid.cells.x), size_t(grid.cells.x) * size_t(grid.cells.y)};
    for (int axis = 0; axis < 3; ++axis) {
        const int n = grid.cells[axis];
        OneSidedEnvelope envelope(grid.cell[axis], betweenCentres);
        std::vector<double> line(n), least(n);
        for (size_t start = 0; start < field.size(); ++start) {
            if (start / stride[axis] % size_t(n) != 0) continue;
            for (int k = 0; k < n; ++k) line[k] = field[start + k * stride[axis]];
            std::fill(least.begin(), least.end(), kInfinity);
            if (sign[axis] >= 0) envelope.lower(line, axis < 2, true, least);
            if (sign[axis] <= 0) envelope.lower(line, axis < 2, false, least);
            for (int k = 0; k < n; ++k) field[start + k * stride[axis]] = least[k];
        }
    }
    for (size_t i = 0; i < field.size(); ++i) squares[i] = float(std::sqrt(field[i]));
    return squares;
}

namespace {

/// Returns the signs of a cone's axes; 0 for both.
glm::ivec3 signOf(Cones cones, int cone) {
    const int azimuth = cone % cones.azimuth, elevation = cone / cones.azimuth;
    glm::ivec3 sign(0);
    if (cones.azimuth == 4) sign.x = azimuth == 0 || azimuth == 3 ? 1 : -1;
    if (cones.azimuth >= 2) sign.y = azimuth < cones.azimuth / 2 ? 1 : -1;
    if (cones.elevation == 2) sign.z = elevation == 1 ? 1 : -1;
    return sign;
}

/// Cuts the rectangle of differences in x and y to a wedge of azimuths; returns the corners, none when they do not
/// meet.
std::vector<glm::dvec2> cutToWedge(glm::dvec2 lower, glm::dvec2 upper, double from, double to) {
    std::vector<glm::dvec2> polygon{{lower.x, lower.y}, {upper.x, lower.y}, {upper.x, upper.y}, {lower.x, upper.y}};
    if (to - from >= 2 * pi) return polygon;
    // The left of the first edge and the right of the second are kept; wedges are at most half planes.
    for (const auto& [angle, side] : {std::pair(from, 1.0), std::pair(to, -1.0)}) {
        const glm::dvec2 normal = side * glm::dvec2(-std::sin(angle), std::cos(angle));
        std::vector<glm::dvec2> kept;
        for (size_t i = 0; i < polygon.size(); ++i) {
            const glm::dvec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
            const double fa = glm::dot(normal, a), fb = glm::dot(normal, b);
            if (fa >= 0) kept.push_back(a);
            if ((fa > 0 && fb < 0) || (fa < 0 && fb > 0)) kept.push_back(a + (b - a) * (fa / (fa - fb)));
        }
        polygon = std::move(kept);
    }
    return polygon;
}

/// Returns the least distance from the origin to a convex polygon, which may be a point or a line.
double leastRadius(const std::vector<glm::dvec2>& polygon) {
    double least = kInfinity;
    bool left = polygon.size() > 2, right = polygon.size() > 2;
    for (size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec2 a = polygon[i], ab = polygon[(i + 1) % polygon.size()] - a;
        const double size = glm::dot(ab, ab), s = size > 0 ? std::clamp(-glm::dot(a, ab) / size, 0.0, 1.0) : 0;
        least = std::min(least, glm::length(a + s * ab));
        const double side = a.x * ab.y - a.y * ab.x;
        left = left && side >= 0, right = right && side <= 0;
    }
    return left || right ? 0 : least;
}

struct Offset {
    glm::ivec3 cells;
    float length;
};

/// Returns offsets of cells that hold a point in the cone from some point of the cell at 0, nearest first, up to `cap`.
std::vector<Offset> offsetsInCone(const TileGrid& grid, Cones cones, int cone, double cap) {
    const double wedge = 2 * pi / cones.azimuth, band = pi / cones.elevation;
    const int azimuth = cone % cones.azimuth, elevation = cone / cones.azimuth;
    // At the axes the signs decide, so a ray's cone is exact there.
    const auto slackAt = [&](int border) {
        return cones.azimuth == 2 || (cones.azimuth % 4 == 0 && border % (cones.azimuth / 4) == 0) ? 0 : kConeSlack;
    };
    const double from = azimuth * wedge - slackAt(azimuth), to = (azimuth + 1) * wedge + slackAt(azimuth + 1);
    const double slackZ = cones.elevation == 2 ? 0 : kConeSlack, low = -pi / 2 + elevation * band - slackZ,
                 high = low + band + 2 * slackZ;
    const glm::ivec3 reach = glm::ivec3(glm::ceil(glm::dvec3(cap) / grid.cell)) + 1;
    std::vector<Offset> offsets;
    // Cells that only touch along a wall are left out: the surface there is in the widened cell on the other side.
    constexpr double kOpen = 1 - 0.5 * kCellSlack;
    for (int j = -reach.y; j <= reach.y; ++j)
        for (int i = -reach.x; i <= reach.x; ++i) {
            const auto polygon = cutToWedge(glm::dvec2(i - kOpen, j - kOpen) * glm::dvec2(grid.cell),
                                            glm::dvec2(i + kOpen, j + kOpen) * glm::dvec2(grid.cell), from,
                                            cones.azimuth == 1 ? from + 7 : to);
            if (polygon.empty()) continue;
            const double near =
                std::max(0.0, leastRadius(polygon) - 1.5 * kCellSlack * std::max(grid.cell.x, grid.cell.y));
            if (near >= cap) continue;
            double far = 0;
            for (const glm::dvec2 p : polygon) far = std::max(far, glm::length(p));
            for (int k = -std::min(reach.z, grid.cells.z); k <= std::min(reach.z, grid.cells.z); ++k) {
                const double bottom = (k - kOpen) * grid.cell.z, top = (k + kOpen) * grid.cell.z;
                const double highest = std::atan2(top, top >= 0 ? near : far),
                             lowest = std::atan2(bottom, bottom >= 0 ? far : near);
                if (highest < low || lowest > high) continue;
                const double gap = std::max(0, std::abs(k) - 1) * grid.cell.z, length = std::hypot(near, gap);
                if (length < cap) offsets.push_back({{i, j, k}, float(length)});
            }
        }
    std::ranges::stable_sort(offsets, {}, &Offset::length);
    return offsets;
}

/// Finds the lengths of cones that are narrow enough to be followed layer by layer.
std::vector<float> beamDistances(const BeamGrid& beams, Cones cones, int cone, double cap, size_t cells) {
    std::vector<float> lengths(cells);
    beams.lengths(beamOf(cones.azimuth, cones.elevation, cone % cones.azimuth, cone / cones.azimuth, kConeSlack), cap,
                  lengths);
    return lengths;
}

std::vector<float> searchedDistances(const Occupancy& occupancy, Cones cones, int cone, double cap) {
    const TileGrid& grid = occupancy.grid;
    const std::vector<Offset> offsets = offsetsInCone(grid, cones, cone, cap);
    std::vector<float> lengths(grid.count(), std::numeric_limits<float>::infinity());
    for (size_t i = 0; i < lengths.size(); ++i) {
        const glm::ivec3 at = grid.at(i);
        for (const Offset& offset : offsets)
            if (occupancy.at(at + offset.cells)) {
                lengths[i] = offset.length;
                break;
            }
    }
    return lengths;
}

/// Computes distances in the paper's way: between centres of fine cells, and the least of each coarse cell.
std::vector<float> leastOfFine(const TileGrid& grid, const Occupancy& fine, glm::ivec3 sign, int refine,
                               double subtract) {
    const std::vector<float> lengths = signedConeDistances(fine, sign, true);
    std::vector<float> least(grid.count(), std::numeric_limits<float>::infinity());
    for (size_t i = 0; i < lengths.size(); ++i) {
        float& target = least[grid.index(fine.grid.at(i) / refine)];
        target = std::min(target, std::max(0.0f, lengths[i] - float(subtract)));
    }
    return least;
}

/// Rounds lengths to bytes that stand for no more than the lengths.
void roundDown(const std::vector<float>& lengths, const Occupancy& occupancy, float cap, float unit, uint8_t* steps) {
    for (size_t i = 0; i < lengths.size(); ++i) {
        const float length = std::min(lengths[i], cap);
        int step = int(std::min(float(kMostSteps), std::floor(length / unit)));
        // A ray's own rounding is part of the bound.
        while (step > 0 && double(float(step) * unit) > double(length) * (1 - 1e-6)) --step;
        steps[i] = occupancy.cells[i] != 0 ? kOccupied : uint8_t(step);
    }
}

Result<void> check(const Occupancy& occupancy, const DistanceOptions& o, const Shape* shape) {
    const auto fail = [](std::string message) {
        return Error{.code = ErrorCode::Usage, .message = std::move(message)};
    };
    if (o.cones.azimuth < 1 || o.cones.azimuth > 32 || o.cones.elevation < 1 || o.cones.elevation > 16)
        return fail("cones must be from 1x1 to 32x16");
    if (!(o.cap > 0) || o.cap > 16) return fail("the cap of distances must be above 0 and at most 16 tiles");
    if (o.rule != DistanceRule::AnyPoint) {
        if (shape == nullptr || !o.cones.areSigns())
            return fail("the paper's rule is there for cones of 1, 2 or 4 azimuths and 1 or 2 elevations");
        if (o.refine < 2 || o.refine > 8) return fail("the paper's rule refines 2 to 8 times");
    }
    if (double(occupancy.grid.count()) * o.cones.count() > double(kMaxGridCells))
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("{} cones of {} cells are too many; at most {} together", o.cones.count(),
                                            occupancy.grid.count(), kMaxGridCells)};
    return {};
}

}  // namespace

Result<DistanceMap> buildDistanceMap(const Occupancy& occupancy, const DistanceOptions& options, const Shape* shape) {
    VCP_TRY(check(occupancy, options, shape));
    const TileGrid& grid = occupancy.grid;
    DistanceMap map{grid, options.cones, float(options.cap / kMostSteps * (1 - 1e-5)), {}};
    map.steps.resize(size_t(options.cones.count()) * grid.count());
    Occupancy fine;
    if (options.rule != DistanceRule::AnyPoint) {
        VCP_TRY_ASSIGN(fine, occupy(*shape, grid.cells * options.refine));
    }
    // Rectangles are drawn in by half of what cells are widened by.
    std::optional<BeamGrid> beams;
    if (options.rule == DistanceRule::AnyPoint && !options.search &&
        areBeams(options.cones.azimuth, options.cones.elevation))
        beams.emplace(grid.cells, grid.cell, occupancy.cells, 0.5 * kCellSlack);
    for (int cone = 0; cone < options.cones.count(); ++cone) {
        std::vector<float> lengths;
        if (beams) {
            lengths = beamDistances(*beams, options.cones, cone, options.cap, grid.count());
        } else if (options.rule != DistanceRule::AnyPoint) {
            // Both centres are off by half a diagonal.
            const double subtract = options.rule == DistanceRule::PaperSafe ? glm::length(fine.grid.cell) : 0;
            lengths = leastOfFine(grid, fine, signOf(options.cones, cone), options.refine, subtract);
        } else if (options.cones.areSigns() && !options.search) {
            lengths = signedConeDistances(occupancy, signOf(options.cones, cone));
        } else {
            lengths = searchedDistances(occupancy, options.cones, cone, options.cap);
        }
        roundDown(lengths, occupancy, float(options.cap), map.unit, map.steps.data() + size_t(cone) * grid.count());
    }
    return map;
}

}  // namespace vcp::meso
