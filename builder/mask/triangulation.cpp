#include "builder/mask/triangulation.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>

#include <GL/glu.h>

namespace vcp {

namespace {

/// A point as the tessellator has it: the weights of corners 1 and 2 are its coordinates.
struct Vertex {
    GLdouble at[3];
    uint32_t number;
};

/// What the tessellator's calls share.
struct Tessellation {
    std::deque<Vertex> vertices;  // they stay where they are
    MaskParts parts;
    std::array<uint32_t, 3> corners{};
    size_t count = 0;

    Vertex* add(const Weights& w) {
        vertices.push_back({{double(w.of[1]), double(w.of[2]), 0}, uint32_t(parts.points.size())});
        parts.points.push_back(w);
        return &vertices.back();
    }
};

/// Returns the weights nearest to a point that may lie beyond the triangle by rounding.
Weights weightsAt(const GLdouble (&at)[3]) {
    const auto whole = [](double value, int32_t most) {
        return int32_t(std::clamp(std::round(value), 0.0, double(most)));
    };
    const int32_t first = whole(at[0], Weights::kOne), second = whole(at[1], Weights::kOne - first);
    return {{Weights::kOne - first - second, first, second}};
}

extern "C" {
void vcpTessellationVertex(void* vertex, void* user) {
    auto& all = *static_cast<Tessellation*>(user);
    all.corners[all.count++] = static_cast<const Vertex*>(vertex)->number;
    if (all.count < 3) return;
    all.count = 0;
    const auto& [a, b, c] = all.corners;
    if (turnOf(all.parts.points[a], all.parts.points[b], all.parts.points[c]) > 0)
        all.parts.triangles.push_back(all.corners);
}
// That it is there makes the tessellator hand out triangles alone, and no fans and strips.
void vcpTessellationEdge(GLboolean, void*) {}
void vcpTessellationCombine(GLdouble at[3], void**, GLfloat*, void** made, void* user) {
    *made = static_cast<Tessellation*>(user)->add(weightsAt({at[0], at[1], at[2]}));
}
}

using Callback = void (*)();

}  // namespace

MaskParts triangulate(std::span<const MaskLoop> loops) {
    Tessellation all;
    const std::unique_ptr<GLUtesselator, decltype(&gluDeleteTess)> tess(gluNewTess(), gluDeleteTess);
    if (!tess) return {};
    gluTessProperty(tess.get(), GLU_TESS_WINDING_RULE, GLU_TESS_WINDING_POSITIVE);
    gluTessNormal(tess.get(), 0, 0, 1);
    gluTessCallback(tess.get(), GLU_TESS_VERTEX_DATA, reinterpret_cast<Callback>(vcpTessellationVertex));
    gluTessCallback(tess.get(), GLU_TESS_EDGE_FLAG_DATA, reinterpret_cast<Callback>(vcpTessellationEdge));
    gluTessCallback(tess.get(), GLU_TESS_COMBINE_DATA, reinterpret_cast<Callback>(vcpTessellationCombine));
    gluTessBeginPolygon(tess.get(), &all);
    for (const MaskLoop& loop : loops) {
        gluTessBeginContour(tess.get());
        for (const MaskLoop::Point& point : loop.points) {
            Vertex* const vertex = all.add(point.weights);
            gluTessVertex(tess.get(), vertex->at, vertex);
        }
        gluTessEndContour(tess.get());
    }
    gluTessEndPolygon(tess.get());
    return std::move(all.parts);
}

}  // namespace vcp
