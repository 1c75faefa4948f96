#include "builder/page/bin_triangles.h"

#include <algorithm>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_sort.h>

namespace vcp {

std::vector<LevelBins> binTriangles(const LatticeMesh& mesh, const FinestPages& pages, double margin, uint64_t first,
                                    uint64_t end) {
    struct Entry {
        uint64_t page;
        uint32_t triangle, level;
    };
    tbb::enumerable_thread_specific<std::vector<Entry>> parts;
    tbb::parallel_for(tbb::blocked_range<size_t>(0, mesh.triangles.size(), 4096), [&](const auto& range) {
        std::vector<Entry>& part = parts.local();
        for (size_t k = range.begin(); k < range.end(); ++k) {
            const auto& t = mesh.triangles[k];
            const glm::i32vec3 corner[3] = {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
            pages.forPagesNear(corner, margin, [&](uint32_t level, uint64_t page) {
                const uint64_t code = pages.firstCode(level, page);
                if (code >= first && code < end) part.push_back({page, uint32_t(k), level});
            });
        }
    });
    std::vector<Entry> entries;
    for (auto& part : parts) {
        entries.insert(entries.end(), part.begin(), part.end());
        std::vector<Entry>().swap(part);
    }
    tbb::parallel_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        if (a.level != b.level) return a.level > b.level;
        return a.page != b.page ? a.page < b.page : a.triangle < b.triangle;
    });
    std::vector<LevelBins> levels;
    for (const Entry& e : entries) {
        if (levels.empty() || levels.back().level != e.level) levels.push_back({e.level, {}});
        TriangleBins& bins = levels.back().bins;
        if (bins.pages.empty() || bins.pages.back() != e.page) {
            bins.pages.push_back(e.page);
            bins.begin.push_back(bins.triangles.size());
        }
        bins.triangles.push_back(e.triangle);
    }
    for (LevelBins& level : levels) level.bins.begin.push_back(level.bins.triangles.size());
    return levels;
}

TriangleBins binTriangles(const LatticeMesh& mesh, const PageGrid& grid, double margin, uint64_t first, uint64_t end) {
    std::vector<LevelBins> levels = binTriangles(mesh, FinestPages(grid), margin, first, end);
    return levels.empty() ? TriangleBins{.pages = {}, .begin = {0}, .triangles = {}} : std::move(levels[0].bins);
}

}  // namespace vcp
