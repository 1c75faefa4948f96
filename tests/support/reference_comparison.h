// Pictures against the reference ray-caster, pixel by pixel, from cameras of every kind.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "render/frame_setup.h"
#include "tests/support/renderer_fixture.h"

namespace vcp::test {

struct NamedCamera {
    const char* name;
    Camera camera;
};

/// Around a box, along the axes, close, from inside the box and the body, with parallel rays.
inline std::vector<NamedCamera> cameras(glm::dvec3 lo, glm::dvec3 hi) {
    const glm::dvec3 middle = (lo + hi) * 0.5;
    const double edge = hi.x - lo.x;
    const auto fit = [&](glm::dvec3 forward) { return fitCamera(lo, hi, forward, {0.1, 1, 0.2}, 0.6, 4.0 / 3); };
    std::vector<NamedCamera> list = {{"slanted", fit({-0.3, -0.5, -1})},
                                     {"along -z", fit({0, 0, -1})},
                                     {"along +x", fit({1, 0, 0})},
                                     {"along -y", fit({0, -1, 0})},
                                     {"diagonal", fit({1, 1, 1})}};
    Camera parallel = fit({0.5, -0.3, 0.7});
    parallel.projection = Projection::Orthographic;
    list.push_back({"parallel", parallel});
    Camera straight = fit({0, 0, 1});
    straight.projection = Projection::Orthographic;
    list.push_back({"parallel along +z", straight});
    Camera close = fit({-0.3, -0.5, -1});
    close.eye = middle + (close.eye - middle) * 0.45;
    list.push_back({"close", close});
    Camera inside = fit({0.7, 0.1, -0.3});
    inside.eye = middle + glm::dvec3(0.013, 0.021, 0.017) * edge;
    list.push_back({"from the middle", inside});
    Camera corner = fit({1, 0.8, 0.9});
    corner.eye = lo + 0.02 * edge;
    list.push_back({"from a corner of the box", corner});
    Camera far = fit({-0.2, -0.3, -1});
    far.eye = middle - glm::normalize(far.forward) * (edge * 300);
    far.verticalFov = 0.005;
    list.push_back({"from far away", far});
    return list;
}

inline std::vector<NamedCamera> cameras(const Scene& scene) { return cameras(scene.boxMin, scene.boxMax); }

struct Comparison {
    uint64_t hit = 0, miss = 0, missed = 0, wrong = 0;
    uint64_t otherNormal = 0;                          // hits whose normals differ by more than kSameNormal
    double depthMax = 0, depthSum = 0, normalMax = 0;  // cells, radians
};
constexpr double kSameNormal = 0.01;

/// Options with the size of the picture's pixels.
inline CastOptions castOptions(const Camera& camera, uint32_t width, uint32_t height) {
    const double pixel = 2 * cameraBasis(camera, width, height).halfHeight / height;
    if (camera.projection == Projection::Orthographic) return {.pixelEdge = pixel};
    return {.pixelEdge = 0, .pixelEdgePerT = pixel};
}

/// Every pixel against the reference on the same cut. Hits that differ by more than two cells are `wrong`.
inline Comparison compare(Renderer& renderer, const Scene& scene, const FrameRequest& request) {
    const std::vector<uint64_t> ones(scene.dataset->pages.size(), 1);
    const std::vector<uint8_t> all(ones.size(), 1), none(ones.size(), 0);
    const Selection selection = selectPages(*scene.dataset, selectionView(request), UINT64_MAX, ones, all, none);
    const auto caster = ReferenceCaster::create(*scene.cache, selection.cut,
                                                castOptions(request.camera, request.width, request.height));
    EXPECT_TRUE(caster);
    const auto depth = renderer.readDepth();
    const auto normals = renderer.readNormals();
    EXPECT_TRUE(depth && normals);
    Comparison c;
    for (uint32_t y = 0; y < request.height; ++y)
        for (uint32_t x = 0; x < request.width; ++x) {
            const CameraRay ray = cameraRay(request.camera, request.width, request.height, x + 0.5, y + 0.5);
            const auto expected = caster->cast({ray.origin, ray.direction});
            const size_t at = size_t{y} * request.width + x;
            const bool found = std::isfinite((*depth)[at]);
            if (!expected && !found) ++c.miss;
            if (expected.has_value() != found) ++c.missed;
            if (!expected || !found) continue;
            const double error = std::abs(double((*depth)[at]) - expected->t) / scene.dataset->cellOf(expected->level);
            if (error > 2) {
                ++c.wrong;
                continue;
            }
            ++c.hit;
            c.depthSum += error;
            c.depthMax = std::max(c.depthMax, error);
            const double angle = std::acos(std::min(1.0, glm::dot(glm::dvec3((*normals)[at]), expected->normal)));
            c.otherNormal += angle > kSameNormal ? 1 : 0;
            c.normalMax = std::max(c.normalMax, angle);
        }
    return c;
}

}  // namespace vcp::test
