// OrbitCamera: the eye as a person moves it, in world space and double precision. The renderer gets the
// plain Camera (render/camera.h) of the moment.
//
// Camera axes: x to the right, y up, -z into the picture. Pixels have their origin at the top left
// corner of the picture, y down; pixel (i, j) covers [i, i+1) x [j, j+1).
//
// All moves keep a promise that a person can see, and the tests check:
//   orbit      the pivot stays where it is in the picture
//   pan        the point that was under the cursor stays under it
//   zoomAbout  the point under the cursor stays under it
//
// Plain data; pure functions; no threads, no GPU.
#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <glm/common.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "octree/io/result.h"
#include "render/camera.h"
#include "render/similarity.h"

namespace vcp {

/// Axis-aligned box, world units.
struct Box {
    glm::dvec3 low{0};
    glm::dvec3 high{0};

    [[nodiscard]] glm::dvec3 centre() const { return 0.5 * (low + high); }
    [[nodiscard]] double diagonal() const;
    /// A box turned inside out: joined with another box, it becomes that box.
    static Box nothing() {
        return {glm::dvec3(std::numeric_limits<double>::infinity()),
                glm::dvec3(-std::numeric_limits<double>::infinity())};
    }
    /// The box about points.
    static Box of(std::span<const glm::dvec3> points) {
        Box box = nothing();
        for (const glm::dvec3& p : points) box = box.joined({p, p});
        return box;
    }
    [[nodiscard]] Box joined(const Box& other) const { return {glm::min(low, other.low), glm::max(high, other.high)}; }
};

/// Returns the box about the corners of a placed box.
Box placedBox(const Box& box, const Similarity& placement);

enum class UpAxis { Y, Z };
/// Returns its direction in the world.
glm::dvec3 directionOf(UpAxis up);

/// Returns the axis that points up in a scan, as far as the box about it says: z where it lies far from the origin
/// along x and y but not along z, as map coordinates do; where it is flat along z, as terrain is; and where it is half
/// as long again along z as along the others, as a statue that stands. y where it is so long along y. Else nothing.
std::optional<UpAxis> upOf(const Box& box);

/// Standard views of a box. `Fit` is the view a dataset opens with: the front; where z is up and the box is flat along
/// z, halfway between the front and the top.
enum class View { Fit, Front, Back, Left, Right, Top, Bottom, Isometric };

/// How much of a picture is covered along its sides, in pixels: what is fitted goes into the rest. Where less than half
/// is left either way, the whole picture is used.
struct PictureMargins {
    double left = 0, right = 0, top = 0, bottom = 0;
};

/// Where an eye is about what it looks at.
struct ViewAngles {
    double azimuth = 0;        ///< degrees about the up axis, from x towards y where z is up, from x to -z where y is
    double elevation = 0;      ///< degrees above the horizon, less than 90 either way
    double magnification = 1;  ///< > 0; 1: all just fits

    bool operator==(const ViewAngles&) const = default;
};

struct OrbitCamera {
    glm::dvec3 position{0};
    glm::dquat orientation{1, 0, 0, 0};  ///< world from camera, unit
    double focusDistance = 1;            ///< distance to the point of interest along the view axis, world units, > 0
    double fovY = 0.7853981633974483;    ///< full vertical angle, radians, in (0, pi)
    Projection projection = Projection::Perspective;
    UpAxis up = UpAxis::Y;

    [[nodiscard]] glm::dvec3 rightVector() const { return orientation * glm::dvec3(1, 0, 0); }
    [[nodiscard]] glm::dvec3 upVector() const { return orientation * glm::dvec3(0, 1, 0); }
    [[nodiscard]] glm::dvec3 forwardVector() const { return orientation * glm::dvec3(0, 0, -1); }
    [[nodiscard]] glm::dvec3 focus() const { return position + forwardVector() * focusDistance; }

    /// Height of what the picture shows at the focus, world units; the same everywhere in orthographic projection.
    [[nodiscard]] double viewHeight() const;

    /// Returns a point's distance from the eye's plane along the view axis; negative behind the eye.
    [[nodiscard]] double depthOf(glm::dvec3 point) const;

    /// Returns the camera as the renderer needs it.
    [[nodiscard]] Camera current() const;

    /// Returns the ray through a point of a picture of `size` pixels.
    [[nodiscard]] CameraRay rayThrough(glm::dvec2 pixel, glm::ivec2 size) const;

    /// Returns where a point is in the picture; nothing when it is behind the eye.
    [[nodiscard]] std::optional<glm::dvec2> pixelOf(glm::dvec3 point, glm::ivec2 size) const;

    /// Turns about `pivot`: by `yaw` radians about the up axis, then by `pitch` about the camera's x axis.
    /// The pitch stops short of the poles, so the picture never turns upside down.
    void orbit(glm::dvec3 pivot, double yaw, double pitch);

    /// Moves sideways so that what is at `depth` under pixel `from` comes under pixel `to`.
    void pan(glm::dvec2 from, glm::dvec2 to, double depth, glm::ivec2 size);

    /// Scales the distance to `point` by `factor` > 0, keeping it where it is in the picture. The focus
    /// moves with it. Stops where doubles could no longer tell the eye from the point.
    void zoomAbout(glm::dvec3 point, double factor);

    /// Moves along the view axis and sideways so that the box just fits into the part of the picture that is not
    /// covered, with its middle in the middle of that part.
    void fit(const Box& box, glm::ivec2 size, const PictureMargins& covered = {});

    /// Does so, as far away as an eye must be that then goes around the box in `count` steps (turntable) and sees all
    /// of it each time.
    void fitAround(const Box& box, glm::ivec2 size, int count);

    /// Turns to a standard view and fits.
    void look(View view, const Box& box, glm::ivec2 size, const PictureMargins& covered = {});

    /// Looks from so far around and up, fits, and then narrows the view.
    void look(const ViewAngles& from, const Box& box, glm::ivec2 size, const PictureMargins& covered = {});

    /// Turns the view with the eye where it is: `yaw` about the up axis, `pitch` about the camera's x axis. The
    /// pitch stops short of the poles.
    void turnHead(double yaw, double pitch);

    /// Moves sideways and along the view until `point` is in the middle of the picture, at the focus; the distance
    /// to the focus stays.
    void centreOn(glm::dvec3 point);

    /// Takes another axis as up; the eye and, unless it looks along that axis, the view direction stay.
    void standUp(UpAxis axis);
};

/// Returns world from camera for an eye that looks along `forward`, with `up` as near to the picture's up as possible.
/// Precondition: the two are not parallel.
glm::dquat facing(glm::dvec3 forward, glm::dvec3 up);

/// Returns a camera `part` in [0, 1] of the way: the focus moves on a line, the distance to it geometrically, the
/// orientation on the shorter arc. 0 and 1 give `from` and `to`; the projection is `to`'s.
OrbitCamera between(const OrbitCamera& from, const OrbitCamera& to, double part);

/// Returns the view of a name on the command line ("fit", "front", "iso", ...).
std::optional<View> viewNamed(std::string_view name);

/// Returns all names of views, comma-separated, for messages.
std::string viewNames();

/// Returns one line of JSON:
/// {"position":[x,y,z],"target":[x,y,z],"up":[x,y,z],"up_axis":"y","fov_degrees":45,"projection":"perspective"}.
/// Doubles survive a round trip to within rounding.
std::string cameraToJson(const OrbitCamera& camera);

/// Reads what cameraToJson writes. "up", "up_axis", "fov_degrees" and "projection" may be absent. `name`
/// stands for the file in errors. May be hostile. Errors: InvalidInput (not JSON, with the line; a field
/// missing, of a wrong type, not finite; target at the eye; up along the view).
Result<OrbitCamera> cameraFromJson(std::string_view text, const std::string& name);

/// Does cameraFromJson of a file of at most 1 MiB. Errors: also Io.
Result<OrbitCamera> readCamera(const std::filesystem::path& path);

}  // namespace vcp
