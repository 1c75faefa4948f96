// The methods of the ray benchmark by name, each with a knob of its own.
//
//   name           what                                                    knob
//   certified      the renderer on a Vulkan device                         error-pixels  0.5; swept 0.5, 1, 2, 4
//   host           the renderer's rays on the processor (render/host/)     error-pixels  0.5; swept 0.5, 1, 2, 4
//   reference      the reference ray-caster in double, finest level
//   paper          Demir and Westermann 2015 (builder/paper/paper_octree.h)        eps  0.25; swept 0.5, 0.25, 0.1
//   paper-onward   the same, steps by the plane up to 2 eps beyond the distance   eps, as paper
//   paper-gpu      the same march over the same octree on a Vulkan device   eps, as paper
//   paper-subvolumes      the same march over the file in subvolumes (builder/paper/paper_subvolumes.h)      eps, as
//   paper paper-subvolumes-gpu  the same on a Vulkan device, which loads those that the view needs   eps, as paper
//   paper-rules    the same with one rule changed at a time                the rule; all of them, always
//   sdf            signed-distance octree (viewer/bench/peers/distance_octree.h)        cell  1; swept 2, 1, 0.5
//   sdf-analytic   trilinear distance, cubic roots (the same)              cell  1; swept 2, 1, 0.5
//   voxel          binary voxel octree (viewer/bench/peers/voxel_octree.h)              cell  1; swept 1, 0.5, 0.25
//   svo-contours   voxels with contours (the same)                         cell  1; swept 2, 1, 0.5
//   embree         packets of 8 coherent rays over the triangles
//   embree-single  one ray at a time
//
// eps and cell count finest cells of the model's .vcp; the peers are built at that cell, or so many times it.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "builder/measure/mesh_sides.h"
#include "builder/paper/paper_octree.h"
#include "viewer/bench/rays/bench_tracer.h"

namespace vcp {

/// Returns the names, in the order of the table above.
const std::vector<std::string>& rayMethodNames();
/// Whether a method is run where none is named: others take as long as all of these, or show no method of its own.
bool isUsualRayMethod(const std::string& method);
/// Returns the default alone, or all values that are swept; a single 0 for a method without a knob.
std::vector<double> rayMethodKnobs(const std::string& method, bool sweep);

/// One model's tracers. What several of them need is made once. Used by one thread.
class RayMethods {
public:
    struct Inputs {
        const IndexedMesh& mesh;
        const MeshBvh& bvh;
        const PageCache& cache;  ///< with the pages of the finest level
        std::filesystem::path vcp;
        std::string device;
        unsigned threads = 0;
        double cell = 1;                                   ///< finest edge of the .vcp, world units
        PaperOptions paper = {};                           ///< options of `paper`; its epsilon is the knob
        std::filesystem::path meshFile = {}, folder = {};  ///< of the mesh; for the file in subvolumes
    };
    explicit RayMethods(Inputs inputs) : in_(std::move(inputs)) {}

    /// Makes a tracer. Errors: Usage where this build lacks the method, Limit where a grid would be too large, Device.
    Result<std::unique_ptr<RayTracer>> make(const std::string& method, double knob);

private:
    const MeshSides& sides();
    Result<const PaperCaster*> paperOf(const PaperOptions& options);
    Result<std::unique_ptr<RayTracer>> makePaper(const PaperOptions& options, std::string knob);
    Result<std::unique_ptr<RayTracer>> makePaperGpu(const PaperOptions& options);
    /// Builds the file in subvolumes, once.
    Result<std::filesystem::path> subvolumesOf(const PaperOptions& options);
    Result<std::unique_ptr<RayTracer>> makeSubvolumes(const PaperOptions& options, bool onDevice);
    Result<std::unique_ptr<RayTracer>> makeDistances(bool analytic, double cells);
    Result<std::unique_ptr<RayTracer>> makeVoxels(bool contours, double cells) const;

    Inputs in_;
    std::optional<MeshSides> sides_;
    std::optional<PaperCaster> paper_;
    std::filesystem::path subvolumes_;  // empty: the file is not built
};

}  // namespace vcp
