#include "builder/level/vertex_step.h"

#include <algorithm>
#include <atomic>
#include <tuple>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_sort.h>

#include "builder/level/triangle_batches.h"

namespace vcp {

namespace {

constexpr size_t kVertexGrain = 4096;  // vertices or triangles that a thread takes at a time

auto placeOf(const VertexImage& v) { return std::tie(v.position.x, v.position.y, v.position.z); }
bool liesBefore(const VertexImage& a, const VertexImage& b) { return placeOf(a) < placeOf(b); }

/// What a thread hands on: triangles, and vertices to the bins of triangles.
struct Batches {
    LevelSink::Batch triangles;
    BinBatch<VertexImage> vertices;

    Result<void> flush() {
        VCP_TRY(triangles.flush());
        return vertices.flush();
    }
};

}  // namespace

Result<void> VertexStep::run(size_t bin, const LatticeMesh& mesh) {
    std::vector<uint32_t> binOf(mesh.positions.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, binOf.size(), kVertexGrain), [&](const auto& range) {
        for (size_t v = range.begin(); v < range.end(); ++v)
            binOf[v] = uint32_t(partition_.binOf(grid_.pageOf(mesh.positions[v])));
    });
    const auto step = [&](size_t k, Batches& batches) -> Result<void> {
        const auto& v = mesh.triangles[k];
        const bool isLowest = std::min({binOf[v[0]], binOf[v[1]], binOf[v[2]]}) == bin;
        LatticeTriangle t{};
        t.stray = mesh.stray[k];
        if (!mesh.parts.empty()) t.part = mesh.parts[v[0]];
        if (!mesh.cornerNormals.empty()) std::copy_n(mesh.cornerNormals[k].begin(), 3, t.own);
        for (int i = 0; i < 3; ++i) {
            const bool isOwn = binOf[v[i]] == bin;
            t.corner[i] = mesh.positions[v[i]];
            t.colour[i] = mesh.colours.empty() || !isOwn ? 0xffffffffu : mesh.colours[v[i]];
            t.normal[i] = isOwn ? mesh.normals[v[i]] : kUnknownNormal;
        }
        if (isLowest) return batches.triangles.add(t);
        for (int i = 0; i < 3; ++i)
            if (binOf[v[i]] == bin)
                for (const size_t to : batches.triangles.binsOf(t))
                    VCP_TRY(batches.vertices.add(to, {t.corner[i], t.colour[i], t.normal[i]}));
        return {};
    };
    return inBatches(
        [&] {
            return Batches{LevelSink::Batch(sink_), BinBatch(vertices_)};
        },
        mesh.triangles.size(), step);
}

bool joinVertices(std::vector<LatticeTriangle>& triangles, std::vector<VertexImage> vertices) {
    tbb::parallel_sort(vertices.begin(), vertices.end(), liesBefore);
    std::atomic<bool> areAllThere = true;
    tbb::parallel_for(tbb::blocked_range<size_t>(0, triangles.size(), kVertexGrain), [&](const auto& range) {
        for (size_t k = range.begin(); k < range.end(); ++k) {
            LatticeTriangle& t = triangles[k];
            for (int i = 0; i < 3; ++i) {
                if (t.normal[i] != kUnknownNormal) continue;
                const VertexImage wanted{t.corner[i], 0, 0};
                const auto at = std::lower_bound(vertices.begin(), vertices.end(), wanted, liesBefore);
                if (at == vertices.end() || at->position != t.corner[i]) {
                    areAllThere = false;
                    continue;
                }
                t.colour[i] = at->colour;
                t.normal[i] = at->normal;
            }
        }
    });
    return areAllThere;
}

}  // namespace vcp
