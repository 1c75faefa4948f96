#include "builder/level/coarsen.h"

#include <algorithm>
#include <array>
#include <optional>

#include <glm/geometric.hpp>

#include "builder/level/stray_bound.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

constexpr uint32_t kNone = VertexClusters::kNone;

using Index3 = std::array<uint32_t, 3>;

bool lessThan(glm::i32vec3 a, glm::i32vec3 b) { return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z; }

class Emitter {
public:
    Emitter(const LatticeMesh& fine, const VertexClusters& clusters) : fine_(fine), clusters_(clusters) {}

    CoarseTriangles run() {
        out_.mesh.positions = clusters_.positions;
        out_.mesh.colours = clusters_.colours;
        out_.mesh.normals = clusters_.normals;
        emitImages();
        indexFans();
        keepLines();
        keepPoints();
        return std::move(out_);
    }

private:
    [[nodiscard]] Index3 imageCorners(uint32_t k) const {
        Index3 c;
        for (int i = 0; i < 3; ++i) c[i] = clusters_.ofVertex[fine_.triangles[k][i]];
        std::sort(c.begin(), c.end());
        return c;
    }

    [[nodiscard]] bool isLongFine(uint32_t k) const {
        const auto& t = fine_.triangles[k];
        return isLong(fine_.positions[t[0]], fine_.positions[t[1]], fine_.positions[t[2]]);
    }

    void emitImages() {
        struct Image {
            Index3 corners;
            uint32_t fine;
        };
        std::vector<Image> images;
        const auto& p = clusters_.positions;
        for (uint32_t k = 0; k < fine_.triangles.size(); ++k) {
            const Index3 c = imageCorners(k);
            if (isLongFine(k)) continue;
            if (c[0] != c[1] && c[1] != c[2] && hasArea(p[c[0]], p[c[1]], p[c[2]]))
                images.push_back({c, k});
            else
                collapsed_.push_back(k);
        }
        std::sort(images.begin(), images.end(), [](const Image& a, const Image& b) { return a.corners < b.corners; });
        out_.imageOf.assign(fine_.triangles.size(), kNone);
        for (const Image& image : images) {
            if (out_.mesh.triangles.empty() || out_.mesh.triangles.back() != image.corners)
                out_.mesh.triangles.push_back(image.corners);
            out_.imageOf[image.fine] = uint32_t(out_.mesh.triangles.size() - 1);
        }
    }

    void indexFans() {
        fanBegin_.assign(clusters_.positions.size() + 1, 0);
        for (const Index3& t : out_.mesh.triangles)
            for (const uint32_t c : t) ++fanBegin_[c + 1];
        for (size_t c = 0; c + 1 < fanBegin_.size(); ++c) fanBegin_[c + 1] += fanBegin_[c];
        fans_.resize(fanBegin_.back());
        std::vector<uint32_t> next(fanBegin_.begin(), fanBegin_.end() - 1);
        for (uint32_t k = 0; k < out_.mesh.triangles.size(); ++k)
            for (const uint32_t c : out_.mesh.triangles[k]) fans_[next[c]++] = k;
        used_.assign(clusters_.positions.size(), false);
        for (size_t c = 0; c < used_.size(); ++c) used_[c] = fanBegin_[c] != fanBegin_[c + 1];
    }

    [[nodiscard]] bool isEdge(uint32_t a, uint32_t b) const {
        if (fanBegin_[a + 1] - fanBegin_[a] > fanBegin_[b + 1] - fanBegin_[b]) std::swap(a, b);
        for (uint32_t i = fanBegin_[a]; i < fanBegin_[a + 1]; ++i) {
            const Index3& t = out_.mesh.triangles[fans_[i]];
            if (t[0] == b || t[1] == b || t[2] == b) return true;
        }
        return false;
    }

    /// Keeps images that are lines and no other image's edge.
    void keepLines() {
        struct Line {
            uint32_t a, b, fine;
        };
        std::vector<Line> lines;
        for (const uint32_t k : collapsed_) {
            const Index3 c = imageCorners(k);
            for (const auto& [a, b] : {std::pair(c[0], c[1]), std::pair(c[1], c[2]), std::pair(c[0], c[2])})
                if (a != b && !isEdge(a, b)) lines.push_back({a, b, k});
        }
        std::sort(lines.begin(), lines.end(),
                  [](const Line& x, const Line& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
        for (size_t begin = 0, end = 0; begin < lines.size(); begin = end) {
            Farthest farthest(clusters_.positions[lines[begin].a], clusters_.positions[lines[begin].b]);
            for (end = begin; end < lines.size() && lines[end].a == lines[begin].a && lines[end].b == lines[begin].b;
                 ++end)
                for (const uint32_t v : fine_.triangles[lines[end].fine]) farthest.offer(v, fine_.positions[v]);
            keep(lines[begin].a, lines[begin].b, farthest);
            used_[lines[begin].a] = used_[lines[begin].b] = true;
        }
    }

    /// Keeps images that are points and no other image's corner.
    void keepPoints() {
        struct Point {
            uint32_t cluster, fine;
        };
        std::vector<Point> points;
        for (const uint32_t k : collapsed_)
            if (const uint32_t c = imageCorners(k)[0]; !used_[c]) points.push_back({c, k});
        std::sort(points.begin(), points.end(), [](const Point& x, const Point& y) { return x.cluster < y.cluster; });
        for (size_t begin = 0, end = 0; begin < points.size(); begin = end) {
            const uint32_t c = points[begin].cluster;
            Farthest first(clusters_.positions[c], clusters_.positions[c]);
            for (end = begin; end < points.size() && points[end].cluster == c; ++end)
                for (const uint32_t v : fine_.triangles[points[end].fine]) first.offer(v, fine_.positions[v]);
            const uint32_t b = addVertex(first, c, {1, 0, 0});
            Farthest second(clusters_.positions[c], out_.mesh.positions[b]);
            for (size_t i = begin; i < end; ++i)
                for (const uint32_t v : fine_.triangles[points[i].fine]) second.offer(v, fine_.positions[v]);
            keep(c, b, second);
        }
    }

    /// Finds the vertex farthest from a line, or from a point, on the coarser lattice; ties by position.
    class Farthest {
    public:
        Farthest(glm::i32vec3 a, glm::i32vec3 b) : a_(a), along_(b - a) {}
        void offer(uint32_t vertex, glm::i32vec3 fine) {
            const glm::dvec3 d = glm::dvec3(fine >> 1) - a_;
            const glm::dvec3 away = along_ == glm::dvec3(0) ? d : glm::cross(along_, d);
            const double squared = glm::dot(away, away);
            if (squared == 0 || squared < squared_ || (squared == squared_ && !lessThan(fine, fine_))) return;
            squared_ = squared;
            vertex_ = vertex;
            fine_ = fine;
        }
        [[nodiscard]] std::optional<uint32_t> vertex() const {
            return squared_ > 0 ? std::optional(vertex_) : std::nullopt;
        }

    private:
        glm::dvec3 a_, along_;
        double squared_ = 0;
        uint32_t vertex_ = 0;
        glm::i32vec3 fine_{0};
    };

    /// Adds a vertex of the finer mesh as it is, or if there is none, a step away from a cluster's.
    uint32_t addVertex(const Farthest& farthest, uint32_t cluster, glm::i32vec3 step) {
        const std::optional<uint32_t> v = farthest.vertex();
        LatticeMesh& mesh = out_.mesh;
        mesh.positions.push_back(v ? fine_.positions[*v] >> 1 : mesh.positions[cluster] + step);
        if (!mesh.colours.empty()) mesh.colours.push_back(v ? fine_.colours[*v] : mesh.colours[cluster]);
        if (!mesh.normals.empty()) mesh.normals.push_back(v ? fine_.normals[*v] : mesh.normals[cluster]);
        return uint32_t(mesh.positions.size() - 1);
    }

    void keep(uint32_t a, uint32_t b, const Farthest& farthest) {
        const glm::i32vec3 along = out_.mesh.positions[b] - out_.mesh.positions[a];
        const glm::i32vec3 step = along.y == 0 && along.z == 0 ? glm::i32vec3(0, 1, 0) : glm::i32vec3(1, 0, 0);
        uint32_t c = addVertex(farthest, a, step);
        const auto& p = out_.mesh.positions;
        if (!hasArea(p[a], p[b], p[c])) c = addVertex(Farthest(p[a], p[a]), a, step);
        out_.mesh.triangles.push_back({a, b, c});
    }

    const LatticeMesh& fine_;
    const VertexClusters& clusters_;
    CoarseTriangles out_;
    std::vector<uint32_t> collapsed_;        ///< short fine triangles
    std::vector<uint32_t> fanBegin_, fans_;  ///< images at each cluster
    std::vector<bool> used_;                 ///< whether a cluster is a corner of something
};

}  // namespace

CoarseTriangles coarseTriangles(const LatticeMesh& fine, const VertexClusters& clusters) {
    return Emitter(fine, clusters).run();
}

LatticeTriangle longImage(const LatticeTriangle& fine, const VertexImage (&image)[3]) {
    LatticeTriangle t;
    for (int i = 0; i < 3; ++i) {
        t.corner[i] = image[i].position;
        t.colour[i] = image[i].colour;
        t.normal[i] = image[i].normal;
    }
    double moved = 0;
    for (int i = 0; i < 3; ++i)
        moved = std::max(moved, glm::length(glm::dvec3(fine.corner[i]) / 2.0 - glm::dvec3(image[i].position)));
    t.stray = std::nextafter(float(moved / kLatticePerCell + double(fine.stray) / 2), 1e9f);
    if (hasArea(t.corner[0], t.corner[1], t.corner[2])) return t;
    // The thin triangle lies along the longest side, with the third corner where the mesh had it; ties by that.
    int from = 0;
    double longest = -1;
    for (int i = 0; i < 3; ++i) {
        const double length = glm::length(glm::dvec3(t.corner[(i + 1) % 3] - t.corner[i]));
        if (length < longest || (length == longest && !lessThan(fine.corner[(i + 2) % 3], fine.corner[(from + 2) % 3])))
            continue;
        longest = length;
        from = i;
    }
    const glm::i32vec3 a = t.corner[from], b = t.corner[(from + 1) % 3];
    glm::i32vec3& third = t.corner[(from + 2) % 3];
    third = fine.corner[(from + 2) % 3] >> 1;
    const glm::i32vec3 along = b - a;
    if (!hasArea(a, b, third))
        third = a + (along.y == 0 && along.z == 0 ? glm::i32vec3(0, 1, 0) : glm::i32vec3(1, 0, 0));
    return t;
}

LatticeMesh coarsen(const LatticeMesh& fine) {
    const VertexClusters clusters = clusterVertices(fine);
    CoarseTriangles coarse = coarseTriangles(fine, clusters);
    coarse.mesh.stray = boundStray(fine, clusters, coarse);
    std::vector<LatticeTriangle> soup;
    const auto corner = [](const LatticeMesh& mesh, uint32_t v, LatticeTriangle& t, int i) {
        t.corner[i] = mesh.positions[v];
        t.colour[i] = mesh.colours.empty() ? 0xffffffffu : mesh.colours[v];
        t.normal[i] = mesh.normals.empty() ? 0 : mesh.normals[v];
    };
    for (size_t k = 0; k < coarse.mesh.triangles.size(); ++k) {
        LatticeTriangle& t = soup.emplace_back();
        for (int i = 0; i < 3; ++i) corner(coarse.mesh, coarse.mesh.triangles[k][i], t, i);
        t.stray = coarse.mesh.stray[k];
    }
    for (size_t k = 0; k < fine.triangles.size(); ++k) {
        const auto& f = fine.triangles[k];
        if (!isLong(fine.positions[f[0]], fine.positions[f[1]], fine.positions[f[2]])) continue;
        LatticeTriangle from;
        from.stray = fine.stray[k];
        VertexImage image[3];
        for (int i = 0; i < 3; ++i) {
            corner(fine, f[i], from, i);
            const uint32_t c = clusters.ofVertex[f[i]];
            image[i] = {clusters.positions[c], clusters.colours.empty() ? 0xffffffffu : clusters.colours[c],
                        clusters.normals.empty() ? 0 : clusters.normals[c]};
        }
        soup.push_back(longImage(from, image));
    }
    return meshOf(soup, !fine.colours.empty());
}

}  // namespace vcp
