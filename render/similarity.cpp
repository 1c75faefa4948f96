#include "render/similarity.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "render/frame_request.h"

namespace vcp {

namespace {

constexpr double kSimilar = 1e-6;

}  // namespace

Result<Similarity> similarityFromMatrix(std::span<const double, 16> rows) {
    const auto usage = [](const char* what) { return Error{.code = ErrorCode::Usage, .message = what}; };
    if (!std::all_of(rows.begin(), rows.end(), [](double x) { return std::isfinite(x); }))
        return usage("has numbers that are not finite");
    if (rows[12] != 0 || rows[13] != 0 || rows[14] != 0 || rows[15] != 1)
        return usage("must have 0, 0, 0, 1 in its last row");
    const glm::dmat3 linear(rows[0], rows[4], rows[8], rows[1], rows[5], rows[9], rows[2], rows[6], rows[10]);
    const double determinant = glm::determinant(linear);
    if (!(determinant > 0))
        return usage(determinant < 0 ? "mirrors, which is not supported" : "flattens all into a plane");
    const double scale = std::cbrt(determinant);
    const glm::dmat3 turn = linear / scale, square = glm::transpose(turn) * turn;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (std::abs(square[i][j] - (i == j ? 1 : 0)) > kSimilar)
                return usage(
                    "stretches or shears; only rotations, translations and one scale for all axes are supported");
    return Similarity{
        .rotation = glm::normalize(glm::quat_cast(turn)), .scale = scale, .translation = {rows[3], rows[7], rows[11]}};
}

SectionPlane planeIn(const Similarity& placement, const SectionPlane& plane) {
    return {placement.turnedFromWorld(plane.normal),
            (plane.offset - glm::dot(plane.normal, placement.translation)) / placement.scale};
}

FrameRequest requestIn(const Similarity& placement, const FrameRequest& request) {
    if (placement == Similarity{}) return request;
    FrameRequest local = request;
    local.camera.eye = placement.fromWorld(request.camera.eye);
    local.camera.forward = placement.turnedFromWorld(request.camera.forward);
    local.camera.up = placement.turnedFromWorld(request.camera.up);
    local.camera.orthographicHeight /= placement.scale;
    local.shading.occlusionRadius /= placement.scale;
    if (!request.shading.lightFollowsCamera)
        local.shading.lightDirection = glm::vec3(placement.turnedFromWorld(glm::dvec3(request.shading.lightDirection)));
    for (DirectedLight& light : local.shading.moreLights)
        if (!light.followsCamera) light.direction = glm::vec3(placement.turnedFromWorld(glm::dvec3(light.direction)));
    for (SectionPlane& plane : local.sections) plane = planeIn(placement, plane);
    return local;
}

}  // namespace vcp
