#include "builder/coarsen.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <glm/geometric.hpp>

#include "octree/leaf_math.h"
#include "octree/packing.h"

namespace vcp {

namespace {

constexpr int kClusterSteps = static_cast<int>(2 * kClusterCells * kLatticePerCell);  // of the finer lattice

struct Member {
    uint64_t cluster;
    uint32_t vertex;
};

/// Vertices grouped by cluster, in the order of the first vertex number within each.
std::vector<Member> groupByCluster(const LatticeMesh& mesh) {
    std::vector<Member> members(mesh.positions.size());
    for (size_t i = 0; i < members.size(); ++i) {
        const glm::i32vec3 c = mesh.positions[i] / kClusterSteps;
        members[i] = {uint64_t(uint32_t(c.x)) | uint64_t(uint32_t(c.y)) << 21 | uint64_t(uint32_t(c.z)) << 42, static_cast<uint32_t>(i)};
    }
    std::sort(members.begin(), members.end(), [](const Member& a, const Member& b) { return a.cluster != b.cluster ? a.cluster < b.cluster : a.vertex < b.vertex; });
    return members;
}

/// Half of a coordinate, rounded to nearest; positions are not negative.
int32_t halved(double fine) { return static_cast<int32_t>(std::llround(fine / 2)); }

}  // namespace

Clusters clusterVertices(const LatticeMesh& fine) {
    const std::vector<Member> members = groupByCluster(fine);
    Clusters clusters;
    clusters.of.resize(fine.positions.size());
    for (size_t begin = 0, end = 0; begin < members.size(); begin = end) {
        glm::dvec3 mean(0), normal(0);
        uint64_t channel[4] = {};
        bool crease = false;
        for (end = begin; end < members.size() && members[end].cluster == members[begin].cluster; ++end) {
            const uint32_t v = members[end].vertex;
            clusters.of[v] = static_cast<uint32_t>(clusters.position.size());
            mean += glm::dvec3(fine.positions[v]);
            const glm::dvec3 n = f64::decodeNormal(fine.normals[v]);
            normal += glm::dot(n, normal) < 0 ? -n : n;
            crease |= (fine.normals[v] & kNormalCreaseBit) != 0;
            if (!fine.colours.empty())
                for (int c = 0; c < 4; ++c) channel[c] += fine.colours[v] >> 8 * c & 255u;
        }
        const uint64_t count = end - begin;
        mean /= double(count);
        clusters.position.emplace_back(halved(mean.x), halved(mean.y), halved(mean.z));
        const double length = glm::length(normal);
        clusters.normal.push_back(packNormal(length > 0 ? normal / length : glm::dvec3(0, 0, 1), crease));
        if (!fine.colours.empty()) {
            uint32_t colour = 0;
            for (int c = 0; c < 4; ++c) colour |= static_cast<uint32_t>((channel[c] + count / 2) / count) << 8 * c;
            clusters.colour.push_back(colour);
        }
    }
    return clusters;
}

}  // namespace vcp
