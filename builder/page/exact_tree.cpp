#include "builder/page/exact_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <vector>

#include <glm/common.hpp>

#include "octree/surface/leaf_triangles.h"

namespace vcp {

namespace {

constexpr int kSubcellSteps = kLatticePerCell / kSubcells;

// A list this short keeps a prepared test for each of its triangles, until its leaves are made; longer ones make each
// test anew, so that a crowded page needs little memory.
constexpr size_t kMostPrepared = 4096;

// Pages have at most 2^7 cells an edge.
constexpr size_t kMostDepth = 7 + kMaxSubcellDepth + 1;

struct Bounds {
    glm::i32vec3 low, high;
};

/// Returns the octants, as bits, whose closed boxes the closed bounds touch, of a box with this middle.
uint32_t octantsOf(const Bounds& b, glm::i32vec3 middle) {
    const uint32_t x = (b.low.x <= middle.x ? 0x55u : 0u) | (b.high.x >= middle.x ? 0xaau : 0u);
    const uint32_t y = (b.low.y <= middle.y ? 0x33u : 0u) | (b.high.y >= middle.y ? 0xccu : 0u);
    const uint32_t z = (b.low.z <= middle.z ? 0x0fu : 0u) | (b.high.z >= middle.z ? 0xf0u : 0u);
    return x & y & z;
}

class ExactTreeBuilder {
public:
    ExactTreeBuilder(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::i32vec3 origin, int cells,
                     size_t mostRecords)
        : mesh_(mesh), numbers_(triangles), origin_(origin), mostRecords_(mostRecords) {
        tree_.triangles = triangles;
        tree_.originLattice = origin;
        tree_.cells = cells;
        tree_.occupied.assign(size_t(cells) * cells * cells, 0);
    }

    PageTree run() {
        const NodeBox whole{glm::ivec3(0), tree_.cells * kSubcells};
        const int edge = whole.edge * kSubcellSteps;
        bounds_.resize(numbers_.size());
        std::vector<uint32_t> inside;
        for (uint32_t k = 0; k < numbers_.size(); ++k) {
            const auto t = cornersOf(k);
            bounds_[k] = {glm::min(t[0], glm::min(t[1], t[2])), glm::max(t[0], glm::max(t[1], t[2]))};
            const auto& [low, high] = bounds_[k];
            if (std::max({low.x, low.y, low.z}) > edge || std::min({high.x, high.y, high.z}) < 0) continue;
            const bool within = std::min({low.x, low.y, low.z}) >= 0 && std::max({high.x, high.y, high.z}) <= edge;
            if (within || CubeTest(t).touches(glm::i32vec3(0), edge)) inside.push_back(k);
        }
        for (const uint32_t k : inside) tree_.stray = std::max(tree_.stray, double(mesh_.stray[numbers_[k]]));
        // Long leaves have a record more than triangles.
        const double room = double(mostRecords_) * kHardCountLong / (kHardCountLong + 1);
        mostRepetition_ = std::min(kMostRepetition, room / double(std::max<size_t>(inside.size(), 1)));
        tree_.nodes.emplace_back();
        build(0, whole, std::move(inside), 1);
        return std::move(tree_);
    }

private:
    [[nodiscard]] std::array<glm::i32vec3, 3> cornersOf(uint32_t local) const {
        const std::array<uint32_t, 3>& v = mesh_.triangles[numbers_[local]];
        return {mesh_.positions[v[0]] - origin_, mesh_.positions[v[1]] - origin_, mesh_.positions[v[2]] - origin_};
    }
    static glm::i32vec3 lowerSteps(const NodeBox& box) { return box.lower * kSubcellSteps; }

    /// Fills node `index`. `list`: local numbers, ascending, of those that touch the box. `repetition`: how often the
    /// page's triangles are named if all boxes are split as those above this one.
    void build(uint32_t index, const NodeBox& box, std::vector<uint32_t> list, double repetition) {
        tree_.nodes[index].box = box;
        if (list.size() <= kMostPrepared) return prepare(index, box, list, repetition);
        if (box.edge == 1) return makeCrowded(index, box, std::move(list));
        std::array<std::vector<uint32_t>, 8> children;
        for (const uint32_t k : list) {
            CubeTest test(cornersOf(k));
            deal(box, test, bounds_[k], k, children);
        }
        size_t together = 0;
        for (const auto& child : children) together += child.size();
        const double above = repetition * double(together) / double(list.size());
        if (above > mostRepetition_) return makeCrowded(index, box, std::move(list));
        std::vector<uint32_t>().swap(list);
        const uint32_t first = addChildren(index);
        for (uint32_t i = 0; i < 8; ++i) build(first + i, box.child(int(i)), std::move(children[i]), above);
    }

    /// Names a triangle that touches a box in the lists of the children that it touches.
    template <class Number>
    static void deal(const NodeBox& box, CubeTest& test, const Bounds& bounds, Number number,
                     std::array<std::vector<Number>, 8>& children) {
        const int half = box.edge * kSubcellSteps / 2;
        const glm::i32vec3 lower = lowerSteps(box);
        uint32_t octants = octantsOf(bounds, lower + half);
        if (std::has_single_bit(octants)) return children[size_t(std::countr_zero(octants))].push_back(number);
        for (; octants != 0; octants &= octants - 1) {
            const int o = std::countr_zero(octants);
            if (test.touches(lower + half * glm::i32vec3(o & 1, o >> 1 & 1, o >> 2), half))
                children[size_t(o)].push_back(number);
        }
    }

    /// Makes a leaf of a list that is too long to prepare.
    void makeCrowded(uint32_t index, const NodeBox& box, std::vector<uint32_t> list) {
        tree_.nodes[index].kind = TreeNode::Kind::Hard;
        tree_.nodes[index].index = uint32_t(tree_.hard.size());
        const glm::ivec3 first = box.lower / kSubcells, last = (box.lower + box.edge - 1) / kSubcells;
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x) occupy({x, y, z});
        tree_.hard.push_back({box, std::move(list)});
    }

    /// Builds the tree below a node, with a test for each of its triangles. Short lists name tests.
    void prepare(uint32_t index, const NodeBox& box, const std::vector<uint32_t>& list, double repetition) {
        tests_.clear();
        for (const uint32_t k : list) tests_.push_back({CubeTest(cornersOf(k)), bounds_[k]});
        local_ = list;
        std::vector<uint16_t> all(list.size());
        for (size_t i = 0; i < all.size(); ++i) all[i] = uint16_t(i);
        split(index, box, all, repetition, 0);
    }

    /// Fills a node whose triangles are `list`: places in tests_, all of which touch the box.
    void split(uint32_t index, const NodeBox& box, const std::vector<uint16_t>& list, double repetition, size_t depth) {
        tree_.nodes[index].box = box;
        if (list.empty()) return;
        const size_t most = box.edge > kWideLeafCells * kSubcells ? kWideLeafTriangles : kExactLeafTriangles;
        if (list.size() <= most || box.edge == 1) return makeLeaf(index, box, list, depth);
        deal(box, list, depth);
        size_t together = 0;
        for (const auto& child : lists_[depth]) together += child.size();
        const double below = repetition * double(together) / double(list.size());
        if (below > mostRepetition_) return makeLeaf(index, box, list, depth);
        const uint32_t first = addChildren(index);
        for (uint32_t i = 0; i < 8; ++i) split(first + i, box.child(int(i)), lists_[depth][i], below, depth + 1);
    }

    /// Deals the triangles of a box to its children, in lists_[depth].
    void deal(const NodeBox& box, const std::vector<uint16_t>& list, size_t depth) {
        auto& children = lists_[depth];
        for (auto& child : children) child.clear();
        for (const uint16_t i : list) deal(box, tests_[i].test, tests_[i].bounds, i, children);
    }

    void makeLeaf(uint32_t index, const NodeBox& box, const std::vector<uint16_t>& list, size_t depth) {
        tree_.nodes[index].kind = TreeNode::Kind::Hard;
        tree_.nodes[index].index = uint32_t(tree_.hard.size());
        std::vector<uint32_t> triangles(list.size());
        for (size_t i = 0; i < list.size(); ++i) triangles[i] = local_[list[i]];
        tree_.hard.push_back({box, std::move(triangles)});
        occupyCells(box, list, depth);
    }

    /// Marks the cells of a leaf that its triangles touch.
    void occupyCells(const NodeBox& box, const std::vector<uint16_t>& list, size_t depth) {
        if (list.empty()) return;
        if (box.edge <= kSubcells) return occupy(box.lower / kSubcells);
        deal(box, list, depth);
        for (int i = 0; i < 8; ++i) occupyCells(box.child(i), lists_[depth][size_t(i)], depth + 1);
    }

    void occupy(glm::ivec3 cell) { tree_.occupied[size_t(cell.x + tree_.cells * (cell.y + tree_.cells * cell.z))] = 1; }

    uint32_t addChildren(uint32_t index) {
        const uint32_t first = uint32_t(tree_.nodes.size());
        const NodeBox box = tree_.nodes[index].box;
        for (int i = 0; i < 8; ++i) tree_.nodes.push_back({.box = box.child(i)});
        tree_.nodes[index].kind = TreeNode::Kind::Internal;
        tree_.nodes[index].index = first;
        return first;
    }

    struct Prepared {
        CubeTest test;
        Bounds bounds;
    };

    const LatticeMesh& mesh_;
    std::span<const uint32_t> numbers_;
    glm::i32vec3 origin_;
    size_t mostRecords_;
    double mostRepetition_ = kMostRepetition;
    PageTree tree_;
    std::vector<Bounds> bounds_;   ///< by local number
    std::vector<Prepared> tests_;  ///< the triangles below the box that was prepared
    std::vector<uint32_t> local_;  ///< their local numbers
    /// Places in tests_, by depth below that box and by octant.
    std::array<std::array<std::vector<uint16_t>, 8>, kMostDepth> lists_;
};

}  // namespace

PageTree buildExactTree(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                        uint32_t log2Cells, size_t mostRecords) {
    const glm::i32vec3 origin = glm::i32vec3(page) * (kLatticePerCell << log2Cells);
    return ExactTreeBuilder(mesh, triangles, origin, 1 << log2Cells, mostRecords).run();
}

}  // namespace vcp
