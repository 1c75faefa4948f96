#include "builder/level/vertex_clusters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/stream/colour_encoding.h"
#include "octree/surface/leaf_math.h"
#include "octree/surface/morton.h"
#include "octree/surface/packing.h"

namespace vcp {

namespace {

// A coarse cell, in steps of the finer lattice.
constexpr int kCoarseCell = 2 * kLatticePerCell;
constexpr int kLargestCube = int(kLargestClusterCells * kCoarseCell);
constexpr int kSmallestCube = int(kSmallestClusterCells * kCoarseCell);

// Sums are of integers, so that their order does not matter: reals are rounded to multiples of this.
constexpr double kFixedPoint = 1 << 30;

// The share of the planes' weight that draws a vertex to the mean of its cluster where the planes leave it free.
constexpr double kMeanWeight = 0.01;

// The cosine of half the angle between the two triangles of an edge, above which the surface turns back there.
constexpr double kTurningBack = 0.8;

// The mean of the directions of a vertex' edges, above which it is a tip; in the middle of a border it is 0.64.
constexpr double kTip = 0.8;

constexpr double kCreaseCosine = 0.766;  // 40 degrees

int64_t fixed(double x) { return int64_t(x * kFixedPoint); }

/// The order of components is xx yy zz yz zx xy.
using Symmetric3 = std::array<double, 6>;

/// Returns the eigenvector of the largest eigenvalue, by Jacobi rotations.
glm::dvec3 dominantDirection(const Symmetric3& m) {
    double a[3][3] = {{m[0], m[5], m[4]}, {m[5], m[1], m[3]}, {m[4], m[3], m[2]}};
    double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int sweep = 0; sweep < 12; ++sweep) {
        const double off = std::abs(a[0][1]) + std::abs(a[0][2]) + std::abs(a[1][2]);
        if (off <= 1e-12 * (std::abs(a[0][0]) + std::abs(a[1][1]) + std::abs(a[2][2]))) break;
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                if (a[p][q] == 0) continue;
                const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (auto& row : a) {
                    const double x = row[p], y = row[q];
                    row[p] = c * x - s * y;
                    row[q] = s * x + c * y;
                }
                for (int k = 0; k < 3; ++k) {
                    const double x = a[p][k], y = a[q][k];
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                    const double g = v[k][p], h = v[k][q];
                    v[k][p] = c * g - s * h;
                    v[k][q] = s * g + c * h;
                }
            }
    }
    const int k = a[0][0] >= a[1][1] && a[0][0] >= a[2][2] ? 0 : a[1][1] >= a[2][2] ? 1 : 2;
    return glm::normalize(glm::dvec3(v[0][k], v[1][k], v[2][k]));
}

/// A sum of squared distances to planes, as integers.
struct Quadric {
    std::array<int64_t, 6> a{};
    std::array<int64_t, 3> b{};

    void add(glm::dvec3 n, double offset, double weight) {
        a[0] += fixed(weight * n.x * n.x), a[1] += fixed(weight * n.y * n.y), a[2] += fixed(weight * n.z * n.z);
        a[3] += fixed(weight * n.y * n.z), a[4] += fixed(weight * n.z * n.x), a[5] += fixed(weight * n.x * n.y);
        for (int i = 0; i < 3; ++i) b[i] += fixed(weight * offset * n[i]);
    }
    void add(const Quadric& q) {
        for (int i = 0; i < 6; ++i) a[i] += q.a[i];
        for (int i = 0; i < 3; ++i) b[i] += q.b[i];
    }
    [[nodiscard]] Symmetric3 matrix() const {
        Symmetric3 m;
        for (int i = 0; i < 6; ++i) m[i] = double(a[i]);
        return m;
    }
    /// Returns the minimiser, drawn to `mean`.
    [[nodiscard]] glm::dvec3 minimiser(glm::dvec3 mean) const {
        Symmetric3 m = matrix();
        const double pull = kMeanWeight * (m[0] + m[1] + m[2]);
        for (int i = 0; i < 3; ++i) m[i] += pull;
        const glm::dvec3 x(m[0], m[5], m[4]), y(m[5], m[1], m[3]), z(m[4], m[3], m[2]);
        const glm::dvec3 rhs = glm::dvec3(b[0], b[1], b[2]) + pull * mean;
        const glm::dvec3 yz = glm::cross(y, z);
        const double det = glm::dot(x, yz);
        if (!(det > 0)) return mean;
        return glm::dvec3(glm::dot(rhs, yz), glm::dot(x, glm::cross(rhs, z)), glm::dot(x, glm::cross(y, rhs))) / det;
    }
};

class Clusterer {
public:
    explicit Clusterer(const LatticeMesh& mesh) : mesh_(mesh) { indexTriangles(); }

    VertexClusters run() {
        out_.ofVertex.assign(mesh_.positions.size(), VertexClusters::kNone);
        struct Keyed {
            uint64_t cube;
            uint32_t vertex;
        };
        std::vector<Keyed> order;
        order.reserve(mesh_.positions.size());
        for (uint32_t v = 0; v < mesh_.positions.size(); ++v)
            if (begin_[v] != begin_[v + 1])
                order.push_back({mortonEncode(glm::u32vec3(mesh_.positions[v] / kLargestCube)), v});
        std::sort(order.begin(), order.end(), [](const Keyed& a, const Keyed& b) {
            return a.cube != b.cube ? a.cube < b.cube : a.vertex < b.vertex;
        });
        for (size_t begin = 0, end = 0; begin < order.size(); begin = end) {
            members_.clear();
            for (end = begin; end < order.size() && order[end].cube == order[begin].cube; ++end)
                members_.push_back({.vertex = order[end].vertex});
            const glm::i32vec3 lower = mesh_.positions[members_[0].vertex] / kLargestCube * kLargestCube;
            centre_ = glm::dvec3(lower) / double(kCoarseCell) + kLargestClusterCells / 2;
            describeMembers();
            cluster(members_, lower, kLargestCube);
        }
        return std::move(out_);
    }

private:
    struct Member {
        uint32_t vertex;
        bool stays = false;    ///< its motion counts: a long triangle uses it, or it is a tip
        uint32_t planes = 0;   ///< first of its planes in planes_
        uint32_t borders = 0;  ///< first of its planes at borders
        uint32_t end = 0;
        glm::dvec3 point{0};  ///< in coarse cells from centre_
        Quadric quadric{};
    };
    struct Plane {
        glm::dvec3 normal;
        double offset;
    };
    using Members = std::span<Member>;

    void indexTriangles() {
        begin_.assign(mesh_.positions.size() + 1, 0);
        for (const auto& t : mesh_.triangles)
            for (const uint32_t v : t) ++begin_[v + 1];
        for (size_t v = 0; v < mesh_.positions.size(); ++v) begin_[v + 1] += begin_[v];
        incident_.resize(begin_.back());
        std::vector<uint32_t> next(begin_.begin(), begin_.end() - 1);
        for (uint32_t k = 0; k < mesh_.triangles.size(); ++k)
            for (const uint32_t v : mesh_.triangles[k]) incident_[next[v]++] = k;
    }

    void describeMembers() {
        planes_.clear();
        for (Member& m : members_) {
            m.point = glm::dvec3(mesh_.positions[m.vertex]) / double(kCoarseCell) - centre_;
            m.planes = uint32_t(planes_.size());
            edges_.clear();
            for (uint32_t i = begin_[m.vertex]; i < begin_[m.vertex + 1]; ++i) addTriangle(m, incident_[i]);
            m.borders = uint32_t(planes_.size());
            addBorders(m);
            m.end = uint32_t(planes_.size());
        }
    }

    void addTriangle(Member& m, uint32_t k) {
        const auto& t = mesh_.triangles[k];
        const glm::i32vec3 a = mesh_.positions[t[0]], b = mesh_.positions[t[1]], c = mesh_.positions[t[2]];
        m.stays = m.stays || isLong(a, b, c);
        // The product is exact, so whichever corner comes first, only the sign can differ.
        const glm::dvec3 n = glm::cross(glm::dvec3(b - a), glm::dvec3(c - a));
        const double length = glm::length(n);
        const glm::dvec3 unit = n / length;
        planes_.push_back({unit, glm::dot(unit, m.point)});
        const double weight = std::min(length / (2.0 * kCoarseCell * kCoarseCell), 1.0);
        m.quadric.add(unit, planes_.back().offset, weight);
        for (int i = 0; i < 3; ++i) {
            if (t[i] == m.vertex) continue;
            // The third corner is neither this vertex nor the member's.
            const uint32_t third = t[0] + t[1] + t[2] - t[i] - m.vertex;
            const glm::dvec3 v(mesh_.positions[m.vertex]);
            const glm::dvec3 along = glm::dvec3(mesh_.positions[t[i]]) - v;
            edges_.push_back({t[i], along, upright(along, glm::dvec3(mesh_.positions[third]) - v)});
        }
    }

    /// Returns the direction in the plane of `along` and `to`, upright on `along`, on the side of `to`.
    static glm::dvec3 upright(glm::dvec3 along, glm::dvec3 to) {
        return glm::normalize(glm::cross(glm::cross(along, to), along));
    }

    /// Adds planes upright on the edges where the surface ends or turns back: there all triangles are on one side. A
    /// vertex with all of its edges on one side is a tip, which planes do not hold.
    void addBorders(Member& m) {
        std::sort(edges_.begin(), edges_.end(), [](const Edge& a, const Edge& b) { return a.other < b.other; });
        Quadric direction;  // used for its sums in integers
        int64_t count = 0;
        for (size_t i = 0, end = 0; i < edges_.size(); i = end) {
            glm::dvec3 inward(0);
            for (end = i; end < edges_.size() && edges_[end].other == edges_[i].other; ++end)
                inward += edges_[end].inward;
            const double length = glm::length(edges_[i].along);
            direction.add(edges_[i].along / length, 1, 1);
            ++count;
            // Sums of three and more may depend on their order in the last bit, so such edges are no borders.
            if (end - i > 2 || glm::length(inward) < kTurningBack * double(end - i)) continue;
            const glm::dvec3 n = glm::normalize(inward);
            planes_.push_back({n, glm::dot(n, m.point)});
            const double cells = std::min(length / kCoarseCell, 1.0);
            m.quadric.add(n, planes_.back().offset, cells * cells);
        }
        const glm::dvec3 sum = glm::dvec3(direction.b[0], direction.b[1], direction.b[2]) / kFixedPoint;
        m.stays = m.stays || glm::length(sum) > kTip * double(count);
    }

    /// Makes one cluster of the members, which lie in the cube, or clusters of its octants.
    void cluster(Members members, glm::i32vec3 lower, int edge) {
        if (members.empty()) return;
        if (members.size() == 1) return emit(members, members[0].point, lower, edge);
        Quadric sum;
        glm::i64vec3 total(0);
        for (const Member& m : members) {
            sum.add(m.quadric);
            total += glm::i64vec3(mesh_.positions[m.vertex]);
        }
        const glm::dvec3 mean = glm::dvec3(total) / (double(members.size()) * kCoarseCell) - centre_;
        const glm::dvec3 low = glm::dvec3(lower) / double(kCoarseCell) - centre_;
        glm::dvec3 best = glm::clamp(sum.minimiser(mean), low, low + double(edge) / kCoarseCell);
        double error = errorOf(members, best, sum);
        if (error > kClusterErrorCells) {
            const double ofMean = errorOf(members, mean, sum);
            if (ofMean < error) {
                best = mean;
                error = ofMean;
            }
        }
        if (error <= kClusterErrorCells || edge <= kSmallestCube) return emit(members, best, lower, edge);
        Member* begin = members.data();
        for (int octant = 0; octant < 8; ++octant) {
            const glm::i32vec3 corner = lower + (edge / 2) * glm::i32vec3(octant & 1, octant >> 1 & 1, octant >> 2);
            const auto inside = [&](const Member& m) {
                const glm::i32vec3 d = mesh_.positions[m.vertex] - corner;
                return std::max({d.x, d.y, d.z}) < edge / 2 && std::min({d.x, d.y, d.z}) >= 0;
            };
            Member* end = std::partition(begin, members.data() + members.size(), inside);
            cluster({begin, end}, corner, edge / 2);
            begin = end;
        }
    }

    /// Estimates how far the surface would move: the least of three views of it, as planes, as one rough sheet and as
    /// points.
    double errorOf(Members members, glm::dvec3 r, const Quadric& sum) const {
        double planes = 0, borders = 0, motion = 0, staying = 0;
        for (const Member& m : members) {
            for (uint32_t i = m.planes; i < m.borders; ++i)
                planes = std::max(planes, std::abs(glm::dot(planes_[i].normal, r) - planes_[i].offset));
            for (uint32_t i = m.borders; i < m.end; ++i)
                borders = std::max(borders, std::abs(glm::dot(planes_[i].normal, r) - planes_[i].offset));
            const double moved = glm::distance(m.point, r);
            motion = std::max(motion, moved);
            if (m.stays) staying = std::max(staying, moved);
        }
        double error = std::max(planes, borders);
        if (error > kClusterErrorCells && borders <= kClusterErrorCells) {
            const glm::dvec3 n = dominantDirection(sum.matrix());
            double sheet = borders;
            for (const Member& m : members) sheet = std::max(sheet, std::abs(glm::dot(n, m.point - r)));
            error = std::min(error, sheet);
        }
        return std::max(std::min(error, motion), staying);
    }

    void emit(Members members, glm::dvec3 r, glm::i32vec3 lower, int edge) {
        const uint32_t number = uint32_t(out_.positions.size());
        for (const Member& m : members) out_.ofVertex[m.vertex] = number;
        // The point stays within the half-open cube, so that no two clusters meet in a point.
        const glm::dvec3 steps = glm::round((centre_ + r) * double(kLatticePerCell));
        out_.positions.push_back(glm::clamp(glm::i32vec3(steps), lower / 2, (lower + edge) / 2 - 1));
        if (!mesh_.colours.empty()) out_.colours.push_back(meanColour(members));
        if (!mesh_.normals.empty()) out_.normals.push_back(meanNormal(members));
    }

    uint32_t meanColour(Members members) const {
        LightMean light;
        for (const Member& m : members) light.add(mesh_.colours[m.vertex]);
        return light.mean();
    }

    uint32_t meanNormal(Members members) const {
        if (members.size() == 1) return mesh_.normals[members[0].vertex];
        Quadric sum;
        bool crease = false;
        for (const Member& m : members) {
            sum.add(f64::decodeNormal(mesh_.normals[m.vertex]), 0, 1);
            crease = crease || (mesh_.normals[m.vertex] & kNormalCreaseBit) != 0;
        }
        const glm::dvec3 n = dominantDirection(sum.matrix());
        for (const Member& m : members)
            crease = crease || std::abs(glm::dot(n, f64::decodeNormal(mesh_.normals[m.vertex]))) < kCreaseCosine;
        return packNormal(n, crease);
    }

    /// An edge, at a member, of one of its triangles.
    struct Edge {
        uint32_t other;
        glm::dvec3 along, inward;
    };

    const LatticeMesh& mesh_;
    VertexClusters out_;
    std::vector<uint32_t> begin_, incident_;  ///< triangles at each vertex
    glm::dvec3 centre_{0};                    ///< centre of the largest cube, coarse cells
    std::vector<Member> members_;
    std::vector<Plane> planes_;
    std::vector<Edge> edges_;
};

}  // namespace

VertexClusters clusterVertices(const LatticeMesh& fine) { return Clusterer(fine).run(); }

bool isLong(glm::i32vec3 a, glm::i32vec3 b, glm::i32vec3 c) {
    const glm::i32vec3 extent = glm::max(a, glm::max(b, c)) - glm::min(a, glm::min(b, c));
    return std::max({extent.x, extent.y, extent.z}) > kShortTriangleCells * kLatticePerCell;
}

}  // namespace vcp
