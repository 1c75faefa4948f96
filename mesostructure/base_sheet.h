// A grid of triangles over a rectangle of parameters, of which base surfaces are made.
#pragma once

#include <functional>

#include "mesostructure/base_surface.h"

namespace vcp::meso {

/// Adds a grid of columns x rows cells over [0, 1]^2. `uv` maps the parameters to tiles.
inline void addSheet(BaseSurface& to, int columns, int rows, const std::function<glm::dvec3(double, double)>& at,
                     const std::function<glm::dvec2(double, double)>& uv) {
    const auto first = uint32_t(to.positions.size());
    const auto parameter = [](int i, int n) { return double(i) / n; };
    for (int j = 0; j <= rows; ++j)
        for (int i = 0; i <= columns; ++i) to.positions.push_back(at(parameter(i, columns), parameter(j, rows)));
    const auto add = [&](std::array<glm::ivec2, 3> corners) {
        std::array<uint32_t, 3> triangle;
        std::array<glm::dvec2, 3> map;
        for (int k = 0; k < 3; ++k) {
            triangle[k] = first + uint32_t(corners[k].x + (columns + 1) * corners[k].y);
            map[k] = uv(parameter(corners[k].x, columns), parameter(corners[k].y, rows));
        }
        to.triangles.push_back(triangle), to.uvs.push_back(map);
    };
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            add({glm::ivec2(i, j), glm::ivec2(i + 1, j), glm::ivec2(i + 1, j + 1)});
            add({glm::ivec2(i, j), glm::ivec2(i + 1, j + 1), glm::ivec2(i, j + 1)});
        }
}

}  // namespace vcp::meso
