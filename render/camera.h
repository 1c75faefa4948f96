// Where a picture is taken from. Plain data in world space and double precision; what the GPU gets is
// relative to the eye (render/shared/frame.h), so that large coordinates lose nothing.
#pragma once

#include <cstdint>

#include <glm/vec3.hpp>

#include "render/host/picture_rays.h"

namespace vcp {

enum class Projection { Perspective, Orthographic };

/// A camera. `forward` and `up` need neither be unit length nor orthogonal, but not parallel.
struct Camera {
    glm::dvec3 eye{0, 0, 0};
    glm::dvec3 forward{0, 0, -1};
    glm::dvec3 up{0, 1, 0};
    Projection projection = Projection::Perspective;
    double verticalFov = 0.6;       ///< perspective: angle from the lower to the upper edge, radians
    double orthographicHeight = 1;  ///< orthographic: from the lower to the upper edge, world units

    bool operator==(const Camera&) const = default;
};

/// A camera's orthonormal axes (right, up, forward) and the half extents of the picture in its plane, at distance 1
/// (perspective) or anywhere (orthographic, world units).
struct CameraBasis {
    glm::dvec3 right, up, forward;
    double halfWidth, halfHeight;
};
CameraBasis cameraBasis(const Camera& camera, uint32_t width, uint32_t height);

/// The ray through a point of the picture in pixels (0, 0 is the upper left corner of the upper left pixel; pixel
/// centres are at + 0.5). `direction` has unit length.
struct CameraRay {
    glm::dvec3 origin, direction;
};
CameraRay cameraRay(const Camera& camera, uint32_t width, uint32_t height, double x, double y);

/// The same rays as the host casts them (render/host/host_caster.h).
PictureRays pictureRays(const Camera& camera, uint32_t width, uint32_t height);

/// Returns a camera that looks along `forward` at the middle of a box, from where all of the box is in the picture.
Camera fitCamera(glm::dvec3 boxMin, glm::dvec3 boxMax, glm::dvec3 forward, glm::dvec3 up, double verticalFov,
                 double aspect);

}  // namespace vcp
