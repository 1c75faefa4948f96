#include "viewer/camera/camera_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>

#include "viewer/camera/json_lines.h"
#include "viewer/camera/text_file.h"

namespace vcp {

namespace {

constexpr size_t kMostCameras = 10000;
constexpr size_t kLargestFile = 64 << 20;
constexpr int kDeepestCamera = 4;  // a camera's coordinates are nested 3 deep

/// Returns the weights of four keys in a row, for a time from 0 to 1 between the middle two.
std::array<double, 4> catmullRomWeights(double t) {
    return {0.5 * t * (-1 + t * (2 - t)), 0.5 * (2 + t * t * (-5 + 3 * t)), 0.5 * t * (1 + t * (4 - 3 * t)),
            0.5 * t * t * (t - 1)};
}

/// Returns one of two quaternions that are the same turn: the one nearer to `to`.
glm::dquat nearer(const glm::dquat& turn, const glm::dquat& to) { return glm::dot(turn, to) < 0 ? -turn : turn; }

/// The quantities of a camera that are blended.
struct Key {
    glm::dvec3 focus{0};
    double logDistance = 0;
    glm::dquat orientation{1, 0, 0, 0};

    Key operator+(const Key& b) const {
        return {focus + b.focus, logDistance + b.logDistance, orientation + b.orientation};
    }
    Key operator*(double s) const { return {focus * s, logDistance * s, orientation * s}; }
};

std::vector<Key> blendable(std::span<const OrbitCamera> cameras) {
    std::vector<Key> keys;
    for (const OrbitCamera& camera : cameras) {
        const glm::dquat turn = keys.empty() ? camera.orientation : nearer(camera.orientation, keys.back().orientation);
        keys.push_back({camera.focus(), std::log(camera.focusDistance), turn});
    }
    return keys;
}

/// Returns a key; beyond the ends the path goes straight on.
Key keyAt(const std::vector<Key>& keys, std::ptrdiff_t i) {
    const auto last = std::ptrdiff_t(keys.size()) - 1;
    const auto at = [&](std::ptrdiff_t k) { return keys[size_t(std::clamp<std::ptrdiff_t>(k, 0, last))]; };
    if (i < 0) return at(0) * 2 + at(1) * -1;
    if (i > last) return at(last) * 2 + at(last - 1) * -1;
    return at(i);
}

/// Returns an error of camera `number` of a path, with the line where it or its field stands.
Error inPath(Error error, std::string_view text, size_t number) {
    std::string pointer = fmt::format("/{}", number), field;
    if (error.element.starts_with('"')) {
        field = ": " + error.element;
        pointer += fmt::format("/{}", std::string_view(error.element).substr(1, error.element.size() - 2));
    }
    error.element = fmt::format("line {}: camera {}{}", LinesOf(text)(pointer), number, field);
    error.byte.reset();
    return error;
}

}  // namespace

std::vector<OrbitCamera> turntable(const OrbitCamera& from, glm::dvec3 pivot, int count) {
    std::vector<OrbitCamera> cameras;
    for (int i = 0; i < count; ++i) {
        cameras.push_back(from);
        cameras.back().orbit(pivot, 2 * std::numbers::pi * i / count, 0);
    }
    return cameras;
}

std::vector<OrbitCamera> cameraPath(std::span<const OrbitCamera> keys, int count) {
    const std::vector<Key> blended = blendable(keys);
    std::vector<OrbitCamera> cameras;
    for (int i = 0; i < count; ++i) {
        const double at = count > 1 ? double(i) / (count - 1) * double(keys.size() - 1) : 0;
        const size_t before = std::min(size_t(at), keys.size() - 1), after = std::min(before + 1, keys.size() - 1);
        const double t = at - double(before);
        OrbitCamera camera = keys[before];
        if (t > 0) {
            const std::array<double, 4> weights = catmullRomWeights(t);
            Key sum = keyAt(blended, std::ptrdiff_t(before) - 1) * weights[0];
            for (std::ptrdiff_t k = 1; k < 4; ++k)
                sum = sum + keyAt(blended, std::ptrdiff_t(before) - 1 + k) * weights[size_t(k)];
            camera.orientation = glm::normalize(sum.orientation);
            camera.focusDistance = std::exp(sum.logDistance);
            camera.position = sum.focus - camera.forwardVector() * camera.focusDistance;
            camera.fovY = glm::mix(camera.fovY, keys[after].fovY, t);
        }
        cameras.push_back(camera);
    }
    return cameras;
}

Result<std::vector<OrbitCamera>> camerasFromJson(std::string_view text, const std::string& name) {
    const auto isShallow = [](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
        return depth <= kDeepestCamera;
    };
    const auto json = nlohmann::json::parse(text, isShallow, false);
    if (!json.is_array() || json.empty() || json.size() > kMostCameras)
        return Error{.code = ErrorCode::InvalidInput,
                     .message = fmt::format("is not a JSON array of 1 to {} cameras", kMostCameras),
                     .file = name};
    std::vector<OrbitCamera> cameras;
    for (size_t i = 0; i < json.size(); ++i) {
        auto camera = cameraFromJson(json[i].dump(-1, ' ', false, nlohmann::json::error_handler_t::replace), name);
        if (!camera) return inPath(camera.error(), text, i);
        cameras.push_back(*camera);
    }
    return cameras;
}

Result<std::vector<OrbitCamera>> readCameras(const std::filesystem::path& path) {
    VCP_TRY_ASSIGN(const auto text, readText(path, kLargestFile, "a path of cameras",
                                             "cannot be opened; a path is a JSON array of cameras"));
    return camerasFromJson(text, path.string());
}

}  // namespace vcp
