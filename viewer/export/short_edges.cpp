#include "viewer/export/short_edges.h"

#include <algorithm>
#include <array>
#include <unordered_map>
#include <utility>

#include <glm/geometric.hpp>

namespace vcp {

namespace {

using Triangle = std::array<uint32_t, 3>;

constexpr uint32_t kWhole = UINT32_MAX;  // of an edge: it is not parted

/// One turn: parts each long edge once.
class EdgeSplitter {
public:
    EdgeSplitter(IndexedMesh& mesh, double longest) : mesh_(mesh), longest_(longest) {}

    /// Returns how many triangles more there would be.
    [[nodiscard]] uint64_t added() const {
        uint64_t count = 0;
        for (const Triangle& t : mesh_.triangles)
            for (size_t i = 0; i < 3; ++i) count += isLong(t[i], t[(i + 1) % 3]) ? 1 : 0;
        return count;
    }

    void split() {
        std::vector<Triangle> parts;
        for (const Triangle& t : mesh_.triangles) {
            Triangle middles{};
            for (size_t i = 0; i < 3; ++i) middles[i] = middleOf(t[i], t[(i + 1) % 3]);
            part(t, middles, parts);
        }
        mesh_.triangles = std::move(parts);
        mesh_.coordinates.clear();
    }

private:
    [[nodiscard]] bool isLong(uint32_t a, uint32_t b) const {
        return glm::distance(mesh_.positions[a], mesh_.positions[b]) > longest_;
    }

    uint32_t middleOf(uint32_t a, uint32_t b) {
        if (!isLong(a, b)) return kWhole;
        const auto [low, high] = std::minmax(a, b);
        const auto [found, isNew] = middles_.try_emplace(uint64_t{low} << 32 | high, uint32_t(mesh_.positions.size()));
        if (isNew) mesh_.positions.push_back((mesh_.positions[low] + mesh_.positions[high]) / 2.0);
        return found->second;
    }

    /// Parts a triangle at the middles of its edges, of which the first begins at its first vertex.
    static void part(Triangle t, Triangle middles, std::vector<Triangle>& parts) {
        const auto count = 3 - std::ranges::count(middles, kWhole);
        if (count == 0) return parts.push_back(t);
        if (count == 3) {
            for (size_t i = 0; i < 3; ++i) parts.push_back({t[i], middles[i], middles[(i + 2) % 3]});
            return parts.push_back(middles);
        }
        // Turned so that the first edge is parted and, where two are, the second one too.
        while (middles[0] == kWhole || (count == 2 && middles[1] == kWhole)) {
            std::rotate(t.begin(), t.begin() + 1, t.end());
            std::rotate(middles.begin(), middles.begin() + 1, middles.end());
        }
        if (count == 1) {
            parts.push_back({t[0], middles[0], t[2]});
            return parts.push_back({middles[0], t[1], t[2]});
        }
        parts.push_back({middles[0], t[1], middles[1]});
        parts.push_back({t[0], middles[0], middles[1]});
        parts.push_back({t[0], middles[1], t[2]});
    }

    IndexedMesh& mesh_;
    double longest_;
    std::unordered_map<uint64_t, uint32_t> middles_;  // of the edges that are parted, by their vertices
};

}  // namespace

void shortenEdges(IndexedMesh& mesh, double longest, uint64_t most) {
    while (true) {
        EdgeSplitter splitter(mesh, longest);
        const uint64_t added = splitter.added();
        if (added == 0 || mesh.triangles.size() + added > most) return;
        splitter.split();
    }
}

}  // namespace vcp
