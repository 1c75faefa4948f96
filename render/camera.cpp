#include "render/camera.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace vcp {

CameraBasis cameraBasis(const Camera& camera, uint32_t width, uint32_t height) {
    CameraBasis basis;
    basis.forward = glm::normalize(camera.forward);
    basis.right = glm::normalize(glm::cross(basis.forward, camera.up));
    basis.up = glm::cross(basis.right, basis.forward);
    basis.halfHeight =
        camera.projection == Projection::Perspective ? std::tan(camera.verticalFov / 2) : camera.orthographicHeight / 2;
    basis.halfWidth = basis.halfHeight * double(width) / double(height);
    return basis;
}

CameraRay cameraRay(const Camera& camera, uint32_t width, uint32_t height, double x, double y) {
    const CameraBasis basis = cameraBasis(camera, width, height);
    const glm::dvec3 aside =
        basis.right * (2 * x / width - 1) * basis.halfWidth + basis.up * (1 - 2 * y / height) * basis.halfHeight;
    if (camera.projection == Projection::Orthographic) return {camera.eye + aside, basis.forward};
    return {camera.eye, glm::normalize(basis.forward + aside)};
}

PictureRays pictureRays(const Camera& camera, uint32_t width, uint32_t height) {
    const CameraBasis basis = cameraBasis(camera, width, height);
    const glm::dvec3 corner = basis.up * basis.halfHeight - basis.right * basis.halfWidth;
    const glm::dvec3 perX = basis.right * (2 * basis.halfWidth / width),
                     perY = basis.up * (-2 * basis.halfHeight / height);
    PictureRays rays{.origin = camera.eye, .direction = basis.forward, .size = {int(width), int(height)}};
    if (camera.projection == Projection::Orthographic) {
        rays.origin += corner;
        rays.originPerX = perX;
        rays.originPerY = perY;
    } else {
        rays.direction += corner;
        rays.directionPerX = perX;
        rays.directionPerY = perY;
    }
    return rays;
}

Camera fitCamera(glm::dvec3 boxMin, glm::dvec3 boxMax, glm::dvec3 forward, glm::dvec3 up, double verticalFov,
                 double aspect) {
    Camera camera;
    camera.forward = glm::normalize(forward);
    camera.up = up;
    camera.verticalFov = verticalFov;
    const glm::dvec3 middle = (boxMin + boxMax) * 0.5;
    // The camera stands far enough that every corner is inside both pairs of the frustum's planes.
    const CameraBasis basis = cameraBasis(camera, 1, 1);
    const double tanY = basis.halfHeight, tanX = tanY * aspect;
    double distance = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 p = glm::dvec3(corner & 1 ? boxMax.x : boxMin.x, corner & 2 ? boxMax.y : boxMin.y,
                                        corner & 4 ? boxMax.z : boxMin.z) -
                             middle;
        const double ahead = glm::dot(p, basis.forward);
        distance = std::max({distance, std::abs(glm::dot(p, basis.right)) / tanX - ahead,
                             std::abs(glm::dot(p, basis.up)) / tanY - ahead});
    }
    camera.eye = middle - camera.forward * (distance * 1.02);
    camera.orthographicHeight = 2 * distance * tanY;
    return camera;
}

}  // namespace vcp
