#include "builder/page/bin_triangles.h"

#include <algorithm>
#include <utility>

#include <oneapi/tbb/parallel_for.h>

namespace vcp {

std::vector<LevelBins> binTriangles(const LatticeMesh& mesh, const FinestPages& pages, double margin, uint64_t first,
                                    uint64_t end) {
    using Page = std::pair<int, uint64_t>;  // the level, negative since the deepest comes first, and the code
    struct Entry {
        Page page;
        uint32_t triangle;
    };
    constexpr size_t kGrain = 4096;
    const size_t count = mesh.triangles.size();
    std::vector<std::vector<Entry>> parts((count + kGrain - 1) / kGrain);
    tbb::parallel_for(size_t{0}, parts.size(), [&](size_t i) {
        for (size_t k = i * kGrain; k < std::min(count, (i + 1) * kGrain); ++k) {
            const auto& t = mesh.triangles[k];
            const glm::i32vec3 corner[3] = {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
            pages.forPagesNear(corner, margin, [&](uint32_t level, uint64_t page) {
                const uint64_t code = pages.firstCode(level, page);
                if (code >= first && code < end) parts[i].push_back({{-int(level), page}, uint32_t(k)});
            });
        }
    });
    std::vector<Page> found;
    for (const auto& part : parts)
        for (const Entry& e : part)
            if (found.empty() || found.back() != e.page) found.push_back(e.page);
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    // Entries come in the triangles' order, and many in a row are of one page.
    const auto forEachEntry = [&](auto&& visit) {
        size_t number = 0;
        for (const auto& part : parts)
            for (const Entry& e : part) {
                if (found[number] != e.page)
                    number = size_t(std::lower_bound(found.begin(), found.end(), e.page) - found.begin());
                visit(number, e.triangle);
            }
    };
    std::vector<size_t> counts(found.size(), 0);
    forEachEntry([&](size_t number, uint32_t) { ++counts[number]; });
    std::vector<LevelBins> levels;
    std::vector<std::pair<size_t, size_t>> next;  // of each page: its level's place, and where its next triangle goes
    for (size_t i = 0; i < found.size(); ++i) {
        const auto level = uint32_t(-found[i].first);
        if (levels.empty() || levels.back().level != level)
            levels.push_back({level, {.pages = {}, .begin = {0}, .triangles = {}}});
        TriangleBins& bins = levels.back().bins;
        next.emplace_back(levels.size() - 1, bins.begin.back());
        bins.pages.push_back(found[i].second);
        bins.begin.push_back(bins.begin.back() + counts[i]);
    }
    for (LevelBins& level : levels) level.bins.triangles.resize(level.bins.begin.back());
    forEachEntry([&](size_t number, uint32_t triangle) {
        auto& [level, place] = next[number];
        levels[level].bins.triangles[place++] = triangle;
    });
    return levels;
}

TriangleBins binTriangles(const LatticeMesh& mesh, const PageGrid& grid, double margin, uint64_t first, uint64_t end) {
    std::vector<LevelBins> levels = binTriangles(mesh, FinestPages(grid), margin, first, end);
    return levels.empty() ? TriangleBins{.pages = {}, .begin = {0}, .triangles = {}} : std::move(levels[0].bins);
}

}  // namespace vcp
