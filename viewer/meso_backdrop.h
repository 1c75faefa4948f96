// What mesostructure is drawn over: an octree in the same picture, seen by the same camera in the same light. The nearer
// of the two wins at each pixel (MesoBehind); mesostructure casts no shadow on the octree, nor the octree on it.
#pragma once

#include <memory>
#include <string>

#include "render/meso_renderer.h"
#include "render/renderer.h"
#include "viewer/open_dataset.h"

namespace vcp {

class MesoBackdrop {
public:
    /// A .vcp file, or a mesh, which is built into the cache first. Errors: those of datasetFor, openDataset and Renderer.
    static Result<MesoBackdrop> open(const std::string& input, const std::string& device);

    [[nodiscard]] Box bounds() const { return open_.bounds(); }
    /// Waits until settled. Of the request's size, camera, light, shadows and background. Errors: those of Renderer.
    Result<MesoBehind> draw(const MesoRequest& request);

private:
    OpenDataset open_;
    std::unique_ptr<Renderer> renderer_;
};

}  // namespace vcp
