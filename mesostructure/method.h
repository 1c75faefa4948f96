// A method by name: which marcher it is, with the arrays that it reads. The reference marchers (march.h) and the
// shaders are made from the same arrays (march_arrays.h).
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "mesostructure/asset_file.h"
#include "mesostructure/march_arrays.h"

namespace vcp::meso {

enum class WalkKind { Grid, Relief, Layers, Pyramid, Sphere, Displacement, Slices };

struct Method {
    WalkKind kind = WalkKind::Grid;
    const HeightMap* heights = nullptr;  ///< the asset's, where the method reads it; must outlive the method
    ReliefOptions relief;
    // In a walk over a grid, the first that exists of boxes, compressed, distances and occupancy skips; the others are
    // not read.
    std::unique_ptr<Occupancy> occupancy;
    std::unique_ptr<DistanceMap> distances;
    std::unique_ptr<CompressedMap> compressed;
    std::unique_ptr<OctantBoxes> boxes;
    std::unique_ptr<PatchSet> patches;
    std::unique_ptr<SampledField> field;
    std::unique_ptr<SphereMap> sphere;
    std::unique_ptr<SafeFactors> guesses;  ///< beside boxes
    int mostGuesses = 1;
    std::unique_ptr<GdmMap> gdm;
    std::unique_ptr<PropertyVolume> volume;
    std::unique_ptr<ReliefLayers> layers;

    [[nodiscard]] Skipping skipping() const;
    [[nodiscard]] Surface surface() const {
        return {patches.get(), kind == WalkKind::Grid ? heights : nullptr, field.get()};
    }
    /// Packs the arrays; the method is not referred to afterwards. Errors: Usage (a method without its arrays), Limit.
    [[nodiscard]] Result<MarchArrays> arrays() const;
    /// Makes the marcher. Errors: as gridMarcher's.
    [[nodiscard]] Result<std::unique_ptr<Marcher>> marcher() const;
};

struct MethodOptions {
    std::string name = "boxes";
    /// Cells of the grid, points of a map or texels of layers, along x; 0: the asset's own grid, or 64; points 32,
    /// texels 256.
    int cells = 0;
    Cones cones{4, 1};  ///< cones of all ddm
    int steps = 32;     ///< steps of relief mapping
    int refinements = 10;
    float tolerance = ReliefOptions().tolerance;
    int rank = 16;                  ///< terms of gdm, gdm-visibility and vdm; 0: the table itself
    int bits = 16;                  ///< of their values: 8 or 16
    glm::ivec2 directions{16, 32};  ///< theirs: elevations over the sphere (vdm: over its lower half), azimuths
    Curvatures curvatures{5, 0.5};  ///< of the base, of vdm
    /// Points along z of a map or of slices; 0: as far apart as along x. Bounds a texel of relief-layers; 0: 4.
    int layers = 0;
    const DistanceTable* table = nullptr;  ///< traced already by tracedBy of these options; null: it is traced
    /// As GdmOptions::shareOut, of that tracing.
    std::function<bool(size_t count, const std::function<void(size_t first, size_t last)>& fill)> shareOut = {};
    SafeOptions guesses = {};                         ///< of gdm-safe
    int mostGuesses = 1;                              ///< of a ray of gdm-safe
    double cap = 0;                                   ///< longest distance of dm and of all ddm, tiles; 0: 1/4, or 1/8
    DistanceRule distances = DistanceRule::AnyPoint;  ///< of dm and of all ddm
};

/// The names for height fields only: "relief-linear", "relief-binary", "relief-secant", "relief-secant-printed",
/// "relief-illinois", "pyramid". For all: "sphere", "dm", "ddm", "ddm-quadric", "ddm-quadric-fitted", "ddm-compressed",
/// "ddm-cells", "quadric", "boxes", "cells", "gdm", "gdm-visibility", "gdm-safe", "vdm", "slices", "relief-layers".
/// Beside "ddm-quadric", which is compressed, "ddm-compressed" has no quadrics, "quadric" steps from cell to cell, and
/// "ddm-cells" has the exact cells of "boxes" under the distances of "ddm".
std::span<const std::string_view> methodNames();
/// Whether a method of that name marches the asset: some march only height fields.
bool methodFits(std::string_view name, const Asset& asset);

/// Returns what is traced for "gdm", "gdm-visibility" and "vdm".
GdmOptions tracedBy(const Shape& shape, const MethodOptions& options);

/// Copies what the asset holds already, and builds the rest. `shape` is the asset's. Errors: Usage (no such method, or
/// it does not fit this asset); the builders'.
Result<Method> buildMethod(const Asset& asset, const Shape& shape, const MethodOptions& options);

}  // namespace vcp::meso
