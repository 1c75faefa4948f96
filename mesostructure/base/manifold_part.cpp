#include "mesostructure/base/manifold_part.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

namespace vcp::meso {

uint64_t keepManifoldPart(BaseSurface& surface) {
    const auto hasArea = [](const auto& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; };
    std::vector<std::pair<uint64_t, uint32_t>> edges;  // from and to, and the triangle
    edges.reserve(3 * surface.triangles.size());
    for (uint32_t i = 0; i < surface.triangles.size(); ++i) {
        const auto& t = surface.triangles[i];
        if (!hasArea(t)) continue;
        for (int k = 0; k < 3; ++k) edges.emplace_back(uint64_t{t[k]} << 32 | t[(k + 1) % 3], i);
    }
    std::sort(edges.begin(), edges.end());
    std::vector<bool> isLeft(surface.triangles.size(), true);
    for (size_t i = 1; i < edges.size(); ++i)
        if (edges[i].first == edges[i - 1].first) isLeft[edges[i].second] = false;
    uint64_t gone = 0;
    size_t kept = 0;
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        if (!hasArea(surface.triangles[i])) continue;
        if (!isLeft[i]) {
            ++gone;
            continue;
        }
        surface.triangles[kept] = surface.triangles[i];
        if (!surface.uvs.empty()) surface.uvs[kept] = surface.uvs[i];
        ++kept;
    }
    surface.triangles.resize(kept);
    if (!surface.uvs.empty()) surface.uvs.resize(kept);
    return gone;
}

uint64_t leaveOutFolds(BaseSurface& surface) {
    auto& triangles = surface.triangles;
    // The corners in order, whether they go the other way round, and the number.
    std::vector<std::tuple<std::array<uint32_t, 3>, bool, uint32_t>> all;
    all.reserve(triangles.size());
    for (uint32_t i = 0; i < triangles.size(); ++i) {
        const auto& t = triangles[i];
        std::array<uint32_t, 3> corners = t;
        std::sort(corners.begin(), corners.end());
        all.emplace_back(corners, (t[0] < t[1]) + (t[1] < t[2]) + (t[2] < t[0]) == 1, i);
    }
    std::sort(all.begin(), all.end());
    std::vector<bool> isLeft(triangles.size(), true);
    for (size_t first = 0, last = 0; first < all.size(); first = last) {
        size_t turned = first;
        for (; last < all.size() && std::get<0>(all[last]) == std::get<0>(all[first]); ++last)
            turned += !std::get<1>(all[last]);
        for (size_t i = first, j = turned; i < turned && j < last; ++i, ++j)
            isLeft[std::get<2>(all[i])] = isLeft[std::get<2>(all[j])] = false;
    }
    size_t kept = 0;
    for (size_t i = 0; i < triangles.size(); ++i)
        if (isLeft[i]) triangles[kept++] = triangles[i];
    const uint64_t gone = triangles.size() - kept;
    triangles.resize(kept);
    return gone;
}

namespace {

constexpr uint32_t kNoTwin = ~uint32_t{0};

class UnionFind {
public:
    explicit UnionFind(size_t count) : parents_(count) { std::iota(parents_.begin(), parents_.end(), 0u); }
    uint32_t rootOf(uint32_t i) {
        for (; parents_[i] != i; i = parents_[i]) parents_[i] = parents_[parents_[i]];
        return i;
    }
    void unite(uint32_t a, uint32_t b) { parents_[rootOf(a)] = rootOf(b); }

private:
    std::vector<uint32_t> parents_;
};

/// The half-edges of a surface, 3 a triangle, from corner k to the next, and which of them belong together.
class Sheets {
public:
    explicit Sheets(const BaseSurface& surface)
        : triangles_(surface.triangles), twins_(3 * triangles_.size(), kNoTwin), parts_(triangles_.size()) {
        std::vector<std::pair<uint64_t, uint32_t>> edges;
        edges.reserve(twins_.size());
        for (uint32_t e = 0; e < twins_.size(); ++e) {
            const uint32_t a = startOf(e), b = startOf(nextOf(e));
            edges.emplace_back(uint64_t{std::min(a, b)} << 32 | std::max(a, b), e);
        }
        std::sort(edges.begin(), edges.end());
        std::vector<std::vector<uint32_t>> crowded;
        for (size_t first = 0, last = 0; first < edges.size(); first = last) {
            while (last < edges.size() && edges[last].first == edges[first].first) ++last;
            std::vector<uint32_t> group;
            for (size_t i = first; i < last; ++i) group.push_back(edges[i].second);
            if (last - first > 2)
                crowded.push_back(std::move(group));
            else if (last - first == 2 && startOf(group[0]) != startOf(group[1]))
                join(group[0], group[1]);
        }
        for (const auto& group : crowded) pairUp(group);
    }

    [[nodiscard]] const std::vector<uint32_t>& crowded() const { return crowded_; }
    [[nodiscard]] uint32_t twinOf(uint32_t e) const { return twins_[e]; }
    [[nodiscard]] uint32_t partOf(uint32_t triangle) { return parts_.rootOf(triangle); }
    [[nodiscard]] uint32_t startOf(uint32_t e) const { return triangles_[e / 3][e % 3]; }
    static uint32_t nextOf(uint32_t e) { return e - e % 3 + (e + 1) % 3; }

private:
    void join(uint32_t a, uint32_t b) {
        twins_[a] = b, twins_[b] = a;
        parts_.unite(a / 3, b / 3);
    }

    /// Joins the half-edges of an edge two and two: first those of triangles that belong together without it.
    void pairUp(const std::vector<uint32_t>& group) {
        crowded_.insert(crowded_.end(), group.begin(), group.end());
        for (const bool asTheyAre : {true, false})
            for (const uint32_t a : group)
                for (const uint32_t b : group)
                    if (twins_[a] == kNoTwin && twins_[b] == kNoTwin && startOf(a) != startOf(b) &&
                        (!asTheyAre || partOf(a / 3) == partOf(b / 3)))
                        join(a, b);
    }

    const std::vector<std::array<uint32_t, 3>>& triangles_;
    std::vector<uint32_t> twins_, crowded_;
    UnionFind parts_;
};

/// Leaves out closed sheets of a few triangles that touch another one along an edge.
void leaveOutPockets(BaseSurface& surface, Sheets& sheets) {
    constexpr uint32_t kMostOfPocket = 16;
    auto& triangles = surface.triangles;
    std::vector<uint32_t> sizes(triangles.size(), 0);
    for (uint32_t i = 0; i < triangles.size(); ++i) {
        uint32_t& size = sizes[sheets.partOf(i)];
        for (uint32_t k = 0; k < 3; ++k)
            if (sheets.twinOf(3 * i + k) == kNoTwin) size = kMostOfPocket;
        ++size;
    }
    std::vector<bool> isPocket(triangles.size(), false);
    for (const uint32_t e : sheets.crowded()) {
        const uint32_t part = sheets.partOf(e / 3);
        if (sizes[part] <= kMostOfPocket && 4 * sizes[part] < triangles.size()) isPocket[part] = true;
    }
    size_t kept = 0;
    for (uint32_t i = 0; i < triangles.size(); ++i)
        if (!isPocket[sheets.partOf(i)]) triangles[kept++] = triangles[i];
    triangles.resize(kept);
}

/// Gives fans of triangles corners of their own, where a corner of a crowded edge has several.
void partFans(BaseSurface& surface, const Sheets& sheets) {
    constexpr double kApart = 1.0 / 16;  // of the way to the middle of the fan's border
    auto& triangles = surface.triangles;
    UnionFind fans(3 * triangles.size());
    std::vector<bool> isAsked(surface.positions.size(), false);
    for (const uint32_t e : sheets.crowded()) isAsked[sheets.startOf(e)] = true;
    for (uint32_t e = 0; e < 3 * triangles.size(); ++e)
        if (const uint32_t twin = sheets.twinOf(e); twin != kNoTwin) fans.unite(e, Sheets::nextOf(twin));
    struct Fan {
        bool isOpen = false;
        glm::dvec3 sum{0};
        std::vector<uint32_t> corners;
    };
    std::map<std::pair<uint32_t, uint32_t>, Fan> all;  // by corner and root
    for (uint32_t e = 0; e < 3 * triangles.size(); ++e) {
        const uint32_t corner = sheets.startOf(e), next = Sheets::nextOf(e), last = Sheets::nextOf(next);
        if (!isAsked[corner]) continue;
        Fan& fan = all[{corner, fans.rootOf(e)}];
        fan.isOpen = fan.isOpen || sheets.twinOf(e) == kNoTwin || sheets.twinOf(last) == kNoTwin;
        fan.sum += 0.5 * (surface.positions[sheets.startOf(next)] + surface.positions[sheets.startOf(last)]);
        fan.corners.push_back(e);
    }
    std::vector<bool> isTaken(surface.positions.size(), false);
    for (const auto& [key, fan] : all) isTaken[key.first] = isTaken[key.first] || fan.isOpen;
    for (const auto& [key, fan] : all) {
        if (fan.isOpen) continue;
        if (!isTaken[key.first]) {
            isTaken[key.first] = true;
            continue;
        }
        const glm::dvec3 at = surface.positions[key.first];
        for (const uint32_t e : fan.corners) triangles[e / 3][e % 3] = uint32_t(surface.positions.size());
        surface.positions.push_back(at + kApart * (fan.sum / double(fan.corners.size()) - at));
    }
}

}  // namespace

void partSheets(BaseSurface& surface) {
    {
        Sheets sheets(surface);
        if (sheets.crowded().empty()) return;
        leaveOutPockets(surface, sheets);
    }
    const BaseSurface before = surface;
    partFans(surface, Sheets(before));
}

}  // namespace vcp::meso
