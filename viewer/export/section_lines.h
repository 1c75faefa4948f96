// The lines in which a plane cuts triangles, joined into polylines.
//
// A vertex on the plane counts as above it, so a triangle is cut through two of its edges or not at all, and triangles
// that share an edge share the point on it, bit for bit. Lines end at borders, and where more than two cut triangles
// share an edge. Memory: some 300 bytes for each triangle that is cut.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "viewer/export/surface_stream.h"

namespace vcp {

struct Polyline {
    std::vector<glm::dvec3> points = {};  ///< world units; of a closed line the first does not come again
    bool isClosed = false;
};

class SectionLines {
public:
    explicit SectionLines(const CutPlane& plane) : plane_(plane) {}

    /// Cuts triangles; one that comes again, with the same corners, counts once.
    void add(std::span<const Facet> facets);
    /// Returns the lines, in an order that depends on the triangles alone, not on the order in which they came.
    [[nodiscard]] std::vector<Polyline> join() const;

private:
    /// Both ends of an edge, the smaller first: what the point on it is known by.
    struct EdgePoint {
        std::array<double, 6> edge;
        glm::dvec3 at;
    };
    using Segment = std::array<EdgePoint, 2>;

    [[nodiscard]] EdgePoint crossing(glm::dvec3 a, glm::dvec3 b) const;
    [[nodiscard]] double height(glm::dvec3 p) const;

    CutPlane plane_;
    std::vector<Segment> segments_;
};

/// Returns the length of a line, world units.
double lengthOf(const Polyline& line);

/// Axes in a plane: a drawing's x and y, and what point of the world its origin is.
struct PlaneAxes {
    glm::dvec3 origin{0}, x{1, 0, 0}, y{0, 1, 0};

    [[nodiscard]] glm::dvec2 of(glm::dvec3 p) const;
};

/// Returns axes for drawing what is cut. Across an axis of the world they are the other two, (y, z), (x, z) or (x, y),
/// with their own coordinates; else y is as near to up, +z, as can be, and the origin is the plane's point nearest to
/// the world's.
PlaneAxes axesOf(const CutPlane& plane);

}  // namespace vcp
