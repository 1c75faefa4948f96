#include "builder/paper/corner_octree.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <tuple>

#include <glm/geometric.hpp>

#include "builder/paper/grid_points.h"
#include "builder/paper/parallel_rows.h"
#include "builder/paper/region_growing.h"

namespace vcp {

namespace {

constexpr double kSqrt3 = 1.7320508075688772;
constexpr int kBlockLevel = 1;
constexpr float kPointToBoundary = 0.70712f;

enum class Kind : uint8_t { Inner, Empty, Leaf };

struct BuildNode {
    glm::ivec3 low{0};   ///< lowest cell
    uint32_t first = 0;  ///< first of the eight children, one level below; of inner nodes
    uint32_t word = 0;   ///< where its word goes
    Kind kind = Kind::Empty;
    bool isAround = false;  ///< it lies around the region, and has points only
};

glm::ivec3 octantOffset(int octant) { return {octant & 1, octant >> 1 & 1, octant >> 2 & 1}; }

class CornerOctreeBuilder {
public:
    CornerOctreeBuilder(const MeshBvh& mesh, const MeshSides* sides, const CornerField& field,
                        const CornerOctreeOptions& options)
        : mesh_(mesh), sides_(sides), field_(field), options_(options) {}

    Result<CornerOctree> build() {
        const auto limit = [](const char* what) { return Error{.code = ErrorCode::Limit, .message = what}; };
        const glm::dvec3 extent = (mesh_.high() - mesh_.low()) / options_.cell;
        if (!options_.region && !(std::max({extent.x, extent.y, extent.z}) < RootGrid::kMaxCells / 2))
            return limit("the cells are too small for this mesh: more than 2^19 would lie across it");
        tree_.frame =
            options_.region ? options_.region->grid : RootGrid::around(mesh_.low(), mesh_.high(), options_.cell, 4);
        firstRoot_ = options_.region ? options_.region->firstRoot : glm::ivec3(0);
        roots_ = options_.region ? options_.region->roots : tree_.frame.roots;
        levels_.resize(size_t(tree_.frame.rootLevel) + 1);
        makeRoots();
        for (int level = tree_.frame.rootLevel; level > kBlockLevel; --level) {
            findEmpty(level, field_.band());
            if (!split(level)) return limit("the octree would have more than 2^30 nodes");
        }
        findEmpty(kBlockLevel, field_.band());
        sampleBlocks();
        if (!split(kBlockLevel)) return limit("the octree would have more than 2^30 nodes");
        makeCells();
        for (int level = kBlockLevel; level <= tree_.frame.rootLevel; ++level) merge(level);
        number();
        storeEmpty();
        storeLeaves();
        tree_.frame.low = tree_.frame.worldFromGrid(glm::dvec3(firstRoot_ * (1 << tree_.frame.rootLevel)));
        tree_.frame.roots = roots_;
        return std::move(tree_);
    }

private:
    [[nodiscard]] CornerSample sampleAt(glm::ivec3 point) const {
        const glm::dvec3 p = tree_.frame.worldFromGrid(glm::dvec3(point));
        const auto nearest = mesh_.nearestPoint(p);
        if (!nearest) return {glm::vec3(0), float(1e9)};
        CornerSample sample;
        sample.toSurface = glm::vec3((nearest->point - p) / options_.cell);
        sample.distance = float(nearest->distance / options_.cell);
        if (field_.isSigned() && sides_->isInside(p, *nearest)) sample.distance = -sample.distance;
        return sample;
    }
    [[nodiscard]] CornerSample sampled(glm::ivec3 point) const {
        const CornerSample* known = points_.find(point);
        return known && known->isReached() ? *known : sampleAt(point);
    }
    /// Returns the distance in cells, without sign; nothing where it is more than `within`.
    [[nodiscard]] std::optional<float> distanceWithin(glm::ivec3 point, float within) const {
        if (const CornerSample* known = points_.find(point); known && known->isReached())
            return std::abs(known->distance);
        const auto nearest = mesh_.nearestPoint(tree_.frame.worldFromGrid(glm::dvec3(point)), within * options_.cell);
        if (!nearest) return {};
        return float(nearest->distance / options_.cell);
    }
    [[nodiscard]] CornerSamples cornersOf(glm::ivec3 low, int size) const {
        CornerSamples corners;
        for (int k = 0; k < 8; ++k) corners[k] = sampled(low + size * octantOffset(k));
        return corners;
    }

    void makeRoots() {
        const int level = tree_.frame.rootLevel;
        auto& roots = levels_[level];
        for (int z = 0; z < roots_.z; ++z)
            for (int y = 0; y < roots_.y; ++y)
                for (int x = 0; x < roots_.x; ++x) roots.push_back({(firstRoot_ + glm::ivec3(x, y, z)) * (1 << level)});
        if (options_.region && options_.growRounds > 0) addNodesAround();
    }
    /// Points of the region take over what points around it have, as far away as there are rounds.
    void addNodesAround() {
        constexpr int kLevel = 3, kEdge = 1 << kLevel;
        static_assert(kLevel < CornerRegion::kLeastRootLevel);
        const int edge = 1 << tree_.frame.rootLevel, width = (options_.growRounds / kEdge + 1) * kEdge;
        const glm::ivec3 low = firstRoot_ * edge, high = low + roots_ * edge;
        const glm::ivec3 from = glm::max(low - width, 0), to = glm::min(high + width, tree_.frame.cells());
        for (int z = from.z; z < to.z; z += kEdge)
            for (int y = from.y; y < to.y; y += kEdge)
                for (int x = from.x; x < to.x; x += kEdge) {
                    const glm::ivec3 p(x, y, z);
                    if (p == glm::clamp(p, low, high - 1)) continue;
                    levels_[kLevel].push_back({.low = p, .isAround = true});
                }
    }

    /// Makes nodes without a point within `band` of the surface empty, the others inner.
    void findEmpty(int level, float band) {
        auto& nodes = levels_[level];
        const double half = 0.5 * (1 << level);
        const double reach = (band + half * kSqrt3) * (1 + 1e-6) * options_.cell;
        forEachIndex(nodes.size(), options_.threads, [&](size_t i) {
            const glm::dvec3 centre = tree_.frame.worldFromGrid(glm::dvec3(nodes[i].low) + half);
            nodes[i].kind = mesh_.nearestPoint(centre, reach) ? Kind::Inner : Kind::Empty;
        });
    }

    /// Whether points of the region may come to have what a point around it has.
    [[nodiscard]] bool isReached(glm::ivec3 point) const {
        const int edge = 1 << tree_.frame.rootLevel;
        const glm::ivec3 low = firstRoot_ * edge, high = low + roots_ * edge;
        const glm::ivec3 away = glm::abs(point - glm::clamp(point, low, high));
        return std::max({away.x, away.y, away.z}) <= options_.growRounds;
    }

    bool split(int level) {
        auto& children = levels_[level - 1];
        const int size = 1 << (level - 1);
        for (BuildNode& node : levels_[level]) {
            if (node.kind != Kind::Inner) continue;
            node.first = uint32_t(children.size());
            for (int k = 0; k < 8; ++k)
                children.push_back({.low = node.low + size * octantOffset(k), .isAround = node.isAround});
            if (children.size() > CornerOctree::kEmpty / 2) return false;
        }
        return true;
    }

    /// Samples the grid points of blocks that may be kept; blocks with all points beyond the band become empty.
    void sampleBlocks() {
        auto& blocks = levels_[kBlockLevel];
        const auto forPoints = [](const BuildNode& block, const auto& visit) {
            for (int z = 0; z <= 2; ++z)
                for (int y = 0; y <= 2; ++y)
                    for (int x = 0; x <= 2; ++x) visit(block.low + glm::ivec3(x, y, z));
        };
        for (const BuildNode& block : blocks)
            if (block.kind == Kind::Inner)
                forPoints(block, [&](glm::ivec3 point) {
                    if (!block.isAround || isReached(point)) points_.add(point);
                });
        if (options_.growRounds >= 0)
            growClosestPoints(mesh_.mesh(), tree_.frame, options_.growRounds, options_.threads, points_);
        else
            points_.fill(options_.threads, [&](glm::ivec3 point) { return sampleAt(point); });
        forEachIndex(blocks.size(), options_.threads, [&](size_t i) {
            if (blocks[i].isAround) blocks[i].kind = Kind::Empty;
            if (blocks[i].kind != Kind::Inner) return;
            float least = std::numeric_limits<float>::infinity(), most = 0;
            forPoints(blocks[i], [&](glm::ivec3 point) {
                const float d = std::abs(points_.find(point)->distance);
                least = std::min(least, d);
                most = std::max(most, d);
            });
            if (least > field_.band() || std::isinf(most)) blocks[i].kind = Kind::Empty;
        });
    }

    void makeCells() {
        auto& cells = levels_[0];
        forEachIndex(cells.size(), options_.threads, [&](size_t i) {
            cells[i].kind = field_.keepCell(cornersOf(cells[i].low, 1)) ? Kind::Leaf : Kind::Empty;
        });
    }

    void merge(int level) {
        auto& nodes = levels_[level];
        const auto& below = levels_[level - 1];
        forEachIndex(nodes.size(), options_.threads, [&](size_t i) {
            BuildNode& node = nodes[i];
            if (node.kind != Kind::Inner) return;
            int leaves = 0, empties = 0;
            for (int k = 0; k < 8; ++k) {
                leaves += below[node.first + k].kind == Kind::Leaf ? 1 : 0;
                empties += below[node.first + k].kind == Kind::Empty ? 1 : 0;
            }
            if (empties == 8)
                node.kind = Kind::Empty;
            else if (leaves + empties == 8 && field_.mergeThreshold() >= 0 && mergedIsGood(level, node))
                node.kind = Kind::Leaf;
        });
    }

    /// Compares, at the corners of the children that are leaves, the merged leaf with the exact samples.
    [[nodiscard]] bool mergedIsGood(int level, const BuildNode& node) const {
        const int size = 1 << level, half = size / 2;
        const CornerSamples corners = cornersOf(node.low, size);
        // A longer vector may be of a triangle that the region does not have.
        if (options_.region && std::ranges::any_of(corners, [&](const CornerSample& corner) {
                return std::abs(corner.distance) > options_.region->halo;
            }))
            return false;
        for (int point = 0; point < 27; ++point) {
            const glm::ivec3 at(point % 3, point / 3 % 3, point / 9);
            bool ofLeaf = false;
            for (int k = 0; k < 8; ++k) {
                const glm::ivec3 from = at - octantOffset(k);
                const bool touches = std::min({from.x, from.y, from.z}) >= 0 && std::max({from.x, from.y, from.z}) <= 1;
                ofLeaf = ofLeaf || (touches && levels_[level - 1][node.first + k].kind == Kind::Leaf);
            }
            if (ofLeaf && field_.mergeError(corners, float(size), 0.5f * glm::vec3(at), sampled(node.low + half * at)) >
                              field_.mergeThreshold())
                return false;
        }
        return true;
    }

    /// Chooses where each reachable node's word goes, and writes the words of inner nodes.
    void number() {
        const int top = tree_.frame.rootLevel;
        for (uint32_t i = 0; i < levels_[top].size(); ++i) levels_[top][i].word = i;
        tree_.nodes.resize(levels_[top].size());
        std::vector<uint32_t> reached(levels_[top].size()), next;
        for (uint32_t i = 0; i < reached.size(); ++i) reached[i] = i;
        for (int level = top; level >= 0; --level, reached.swap(next), next.clear()) {
            for (const uint32_t i : reached) {
                BuildNode& node = levels_[level][i];
                if (node.kind == Kind::Empty) empties_.push_back({level, i});
                if (node.kind == Kind::Leaf) leaves_.push_back({level, i});
                if (node.kind != Kind::Inner) continue;
                const auto first = uint32_t(tree_.nodes.size());
                tree_.nodes[node.word] = int32_t(first);
                tree_.nodes.resize(first + 8);
                for (uint32_t k = 0; k < 8; ++k) {
                    levels_[level - 1][node.first + k].word = first + k;
                    next.push_back(node.first + k);
                }
            }
        }
    }

    struct NodeRef {
        int level;
        uint32_t index;
    };
    [[nodiscard]] const BuildNode& at(NodeRef ref) const { return levels_[ref.level][ref.index]; }

    void storeEmpty() {
        tree_.emptyNodes = empties_.size();
        tree_.cutoff = glm::length(glm::vec3(tree_.frame.cells()));
        forEachIndex(empties_.size(), options_.threads, [&](size_t i) {
            const BuildNode& node = at(empties_[i]);
            // A cell beside a leaf has no distance that is worth a step.
            float least = empties_[i].level == 0 ? 0 : leastOnBoundary(node.low, 1 << empties_[i].level);
            if (options_.region) least = std::min(least, options_.region->halo);
            if (options_.safeEmpty) least = std::max(least - kPointToBoundary, 0.0f);
            const double scaled = std::min(double(least) / tree_.cutoff, 1.0) * (CornerOctree::kEmpty - 1);
            const double code = (options_.safeEmpty ? std::floor(scaled) : std::ceil(scaled)) + CornerOctree::kEmpty;
            tree_.nodes[node.word] = int32_t(code);
        });
    }

    /// Returns the least distance of the grid points on a cube's boundary: faces are halved until no point in a piece
    /// can be nearer than the nearest one seen.
    [[nodiscard]] float leastOnBoundary(glm::ivec3 low, int size) const {
        const glm::dvec3 centre = tree_.frame.worldFromGrid(glm::dvec3(low) + 0.5 * size);
        glm::ivec3 start = low;
        if (const auto nearest = mesh_.nearestPoint(centre)) {
            // The point where the way from the centre to the surface leaves the cube.
            const glm::dvec3 way = (nearest->point - centre) / options_.cell;
            const double longest = std::max({std::abs(way.x), std::abs(way.y), std::abs(way.z), 1e-30});
            start = glm::clamp(glm::ivec3(glm::round(glm::dvec3(low) + 0.5 * size + way * (0.5 * size / longest))), low,
                               low + size);
        }
        float least = std::abs(sampled(start).distance);
        for (int axis = 0; axis < 3; ++axis)
            for (int side = 0; side < 2; ++side) {
                glm::ivec3 from = low, to = low + size;
                from[axis] = to[axis] = side ? low[axis] + size : low[axis];
                leastOnFace(from, to, least);
            }
        return least;
    }
    void leastOnFace(glm::ivec3 from, glm::ivec3 to, float& least) const {
        const glm::ivec3 middle = (from + to) / 2;
        const float reach = glm::length(glm::vec3(glm::max(to - middle, middle - from)));
        const auto d = distanceWithin(middle, (least + reach) * 1.00001f);
        if (!d) return;
        least = std::min(least, *d);
        if (from == to || *d - reach >= least) return;
        const glm::ivec3 extent = to - from;
        int axis = extent.x >= extent.y ? 0 : 1;
        if (extent.z > extent[axis]) axis = 2;
        glm::ivec3 lowTo = to, highFrom = from;
        lowTo[axis] = middle[axis];
        highFrom[axis] = middle[axis] + 1;
        leastOnFace(from, lowTo, least);
        leastOnFace(highFrom, to, least);
    }

    void storeLeaves() {
        std::ranges::sort(leaves_, [&](NodeRef a, NodeRef b) {
            const glm::ivec3 p = at(a).low, q = at(b).low;
            return std::tie(a.level, p.z, p.y, p.x) < std::tie(b.level, q.z, q.y, q.x);
        });
        tree_.leaves = leaves_.size();
        std::vector<bool> adjoins(leaves_.size());
        std::vector<uint32_t> slice(leaves_.size());
        uint32_t slices = 0;
        for (size_t i = 0; i < leaves_.size(); ++i) {
            const glm::ivec3 along(1 << leaves_[i].level, 0, 0);
            adjoins[i] = i > 0 && leaves_[i - 1].level == leaves_[i].level &&
                         at(leaves_[i - 1]).low + along == at(leaves_[i]).low;
            slice[i] = adjoins[i] ? slices - 1 : slices;
            slices = slice[i] + 2;
            tree_.nodes[at(leaves_[i]).word] = -int32_t(slice[i]) - 1;
        }
        tree_.largest = largestDistance();
        if (options_.region)
            tree_.vectors.resize(slices);
        else
            tree_.slices.resize(slices);
        forEachIndex(leaves_.size(), options_.threads, [&](size_t i) {
            const CornerSamples corners = cornersOf(at(leaves_[i]).low, 1 << leaves_[i].level);
            // A shared slice is written once, by the leaf before it.
            for (uint32_t x = adjoins[i] ? 1 : 0; x < 2; ++x)
                for (uint32_t k = 0; k < 4; ++k)
                    if (options_.region)
                        tree_.vectors[slice[i] + x][k] = corners[x + 2 * k].toSurface;
                    else
                        tree_.slices[slice[i] + x][k] = field_.pack(corners[x + 2 * k], tree_.largest);
        });
    }
    [[nodiscard]] float largestDistance() const {
        std::vector<float> largest(leaves_.size());
        forEachIndex(leaves_.size(), options_.threads, [&](size_t i) {
            for (const CornerSample& corner : cornersOf(at(leaves_[i]).low, 1 << leaves_[i].level))
                largest[i] = std::max(largest[i], std::abs(corner.distance));
        });
        return largest.empty() ? 1 : std::ranges::max(largest);
    }

    const MeshBvh& mesh_;
    const MeshSides* sides_;
    const CornerField& field_;
    const CornerOctreeOptions& options_;
    CornerOctree tree_;                   // its frame is that of the whole grid until the end
    glm::ivec3 firstRoot_{0}, roots_{1};  // of the grid
    std::vector<std::vector<BuildNode>> levels_;
    GridPoints<CornerSample> points_;
    std::vector<NodeRef> empties_, leaves_;
};

}  // namespace

float haloOf(const CornerField& field, int growRounds) {
    // The farthest block with a point that counts reaches two cells beyond it, and is kept where the surface is within
    // the band and half its diagonal.
    constexpr float kBlock = 4, kUsual = 16;
    return std::max(kUsual, std::ceil(field.band()) + float(std::max(growRounds, 0)) + kBlock);
}

Result<CornerOctree> buildCornerOctree(const MeshBvh& mesh, const MeshSides* sides, const CornerField& field,
                                       const CornerOctreeOptions& options) {
    return CornerOctreeBuilder(mesh, sides, field, options).build();
}

}  // namespace vcp
