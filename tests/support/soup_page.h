// Pages of hard leaves from any triangles, for tests of what codes them.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <random>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "octree/page/page.h"
#include "octree/surface/leaf_triangles.h"
#include "octree/surface/packing.h"
#include "octree/surface/vertex_normal.h"

namespace vcp::test {

using Block = std::vector<uint4>;

inline std::span<const std::byte> asBytes(const Block& block) { return std::as_bytes(std::span(block)); }

struct WholePage {
    Block geometry, colour;
    [[nodiscard]] PageView view() const { return *parsePage(asBytes(geometry), asBytes(colour)); }
};

inline Block randomColours(const PageView& page, uint32_t seed) {
    std::mt19937 random(seed);
    Block colours(colourPageBytes(page.header) / 16, uint4(0));
    auto* bytes = reinterpret_cast<uint8_t*>(colours.data());
    const size_t used = size_t{16} * page.header.faces + size_t{4} * page.header.vertices;
    for (size_t i = 0; i < used; ++i) bytes[i] = uint8_t(i % 4 == 3 ? 255 : 100 + random() % 40);
    return colours;
}

/// A page with one level of cells or subcells, every leaf hard that a triangle touches.
class SoupPage {
public:
    SoupPage(uint32_t log2Cells, uint32_t depth) : depth_(depth) { header_.log2Cells = log2Cells; }

    uint32_t vertex(glm::i32vec3 p) {
        positions_.push_back(p);
        return uint32_t(positions_.size() - 1);
    }
    void triangle(uint32_t a, uint32_t b, uint32_t c) { triangles_.push_back({a, b, c}); }

    [[nodiscard]] WholePage build(uint32_t seed) {
        std::mt19937 random(seed);
        sums_.assign(positions_.size(), WideVector(0));
        for (const auto& t : triangles_)
            for (const uint32_t v : t)
                addNormal(sums_[v], areaNormal(positions_[t[0]], positions_[t[1]], positions_[t[2]]));
        std::vector<std::pair<glm::i32vec3, uint32_t>> queue;  // internal nodes, breadth first
        header_.root = node(glm::i32vec3(0), 0, queue);
        for (size_t i = 0; i < queue.size(); ++i)
            for (int o = 0; o < 8; ++o) {
                const int edge = edgeAt(queue[i].second + 1);
                nodes_.push_back(
                    node(queue[i].first + edge * glm::i32vec3(o & 1, o >> 1 & 1, o >> 2), queue[i].second + 1, queue));
            }
        header_.groups = uint32_t(nodes_.size() / 8);
        header_.entries = uint32_t(entries_.size());
        header_.vertices = uint32_t(numbers_.size());
        const PageSections s = pageSections(header_);
        WholePage page{Block(s.end / 16), {}};
        auto* out = reinterpret_cast<std::byte*>(page.geometry.data());
        std::memcpy(out, &header_, sizeof header_);
        if (!nodes_.empty()) std::memcpy(out + s.nodes, nodes_.data(), nodes_.size() * 4);
        storeEntries(entries_, header_.vertices, out + s.strips);
        auto* vertices = reinterpret_cast<glm::u32vec2*>(out + s.vertices);
        auto* normals = reinterpret_cast<uint32_t*>(out + s.normals);
        for (const auto& [v, number] : numbers_) {
            const glm::i32vec3 p = positions_[v] + kLatticeBias;
            vertices[number] = pack21(uint32_t(p.x), uint32_t(p.y), uint32_t(p.z));
            // As computed, near that, or any at all.
            NormalGridPoint point = normalGridPoint(sums_[v]);
            if (random() % 4 == 0) point.u = uint32_t(random() % (kNormalSteps + 1));
            normals[number] = random() % 8 == 0 ? uint32_t(random()) : packGridNormal(point, random() % 5 == 0);
        }
        page.colour = randomColours(*parsePage(asBytes(page.geometry)), seed);
        return page;
    }

    bool forgetATriangle = false;     ///< in the first leaf that has two
    double clearancePerDepth = 0.25;  ///< of empty leaves, in cells: what is to be coded, true only where it is 0

private:
    [[nodiscard]] int edgeAt(uint32_t depth) const { return (kLatticePerCell << header_.log2Cells) >> depth; }

    uint32_t node(glm::i32vec3 lower, uint32_t depth, std::vector<std::pair<glm::i32vec3, uint32_t>>& queue) {
        std::vector<uint32_t> inside;
        for (uint32_t k = 0; k < triangles_.size(); ++k) {
            const std::array<glm::i32vec3, 3> t{positions_[triangles_[k][0]], positions_[triangles_[k][1]],
                                                positions_[triangles_[k][2]]};
            bool boxes = true;
            for (int axis = 0; axis < 3; ++axis)
                boxes = boxes && std::min({t[0][axis], t[1][axis], t[2][axis]}) <= lower[axis] + edgeAt(depth) &&
                        std::max({t[0][axis], t[1][axis], t[2][axis]}) >= lower[axis];
            if (boxes && CubeTest(t).touches(lower, edgeAt(depth))) inside.push_back(k);
        }
        if (inside.empty()) return emptyNode(clearancePerDepth * double(depth));
        if (depth < depth_) {
            queue.emplace_back(lower, depth);
            return kNodeInternal << kNodeTypeShift | uint32_t(queue.size() - 1);
        }
        ++header_.hardLeaves;
        if (forgetATriangle && inside.size() > 1) {
            inside.pop_back();
            forgetATriangle = false;
        }
        std::vector<Index3> list;
        for (const uint32_t k : inside) {
            Index3& v = list.emplace_back();
            for (size_t i = 0; i < 3; ++i)
                v[i] = numbers_.try_emplace(triangles_[k][i], uint32_t(numbers_.size())).first->second;
        }
        return appendHardLeaf(list, entries_);
    }

    PageHeader header_;
    uint32_t depth_;
    std::vector<glm::i32vec3> positions_;
    std::vector<Index3> triangles_;
    std::vector<WideVector> sums_;
    std::vector<uint32_t> nodes_, entries_;
    std::map<uint32_t, uint32_t> numbers_;  ///< of vertices in the page
};

inline glm::i32vec3 randomPoint(std::mt19937& random, int edge) {
    const auto any = [&] { return int(random() % unsigned(edge)); };
    return {any(), any(), any()};
}

/// Triangles anywhere, many of which share vertices: borders, fans, edges of three and more.
inline SoupPage soup(uint32_t seed, uint32_t log2Cells, uint32_t depth, uint32_t vertices, uint32_t triangles) {
    std::mt19937 random(seed);
    SoupPage page(log2Cells, depth);
    const int edge = kLatticePerCell << log2Cells;
    for (uint32_t i = 0; i < vertices; ++i) page.vertex(randomPoint(random, edge + edge / 4) - edge / 8);
    std::set<std::array<uint32_t, 3>> made;
    while (made.size() < triangles) {
        std::array<uint32_t, 3> v;
        for (uint32_t& at : v) at = uint32_t(random() % vertices);
        std::array<uint32_t, 3> sorted = v;
        std::sort(sorted.begin(), sorted.end());
        if (sorted[0] == sorted[1] || sorted[1] == sorted[2] || !made.insert(sorted).second) continue;
        page.triangle(v[0], v[1], v[2]);
    }
    return page;
}

/// A bumpy sheet of n x n squares with holes, in both windings.
inline SoupPage sheet(uint32_t seed, uint32_t log2Cells, uint32_t depth, uint32_t n) {
    std::mt19937 random(seed);
    SoupPage page(log2Cells, depth);
    const int edge = kLatticePerCell << log2Cells;
    for (uint32_t y = 0; y <= n; ++y)
        for (uint32_t x = 0; x <= n; ++x)
            page.vertex({int(x) * edge / int(n), int(y) * edge / int(n), edge / 2 + int(random() % 300)});
    for (uint32_t y = 0; y < n; ++y)
        for (uint32_t x = 0; x < n; ++x) {
            const uint32_t a = x + (n + 1) * y, b = a + 1, c = a + n + 1, d = c + 1;
            if (random() % 9 != 0) page.triangle(a, b, c);
            if (random() % 9 != 0) random() % 2 == 0 ? page.triangle(b, d, c) : page.triangle(c, d, b);
        }
    return page;
}

}  // namespace vcp::test
