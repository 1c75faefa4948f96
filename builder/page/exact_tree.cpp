#include "builder/page/exact_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <queue>
#include <vector>

#include <glm/common.hpp>

#include "octree/surface/leaf_triangles.h"

namespace vcp {

namespace {

constexpr int kSubcellSteps = kLatticePerCell / kSubcells;

// A list this short keeps a prepared test for each of its triangles until its leaves are made; of longer ones each test
// is made anew where it is needed, so that a crowded page needs little memory.
constexpr size_t kMostPrepared = 4096;

// Pages have at most 2^7 cells an edge.
constexpr size_t kMostDepth = 7 + kMaxSubcellDepth + 1;

struct Bounds {
    glm::i32vec3 low, high;
};

/// A box with many triangles that is still to be split, or to be a leaf.
struct CrowdedBox {
    uint32_t index = 0;  // its node
    NodeBox box;
    size_t depth = 0;
    std::vector<uint32_t> list;

    /// Whether the other is split first.
    bool operator<(const CrowdedBox& other) const {
        return list.size() != other.list.size() ? list.size() < other.list.size() : index > other.index;
    }
};

class ExactTreeBuilder {
public:
    ExactTreeBuilder(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::i32vec3 origin, int cells,
                     size_t mostRecords)
        : mesh_(mesh), mostRecords_(mostRecords) {
        tree_.triangles = triangles;
        tree_.originLattice = origin;
        tree_.cells = cells;
        tree_.listsAreCertain = true;
        tree_.occupied.assign(size_t(cells) * cells * cells, 0);
    }

    PageTree run() {
        const NodeBox whole{glm::ivec3(0), tree_.cells * kSubcells};
        const std::vector<uint32_t> inside = trianglesIn(whole);
        for (const uint32_t k : inside) tree_.stray = std::max(tree_.stray, double(mesh_.stray[tree_.triangles[k]]));
        // Long leaves have a record more than triangles.
        constexpr double kNamed = double(kHardCountLong) / (kHardCountLong + 1);
        const auto count = double(std::max<size_t>(inside.size(), 1));
        const double most = mostRepetitionOf(inside.size());
        mostRepetition_ = std::min(most, double(mostRecords_) * kNamed / count);
        tree_.nodes.emplace_back();
        build(0, whole, inside, 1, 0);
        splitCrowded(std::min(most * kNamed, mostRepetition_) * count);
        return std::move(tree_);
    }

private:
    [[nodiscard]] std::array<glm::i32vec3, 3> cornersOf(uint32_t local) const {
        const std::array<uint32_t, 3>& v = mesh_.triangles[tree_.triangles[local]];
        const glm::i32vec3 origin = tree_.originLattice;
        return {mesh_.positions[v[0]] - origin, mesh_.positions[v[1]] - origin, mesh_.positions[v[2]] - origin};
    }

    /// Finds the bounds of all triangles; returns the local numbers of those that touch the page.
    std::vector<uint32_t> trianglesIn(const NodeBox& page) {
        const int edge = page.edge * kSubcellSteps;
        bounds_.resize(tree_.triangles.size());
        std::vector<uint32_t> inside;
        for (uint32_t k = 0; k < bounds_.size(); ++k) {
            const auto t = cornersOf(k);
            const auto& [low, high] =
                bounds_[k] = {glm::min(t[0], glm::min(t[1], t[2])), glm::max(t[0], glm::max(t[1], t[2]))};
            if (std::max({low.x, low.y, low.z}) > edge || std::min({high.x, high.y, high.z}) < 0) continue;
            const bool within = std::min({low.x, low.y, low.z}) >= 0 && std::max({high.x, high.y, high.z}) <= edge;
            if (within || CubeTest(t).touches(glm::i32vec3(0), edge)) inside.push_back(k);
        }
        return inside;
    }

    /// Fills node `index`. `list`: local numbers, ascending, of the triangles that touch the box. `repetition`: how
    /// often the page's triangles are named if all boxes are split as those above this one.
    void build(uint32_t index, const NodeBox& box, const std::vector<uint32_t>& list, double repetition, size_t depth) {
        tree_.nodes[index].box = box;
        if (list.empty()) return;
        const bool isTop = tests_.empty() && list.size() <= kMostPrepared;
        if (isTop) prepare(list);
        split(index, box, list, repetition, depth);
        if (isTop) tests_.clear();
    }

    void prepare(const std::vector<uint32_t>& list) {
        place_.resize(bounds_.size());
        tests_.reserve(list.size());
        for (const uint32_t k : list) {
            place_[k] = uint16_t(tests_.size());
            tests_.emplace_back(cornersOf(k));
        }
    }

    void split(uint32_t index, const NodeBox& box, const std::vector<uint32_t>& list, double repetition, size_t depth) {
        const size_t most = box.edge > kWideLeafCells * kSubcells ? kWideLeafTriangles : kExactLeafTriangles;
        if (list.size() <= most || box.edge == 1) return makeLeaf(index, box, list, depth);
        size_t together = 0;
        for (const auto& child : deal(box, list, depth)) together += child.size();
        const double below = repetition * double(together) / double(list.size());
        if (below > mostRepetition_) return leaveCrowded({index, box, depth, list});
        const uint32_t first = tree_.addChildren(index);
        for (uint32_t i = 0; i < 8; ++i) build(first + i, box.child(int(i)), lists_[depth][i], below, depth + 1);
    }

    using Lists = std::array<std::vector<uint32_t>, 8>;

    /// Deals the triangles of a box to its children. Returns lists_[depth].
    const Lists& deal(const NodeBox& box, const std::vector<uint32_t>& list, size_t depth) {
        Lists& children = lists_[depth];
        for (auto& child : children) child.clear();
        const int half = box.edge * kSubcellSteps / 2;
        const glm::i32vec3 lower = box.lower * kSubcellSteps;
        for (const uint32_t k : list) {
            const uint32_t octants = octantsTouched(bounds_[k].low, bounds_[k].high, lower + half);
            if ((octants & (octants - 1)) == 0) {
                children[size_t(std::countr_zero(octants))].push_back(k);
                continue;
            }
            const uint32_t touched = tests_.empty() ? CubeTest(cornersOf(k)).touchedOctants(lower + half, half, octants)
                                                    : tests_[place_[k]].touchedOctants(lower + half, half, octants);
            for (uint32_t rest = touched; rest != 0; rest &= rest - 1)
                children[size_t(std::countr_zero(rest))].push_back(k);
        }
        return children;
    }

    void leaveCrowded(CrowdedBox crowded) {
        if (crowded.list.size() <= kCrowdedLeafTriangles || crowded.box.edge == 1)
            return makeLeaf(crowded.index, crowded.box, crowded.list, crowded.depth);
        named_ += crowded.list.size();
        crowded_.push(std::move(crowded));
    }

    /// Splits boxes that were left since their triangles would be named too often if all boxes were split as those
    /// above: the fullest first, while the page's leaves name no more than `most`. Where only some of a page's
    /// triangles are long, there is room for these.
    void splitCrowded(double most) {
        while (!crowded_.empty()) {
            const CrowdedBox at = crowded_.top();
            crowded_.pop();
            named_ -= at.list.size();
            size_t together = 0;
            for (const auto& child : deal(at.box, at.list, at.depth)) together += child.size();
            if (double(named_ + together) > most) {
                makeLeaf(at.index, at.box, at.list, at.depth);
                continue;
            }
            const uint32_t first = tree_.addChildren(at.index);
            for (uint32_t i = 0; i < 8; ++i) {
                tree_.nodes[first + i].box = at.box.child(int(i));
                if (!lists_[at.depth][i].empty())
                    leaveCrowded({first + i, at.box.child(int(i)), at.depth + 1, lists_[at.depth][i]});
            }
        }
    }

    void makeLeaf(uint32_t index, const NodeBox& box, const std::vector<uint32_t>& list, size_t depth) {
        named_ += list.size();
        tree_.makeHard(index, list);
        occupyCells(box, list, depth);
    }

    /// Marks the cells of a box that its triangles touch.
    void occupyCells(const NodeBox& box, const std::vector<uint32_t>& list, size_t depth) {
        if (list.empty()) return;
        if (box.edge > kSubcells) {
            deal(box, list, depth);
            for (int i = 0; i < 8; ++i) occupyCells(box.child(i), lists_[depth][size_t(i)], depth + 1);
            return;
        }
        const glm::ivec3 cell = box.lower / kSubcells;
        tree_.occupied[size_t(cell.x + tree_.cells * (cell.y + tree_.cells * cell.z))] = 1;
    }

    const LatticeMesh& mesh_;
    size_t mostRecords_;
    double mostRepetition_ = kMostRepetition;
    size_t named_ = 0;  ///< triangles that leaves and crowded boxes name
    std::priority_queue<CrowdedBox> crowded_;
    PageTree tree_;
    std::vector<Bounds> bounds_;           ///< by local number
    std::vector<CubeTest> tests_;          ///< of the triangles below the box that was prepared; else empty
    std::vector<uint16_t> place_;          ///< by local number, the place of its test
    std::array<Lists, kMostDepth> lists_;  ///< of the box at each depth that is being split: its children's triangles
};

}  // namespace

PageTree buildExactTree(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                        uint32_t log2Cells, size_t mostRecords) {
    const glm::i32vec3 origin = glm::i32vec3(page) * (kLatticePerCell << log2Cells);
    return ExactTreeBuilder(mesh, triangles, origin, 1 << log2Cells, mostRecords).run();
}

}  // namespace vcp
