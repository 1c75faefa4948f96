#include "builder/lattice/mesh_textures.h"

#include <algorithm>
#include <tuple>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_sort.h>

namespace vcp {

namespace {

constexpr size_t kTriangleGrain = 4096;  // triangles that a thread takes at a time

bool isBefore(glm::i32vec3 a, glm::i32vec3 b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); }

/// Brings the corners into their order.
void sortCorners(TexturedTriangle& t) {
    const auto order = [&](int a, int b) {
        if (!isBefore(t.corner[b], t.corner[a])) return;
        std::swap(t.corner[a], t.corner[b]);
        std::swap(t.point[a], t.point[b]);
    };
    order(0, 1);
    order(1, 2);
    order(0, 1);
}

/// Compares triangles whose corners are in order, by these alone.
int compareCorners(const TexturedTriangle& a, const TexturedTriangle& b) {
    for (int i = 0; i < 3; ++i)
        if (a.corner[i] != b.corner[i]) return isBefore(a.corner[i], b.corner[i]) ? -1 : 1;
    return 0;
}

bool isLess(const TexturedTriangle& a, const TexturedTriangle& b) {
    if (const int corners = compareCorners(a, b); corners != 0) return corners < 0;
    const auto rest = [](const TexturedTriangle& t) {
        return std::tie(t.material, t.point[0].x, t.point[0].y, t.point[1].x, t.point[1].y, t.point[2].x, t.point[2].y);
    };
    return rest(a) < rest(b);
}

/// Returns what is known of a triangle, or none. `known`: sorted; `corners`: as the mesh has them.
std::array<TexturePoint, 3> found(const std::vector<TexturedTriangle>& known, const glm::i32vec3 (&corners)[3]) {
    TexturedTriangle wanted{};
    for (int i = 0; i < 3; ++i) wanted.corner[i] = corners[i];
    sortCorners(wanted);
    const auto at =
        std::lower_bound(known.begin(), known.end(), wanted,
                         [](const TexturedTriangle& a, const TexturedTriangle& b) { return compareCorners(a, b) < 0; });
    std::array<TexturePoint, 3> points{};
    if (at == known.end() || compareCorners(*at, wanted) != 0) return points;
    for (size_t i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            if (at->corner[k] == corners[i]) points[i] = {at->point[k].x, at->point[k].y, at->material};
    return points;
}

}  // namespace

void addTextures(LatticeMesh& mesh, std::vector<TexturedTriangle> known) {
    if (known.empty()) return;
    tbb::parallel_for(tbb::blocked_range<size_t>(0, known.size(), kTriangleGrain), [&](const auto& range) {
        for (size_t k = range.begin(); k < range.end(); ++k) sortCorners(known[k]);
    });
    tbb::parallel_sort(known.begin(), known.end(), isLess);
    mesh.textures.resize(mesh.triangles.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, mesh.triangles.size(), kTriangleGrain), [&](const auto& range) {
        for (size_t k = range.begin(); k < range.end(); ++k) {
            const auto& [a, b, c] = mesh.triangles[k];
            mesh.textures[k] = found(known, {mesh.positions[a], mesh.positions[b], mesh.positions[c]});
        }
    });
}

}  // namespace vcp
