// What mesostructure is drawn over: octrees in the same picture, seen by the same camera in the same light. The nearer
// of the two wins at each pixel (MesoBehind); mesostructure casts no shadow on octrees, nor they on it.
#pragma once

#include <memory>
#include <string>

#include "render/meso_renderer.h"
#include "render/renderer.h"
#include "viewer/opened_scene.h"

namespace vcp {

class MesoBackdrop {
public:
    /// What `vcp render` takes: a .vcp file, a mesh, or a scene of several, of which only the datasets count. Errors: those of
    /// openScene and Renderer.
    static Result<MesoBackdrop> open(const std::string& input, const std::string& device);

    [[nodiscard]] Box bounds() const { return open_.bounds(); }
    /// Waits until settled. Of the request's size, camera, light, shadows and background. Errors: those of Renderer.
    Result<MesoBehind> draw(const MesoRequest& request);

private:
    OpenedScene open_;
    std::unique_ptr<Renderer> renderer_;
};

}  // namespace vcp
