#include "mesostructure/remesh/remesh_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/base/surface_edges.h"
#include "mesostructure/shell.h"

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3, glm::vec2;

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
    std::unordered_map<uint64_t, std::pair<uint32_t, int>> sides;  // by (to, from): triangle and corner
    const auto key = [](uint32_t from, uint32_t to) { return (uint64_t{from} << 32) | to; };
    for (uint32_t i = 0; i < surface.triangles.size(); ++i)
        for (int k = 0; k < 3; ++k) sides[key(surface.triangles[i][k], surface.triangles[i][(k + 1) % 3])] = {i, k};
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        auto& seams = surface.seams.emplace_back();
        seams.fill(RemeshSurface::kNoSeam);
        for (int k = 0; k < 3; ++k) {
            const auto found = sides.find(key(surface.triangles[i][(k + 1) % 3], surface.triangles[i][k]));
            if (found == sides.end()) continue;
            const auto& other = surface.uvs[found->second.first];
            const int corner = found->second.second;
            const std::array<vec2, 2> beyond{other[(corner + 1) % 3], other[corner]};
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

/// Halves triangles until none of their edges is longer than so many texels.
class Cutting {
public:
    Cutting(const RemeshSurface& from, double mostTexels, uint64_t mostTriangles)
        : most_(mostTexels), mostTriangles_(mostTriangles), texels_(from.heights->texels()), cut_(from) {
        cut_.triangles.clear(), cut_.uvs.clear(), cut_.baseTriangles.clear(), cut_.seams.clear(), cut_.seamUvs.clear(),
            cut_.places.clear();
    }

    Result<RemeshSurface> run(const RemeshSurface& from) {
        for (size_t i = 0; i < from.triangles.size(); ++i) {
            Part part{from.triangles[i], from.uvs[i], {}, from.baseTriangles[i]};
            for (int k = 0; k < 3; ++k) {
                const uint32_t seam = from.seams[i][k];
                part.beyond[k] = seam != RemeshSurface::kNoSeam
                                     ? from.seamUvs[seam]
                                     : std::array<vec2, 2>{part.uvs[k], part.uvs[(k + 1) % 3]};
            }
            open_.push_back(part);
            while (!open_.empty()) VCP_TRY(step());
        }
        addDensities(cut_), addSeams(cut_), addPlaces(cut_);
        return std::move(cut_);
    }

private:
    struct Part {
        std::array<uint32_t, 3> corners;
        std::array<vec2, 3> uvs;
        std::array<std::array<vec2, 2>, 3> beyond;  ///< the other side's coordinates of the edges
        uint32_t baseTriangle = 0;
    };

    [[nodiscard]] double lengthOf(vec2 a, vec2 b) const { return glm::length((dvec2(b) - dvec2(a)) * texels_); }

    Result<void> step() {
        const Part part = open_.back();
        open_.pop_back();
        int longest = -1;
        double most = most_;
        for (int k = 0; k < 3; ++k)
            if (const double length = std::max(lengthOf(part.uvs[k], part.uvs[(k + 1) % 3]),
                                               lengthOf(part.beyond[k][0], part.beyond[k][1]));
                length > most)
                longest = k, most = length;
        if (longest < 0) {
            cut_.triangles.push_back(part.corners), cut_.uvs.push_back(part.uvs);
            cut_.baseTriangles.push_back(part.baseTriangle);
        } else {
            halve(part, longest);
        }
        if (cut_.triangles.size() + open_.size() > mostTriangles_)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("a remeshed surface of more than {} patches of {} texels",
                                                mostTriangles_, most_)};
        return {};
    }

    void halve(const Part& part, int k) {
        const int next = (k + 1) % 3, other = (k + 2) % 3;
        const uint32_t middle = middleOf(part.corners[k], part.corners[next]);
        const vec2 uv = 0.5f * (part.uvs[k] + part.uvs[next]), beyond = 0.5f * (part.beyond[k][0] + part.beyond[k][1]);
        Part first = part, second = part;
        first.corners[next] = second.corners[k] = middle;
        first.uvs[next] = second.uvs[k] = uv;
        first.beyond[k][1] = second.beyond[k][0] = beyond;
        first.beyond[next] = {uv, part.uvs[other]}, second.beyond[other] = {part.uvs[other], uv};
        open_.push_back(second), open_.push_back(first);
    }

    uint32_t middleOf(uint32_t a, uint32_t b) {
        const auto [found, isNew] =
            middles_.try_emplace((uint64_t{std::min(a, b)} << 32) | std::max(a, b), uint32_t(cut_.positions.size()));
        if (isNew) {
            cut_.positions.push_back(0.5f * (cut_.positions[a] + cut_.positions[b]));
            cut_.directions.push_back(0.5f * (cut_.directions[a] + cut_.directions[b]));
        }
        return found->second;
    }

    double most_;
    uint64_t mostTriangles_;
    dvec2 texels_;
    RemeshSurface cut_;
    std::vector<Part> open_;
    std::unordered_map<uint64_t, uint32_t> middles_;
};

}  // namespace

Result<RemeshSurface> cutSurface(const RemeshSurface& surface, double mostTexels, uint64_t mostTriangles) {
    return Cutting(surface, mostTexels, mostTriangles).run(surface);
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
