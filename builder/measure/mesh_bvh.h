// MeshBvh answers two questions about a mesh exactly, in double precision: the nearest point, and what a ray hits. It
// is the oracle that everything rendered is measured against, so it shares no code with the octree or its builder.
//
// Rays: the watertight test of Woop, Benthin and Wald 2013 in double, edges and vertices inclusive. A sheared
// edge function is a difference of two products; rounding keeps its sign or makes it zero, and zero counts
// as inside. So a ray cannot pass between two triangles that share an edge or around a vertex; it may
// report both of them. Boxes are widened by the rounding of the ray's transformation.
//
// Closest points: all coordinates are taken relative to the query. The three edges are always tried, the
// interior where the foot of the perpendicular is inside. The answer is a point of the triangle in any case,
// to within rounding: it never understates a distance, however thin the triangle; triangles that are a segment
// or a point are answered as such.
//
// A binned SAH tree, built on one thread; about 40 bytes a triangle beside the mesh.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/measure/indexed_mesh.h"

namespace vcp {

/// The distance within which everything lies.
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct NearestPoint {
    glm::dvec3 point{0};
    double distance = kInfinity;
    uint32_t triangle = 0;
};

/// Returns the closest point of triangle a b c to p. Exact to rounding for slivers, segments and points.
glm::dvec3 closestPointOfTriangle(glm::dvec3 p, glm::dvec3 a, glm::dvec3 b, glm::dvec3 c);

struct MeshHit {
    double t = 0;  ///< in units of |direction|
    uint32_t triangle = 0;
    glm::dvec3 normal{0};  ///< unit normal of the triangle, on the side from which its vertices turn left
};

class MeshBvh {
public:
    /// `mesh` must outlive the tree, and have fewer than 2^31 triangles; positions finite.
    explicit MeshBvh(const IndexedMesh& mesh);

    /// Returns the nearest point of the mesh within `within` of p; any one among equals. Any thread.
    [[nodiscard]] std::optional<NearestPoint> nearestPoint(glm::dvec3 p, double within = kInfinity) const;

    /// Returns the first hit with tMin <= t <= tMax. Triangles seen exactly edge-on are not hit. Any thread.
    [[nodiscard]] std::optional<MeshHit> nearestHit(glm::dvec3 origin, glm::dvec3 direction, double tMin = 0,
                                                    double tMax = kInfinity) const;
    [[nodiscard]] bool anyHit(glm::dvec3 origin, glm::dvec3 direction, double tMin, double tMax) const;
    /// Returns every hit, sorted by t. A ray through a shared edge reports both triangles.
    [[nodiscard]] std::vector<MeshHit> allHits(glm::dvec3 origin, glm::dvec3 direction, double tMin = 0,
                                               double tMax = kInfinity) const;

    /// Returns the triangles whose boxes touch the box low, high. Any thread.
    [[nodiscard]] std::vector<uint32_t> trianglesNear(glm::dvec3 low, glm::dvec3 high) const;

    [[nodiscard]] const IndexedMesh& mesh() const { return *mesh_; }
    [[nodiscard]] glm::dvec3 low() const { return nodes_.empty() ? glm::dvec3(0) : nodes_[0].low; }
    [[nodiscard]] glm::dvec3 high() const { return nodes_.empty() ? glm::dvec3(0) : nodes_[0].high; }

private:
    struct Node {
        glm::dvec3 low, high;
        uint32_t first;  ///< first of the two children, or first triangle in order_
        uint32_t count;  ///< number of triangles; 0 for an inner node
    };
    struct WoopRay;

    void split(uint32_t node, std::vector<glm::dvec3>& centres);
    void fitNode(Node& node) const;
    template <class Visit>
    void walkRay(const WoopRay& ray, double tMin, double& tMax, const Visit& visit) const;

    const IndexedMesh* mesh_;
    std::vector<Node> nodes_;
    std::vector<uint32_t> order_;  ///< triangles, leaf by leaf
};

}  // namespace vcp
