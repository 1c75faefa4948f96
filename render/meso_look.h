// What drawing a surface with mesostructure takes besides its arrays and its shell, for the passes as for the host.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "render/frame_request.h"
#include "render/meso_surface.h"
#include "render/shared/meso_view.h"

namespace vcp {

/// How a surface looks in all pictures.
struct MesoLook {
    frame::MesoView view{};       ///< what does not depend on the picture
    std::vector<uint64_t> looks;  ///< words of what is seen from far, then the textures, then the transfer
    uint32_t textures = 0;        ///< frame::kMesoColours, kMesoNormals
    bool isFarDrawn = false;      ///< it is seen from far where it is small
};
MesoLook mesoLook(const MesoSurface& surface);
/// Surfaces with the same key have the same words.
using LookKey = std::array<const void*, 4>;
inline LookKey lookKey(const MesoSurface& surface) {
    return {surface.far.get(), surface.colours.get(), surface.normals.get(), surface.transfer.get()};
}
/// Returns a view of the surface without textures and what is seen from far.
frame::MesoView plainView(const MesoSurface& surface);

/// Fills the rays of a picture and what they are clipped by. `origin`: of the surface's space in the world.
void setRays(frame::MesoView& view, glm::dvec3 origin, const PictureRays& rays);

/// Fills all that depends on the picture.
void setPicture(frame::MesoView& view, glm::dvec3 origin, const FrameRequest& request);

/// Whether light from everywhere is another over a surface's base than that of the surroundings.
bool changesBaseLight(const MesoSurface& surface);

/// Whether pictures show what volumes of transfer say.
bool readsTransfer(const Shading& shading);

/// Whether rays of light go from and through the surfaces of a picture.
bool hasMesoShadows(const Shading& shading);

}  // namespace vcp
