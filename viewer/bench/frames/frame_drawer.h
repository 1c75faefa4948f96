// What the benchmark of frames asks of a caster: a picture's hits alone, or its light, shadows and occlusion as well.
#pragma once

#include <memory>

#include "builder/measure/indexed_mesh.h"
#include "octree/io/result.h"
#include "octree/reference_caster.h"
#include "render/frame_request.h"
#include "render/host/host_picture.h"

namespace vcp {

/// A frame to draw. All drawers get the same one.
struct FrameTask {
    FrameRequest request;         ///< a perspective camera, one light
    PictureRays rays;             ///< of the request, world space
    frame::FrameConstants frame;  ///< of the request, with lengths in finest cells
    bool isHitsOnly = false;      ///< only depths and normals are wanted
    double cell = 1;              ///< edge of a finest cell, world units
};

class FrameDrawer {
public:
    virtual ~FrameDrawer() = default;
    /// Makes ready for a camera; the time that it takes is not that of a frame.
    virtual Result<void> prepare(const FrameTask& task) = 0;
    /// Draws into an empty picture.
    virtual Result<void> draw(const FrameTask& task, HostPicture& picture) = 0;
};

/// The host's caster, over the pages that the renderer would draw. `cache` must outlive it. Errors of prepare: those of
/// reading pages.
std::unique_ptr<FrameDrawer> makeHostDrawer(PageCache& cache, unsigned threads);

/// Embree over the mesh: packets of 8 rays, coherent ones from the eye and to the light. Rays, light and colours are
/// the host's: the same tiles, shaded by the same code. Errors: Usage where this build has no Embree.
Result<std::unique_ptr<FrameDrawer>> makeEmbreeDrawer(const IndexedMesh& mesh, unsigned threads);

}  // namespace vcp
