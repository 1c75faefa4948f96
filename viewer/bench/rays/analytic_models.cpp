#include "viewer/bench/rays/analytic_models.h"

#include <cmath>
#include <numbers>
#include <span>
#include <string>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "octree/io/output_file.h"

namespace vcp {

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Adds a grid of nu by nv quads over (u, v) in [0, 1)^2 that closes in u, and on request in v.
template <class Position>
IndexedMesh gridSurface(uint32_t nu, uint32_t nv, bool closesInV, const Position& position) {
    IndexedMesh mesh;
    const uint32_t rows = closesInV ? nv : nv + 1;
    for (uint32_t v = 0; v < rows; ++v)
        for (uint32_t u = 0; u < nu; ++u) mesh.positions.push_back(position(double(u) / nu, double(v) / nv));
    for (uint32_t v = 0; v < nv; ++v)
        for (uint32_t u = 0; u < nu; ++u) {
            const uint32_t u1 = (u + 1) % nu, v1 = (v + 1) % rows;
            const uint32_t a = v * nu + u, b = v * nu + u1, c = v1 * nu + u1, d = v1 * nu + u;
            // The first and last row of a sphere are points.
            if (closesInV || v > 0) mesh.triangles.push_back({a, c, b});
            if (closesInV || v + 1 < nv) mesh.triangles.push_back({a, d, c});
        }
    return mesh;
}

IndexedMesh sphere() {
    constexpr uint32_t kRings = 256;
    return gridSurface(2 * kRings, kRings, false, [](double u, double v) {
        const double polar = v * kTurn / 2, r = v == 0 || v == 1 ? 0 : std::sin(polar);
        return glm::dvec3(r * std::cos(u * kTurn), r * std::sin(u * kTurn), std::cos(polar));
    });
}

IndexedMesh torus() {
    constexpr double kRing = 0.7, kTube = 0.3;
    return gridSurface(512, 192, true, [](double u, double v) {
        const double r = kRing + kTube * std::cos(v * kTurn);
        return glm::dvec3(r * std::cos(u * kTurn), kTube * std::sin(v * kTurn), r * std::sin(u * kTurn));
    });
}

/// Turns a point about an axis through the middle (Rodrigues).
glm::dvec3 turned(glm::dvec3 p, glm::dvec3 axis, double angle) {
    return p * std::cos(angle) + glm::cross(axis, p) * std::sin(angle) +
           axis * (glm::dot(axis, p) * (1 - std::cos(angle)));
}

IndexedMesh plate() {
    const glm::dvec3 half(1, 0.7, 0.2 * kAnalyticModelCell);
    const glm::dvec3 axis = glm::normalize(glm::dvec3(1, 2, 0.5));
    IndexedMesh mesh;
    for (int corner = 0; corner < 8; ++corner)
        mesh.positions.push_back(
            turned(half * glm::dvec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1), axis, 0.6));
    for (uint32_t axisBit : {1u, 2u, 4u}) {
        const uint32_t next = axisBit == 4 ? 1 : axisBit * 2, last = 7 - axisBit - next;
        for (const uint32_t side : {0u, axisBit}) {
            std::array<uint32_t, 4> quad = {side, side | next, side | next | last, side | last};
            if (side == 0) std::swap(quad[1], quad[3]);
            mesh.triangles.push_back({quad[0], quad[1], quad[2]});
            mesh.triangles.push_back({quad[0], quad[2], quad[3]});
        }
    }
    return mesh;
}

}  // namespace

std::vector<AnalyticModel> analyticModels() { return {{"sphere", sphere()}, {"torus", torus()}, {"plate", plate()}}; }

Result<std::vector<std::filesystem::path>> writeAnalyticModels(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const AnalyticModel& model : analyticModels()) {
        files.push_back(folder / (model.name + ".ply"));
        VCP_TRY(writePly(model.mesh, files.back()));
    }
    return files;
}

Result<void> writePly(const IndexedMesh& mesh, const std::filesystem::path& path) {
    std::string file = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n"
        "property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.positions.size(), mesh.triangles.size());
    for (const glm::dvec3& p : mesh.positions) file.append(reinterpret_cast<const char*>(&p), sizeof(p));
    for (const auto& triangle : mesh.triangles) {
        file += '\3';
        file.append(reinterpret_cast<const char*>(triangle.data()), sizeof(triangle));
    }
    return writeFile(path, OutputKind::Ply, std::as_bytes(std::span(file)));
}

}  // namespace vcp
