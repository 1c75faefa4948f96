#include "mesostructure/base/manifold_part.h"

#include <algorithm>
#include <array>
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

}  // namespace vcp::meso
