#include "builder/coarsen.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <glm/geometric.hpp>

#include "octree/leaf_math.h"

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

LatticeMesh coarsen(const LatticeMesh& fine) {
    const std::vector<Member> members = groupByCluster(fine);
    LatticeMesh coarse;
    std::vector<uint32_t> renamed(fine.positions.size());
    for (size_t begin = 0, end = 0; begin < members.size(); begin = end) {
        glm::dvec3 mean(0);
        uint64_t channel[4] = {};
        for (end = begin; end < members.size() && members[end].cluster == members[begin].cluster; ++end) {
            const uint32_t v = members[end].vertex;
            mean += glm::dvec3(fine.positions[v]);
            if (!fine.colours.empty())
                for (int c = 0; c < 4; ++c) channel[c] += fine.colours[v] >> 8 * c & 255u;
        }
        const uint64_t count = end - begin;
        mean /= double(count);
        const glm::i32vec3 p(halved(mean.x), halved(mean.y), halved(mean.z));
        float stray = 0;
        for (size_t i = begin; i < end; ++i) {
            const uint32_t v = members[i].vertex;
            renamed[v] = static_cast<uint32_t>(coarse.positions.size());
            const double moved = glm::length(glm::dvec3(fine.positions[v]) / 2.0 - glm::dvec3(p)) / kLatticePerCell;
            stray = std::max(stray, static_cast<float>(fine.stray[v] / 2 + moved));
        }
        coarse.positions.push_back(p);
        coarse.stray.push_back(std::nextafter(stray, 1e9f));
        if (!fine.colours.empty()) {
            uint32_t colour = 0;
            for (int c = 0; c < 4; ++c) colour |= static_cast<uint32_t>((channel[c] + count / 2) / count) << 8 * c;
            coarse.colours.push_back(colour);
        }
    }
    coarse.triangles.reserve(fine.triangles.size());
    for (const auto& t : fine.triangles) {
        const std::array<uint32_t, 3> r{renamed[t[0]], renamed[t[1]], renamed[t[2]]};
        if (r[0] != r[1] && r[1] != r[2] && r[2] != r[0]) coarse.triangles.push_back(r);
    }
    weld(coarse);
    return coarse;
}

}  // namespace vcp
