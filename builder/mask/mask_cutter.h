// Cuts triangles by the masks of their materials.
#pragma once

#include <array>
#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/mask/alpha_mask.h"
#include "builder/mask/triangle_weights.h"
#include "builder/stream/material.h"

namespace vcp {

/// What a mask leaves of a triangle: triangles that turn as it does. They meet along whole edges.
struct MaskParts {
    std::vector<Weights> points;
    std::vector<std::array<uint32_t, 3>> triangles;  ///< numbers of points; none: all of it is cut out
};

/// Cuts the triangles of one mesh. Its masks are read when they are first asked for; those least recently used go when
/// memory is passed. The parts do not depend on what was asked before. One thread.
class MaskCutter {
public:
    /// `memoryBytes`: for masks and for parts that may be asked for again.
    explicit MaskCutter(uint64_t memoryBytes) : memoryBytes_(memoryBytes) {}

    /// Lets the outline's corners that span less than a square of this length go, unless that is much of what the
    /// outline surrounds. 0: none. Before the first triangle.
    void setDetail(double length) { detail_ = length; }

    /// Returns what is left of a triangle of `materials[number]`, which may be beyond them; null: all of it. The parts
    /// are within 1.5 texels of where bilinear alpha is at least the cutoff, but for what may go, and what surrounds
    /// less than 2 square texels. They are at most one for each 128 texels and for each two squares of the detail, but
    /// 256 to 65536: where that is too few, the mask is looked at more coarsely, and where the coarsest is too much,
    /// the triangle stays whole. `area`: of the triangle, in the unit of the detail. Valid until the next call.
    const MaskParts* partsOf(std::span<const Material> materials, uint32_t number, const std::array<glm::vec2, 3>& uv,
                             double area);

    /// Triangles that were cut, or cut out.
    [[nodiscard]] uint64_t cutTriangles() const { return cutTriangles_; }
    /// Masks that could not be read, or not in full, one line each.
    [[nodiscard]] std::span<const std::string> warnings() const { return warnings_; }

private:
    struct Loaded {
        uint32_t material;
        AlphaMask mask;
    };
    struct Place {
        uint32_t material;
        int log2Spared;
        std::array<float, 6> uv;
        auto operator<=>(const Place&) const = default;
    };

    const AlphaMask* maskOf(std::span<const Material> materials, uint32_t number);
    const MaskParts* cut(const AlphaMask& mask, const Place& place, const std::array<glm::dvec2, 3>& texels);

    uint64_t memoryBytes_;
    double detail_ = 0;
    std::list<Loaded> loaded_;                                                   // the one used last comes first
    std::map<uint32_t, std::optional<std::list<Loaded>::iterator>> byMaterial_;  // nothing: it cuts nothing
    uint64_t loadedBytes_ = 0;
    std::map<Place, std::optional<MaskParts>> known_;  // nothing: whole
    uint64_t knownBytes_ = 0;
    uint64_t cutTriangles_ = 0;
    std::vector<std::string> warnings_;
};

}  // namespace vcp
