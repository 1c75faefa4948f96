#include "builder/level/level_step.h"

#include <algorithm>
#include <cmath>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <glm/geometric.hpp>

#include "builder/level/stray_bound.h"
#include "builder/level/triangle_batches.h"

namespace vcp {

uint64_t BinsNear::pageAround(const glm::i32vec3 (&corner)[3]) const {
    const PageGrid grid = pages_.gridOf(pages_.base());
    const uint32_t log2Steps = PageGrid::kLog2LatticePerCell + pages_.deepest() - pages_.base();
    // Bounds are widened by a little more than forPagesNear does.
    const auto margin = int64_t(std::ldexp(marginCells_, int(log2Steps))) + 4;
    const auto low = (glm::i64vec3(glm::min(corner[0], glm::min(corner[1], corner[2]))) - margin) >>
                     int64_t(log2Steps + grid.log2Cells);
    const auto high = (glm::i64vec3(glm::max(corner[0], glm::max(corner[1], corner[2]))) + margin) >>
                      int64_t(log2Steps + grid.log2Cells);
    const bool isOne = low == high && glm::all(glm::greaterThanEqual(low, glm::i64vec3(0))) &&
                       glm::all(glm::lessThanEqual(low, glm::i64vec3(grid.lastPage())));
    return isOne ? mortonEncode(glm::u32vec3(low)) : kNoPage;
}

const std::vector<size_t>& BinsNear::of(const glm::i32vec3 (&corner)[3]) {
    // Where one bin has all pages, no other needs to be looked for.
    if (partition_.bins() == 1) return touched_;
    const uint64_t around = pageAround(corner);
    if (around != kNoPage && around == page_) return touched_;
    page_ = kNoPage;
    if (around != kNoPage) {
        const size_t bin = partition_.binOf(pages_.firstCode(pages_.base(), around));
        if (partition_.binOf(pages_.firstCode(pages_.base(), around + 1) - 1) == bin) {
            page_ = around;
            touched_.assign(1, bin);
            return touched_;
        }
    }
    // A triangle seldom spans more than two bins, so the list of those seen is short.
    touched_.clear();
    pages_.forPagesNear(corner, marginCells_, [&](uint32_t level, uint64_t page) {
        const size_t bin = partition_.binOf(pages_.firstCode(level, page));
        if (std::find(touched_.begin(), touched_.end(), bin) == touched_.end()) touched_.push_back(bin);
    });
    return touched_;
}

Result<void> LevelSink::Batch::add(const LatticeTriangle& t) {
    for (const size_t bin : binsOf(t)) VCP_TRY(batch_.add(bin, t));
    return {};
}

/// The images of the vertices of the bin's mesh.
struct LevelStep::Images {
    std::vector<uint32_t> bin;  ///< the bin that the vertex lies in
    std::vector<uint8_t> known;
    std::vector<VertexImage> image;
};

/// Whether all that the image of a vertex depends on is within the bin's surroundings.
bool LevelStep::isKnown(size_t bin, glm::i32vec3 p) const {
    if (binOf(p) == bin) return true;
    // The coarse cell must lie within a page of the bin, widened.
    const glm::dvec3 low = glm::dvec3(p >> int(PageGrid::kLog2LatticePerCell + 1)) * 2.0;
    const double edge = grid_.edgeCells();
    const glm::i32vec3 first = glm::max(glm::i32vec3(glm::ceil((low + 2.0 - kStepMarginCells) / edge)) - 1, 0);
    const glm::i32vec3 last = glm::min(glm::i32vec3(glm::floor((low + kStepMarginCells) / edge)), grid_.lastPage());
    for (int z = first.z; z <= last.z; ++z)
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x)
                if (partition_.binOf(mortonEncode(glm::u32vec3(x, y, z))) == bin) return true;
    return false;
}

LevelStep::Images LevelStep::imagesOf(size_t bin, const LatticeMesh& mesh) const {
    Images images;
    images.bin.resize(mesh.positions.size());
    images.known.resize(mesh.positions.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, mesh.positions.size(), 4096), [&](const auto& range) {
        for (size_t v = range.begin(); v < range.end(); ++v) {
            images.bin[v] = uint32_t(binOf(mesh.positions[v]));
            images.known[v] = isKnown(bin, mesh.positions[v]);
        }
    });
    return images;
}

Result<void> LevelStep::pass(const WaitingTriangle& w, LevelSink::Batch& batch) {
    if (w.known != 7) {
        size_t lowest = partition_.bins();
        for (int i = 0; i < 3; ++i)
            if (!(w.known >> i & 1)) lowest = std::min(lowest, binOf(w.from.corner[i]));
        return waiting_.append(lowest, std::span(&w, 1));
    }
    return batch.add(longImage(w.from, w.image));
}

Result<void> LevelStep::stepWaiting(size_t bin, const LatticeMesh& mesh, const Images& images) {
    VCP_TRY(waiting_.raw().flush(bin));
    LevelSink::Batch batch(sink_);
    VCP_TRY_ASSIGN(const auto blocks, waiting_.blocks(bin));
    for (const RawBins::Block& block : blocks) {
        VCP_TRY_ASSIGN(auto records, waiting_.read(block));
        for (WaitingTriangle& w : records) {
            for (int i = 0; i < 3; ++i) {
                if (w.known >> i & 1) continue;
                const auto vertex = findVertex(mesh, w.from.corner[i]);
                if (!vertex || !images.known[*vertex]) continue;
                w.image[i] = images.image[*vertex];
                w.known |= 1u << i;
            }
            VCP_TRY(pass(w, batch));
        }
    }
    return batch.flush();
}

Result<void> LevelStep::stepShort(size_t bin, const LatticeMesh& mesh, const VertexClusters& clusters) {
    const CoarseTriangles coarse = coarseTriangles(mesh, clusters);
    const std::vector<float> stray = boundStray(mesh, clusters, coarse);
    const LatticeMesh& to = coarse.mesh;
    return inBatches([&] { return LevelSink::Batch(sink_); }, to.triangles.size(),
                     [&](size_t k, LevelSink::Batch& batch) -> Result<void> {
                         LatticeTriangle t;
                         size_t lowest = partition_.bins();
                         for (int i = 0; i < 3; ++i) {
                             const uint32_t v = to.triangles[k][i];
                             t.corner[i] = to.positions[v];
                             t.colour[i] = to.colours.empty() ? 0xffffffffu : to.colours[v];
                             t.normal[i] = to.normals[v];
                             lowest = std::min(lowest, binOf(to.positions[v] * 2));
                         }
                         // Images near the bin's ends belong to other bins, and are not wholly known here.
                         if (lowest != bin) return {};
                         t.stray = stray[k];
                         return batch.add(t);
                     });
}

Result<void> LevelStep::stepLong(size_t bin, const LatticeMesh& mesh, const Images& images) {
    return inBatches([&] { return LevelSink::Batch(sink_); }, mesh.triangles.size(),
                     [&](size_t k, LevelSink::Batch& batch) -> Result<void> {
                         const auto& v = mesh.triangles[k];
                         if (std::min({images.bin[v[0]], images.bin[v[1]], images.bin[v[2]]}) != bin) return {};
                         if (!isLong(mesh.positions[v[0]], mesh.positions[v[1]], mesh.positions[v[2]])) return {};
                         WaitingTriangle w{};
                         w.from.stray = mesh.stray[k];
                         if (!mesh.parts.empty()) w.from.part = mesh.parts[v[0]];
                         for (int i = 0; i < 3; ++i) {
                             w.from.corner[i] = mesh.positions[v[i]];
                             if (!images.known[v[i]]) continue;
                             w.image[i] = images.image[v[i]];
                             w.known |= 1u << i;
                         }
                         return pass(w, batch);
                     });
}

Result<void> LevelStep::run(size_t bin, const LatticeMesh& mesh) {
    Images images = imagesOf(bin, mesh);
    images.image.resize(mesh.positions.size());
    const auto colourOf = [](const std::vector<uint32_t>& colours, size_t v) {
        return colours.empty() ? 0xffffffffu : colours[v];
    };
    const VertexClusters clusters = clusterVertices(mesh);
    for (size_t v = 0; v < mesh.positions.size(); ++v)
        if (const uint32_t c = clusters.ofVertex[v]; c != VertexClusters::kNone)
            images.image[v] = {clusters.positions[c], colourOf(clusters.colours, c), clusters.normals[c]};
    VCP_TRY(stepShort(bin, mesh, clusters));
    VCP_TRY(stepWaiting(bin, mesh, images));
    return stepLong(bin, mesh, images);
}

}  // namespace vcp
