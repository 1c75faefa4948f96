#include "viewer/bake/displaced_mesh.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "mesostructure/shell.h"

namespace vcp {

namespace {

using glm::dvec2, glm::dvec3;

constexpr uint64_t kMostTriangles = uint64_t{1} << 26;

double heightAt(const meso::HeightMap& map, dvec2 at) {
    const double x = at.x * map.size.x, y = at.y * map.size.x, left = std::floor(x), low = std::floor(y);
    const int i = int(left), j = int(low);
    const double u = x - left, v = y - low;
    return (map.height(i, j) * (1 - u) + map.height(i + 1, j) * u) * (1 - v) +
           (map.height(i, j + 1) * (1 - u) + map.height(i + 1, j + 1) * u) * v;
}

/// Parts along the edges: no part of an edge is longer than a texel along an axis of the map.
uint32_t partsOf(const std::array<dvec2, 3>& uv, int size) {
    double longest = 1;
    for (int k = 0; k < 3; ++k) {
        const dvec2 edge = glm::abs(uv[(k + 1) % 3] - uv[k]) * double(size);
        longest = std::max({longest, edge.x, edge.y});
    }
    return uint32_t(std::ceil(longest - 1e-6));
}

}  // namespace

Result<IndexedMesh> displacedMesh(const meso::BaseSurface& surface, const meso::HeightMap& heights, double offset) {
    const std::vector<dvec3> directions = meso::shellDirections(surface);
    const double edge = meso::tileEdge(surface);
    uint64_t triangles = 0;
    for (const auto& uv : surface.uvs) {
        const uint64_t n = partsOf(uv, heights.size.x);
        triangles += n * n;
    }
    if (triangles > kMostTriangles)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("the displaced base has {} triangles, and at most {} are measured",
                                            triangles, kMostTriangles)};
    IndexedMesh mesh;
    mesh.triangles.reserve(triangles);
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        const auto& t = surface.triangles[i];
        const auto& uv = surface.uvs[i];
        const uint32_t n = partsOf(uv, heights.size.x), first = uint32_t(mesh.positions.size());
        for (uint32_t row = 0; row <= n; ++row)
            for (uint32_t column = 0; column + row <= n; ++column) {
                const dvec3 w = dvec3(n - row - column, column, row) / double(n);
                const double h = offset + edge * heightAt(heights, w.x * uv[0] + w.y * uv[1] + w.z * uv[2]);
                dvec3 p(0);
                for (int k = 0; k < 3; ++k) p += w[k] * (surface.positions[t[k]] + h * directions[t[k]]);
                mesh.positions.push_back(p);
            }
        // Row r begins behind n + 1, n, ... points.
        const auto point = [&](uint32_t row, uint32_t column) {
            return first + row * (n + 1) - row * (row - 1) / 2 + column;
        };
        for (uint32_t row = 0; row < n; ++row)
            for (uint32_t column = 0; column + row < n; ++column) {
                mesh.triangles.push_back({point(row, column), point(row, column + 1), point(row + 1, column)});
                if (column + row + 1 < n)
                    mesh.triangles.push_back(
                        {point(row, column + 1), point(row + 1, column + 1), point(row + 1, column)});
            }
    }
    return mesh;
}

}  // namespace vcp
