// Meshes with known shapes, for tests of what is measured against meshes.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "builder/measure/indexed_mesh.h"

namespace vcp::test {

/// A triangle soup in the unit cube: slivers, points, segments and ordinary triangles.
inline IndexedMesh randomTriangles(uint32_t count, uint64_t seed, bool adversarial) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const auto point = [&] { return glm::dvec3(unit(random), unit(random), unit(random)); };
    IndexedMesh mesh;
    for (uint32_t i = 0; i < count; ++i) {
        const glm::dvec3 a = point();
        glm::dvec3 b = a + (point() - 0.5) * 0.1, c = a + (point() - 0.5) * 0.1;
        if (adversarial && i % 4 == 1) c = a + (b - a) * unit(random) + (point() - 0.5) * 1e-7;  // aspect 1e6
        if (adversarial && i % 16 == 2) b = c = a;
        if (adversarial && i % 16 == 6) c = b;
        for (const glm::dvec3& p : {a, b, c}) mesh.positions.push_back(p);
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    return mesh;
}

/// A closed grid surface p(u, v), u and v in [0, 1), wrapping in u and, if asked, in v.
template <class Position>
IndexedMesh gridSurface(uint32_t nu, uint32_t nv, bool wrapV, const Position& position) {
    IndexedMesh mesh;
    const uint32_t rows = wrapV ? nv : nv + 1;
    for (uint32_t v = 0; v < rows; ++v)
        for (uint32_t u = 0; u < nu; ++u) mesh.positions.push_back(position(double(u) / nu, double(v) / nv));
    for (uint32_t v = 0; v < nv; ++v)
        for (uint32_t u = 0; u < nu; ++u) {
            const uint32_t u1 = (u + 1) % nu, v1 = (v + 1) % rows;
            const uint32_t a = v * nu + u, b = v * nu + u1, c = v1 * nu + u1, d = v1 * nu + u;
            mesh.triangles.push_back({a, b, c});
            mesh.triangles.push_back({a, c, d});
        }
    return mesh;
}

inline constexpr double kTwoPi = 6.283185307179586;

inline IndexedMesh sphereMesh(glm::dvec3 centre, double radius, uint32_t rings) {
    IndexedMesh mesh = gridSurface(2 * rings, rings, false, [&](double u, double v) {
        const double polar = v * kTwoPi / 2;
        const double s = v == 0 || v == 1 ? 0 : std::sin(polar);
        return centre + radius * glm::dvec3(s * std::cos(u * kTwoPi), s * std::sin(u * kTwoPi), std::cos(polar));
    });
    // The first and last row are the poles: triangles of their quads without area go.
    std::erase_if(mesh.triangles, [&](const auto& t) {
        const auto& p = mesh.positions;
        return p[t[0]] == p[t[1]] || p[t[1]] == p[t[2]] || p[t[2]] == p[t[0]];
    });
    return mesh;
}

inline IndexedMesh torusMesh(glm::dvec3 centre, double ring, double tube, uint32_t around, uint32_t across) {
    return gridSurface(around, across, true, [&](double u, double v) {
        const double r = ring + tube * std::cos(v * kTwoPi);
        return centre + glm::dvec3(r * std::cos(u * kTwoPi), r * std::sin(u * kTwoPi), tube * std::sin(v * kTwoPi));
    });
}

/// A closed box with `n` by `n` quads a side.
inline IndexedMesh boxMesh(glm::dvec3 low, glm::dvec3 high, uint32_t n) {
    IndexedMesh mesh;
    std::map<std::array<uint32_t, 3>, uint32_t> numbers;
    const auto vertex = [&](glm::uvec3 at) {
        const auto [entry, isNew] = numbers.try_emplace({at.x, at.y, at.z}, uint32_t(mesh.positions.size()));
        if (isNew) mesh.positions.push_back(low + (high - low) * glm::dvec3(at) / double(n));
        return entry->second;
    };
    for (uint32_t axis = 0; axis < 3; ++axis)
        for (uint32_t side = 0; side < 2; ++side)
            for (uint32_t i = 0; i < n; ++i)
                for (uint32_t j = 0; j < n; ++j) {
                    const auto at = [&](uint32_t a, uint32_t b) {
                        glm::uvec3 p;
                        p[axis] = side * n;
                        p[(axis + 1) % 3] = a;
                        p[(axis + 2) % 3] = b;
                        return vertex(p);
                    };
                    std::array<uint32_t, 4> q = {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)};
                    if (side == 0) std::swap(q[1], q[3]);
                    mesh.triangles.push_back({q[0], q[1], q[2]});
                    mesh.triangles.push_back({q[0], q[2], q[3]});
                }
    return mesh;
}

inline void append(IndexedMesh& to, const IndexedMesh& from) {
    const auto base = uint32_t(to.positions.size());
    to.positions.insert(to.positions.end(), from.positions.begin(), from.positions.end());
    for (const auto& t : from.triangles) to.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

/// Turns a mesh about an axis through `centre` (Rodrigues).
inline void rotate(IndexedMesh& mesh, glm::dvec3 centre, glm::dvec3 axis, double angle) {
    axis = glm::normalize(axis);
    for (glm::dvec3& p : mesh.positions) {
        const glm::dvec3 v = p - centre;
        p = centre + v * std::cos(angle) + glm::cross(axis, v) * std::sin(angle) +
            axis * (glm::dot(axis, v) * (1 - std::cos(angle)));
    }
}

/// Writes an OBJ whose numbers survive.
inline void writeObj(const IndexedMesh& mesh, const std::filesystem::path& path) {
    std::ofstream out(path);
    for (const glm::dvec3& p : mesh.positions) out << fmt::format("v {:.17g} {:.17g} {:.17g}\n", p.x, p.y, p.z);
    for (const auto& t : mesh.triangles) out << fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
}

}  // namespace vcp::test
