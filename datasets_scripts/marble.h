// Marble: the relief and the colour of weathered stone at a point in space.
#pragma once

#include <algorithm>

#include "datasets_scripts/procedural_noise.h"

namespace vcp::scan {

inline constexpr glm::dvec3 kMarble(0.91, 0.885, 0.835), kVein(0.47, 0.48, 0.52), kDirt(0.50, 0.39, 0.27);

/// Weathered stone: what all marble parts share.
struct Marble {
    Noise noise;
    double finest;  ///< shortest wavelength that the tessellation can carry

    /// Returns the height of weathering, chisel marks and pits, in metres.
    [[nodiscard]] double roughness(const glm::dvec3& p) const {
        const double pits = std::max(0.0, noise(p * 19.0 + 7.0) - 0.35);
        return 0.0035 * noise.fractal(p, 0.16, finest) - 0.016 * pits * pits;
    }

    /// `cavity`: 1 in the depth of a fold, where dirt gathers.
    [[nodiscard]] glm::dvec3 colour(const glm::dvec3& p, double cavity) const {
        const double warp = noise(p * 2.1 + 31.0);
        const double wide = noise(p * glm::dvec3(2.6, 1.3, 2.6) + 1.6 * warp);
        const double fine = noise(p * glm::dvec3(7.0, 4.0, 7.0) + 2.2 * warp + 11.0);
        const double vein = 0.75 * bump(wide / 0.075) + 0.35 * bump(fine / 0.06);
        const double cloud = 0.5 + 0.5 * noise(p * 3.3 + 53.0);
        glm::dvec3 colour = kMarble * (0.93 + 0.07 * cloud);
        colour += (kVein - colour) * std::min(0.8, vein * (0.35 + 0.65 * cloud));
        const double dirt = std::clamp(cavity + 0.25 * noise(p * 9.0 + 71.0), 0.0, 1.0);
        return colour + (kDirt - colour) * (0.75 * dirt);
    }
};

}  // namespace vcp::scan
