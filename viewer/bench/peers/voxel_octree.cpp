#include "viewer/bench/peers/voxel_octree.h"

#include <cmath>

#include "builder/lattice/triangle_geometry.h"
#include "builder/paper/parallel_rows.h"

namespace vcp {

namespace {

constexpr double kTouch = 1e-6;  // in cells; what touches a voxel's face is in it

/// Returns the extent of the unit voxel on either side of its centre, along an integer normal.
float extentAlong(glm::vec3 n) { return 0.5f * (std::abs(n.x) + std::abs(n.y) + std::abs(n.z)); }

glm::ivec3 octantOffset(int octant) { return {octant & 1, octant >> 1 & 1, octant >> 2 & 1}; }

/// A node of the level being split, and where its triangles are in the level's list.
struct OpenNode {
    glm::ivec3 low{0};
    uint64_t first = 0, end = 0;
};

/// One level while it is built.
struct OpenLevel {
    std::vector<OpenNode> nodes;
    std::vector<uint32_t> triangles;
};

class VoxelBuilder {
public:
    VoxelBuilder(const IndexedMesh& mesh, double cell, bool contours, unsigned threads)
        : mesh_(mesh), threads_(threads) {
        tree_.hasContours = contours;
        glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
        for (const auto& triangle : mesh.triangles)
            for (const uint32_t vertex : triangle) {
                low = glm::min(low, mesh.positions[vertex]);
                high = glm::max(high, mesh.positions[vertex]);
            }
        extent_ = (high - low) / cell;
        tree_.frame = RootGrid::around(low, high, cell, 1);
    }

    Result<VoxelOctree> build() {
        const auto limit = [](const char* what) { return Error{.code = ErrorCode::Limit, .message = what}; };
        if (!(std::max({extent_.x, extent_.y, extent_.z}) < RootGrid::kMaxCells / 2))
            return limit("the cells are too small for this mesh: more than 2^19 would lie across it");
        OpenLevel open = rootLevel();
        for (int level = tree_.frame.rootLevel; level > 0; --level) {
            if (open.nodes.size() > 1u << 24)
                return limit("a level of the voxel octree would have more than 2^24 nodes");
            tree_.levelStart[level] = uint32_t(tree_.nodes.size());
            open = split(open, level);
        }
        tree_.voxels = open.nodes.size();
        if (tree_.hasContours) fitContours(open);
        return std::move(tree_);
    }

private:
    [[nodiscard]] Triangle3 inGrid(uint32_t triangle) const {
        auto v = mesh_.corners(triangle);
        for (glm::dvec3& p : v) p = tree_.frame.gridFromWorld(p);
        return v;
    }

    OpenLevel rootLevel() {
        const RootGrid& frame = tree_.frame;
        const int size = 1 << frame.rootLevel;
        std::vector<std::vector<uint32_t>> bins(size_t(frame.roots.x) * frame.roots.y * frame.roots.z);
        for (uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
            const BoxOverlap overlap(inGrid(i));
            const glm::ivec3 low = glm::clamp(glm::ivec3(glm::floor((overlap.lower() - kTouch) / double(size))),
                                              glm::ivec3(0), frame.roots - 1);
            const glm::ivec3 high = glm::clamp(glm::ivec3(glm::floor((overlap.upper() + kTouch) / double(size))),
                                               glm::ivec3(0), frame.roots - 1);
            for (int z = low.z; z <= high.z; ++z)
                for (int y = low.y; y <= high.y; ++y)
                    for (int x = low.x; x <= high.x; ++x)
                        if (overlap.test((glm::dvec3(x, y, z) + 0.5) * double(size), 0.5 * size))
                            bins[(size_t(z) * frame.roots.y + y) * frame.roots.x + x].push_back(i);
        }
        OpenLevel level;
        for (size_t i = 0; i < bins.size(); ++i) {
            tree_.roots.push_back(bins[i].empty() ? VoxelOctree::kEmptyWord : int32_t(level.nodes.size()));
            if (bins[i].empty()) continue;
            const glm::ivec3 at(int(i) % frame.roots.x, int(i) / frame.roots.x % frame.roots.y,
                                int(i) / (frame.roots.x * frame.roots.y));
            const uint64_t first = level.triangles.size();
            level.triangles.insert(level.triangles.end(), bins[i].begin(), bins[i].end());
            level.nodes.push_back({at * size, first, level.triangles.size()});
        }
        return level;
    }

    /// What the nodes of a row of 256 become: descriptors with children counted from the row's first.
    struct SplitRow {
        std::vector<uint32_t> descriptors;
        OpenLevel children;
    };

    OpenLevel split(const OpenLevel& open, int level) {
        constexpr size_t kRow = 256;
        std::vector<SplitRow> rows((open.nodes.size() + kRow - 1) / kRow);
        forEachRow(int(rows.size()), threads_, [&](int row) {
            const size_t first = size_t(row) * kRow;
            for (size_t i = first; i < open.nodes.size() && i < first + kRow; ++i)
                splitNode(open, open.nodes[i], level, rows[row]);
        });
        OpenLevel children;
        for (SplitRow& row : rows) {
            const auto firstChild = uint32_t(children.nodes.size());
            for (const uint32_t descriptor : row.descriptors) {
                if (level == 1) {
                    tree_.masks.push_back(uint8_t(descriptor >> 24));
                    if (tree_.hasContours) tree_.firstContour.push_back((descriptor & 0xFFFFFFu) + firstChild);
                } else {
                    tree_.nodes.push_back((descriptor & 0xFF000000u) | ((descriptor & 0xFFFFFFu) + firstChild));
                }
            }
            const uint64_t firstTriangle = children.triangles.size();
            for (OpenNode node : row.children.nodes) {
                node.first += firstTriangle;
                node.end += firstTriangle;
                children.nodes.push_back(node);
            }
            children.triangles.insert(children.triangles.end(), row.children.triangles.begin(),
                                      row.children.triangles.end());
            row = {};
        }
        return children;
    }

    void splitNode(const OpenLevel& open, const OpenNode& node, int level, SplitRow& row) const {
        const int half = 1 << (level - 1);
        std::array<std::vector<uint32_t>, 8> inside;
        for (uint64_t i = node.first; i < node.end; ++i) {
            const BoxOverlap overlap(inGrid(open.triangles[i]));
            for (int k = 0; k < 8; ++k)
                if (overlap.test(glm::dvec3(node.low + half * octantOffset(k)) + 0.5 * half, 0.5 * half))
                    inside[k].push_back(open.triangles[i]);
        }
        auto descriptor = uint32_t(row.children.nodes.size());
        for (int k = 0; k < 8; ++k) {
            if (inside[k].empty()) continue;
            descriptor |= 1u << (24 + k);
            const uint64_t first = row.children.triangles.size();
            row.children.triangles.insert(row.children.triangles.end(), inside[k].begin(), inside[k].end());
            row.children.nodes.push_back({node.low + half * octantOffset(k), first, row.children.triangles.size()});
        }
        row.descriptors.push_back(descriptor);
    }

    void fitContours(const OpenLevel& voxels) {
        tree_.contours.resize(voxels.nodes.size());
        forEachIndex(voxels.nodes.size(), threads_, [&](size_t i) {
            const OpenNode& voxel = voxels.nodes[i];
            const glm::dvec3 centre = glm::dvec3(voxel.low) + 0.5;
            std::vector<glm::dvec3> points;
            glm::dvec3 sum(0), largest(0);
            for (uint64_t k = voxel.first; k < voxel.end; ++k) {
                Triangle3 triangle = inGrid(voxels.triangles[k]);
                for (glm::dvec3& p : triangle) p -= centre;
                Polygon polygon;
                clipToBox(triangle, glm::dvec3(-0.5 - kTouch), glm::dvec3(0.5 + kTouch), polygon);
                glm::dvec3 area(0);
                for (size_t corner = 0; corner < polygon.size(); ++corner) {
                    points.push_back(polygon[corner]);
                    if (corner >= 2) area += glm::cross(polygon[corner - 1] - polygon[0], polygon[corner] - polygon[0]);
                }
                sum += glm::dot(area, sum) < 0 ? -area : area;
                if (glm::dot(area, area) > glm::dot(largest, largest)) largest = area;
            }
            tree_.contours[i] = packContour(points, {sum, largest, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
        });
    }

    const IndexedMesh& mesh_;
    unsigned threads_;
    glm::dvec3 extent_{0};
    VoxelOctree tree_;
};

}  // namespace

uint32_t packContour(const std::vector<glm::dvec3>& points, const std::vector<glm::dvec3>& normals) {
    // Where there is nothing to enclose, the slab is the whole voxel.
    uint32_t best = 127u << 7 | 62u << 14 | 31u << 20 | 31u << 26;
    double bestWidth = std::numeric_limits<double>::infinity();
    if (points.empty()) return best;
    for (const glm::dvec3& wanted : normals) {
        const double longest = std::max({std::abs(wanted.x), std::abs(wanted.y), std::abs(wanted.z)});
        if (!(longest > 0)) continue;
        const glm::ivec3 n(glm::round(wanted * (31 / longest)));
        const double extent = extentAlong(glm::vec3(n));
        double low = extent, high = -extent;
        for (const glm::dvec3& p : points) {
            low = std::min(low, glm::dot(p, glm::dvec3(n)));
            high = std::max(high, glm::dot(p, glm::dvec3(n)));
        }
        const auto quantized = [&](double at) { return std::clamp((at / extent + 1) * 0.5, 0.0, 1.0) * 127; };
        // The planes are moved a little apart, so that single precision rounds nothing out of the slab.
        const auto lowCode = uint32_t(std::max(std::floor(quantized(low) - 1e-3), 0.0));
        const auto highCode = uint32_t(std::min(std::ceil(quantized(high) + 1e-3), 127.0));
        const double width = (highCode - lowCode) * extent / glm::length(glm::dvec3(n));
        if (width >= bestWidth) continue;
        bestWidth = width;
        best = lowCode | highCode << 7 | uint32_t(n.x + 31) << 14 | uint32_t(n.y + 31) << 20 | uint32_t(n.z + 31) << 26;
    }
    return best;
}

Result<VoxelOctree> buildVoxelOctree(const IndexedMesh& mesh, double cell, bool contours, unsigned threads) {
    return VoxelBuilder(mesh, cell, contours, threads).build();
}

}  // namespace vcp
