#include "builder/page/page_builder.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <glm/common.hpp>

#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

// Splitting a crowded hard leaf is given up where the children together would repeat its triangles more often than
// this: a fan's centre or long triangles gain nothing from smaller leaves.
constexpr double kMaxRepetition = 3.5;

// A merged leaf may use only this share of the tolerance: where leaves of different sizes meet, their normals differ by
// about their errors over a cell, and shading shows it sooner than the surface does.
constexpr double kMergeTolerance = 0.5;

// Merging is tried only while the leaves' own error is below this part of the tolerance.
constexpr double kMergeTrial = 0.2;

// Leaves are merged only while their colours stay so close to what the larger leaf blends, of 255.
constexpr double kColourTolerance = 10;

double errorOf(const SoftLeaf& leaf) {
    return (leaf.certificate.maxValue + wallOf(leaf.wall)) * leaf.box.edgeCells() / leaf.certificate.minSlope;
}

class TreeBuilder {
public:
    /// `hardEdge`: boxes up to this edge, in cells, become hard leaves without trying other kinds; 1: none do.
    TreeBuilder(PageGeometry& geometry, double tolerance, int hardEdge)
        : geometry_(geometry),
          tolerance_(tolerance),
          hardEdge_(hardEdge),
          mostLeaves_(mostSplitLeaves(geometry.triangleCount())),
          mostRecords_(mostSplitRecords(geometry.triangleCount())) {
        fillOccupancy();
        tree_.triangles = geometry.numbers();
        tree_.originLattice = geometry.originLattice();
        tree_.cells = geometry.cells();
        tree_.stray = geometry.stray();
        tree_.occupied = occupancy_.front();
    }

    PageTree run() {
        tree_.nodes.emplace_back();
        build(0, {glm::ivec3(0), geometry_.cells() * kSubcells});
        return std::move(tree_);
    }

private:
    using Kind = TreeNode::Kind;

    /// occupancy_[l]: cubes of 2^l cells that the mesh touches.
    void fillOccupancy() {
        const int n = geometry_.cells();
        const auto index = [](int side, int x, int y, int z) { return size_t(x + side * (y + side * z)); };
        occupancy_.emplace_back(size_t(n) * n * n);
        for (int z = 0; z < n; ++z)
            for (int y = 0; y < n; ++y)
                for (int x = 0; x < n; ++x) occupancy_[0][index(n, x, y, z)] = geometry_.occupied({x, y, z});
        for (int m = n / 2; m >= 1; m /= 2) {
            std::vector<uint8_t> up(size_t(m) * m * m, 0);
            for (int z = 0; z < 2 * m; ++z)
                for (int y = 0; y < 2 * m; ++y)
                    for (int x = 0; x < 2 * m; ++x)
                        up[index(m, x / 2, y / 2, z / 2)] |= occupancy_.back()[index(2 * m, x, y, z)];
            occupancy_.push_back(std::move(up));
        }
    }

    bool occupied(const NodeBox& box) const {
        int level = 0;
        while (kSubcells << level < box.edge) ++level;
        const int n = geometry_.cells() >> level;
        const glm::ivec3 c = box.lower / box.edge;
        return occupancy_[level][size_t(c.x + n * (c.y + n * c.z))] != 0;
    }

    /// Fills node `index`: a box of at least a cell.
    void build(uint32_t index, const NodeBox& box) {
        tree_.nodes[index].box = box;
        if (!occupied(box)) return;
        if (hardEdge_ > 1 && box.edge <= hardEdge_ * kSubcells) {
            std::vector<uint32_t> around, inside;
            geometry_.trianglesOf(box, around, inside);
            return makeHard(index, inside);
        }
        if (box.edge == kSubcells) {
            const PageGeometry::CellTriangles triangles = geometry_.trianglesOf(box.lower / kSubcells);
            return fillCell(index, box, triangles.around, triangles.inside, 0);
        }
        const uint32_t first = tree_.addChildren(index);
        for (uint32_t i = 0; i < 8; ++i) build(first + i, box.child(int(i)));
        merge(index);
    }

    /// Fills a cell or less: soft if it certifies, hard if its triangles are few or splitting gains nothing, else split
    void fillCell(uint32_t index, const NodeBox& box, std::span<const uint32_t> around,
                  std::span<const uint32_t> inside, uint32_t depth) {
        tree_.nodes[index].box = box;
        if (inside.empty()) return;
        if (const auto certificate = certify(box, around, tolerance_)) return makeSoft(index, *certificate);
        const bool isFull = tree_.soft.size() + tree_.hard.size() >= mostLeaves_ || records_ >= mostRecords_;
        if (inside.size() <= kHardLeafTriangles || depth == kMaxSubcellDepth || isFull) return makeHard(index, inside);
        PageGeometry::ChildTriangles& children = children_[depth];
        geometry_.split(box, around, children);
        size_t together = 0;
        for (const auto& list : children.inside) together += list.size();
        if (double(together) > kMaxRepetition * double(inside.size())) return makeHard(index, inside);
        const uint32_t first = tree_.addChildren(index);
        for (uint32_t i = 0; i < 8; ++i)
            fillCell(first + i, box.child(int(i)), children.around[i], children.inside[i], depth + 1);
    }

    const CornerVector& cornerOf(const NodeBox& box, int i) {
        return geometry_.corner(box.lower + box.edge * glm::ivec3(i & 1, i >> 1 & 1, i >> 2));
    }

    std::optional<Certificate> certify(const NodeBox& box, std::span<const uint32_t> around, double tolerance) {
        triangles_.clear();
        pointers_.clear();
        for (const uint32_t k : around) triangles_.push_back(geometry_.triangle(k));
        for (const CertifiedTriangle& t : triangles_) pointers_.push_back(&t);
        const auto corner = [&](int i) -> const CornerVector& { return cornerOf(box, i); };
        const Certificate certificate =
            certifyLeaf(box.lowerCells(), box.edgeCells(), pointers_, tolerance, corner, scratch_);
        if (!certificate.soft) return {};
        return certificate;
    }

    void makeSoft(uint32_t index, const Certificate& certificate) {
        tree_.nodes[index].kind = Kind::Soft;
        tree_.nodes[index].index = uint32_t(tree_.soft.size());
        tree_.soft.push_back({tree_.nodes[index].box, certificate, {}, 0});
        if (!geometry_.hasColour()) return;
        for (int i = 0; i < 8; ++i) tree_.soft.back().colours[size_t(i)] = cornerOf(tree_.nodes[index].box, i).colour;
    }

    void makeHard(uint32_t index, std::span<const uint32_t> triangles) {
        tree_.makeHard(index, {triangles.begin(), triangles.end()});
        records_ += triangles.size();
    }

    /// Applies the merging rule (Demir and Westermann 2015, section 3, with a true bound): eight siblings become one
    /// leaf where one leaf represents the mesh within tolerance, or is hard with few triangles.
    void merge(uint32_t index) {
        const uint32_t first = tree_.nodes[index].index;
        size_t soft = 0, hard = 0;
        double worst = 0;
        for (uint32_t c = first; c < first + 8; ++c) {
            if (tree_.nodes[c].kind == Kind::Internal) return;
            soft += tree_.nodes[c].kind == Kind::Soft;
            worst =
                std::max(worst, tree_.nodes[c].kind == Kind::Soft ? errorOf(tree_.soft[tree_.nodes[c].index]) : 0.0);
            if (tree_.nodes[c].kind != Kind::Hard) continue;
            // The parent would hold what a child holds.
            if (tree_.hard[tree_.nodes[c].index].triangles.size() > kMergedHardTriangles) return;
            ++hard;
        }
        const NodeBox box = tree_.nodes[index].box;
        std::vector<uint32_t> around, inside;
        if (soft + hard > 0) {
            // A leaf's error grows with the third power of its edge; one that cannot succeed is not tried.
            if (hard == 0 && (box.edge > kMaxSoftCells * kSubcells || worst > kMergeTrial * tolerance_)) return;
            geometry_.trianglesOf(box, around, inside);
        }
        const std::optional<Certificate> certificate =
            soft > 0 && hard == 0 ? certify(box, around, kMergeTolerance * tolerance_) : std::nullopt;
        if (certificate && !colourFits(box, first)) return;
        const bool hardFits = hard > 0 && inside.size() <= kMergedHardTriangles;
        if (soft + hard > 0 && !certificate && !hardFits) return;
        // The children and their leaves are the last elements that were made.
        tree_.nodes.resize(first);
        tree_.soft.resize(tree_.soft.size() - soft);
        for (size_t i = tree_.hard.size() - hard; i < tree_.hard.size(); ++i)
            records_ -= tree_.hard[i].triangles.size();
        tree_.hard.resize(tree_.hard.size() - hard);
        tree_.nodes[index].kind = Kind::Empty;
        if (certificate) makeSoft(index, *certificate);
        if (hardFits) makeHard(index, inside);
    }

    /// Whether the colours at the corners of the children are those that the corners of the parent blend to.
    bool colourFits(const NodeBox& box, uint32_t firstChild) {
        if (!geometry_.hasColour()) return true;
        uint32_t outer[8];
        for (int i = 0; i < 8; ++i) outer[i] = cornerOf(box, i).colour;
        for (int m = 0; m < 27; ++m) {
            const glm::ivec3 g(m % 3, m / 3 % 3, m / 9);
            if (!cornerOfLeaf(g, firstChild)) continue;
            const uint32_t colour = geometry_.corner(box.lower + box.edge / 2 * g).colour;
            for (int c = 0; c < 4; ++c) {
                double blend = 0;
                for (int i = 0; i < 8; ++i) {
                    const glm::dvec3 w =
                        glm::mix(1.0 - glm::dvec3(g) / 2.0, glm::dvec3(g) / 2.0, glm::dvec3(i & 1, i >> 1 & 1, i >> 2));
                    blend += w.x * w.y * w.z * double(outer[i] >> 8 * c & 255u);
                }
                if (std::abs(blend - double(colour >> 8 * c & 255u)) > kColourTolerance) return false;
            }
        }
        return true;
    }

    /// Whether point g of a node's 3^3 grid is a corner of a child that is a leaf.
    bool cornerOfLeaf(glm::ivec3 g, uint32_t firstChild) const {
        for (int i = 0; i < 8; ++i) {
            const glm::ivec3 o(i & 1, i >> 1 & 1, i >> 2);
            const glm::ivec3 d = g - o;
            if (d.x >= 0 && d.x <= 1 && d.y >= 0 && d.y <= 1 && d.z >= 0 && d.z <= 1 &&
                tree_.nodes[firstChild + uint32_t(i)].kind != Kind::Empty)
                return true;
        }
        return false;
    }

    PageGeometry& geometry_;
    double tolerance_;
    int hardEdge_;
    size_t mostLeaves_, mostRecords_, records_ = 0;  ///< records: triangles of hard leaves, leaf by leaf
    PageTree tree_;
    std::vector<std::vector<uint8_t>> occupancy_;
    std::vector<CertifiedTriangle> triangles_;
    std::vector<const CertifiedTriangle*> pointers_;
    CertificateScratch scratch_;
    std::array<PageGeometry::ChildTriangles, kMaxSubcellDepth> children_;  ///< by depth, of the cell being split
};

}  // namespace

uint32_t PageTree::addChildren(uint32_t index) {
    const uint32_t first = uint32_t(nodes.size());
    const NodeBox box = nodes[index].box;
    for (int i = 0; i < 8; ++i) nodes.push_back({.box = box.child(i)});
    nodes[index].kind = TreeNode::Kind::Internal;
    nodes[index].index = first;
    return first;
}

void PageTree::makeHard(uint32_t index, std::vector<uint32_t> locals) {
    nodes[index].kind = TreeNode::Kind::Hard;
    nodes[index].index = uint32_t(hard.size());
    hard.push_back({nodes[index].box, std::move(locals)});
}

void PageTree::makeSlab(uint32_t index, const SlabLeaf& leaf) {
    nodes[index].kind = TreeNode::Kind::Slab;
    nodes[index].index = uint32_t(slabs.size());
    slabs.push_back(leaf);
}

size_t PageTree::records() const {
    size_t count = 0;
    for (const HardLeaf& leaf : hard)
        count += leaf.triangles.size() + (leaf.triangles.size() >= kHardCountLong ? 1 : 0);
    return count;
}

PageTree buildPageTree(PageGeometry& geometry, double tolerance, size_t mostRecords) {
    // Many long triangles, each in many leaves, may be more than a page can name: larger leaves repeat them less.
    for (int hardEdge = 1;; hardEdge *= 2) {
        PageTree tree = TreeBuilder(geometry, tolerance, hardEdge).run();
        if (tree.records() <= mostRecords || hardEdge >= geometry.cells()) return tree;
    }
}

double PageTree::certifiedError() const {
    double error = 0;
    for (const SoftLeaf& leaf : soft) error = std::max(error, errorOf(leaf));
    // A point that is drawn and a point of the mesh share an octant of the leaf, whose corners are so far apart.
    for (const SlabLeaf& leaf : slabs) error = std::max(error, kSlabErrorEdges * leaf.box.edgeCells());
    return error;
}

}  // namespace vcp
