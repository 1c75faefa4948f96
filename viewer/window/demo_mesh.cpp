#include "viewer/window/demo_mesh.h"

#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "octree/io/output_file.h"
#include "viewer/scene/mesh_cache.h"

namespace vcp {

namespace fs = std::filesystem;

namespace {

constexpr double kTube = 0.36, kScaleHeight = 0.055;
// Scales stand in rows; every other row is shifted by half of one.
constexpr double kRows = 96, kScalesInRow = 12;

/// Returns a point of a trefoil knot; `t` from 0 to 2 pi.
glm::dvec3 knotAt(double t) {
    return {std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t), -std::sin(3 * t)};
}

/// Returns the height of a scale at a point of the tube, 0 to 1, and the number of its row.
glm::dvec2 scaleAt(double along, double around) {
    double height = 0, row = 0;
    for (int before = 0; before < 2; ++before) {
        const double r = std::floor(along * kRows) - before;
        const double shift = std::fmod(r, 2) != 0 ? 0.5 : 0;
        const double across = around * kScalesInRow + shift - std::floor(around * kScalesInRow + shift) - 0.5;
        // A scale reaches over the next row, round at its end, highest there.
        const double reach = (along * kRows - r) / 2;
        const double inside = 1 - 4 * across * across - std::pow(std::max(0.0, reach - 0.35) / 0.65, 2);
        const double here = inside > 0 ? std::sqrt(inside) * (0.35 + 0.65 * reach) : 0;
        if (here > height) height = here, row = r;
    }
    return {height, row};
}

struct Vertex {
    glm::vec3 position;
    std::array<uint8_t, 3> colour;
};

Vertex vertexAt(uint32_t i, uint32_t j) {
    const double along = double(i) / kDemoAlong, around = double(j) / kDemoAround;
    const double t = 2 * std::numbers::pi * along, angle = 2 * std::numbers::pi * around;
    const glm::dvec3 middle = knotAt(t), tangent = glm::normalize(knotAt(t + 1e-4) - knotAt(t - 1e-4));
    const glm::dvec3 side = glm::normalize(glm::cross(tangent, middle));
    const glm::dvec3 out = std::cos(angle) * side + std::sin(angle) * glm::cross(tangent, side);
    const glm::dvec2 scale = scaleAt(along, around);
    const glm::dvec3 position = middle + (kTube + kScaleHeight * scale.x) * out;
    // From brass to verdigris and back along the knot, darker between the scales.
    const double part = 0.5 + 0.5 * std::cos(2 * std::numbers::pi * scale.y / kRows * 3);
    const glm::dvec3 brass(222, 170, 84), green(72, 158, 148);
    const glm::dvec3 colour = (green + (brass - green) * part) * (0.45 + 0.55 * scale.x);
    return {glm::vec3(position), {uint8_t(colour.x), uint8_t(colour.y), uint8_t(colour.z)}};
}

template <class Value>
void put(std::vector<std::byte>& bytes, const Value& value) {
    const auto raw = std::as_bytes(std::span(&value, 1));
    bytes.insert(bytes.end(), raw.begin(), raw.end());
}

}  // namespace

Result<void> writeDemoMesh(const fs::path& path) {
    const std::string head = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float "
        "z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int "
        "vertex_indices\nend_header\n",
        kDemoAlong * kDemoAround, kDemoTriangles);
    std::vector<std::byte> bytes;
    const auto text = std::as_bytes(std::span(head));
    bytes.insert(bytes.end(), text.begin(), text.end());
    for (uint32_t i = 0; i < kDemoAlong; ++i)
        for (uint32_t j = 0; j < kDemoAround; ++j) {
            const Vertex vertex = vertexAt(i, j);
            for (int axis = 0; axis < 3; ++axis) put(bytes, vertex.position[axis]);
            put(bytes, vertex.colour);
        }
    const auto triangle = [&](uint32_t a, uint32_t b, uint32_t c) {
        put(bytes, uint8_t{3});
        put(bytes, std::array<uint32_t, 3>{a, b, c});
    };
    for (uint32_t i = 0; i < kDemoAlong; ++i)
        for (uint32_t j = 0; j < kDemoAround; ++j) {
            const uint32_t next = (i + 1) % kDemoAlong * kDemoAround, here = i * kDemoAround,
                           beside = (j + 1) % kDemoAround;
            triangle(here + j, next + j, next + beside);
            triangle(here + j, next + beside, here + beside);
        }
    return writeFile(path, OutputKind::Ply, std::span<const std::byte>(bytes), {.overwrite = true});
}

Result<fs::path> demoMesh() {
    VCP_TRY_ASSIGN(const auto cache, defaultCacheFolder());
    std::error_code failed;
    fs::create_directories(cache, failed);
    const fs::path path = cache / "demo.ply";
    if (!fs::exists(path, failed)) VCP_TRY(writeDemoMesh(path));
    return path;
}

}  // namespace vcp
