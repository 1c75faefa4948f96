#include "mesostructure/remesh/remesh_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/base/surface_edges.h"
#include "mesostructure/remesh/height_bends.h"
#include "mesostructure/shell.h"

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3, glm::vec2;

// Where a slope changes by more than this in a texel, or the map jumps along an edge by more than that part of a texel,
// patches are small.
constexpr double kSteepBend = 4, kSteepJump = 1.0 / 16;

Error invalid(std::string message) { return {.code = ErrorCode::InvalidInput, .message = std::move(message)}; }

Result<void> checkNumbers(const BaseSurface& base) {
    const auto isGood = [](auto v, int n) {
        for (int k = 0; k < n; ++k)
            if (!(std::abs(v[k]) < 1e30)) return false;
        return true;
    };
    for (size_t i = 0; i < base.triangles.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            if (!isGood(base.positions[base.triangles[i][k]], 3))
                return invalid(fmt::format("triangle {}: a position is not finite", i));
            if (!isGood(base.uvs[i][k], 2))
                return invalid(fmt::format("triangle {}: a texture coordinate is not finite", i));
        }
    return {};
}

/// Returns the greatest gradient of the texture coordinates over a triangle, tile units a world unit.
double stretchOf(const std::array<dvec3, 3>& p, const std::array<vec2, 3>& uv) {
    const dvec3 a = p[1] - p[0], b = p[2] - p[0], n = glm::cross(a, b);
    const double area = glm::dot(n, n);
    if (!(area > 0)) return 0;
    // The gradient of a function that is 0, s, t at the corners.
    const auto gradient = [&](double s, double t) {
        return glm::length((s * glm::cross(b, n) + t * glm::cross(n, a)) / area);
    };
    return std::max(gradient(uv[1].x - uv[0].x, uv[2].x - uv[0].x), gradient(uv[1].y - uv[0].y, uv[2].y - uv[0].y));
}

void addDensities(RemeshSurface& surface) {
    surface.densities.assign(surface.positions.size(), 0);
    const float texels = float(surface.heights->levels().front().size.x);
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        std::array<dvec3, 3> p;
        for (int k = 0; k < 3; ++k) p[k] = dvec3(surface.positions[surface.triangles[i][k]]);
        const float density = texels * float(stretchOf(p, surface.uvs[i]));
        for (const uint32_t corner : surface.triangles[i])
            surface.densities[corner] = std::max(surface.densities[corner], density);
    }
}

/// Finds the edges along which the two sides' texture coordinates differ.
void addSeams(RemeshSurface& surface) {
    const std::vector<uint32_t> opposite = oppositeEdges(surface.triangles, surface.positions.size());
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        auto& seams = surface.seams.emplace_back();
        seams.fill(RemeshSurface::kNoSeam);
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t side = opposite[3 * i + k];
            if (side == kNoEdge) continue;
            const auto& other = surface.uvs[side / 3];
            const std::array<vec2, 2> beyond{other[(side + 1) % 3], other[side % 3]};
            if (beyond[0] == surface.uvs[i][k] && beyond[1] == surface.uvs[i][(k + 1) % 3]) continue;
            seams[k] = uint32_t(surface.seamUvs.size());
            surface.seamUvs.push_back(beyond);
        }
    }
}

/// Lists the texture coordinates of each position.
void addPlaces(RemeshSurface& surface) {
    std::vector<std::pair<uint32_t, vec2>> all;
    for (size_t i = 0; i < surface.triangles.size(); ++i)
        for (int k = 0; k < 3; ++k) all.emplace_back(surface.triangles[i][k], surface.uvs[i][k]);
    const auto order = [](const auto& a, const auto& b) {
        if (a.first != b.first) return a.first < b.first;
        return a.second.x != b.second.x ? a.second.x < b.second.x : a.second.y < b.second.y;
    };
    std::ranges::sort(all, order);
    all.erase(std::unique(all.begin(), all.end()), all.end());
    surface.firstPlace.assign(surface.positions.size() + 1, 0);
    for (const auto& [position, uv] : all) {
        ++surface.firstPlace[position + 1];
        surface.places.push_back(uv);
    }
    for (size_t i = 1; i < surface.firstPlace.size(); ++i) surface.firstPlace[i] += surface.firstPlace[i - 1];
}

/// Halves the edges of triangles until none is too long.
class Cutting {
public:
    Cutting(const RemeshSurface& from, const CutOptions& options)
        : options_(options), texels_(from.heights->texels()), cut_(from) {
        cut_.triangles.clear(), cut_.uvs.clear(), cut_.baseTriangles.clear(), cut_.seams.clear(), cut_.seamUvs.clear(),
            cut_.places.clear();
    }

    Result<RemeshSurface> run(const RemeshSurface& from) {
        for (const auto& uvs : from.uvs) area_ += areaOf(uvs);
        for (size_t i = 0; i < from.triangles.size(); ++i) {
            Part part{from.triangles[i], from.uvs[i], {}, {}, from.baseTriangles[i]};
            for (size_t k = 0; k < 3; ++k) {
                const uint32_t seam = from.seams[i][k];
                part.beyond[k] = seam != RemeshSurface::kNoSeam
                                     ? from.seamUvs[seam]
                                     : std::array<vec2, 2>{part.uvs[k], part.uvs[(k + 1) % 3]};
            }
            for (size_t k = 0; k < 3; ++k) part.tooLong[k] = tooLong(part, k);
            open_.push_back(part);
            while (!open_.empty()) VCP_TRY(step());
        }
        middles_.clear();
        addDensities(cut_), addSeams(cut_), addPlaces(cut_);
        return std::move(cut_);
    }

private:
    struct Part {
        std::array<uint32_t, 3> corners;
        std::array<vec2, 3> uvs;
        std::array<std::array<vec2, 2>, 3> beyond;  ///< the other side's coordinates of the edges
        std::array<double, 3> tooLong;              ///< as the function, of the edges
        uint32_t baseTriangle = 0;
    };

    static double areaOf(const std::array<vec2, 3>& uvs) {
        const dvec2 a = dvec2(uvs[1]) - dvec2(uvs[0]), b = dvec2(uvs[2]) - dvec2(uvs[0]);
        return std::abs(a.x * b.y - a.y * b.x);
    }

    /// Returns the length of an edge in texels, the longer of its two sides', where it is halved; else 0. It depends on
    /// the edge alone.
    [[nodiscard]] double tooLong(const Part& part, size_t k) const {
        const vec2 a = part.uvs[k], b = part.uvs[(k + 1) % 3];
        const auto lengthOf = [&](vec2 from, vec2 to) { return glm::length((dvec2(to) - dvec2(from)) * texels_); };
        const double own = lengthOf(a, b), beyond = lengthOf(part.beyond[k][0], part.beyond[k][1]),
                     length = std::max(own, beyond);
        if (length > options_.mostTexels) return length;
        if (options_.bends == nullptr) return 0;
        if (!(length > options_.mostSteepTexels) && crossingOf(part, k) == 0) return 0;
        const uint32_t from = part.corners[k], to = part.corners[(k + 1) % 3];
        const double high =
                         std::max(glm::length(dvec3(cut_.directions[from])), glm::length(dvec3(cut_.directions[to]))),
                     wide = glm::distance(dvec3(cut_.positions[from]), dvec3(cut_.positions[to]));
        // How much a slope changes in a texel is compared with 1: both in units of the world.
        const bool isSteep =
            high * options_.bends->along(a, b) * own > kSteepBend * wide ||
            high * options_.bends->along(part.beyond[k][0], part.beyond[k][1]) * beyond > kSteepBend * wide ||
            high * jumpAlong(part, k) * length > kSteepJump * wide;
        return isSteep ? length : 0;
    }

    /// Returns by how much the heights on an edge's two sides differ, in some places.
    [[nodiscard]] double jumpAlong(const Part& part, size_t k) const {
        const vec2 a = part.uvs[k], b = part.uvs[(k + 1) % 3];
        const auto& [start, end] = part.beyond[k];
        if (a == start && b == end) return 0;
        double most = 0;
        constexpr int kPlaces = 16;
        for (int i = 0; i <= kPlaces; ++i) {
            const double t = double(i) / kPlaces;
            most = std::max(most, std::abs(cut_.heights->height(0, glm::mix(dvec2(a), dvec2(b), t)) -
                                           cut_.heights->height(0, glm::mix(dvec2(start), dvec2(end), t))));
        }
        return most;
    }

    Result<void> step() {
        constexpr uint64_t kTold = 1 << 14;  // steps
        const Part part = open_.back();
        open_.pop_back();
        const size_t longest = size_t(std::ranges::max_element(part.tooLong) - part.tooLong.begin());
        if (part.tooLong[longest] == 0) {
            cut_.triangles.push_back(part.corners), cut_.uvs.push_back(part.uvs);
            cut_.baseTriangles.push_back(part.baseTriangle);
            areaDone_ += areaOf(part.uvs);
        } else {
            halve(part, longest);
        }
        if (cut_.triangles.size() + open_.size() > options_.mostTriangles)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("a remeshed surface of more than {} patches of {} texels",
                                                options_.mostTriangles, options_.mostTexels)};
        const double done = area_ > 0 ? std::min(areaDone_ / area_, 1.0) : 0;
        if (steps_++ % kTold != 0) return {};
        cut_.heights->letGo();
        return options_.progress && !options_.progress(done) ? Result<void>(Error::cancelled()) : Result<void>();
    }

    /// Halves the longest edge, and with it one that is nearly as long: the two middles are joined, so that what is
    /// narrow gets shorter, not narrower.
    void halve(const Part& part, size_t k) {
        constexpr double kNearly = 0.75;
        const auto& lengths = part.tooLong;
        const size_t next = (k + 1) % 3, other = (k + 2) % 3;
        const auto [first, second] = halved(part, k);
        const bool isNext = lengths[next] >= lengths[other];
        if (std::max(lengths[next], lengths[other]) < kNearly * lengths[k]) {
            open_.push_back(second), open_.push_back(first);
            return;
        }
        // The half that has the other long edge is halved there, and its edge from that middle is the one to the first.
        const Part& rest = isNext ? second : first;
        const auto [upper, lower] = halved(rest, isNext ? next : other);
        open_.push_back(isNext ? first : second), open_.push_back(upper), open_.push_back(lower);
    }

    /// Returns the halves of a triangle on both sides of the line from the middle of edge k to the opposite corner: the
    /// one with the edge's start first.
    std::pair<Part, Part> halved(const Part& part, size_t k) {
        const size_t next = (k + 1) % 3, other = (k + 2) % 3;
        const Middle middle = middleOf(part, k);
        Part first = part, second = part;
        first.corners[next] = second.corners[k] = middle.corner;
        first.uvs[next] = second.uvs[k] = middle.uv;
        first.beyond[k][1] = second.beyond[k][0] = middle.beyond;
        first.beyond[next] = {middle.uv, part.uvs[other]}, second.beyond[other] = {part.uvs[other], middle.uv};
        first.tooLong[k] = tooLong(first, k), second.tooLong[k] = tooLong(second, k);
        // The edge between the halves.
        first.tooLong[next] = second.tooLong[other] = tooLong(first, next);
        return {first, second};
    }

    /// An edge and its other side, from the end with the lower number; in texels.
    struct Line {
        dvec2 start, end, beyondStart, beyondEnd;
        bool hasSeam;
    };

    [[nodiscard]] Line lineOf(const Part& part, size_t k) const {
        const size_t next = (k + 1) % 3;
        const auto& [start, end] = part.beyond[k];
        Line line{dvec2(part.uvs[k]) * texels_, dvec2(part.uvs[next]) * texels_, dvec2(start) * texels_,
                  dvec2(end) * texels_, part.uvs[k] != start || part.uvs[next] != end};
        if (part.corners[k] > part.corners[next])
            std::swap(line.start, line.end), std::swap(line.beyondStart, line.beyondEnd);
        return line;
    }

    /// Returns where an edge crosses a line between the map's texels, on either side, nearest to its middle; as a part
    /// of its length from the end with the lower number; 0: nowhere between its ends.
    [[nodiscard]] float crossingOf(const Part& part, size_t k) const {
        constexpr double kOnLine = 1e-3;  // texels
        const Line line = lineOf(part, k);
        double best = 0;
        const auto look = [&](double a, double b) {
            const double middle = 0.5 * (a + b);
            for (const double at : {std::floor(middle), std::ceil(middle)}) {
                const double t = (at - a) / (b - a);
                if (at > std::min(a, b) + kOnLine && at < std::max(a, b) - kOnLine &&
                    std::abs(t - 0.5) < std::abs(best - 0.5))
                    best = t;
            }
        };
        for (int axis = 0; axis < 2; ++axis) look(line.start[axis], line.end[axis]);
        for (int axis = 0; axis < 2 && line.hasSeam; ++axis) look(line.beyondStart[axis], line.beyondEnd[axis]);
        return float(best);
    }

    /// Returns where an edge is halved, from the end with the lower number: where it crosses a line of the map near its
    /// middle, so that triangles have their corners on texels; of a long seam in the middle.
    [[nodiscard]] float partOf(const Part& part, size_t k) const {
        const Line line = lineOf(part, k);
        const dvec2 along = line.end - line.start;
        if (std::max(glm::length(along), glm::length(line.beyondEnd - line.beyondStart)) <= options_.mostSteepTexels)
            if (const float t = crossingOf(part, k); t > 0) return t;
        if (line.hasSeam) return 0.5f;
        const int axis = std::abs(along.x) >= std::abs(along.y) ? 0 : 1;
        const double middle = 0.5 * (line.start[axis] + line.end[axis]), most = 0.125 * std::abs(along[axis]);
        for (double step = std::exp2(std::floor(std::log2(std::max(options_.mostTexels, 1.0)))); step >= 1; step /= 2)
            if (const double at = std::floor(middle / step + 0.5) * step; std::abs(at - middle) <= most)
                return float((at - line.start[axis]) / along[axis]);
        return 0.5f;
    }

    struct Middle {
        uint32_t corner;
        vec2 uv, beyond;
    };

    /// Returns the point at which an edge is halved, the same from both its sides.
    Middle middleOf(const Part& part, size_t k) {
        const size_t next = (k + 1) % 3;
        const auto& [start, end] = part.beyond[k];
        const bool isTurned = part.corners[k] > part.corners[next];
        const size_t first = isTurned ? next : k, second = isTurned ? k : next;
        const float t = partOf(part, k);
        const auto between = [t](const auto& a, const auto& b) { return a + t * (b - a); };
        const uint32_t a = part.corners[first], b = part.corners[second];
        const auto [found, isNew] = middles_.try_emplace((uint64_t{a} << 32) | b, uint32_t(cut_.positions.size()));
        if (isNew) {
            cut_.positions.push_back(between(cut_.positions[a], cut_.positions[b]));
            cut_.directions.push_back(between(cut_.directions[a], cut_.directions[b]));
        }
        const Middle middle{found->second, between(part.uvs[first], part.uvs[second]),
                            isTurned ? between(end, start) : between(start, end)};
        // An edge has two sides at most: the second asks last.
        if (!isNew) middles_.erase(found);
        return middle;
    }

    const CutOptions& options_;
    dvec2 texels_;
    RemeshSurface cut_;
    std::vector<Part> open_;
    std::unordered_map<uint64_t, uint32_t> middles_;  // of edges that were halved from one side
    double area_ = 0, areaDone_ = 0;                  // of the map, twice
    uint64_t steps_ = 0;
};

}  // namespace

Result<RemeshSurface> cutSurface(const RemeshSurface& surface, const CutOptions& options) {
    return Cutting(surface, options).run(surface);
}

Result<RemeshSurface> buildRemeshSurface(const BaseSurface& base, std::shared_ptr<const HeightLevels> heights,
                                         double height, double offset) {
    if (!(height > 0) || !std::isfinite(height))
        return Error{.code = ErrorCode::Usage, .message = "a displacement's height must be above 0"};
    if (!std::isfinite(offset))
        return Error{.code = ErrorCode::Usage, .message = "a displacement's offset must be finite"};
    if (base.uvs.size() != base.triangles.size())
        return invalid("a base surface needs texture coordinates for each triangle");
    VCP_TRY(checkNumbers(base));
    if (const auto edges = edgesOf(base); !edges) return edges.error();
    RemeshSurface surface;
    surface.heights = std::move(heights);
    dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
    for (size_t i = 0; i < base.triangles.size(); ++i) {
        const auto& t = base.triangles[i];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
            ++surface.withoutCorners;
            continue;
        }
        surface.baseTriangles.push_back(uint32_t(surface.triangles.size()));
        surface.triangles.push_back(t);
        surface.uvs.push_back({vec2(base.uvs[i][0]), vec2(base.uvs[i][1]), vec2(base.uvs[i][2])});
        for (const uint32_t corner : t)
            low = glm::min(low, base.positions[corner]), high = glm::max(high, base.positions[corner]);
    }
    if (surface.triangles.empty()) return invalid("no triangle has three different corners");
    surface.origin = 0.5 * (low + high);
    const std::vector<dvec3> directions = shellDirections(base);
    for (size_t i = 0; i < base.positions.size(); ++i) {
        const dvec3 bottom = offset == 0 ? base.positions[i] : base.positions[i] + offset * directions[i];
        surface.positions.emplace_back(bottom - surface.origin);
        surface.directions.emplace_back(height * directions[i]);
        surface.longest = std::max(surface.longest, height * glm::length(directions[i]));
    }
    for (size_t i = 0; i < surface.triangles.size(); ++i)
        for (const uint32_t corner : surface.triangles[i]) {
            const dvec3 p = base.positions[corner] + offset * directions[corner], top = p + height * directions[corner];
            if (directions[corner] == dvec3(0))
                return invalid(
                    fmt::format("triangle {}: at ({:.9g}, {:.9g}, {:.9g}) the normals of the triangles "
                                "cancel: there is no direction to displace in",
                                i, p.x, p.y, p.z));
            low = glm::min(low, glm::min(p, top)), high = glm::max(high, glm::max(p, top));
        }
    surface.low = low, surface.high = high;
    addDensities(surface), addSeams(surface), addPlaces(surface);
    return surface;
}

}  // namespace vcp::meso
