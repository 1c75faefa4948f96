// A mesh in Embree, and a camera's rays for it: in floats about the mesh's middle. For builds that have Embree.
#pragma once

#include <atomic>
#include <chrono>
#include <limits>
#include <string>
#include <thread>

#include <embree3/rtcore.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "builder/measure/indexed_mesh.h"
#include "render/camera.h"

namespace vcp {

inline bool countMemory(void* user, ssize_t bytes, bool) {
    static_cast<std::atomic<int64_t>*>(user)->fetch_add(bytes);
    return true;
}

/// A device and a scene with the mesh's tree. Coordinates are floats about the mesh's middle.
class EmbreeScene {
public:
    /// `robust`: no ray slips between triangles that share an edge, which takes longer.
    EmbreeScene(const IndexedMesh& mesh, unsigned threads, bool robust = false) {
        const unsigned count = threads > 0 ? threads : std::max(1u, std::thread::hardware_concurrency());
        device_ = rtcNewDevice(("threads=" + std::to_string(count)).c_str());
        rtcSetDeviceMemoryMonitorFunction(device_, countMemory, &bytes_);
        scene_ = rtcNewScene(device_);
        rtcSetSceneFlags(scene_, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
        glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
        for (const glm::dvec3& p : mesh.positions) {
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
        middle_ = 0.5 * (low + high);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* positions = static_cast<float*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.positions.size()));
        for (const glm::dvec3& p : mesh.positions)
            for (int axis = 0; axis < 3; ++axis) *positions++ = float(p[axis] - middle_[axis]);
        auto* indices = static_cast<uint32_t*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size()));
        for (const auto& triangle : mesh.triangles)
            for (const uint32_t vertex : triangle) *indices++ = vertex;
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        const auto start = std::chrono::steady_clock::now();
        rtcCommitScene(scene_);
        buildSeconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }
    ~EmbreeScene() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    [[nodiscard]] RTCScene scene() const { return scene_; }
    [[nodiscard]] glm::dvec3 middle() const { return middle_; }
    [[nodiscard]] double buildSeconds() const { return buildSeconds_; }
    [[nodiscard]] uint64_t bytes() const { return uint64_t(bytes_.load()); }

private:
    std::atomic<int64_t> bytes_{0};
    RTCDevice device_ = nullptr;
    RTCScene scene_ = nullptr;
    glm::dvec3 middle_{0};
    double buildSeconds_ = 0;
};

/// A camera's rays in floats about the mesh's middle: right, up and forward, scaled to a step of a pixel.
struct FloatCamera {
    glm::vec3 eye, corner, perX, perY;

    FloatCamera(const Camera& camera, glm::ivec2 size, glm::dvec3 middle) {
        const auto width = uint32_t(size.x), height = uint32_t(size.y);
        const CameraBasis b = cameraBasis(camera, width, height);
        eye = glm::vec3(camera.eye - middle);
        perX = glm::vec3(b.right * (2 * b.halfWidth / size.x));
        perY = glm::vec3(b.up * (-2 * b.halfHeight / size.y));
        corner = glm::vec3(b.forward - b.right * b.halfWidth + b.up * b.halfHeight);
    }
    /// The unit direction through a point of the picture in pixels; pixel centres are at + 0.5.
    [[nodiscard]] glm::vec3 direction(float x, float y) const { return glm::normalize(corner + x * perX + y * perY); }
};

}  // namespace vcp
