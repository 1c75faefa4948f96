#include "builder/bin_triangles.h"

#include <algorithm>

#include <glm/common.hpp>

#include "builder/triangle_geometry.h"
#include "octree/leaf_math.h"
#include "octree/vcp_file.h"

namespace vcp {

TriangleBins binTriangles(const LatticeMesh& mesh, uint32_t log2Cells, uint32_t level) {
    struct Entry {
        uint64_t page;
        uint32_t triangle;
    };
    std::vector<Entry> entries;
    entries.reserve(mesh.triangles.size() * 5 / 4);
    const double edge = double(1u << log2Cells);
    const int lastPage = (1 << level) - 1;
    const double half = edge / 2 + kBinMarginCells;
    for (size_t k = 0; k < mesh.triangles.size(); ++k) {
        Triangle3 t;
        for (int i = 0; i < 3; ++i) t[i] = glm::dvec3(mesh.positions[mesh.triangles[k][i]]) / double(kLatticePerCell);
        const BoxOverlap overlap(t);
        const glm::i32vec3 low = glm::i32vec3(glm::max(glm::floor((overlap.lower() - kBinMarginCells) / edge), 0.0));
        const glm::i32vec3 high = glm::min(glm::i32vec3(glm::floor((overlap.upper() + kBinMarginCells) / edge)), lastPage);
        const bool one = low == high;
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x)
                    if (one || overlap.test((glm::dvec3(x, y, z) + 0.5) * edge, half))
                        entries.push_back({mortonEncode(glm::u32vec3(x, y, z)), static_cast<uint32_t>(k)});
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.page != b.page ? a.page < b.page : a.triangle < b.triangle; });
    TriangleBins bins;
    bins.triangles.reserve(entries.size());
    for (const Entry& e : entries) {
        if (bins.pages.empty() || bins.pages.back() != e.page) {
            bins.pages.push_back(e.page);
            bins.begin.push_back(bins.triangles.size());
        }
        bins.triangles.push_back(e.triangle);
    }
    bins.begin.push_back(bins.triangles.size());
    return bins;
}

}  // namespace vcp
