#include "mesostructure/remesh/remesh_frames.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace vcp::meso {

RemeshFrame remeshFrame(const RemeshSurface& surface, size_t triangle) {
    std::array<glm::dvec3, 3> p, d;
    std::array<glm::dvec2, 3> uv;
    for (size_t k = 0; k < 3; ++k) {
        const uint32_t corner = surface.triangles[triangle][k];
        p[k] = glm::dvec3(surface.positions[corner]), d[k] = glm::dvec3(surface.directions[corner]);
        uv[k] = glm::dvec2(surface.uvs[triangle][k]);
    }
    RemeshFrame frame{};
    const glm::dvec3 flat = glm::cross(p[1] - p[0], p[2] - p[0]);
    const double length = glm::length(flat);
    frame.facet = length > 0 ? flat / length : glm::normalize(d[0]);
    std::array<size_t, 3> order{0, 1, 2};
    std::ranges::sort(order, {}, [&](size_t k) { return surface.triangles[triangle][k]; });
    frame.place = p[order[0]], frame.direction = d[order[0]], frame.at = uv[order[0]];
    frame.toSecond = uv[order[1]] - frame.at, frame.toLast = uv[order[2]] - frame.at;
    const glm::dvec2 a = uv[1] - uv[0], b = uv[2] - uv[0];
    const double area = a.x * b.y - a.y * b.x;
    if (!(std::abs(area) > 1e-12 * (glm::dot(a, a) + glm::dot(b, b)))) return frame;
    frame.turned = area > 0 ? 1.0 : -1.0;
    const auto byU = [&](const std::array<glm::dvec3, 3>& of) {
        return (b.y * (of[1] - of[0]) - a.y * (of[2] - of[0])) / area;
    };
    const auto byV = [&](const std::array<glm::dvec3, 3>& of) {
        return (a.x * (of[2] - of[0]) - b.x * (of[1] - of[0])) / area;
    };
    frame.byU = byU(p), frame.byV = byV(p), frame.directionByU = byU(d), frame.directionByV = byV(d);
    return frame;
}

std::vector<glm::vec4> remeshFrames(const RemeshSurface& surface, glm::dvec3 origin) {
    std::vector<glm::vec4> quads{glm::vec4(float(surface.heights->used()), 0, 0, 0)};
    quads.reserve(1 + RemeshMath<float>::kRemeshFrameQuads * surface.triangles.size());
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        const RemeshFrame frame = remeshFrame(surface, i);
        const auto add = [&](const glm::dvec3& v, double w) { quads.emplace_back(glm::vec3(v), float(w)); };
        add(frame.byU, frame.at.x), add(frame.byV, frame.at.y);
        add(frame.directionByU, frame.turned), add(frame.directionByV, frame.toSecond.x);
        add(frame.direction, frame.toSecond.y), add(frame.facet, frame.toLast.x);
        add(frame.place + (surface.origin - origin), frame.toLast.y);
    }
    return quads;
}

}  // namespace vcp::meso
