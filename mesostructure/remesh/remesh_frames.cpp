#include "mesostructure/remesh/remesh_frames.h"

#include <cmath>

#include <glm/geometric.hpp>

namespace vcp::meso {

template <class Real>
typename RemeshHeights<Real>::RemeshFrame remeshFrame(const RemeshSurface& surface, size_t triangle) {
    using Real2 = glm::vec<2, Real>;
    using Real3 = glm::vec<3, Real>;
    std::array<Real3, 3> p, d;
    std::array<Real2, 3> uv;
    for (size_t k = 0; k < 3; ++k) {
        const uint32_t corner = surface.triangles[triangle][k];
        p[k] = Real3(surface.positions[corner]), d[k] = Real3(surface.directions[corner]);
        uv[k] = Real2(surface.uvs[triangle][k]);
    }
    typename RemeshHeights<Real>::RemeshFrame frame{};
    const Real3 flat = glm::cross(p[1] - p[0], p[2] - p[0]);
    const Real length = glm::length(flat);
    frame.facet = length > 0 ? flat / length : glm::normalize(d[0]);
    frame.direction = d[0], frame.at = uv[0];
    const Real2 a = uv[1] - uv[0], b = uv[2] - uv[0];
    const Real area = a.x * b.y - a.y * b.x;
    if (!(std::abs(area) > Real(1e-12) * (glm::dot(a, a) + glm::dot(b, b)))) return frame;
    frame.turned = area > 0 ? Real(1) : Real(-1);
    const auto byU = [&](const std::array<Real3, 3>& of) {
        return (b.y * (of[1] - of[0]) - a.y * (of[2] - of[0])) / area;
    };
    const auto byV = [&](const std::array<Real3, 3>& of) {
        return (a.x * (of[2] - of[0]) - b.x * (of[1] - of[0])) / area;
    };
    frame.byU = byU(p), frame.byV = byV(p), frame.directionByU = byU(d), frame.directionByV = byV(d);
    return frame;
}

template RemeshHeights<float>::RemeshFrame remeshFrame<float>(const RemeshSurface&, size_t);
template RemeshHeights<double>::RemeshFrame remeshFrame<double>(const RemeshSurface&, size_t);

std::vector<glm::vec4> remeshFrames(const RemeshSurface& surface) {
    std::vector<glm::vec4> quads{glm::vec4(float(surface.heights->levels().size()), 0, 0, 0)};
    quads.reserve(1 + RemeshMath<float>::kRemeshFrameQuads * surface.triangles.size());
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        // In double precision, for charts may be small.
        const auto frame = remeshFrame<double>(surface, i);
        const auto add = [&](const glm::dvec3& v, double w) { quads.emplace_back(glm::vec3(v), float(w)); };
        add(frame.byU, frame.at.x), add(frame.byV, frame.at.y);
        add(frame.directionByU, frame.turned), add(frame.directionByV, 0);
        add(frame.direction, 0), add(frame.facet, 0);
    }
    return quads;
}

}  // namespace vcp::meso
