// A method by name: which marcher it is, with the arrays that it reads. The reference marchers (march.h) and the
// shaders are made from the same arrays (march_arrays.h).
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "mesostructure/asset_file.h"
#include "mesostructure/march_arrays.h"

namespace vcp::meso {

enum class WalkKind { Grid, Relief, Pyramid, Sphere };

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
    int cells = 0;      ///< cells of the grid along x; 0: the asset's own grid, or 64
    Cones cones{4, 1};  ///< cones of ddm, ddm-quadric and ddm-quadric-fitted
    int steps = 32;     ///< steps of relief mapping
    int refinements = 10;
    float tolerance = ReliefOptions().tolerance;
    double cap = 0;  ///< longest distance of dm, ddm, ddm-quadric and ddm-quadric-fitted, tiles; 0: 1/4, or 1/8
};

/// The names for height fields only: "relief-linear", "relief-binary", "relief-secant", "relief-secant-printed",
/// "relief-illinois", "pyramid". For all: "sphere", "dm", "ddm", "ddm-quadric", "ddm-quadric-fitted", "boxes", "cells".
std::span<const std::string_view> methodNames();
/// Whether a method of that name marches the asset: some march only height fields.
bool methodFits(std::string_view name, const Asset& asset);

/// Copies what the asset holds already, and builds the rest. `shape` is the asset's. Errors: Usage (no such method, or
/// it does not fit this asset); the builders'.
Result<Method> buildMethod(const Asset& asset, const Shape& shape, const MethodOptions& options);

}  // namespace vcp::meso
