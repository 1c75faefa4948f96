#include "viewer/bake/base_frames.h"

#include <map>
#include <tuple>

#include <glm/geometric.hpp>

namespace vcp {

namespace {

using glm::dvec2, glm::dvec3;

/// Returns the unit vector, or `otherwise` where there is none.
dvec3 unit(dvec3 v, dvec3 otherwise) {
    const double length = glm::length(v);
    return length > 0 ? v / length : otherwise;
}

dvec3 anyAcross(dvec3 normal) {
    const dvec3 axis = std::abs(normal.x) < 0.5 ? dvec3(1, 0, 0) : dvec3(0, 1, 0);
    return glm::normalize(glm::cross(normal, axis));
}

}  // namespace

BaseFrames framesOf(const meso::BaseSurface& surface, const meso::TexelMap& map, const std::vector<dvec3>& directions) {
    BaseFrames made;
    std::map<std::tuple<uint32_t, double, double, bool>, uint32_t> numbers;
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        const auto& t = surface.triangles[i];
        const auto& place = map.places[i];
        const dvec2 a = place[1] - place[0], b = place[2] - place[0];
        const double area = a.x * b.y - a.y * b.x;
        const bool isMirrored = area < 0;
        const dvec3 p = surface.positions[t[0]], x = surface.positions[t[1]] - p, y = surface.positions[t[2]] - p;
        // What a step to the right in the map is in the world, weighted by the map's area.
        const dvec3 right = (b.y * x - a.y * y) * (isMirrored ? -1.0 : 1.0);
        auto& corners = made.triangles.emplace_back();
        for (int k = 0; k < 3; ++k) {
            const auto [found, isNew] =
                numbers.try_emplace({t[k], place[k].x, place[k].y, isMirrored}, uint32_t(made.vertices.size()));
            if (isNew)
                made.vertices.push_back({.position = t[k],
                                         .place = place[k],
                                         .normal = unit(directions[t[k]], dvec3(0, 0, 1)),
                                         .tangent = dvec3(0),
                                         .side = isMirrored ? -1.0 : 1.0});
            corners[k] = found->second;
            made.vertices[found->second].tangent += right;
        }
    }
    for (BaseFrames::Vertex& v : made.vertices)
        v.tangent = unit(v.tangent - glm::dot(v.tangent, v.normal) * v.normal, anyAcross(v.normal));
    return made;
}

glm::dmat3 BaseFrames::at(size_t triangle, dvec3 weights) const {
    dvec3 normal(0), tangent(0);
    for (int k = 0; k < 3; ++k) {
        const Vertex& v = vertices[triangles[triangle][k]];
        normal += weights[k] * v.normal, tangent += weights[k] * v.tangent;
    }
    const Vertex& first = vertices[triangles[triangle][0]];
    normal = unit(normal, first.normal), tangent = unit(tangent, first.tangent);
    return {tangent, first.side * glm::cross(normal, tangent), normal};
}

}  // namespace vcp
