// Section planes: what is filled where they cut, and which interval of a ray they leave (render/shaders/sections.glsl).
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace vcp {

/// What is filled where section planes cut.
enum class Caps : uint8_t {
    None,
    Closed,  ///< closed parts (kFlagParts); surfaces that are open show as lines. Files that say nothing of parts: as
             ///< All
    All,     ///< whatever has an odd number of walls behind it; right for closed surfaces
};

/// A section plane: what has dot(xyz, p) >= w is kept. |xyz| = 1.
using SectionCut = glm::dvec4;

/// Brings planes from the world to a grid: to cells from a point.
inline std::vector<SectionCut> inCells(std::span<const SectionCut> sections, glm::dvec3 origin, double cell) {
    std::vector<SectionCut> planes;
    for (const SectionCut& plane : sections) {
        const glm::dvec3 normal(plane);
        planes.emplace_back(normal, (plane.w - glm::dot(normal, origin)) / cell);
    }
    return planes;
}

/// What is left of a ray. Nothing is where `first` is `last`.
struct KeptInterval {
    double first = 0, last = std::numeric_limits<double>::infinity();  ///< distances along the ray
    const SectionCut* begin = nullptr;  ///< the plane that the interval begins at; null: it begins where the ray does
};

inline KeptInterval keptInterval(std::span<const SectionCut> sections, glm::dvec3 origin, glm::dvec3 direction) {
    KeptInterval kept;
    for (const SectionCut& plane : sections) {
        const double along = glm::dot(glm::dvec3(plane), direction),
                     off = glm::dot(glm::dvec3(plane), origin) - plane.w;
        const double t = -off / along;
        if (along > 0 && t > kept.first) kept.first = t, kept.begin = &plane;
        if (along < 0) kept.last = std::min(kept.last, std::max(t, 0.0));
        if (along == 0 && off < 0) kept.last = 0;
    }
    return kept.first < kept.last ? kept : KeptInterval{0, 0};
}

}  // namespace vcp
