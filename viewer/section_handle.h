// The handle of a section plane over the picture: an arrow along the normal, which moves the plane, and a ring about
// its foot, which turns it. Both have the same size in the picture whatever the distance.
//
// Moving: the arrow follows the cursor along the normal; where the normal points into the picture or out of it, up is
// along the normal. Turning: the ring is the equator of a ball whose near side follows the cursor, or the far side
// where that was gripped; the foot stays. Pixels of the picture, origin at the upper left; pure, no threads.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "render/view/renderer.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {

enum class SectionGrip { None, Move, Turn };

struct SectionHandle {
    size_t plane = 0;      ///< number of its section plane
    glm::dvec3 anchor{0};  ///< the foot: a point of the plane, world
    glm::dvec2 foot{0}, tip{0};
    std::vector<glm::dvec2> ring;  ///< closed by its first point
    bool isAlongView = false;      ///< the arrow is too short to be drawn or followed
};

/// A part of a handle under the cursor.
struct SectionGrab {
    SectionGrip grip = SectionGrip::None;
    size_t plane = 0;

    bool operator==(const SectionGrab&) const = default;
};

/// Returns the point of the plane nearest to `point`.
glm::dvec3 onPlane(const SectionPlane& plane, glm::dvec3 point);

/// Makes a handle; nothing where the foot is not before the eye. `anchor`: a point of the plane. `scale`: pixels a unit
/// of the layout (1 on a common display, 2 on a dense one).
std::optional<SectionHandle> sectionHandle(const SectionPlane& plane, size_t number, glm::dvec3 anchor,
                                           const OrbitCamera& camera, glm::ivec2 size, double scale);

/// Returns what is under the cursor; among several the nearest, arrows before rings.
SectionGrab grabAt(std::span<const SectionHandle> handles, glm::dvec2 pixel, double scale);

/// A section plane that is being dragged, from the press on. The camera must not move meanwhile.
class SectionDrag {
public:
    SectionDrag(const SectionHandle& handle, SectionGrip grip, const SectionPlane& plane, glm::dvec2 pressed,
                const OrbitCamera& camera, glm::ivec2 size, double scale);

    /// Returns the plane with the cursor at `pixel`; where it was pressed, that is the plane as it was. `farthest`: the
    /// most that a plane is moved, world units.
    [[nodiscard]] SectionPlane at(glm::dvec2 pixel, double farthest) const;
    [[nodiscard]] const SectionPlane& before() const { return before_; }
    [[nodiscard]] SectionGrab grab() const { return {grip_, plane_}; }

private:
    [[nodiscard]] double along(glm::dvec2 pixel) const;

    SectionGrip grip_;
    size_t plane_;
    SectionPlane before_;
    glm::dvec3 anchor_, normal_;  // normal: unit
    bool isAlongView_;
    glm::dvec2 pressed_;
    OrbitCamera camera_;
    glm::ivec2 size_;
    double radius_;  // radius of the ring, pixels
    double unitsPerPixel_;
    double side_ = 1;  // -1: the far side was gripped
};

}  // namespace vcp
