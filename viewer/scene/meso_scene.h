// Mesostructure surfaces from what a person says of them: asset, method, base. What scenes and `vcp meso render` hand
// to the renderer (Renderer::setSurfaces).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "mesostructure/method.h"
#include "render/passes/meso_surface.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {

/// A procedural height field (256 texels) or solid by name, or a .meso file. Errors: Usage (no such name); those of
/// readAsset.
Result<meso::Asset> openMesoAsset(const std::string& name);

/// Where a scene file says something; no file: somebody else said it.
struct ScenePlace {
    std::string file;
    size_t line = 0;
    std::string key;  ///< empty: in that line

    /// An error of what was said there: where a person's arguments would be wrong, the file is.
    [[nodiscard]] Error blamed(Error error) const;
};

struct MesoSurfaceDescription {
    std::string asset;  ///< as openMesoAsset
    meso::MethodOptions method;
    std::string base = "quad";  ///< a name of baseSurfaceNames(), or a mesh file with texture coordinates
    double tiles = 4;           ///< along the base (makeBaseSurface, readBaseMesh)
    double heightScale = 1;     ///< of the slab; 1: as high as the asset is to its tile's edge
    glm::dvec3 place{0};        ///< the base's origin, world
    double scale = 1;           ///< of the base, mesh files too
    UpAxis up = UpAxis::Z;      ///< which way the base's z points; mesh files stay as they are
    glm::vec3 colour{0.8f};     ///< encoded
    std::string colourTexture, normalTexture;  ///< pictures over the tile (viewer/scene/tile_texture.h); empty: none
    bool withBase = true;
    bool withFar = true;  ///< far away it is not marched (MesoLook::errorPixels)
    ScenePlace from = {};
};

/// A direction or place in a world where z is up, in one where y may be.
inline glm::dvec3 turnedUp(glm::dvec3 p, UpAxis up) { return up == UpAxis::Z ? p : glm::dvec3(p.x, p.z, -p.y); }

struct MesoScene {
    std::vector<MesoSurface> surfaces;
    Box bounds = Box::nothing();
    std::vector<std::string> warnings;  ///< what shells and maps have that a picture may show
};

/// Errors: those of the assets, methods, bases and shells, with the file where there is one.
Result<MesoScene> makeMesoScene(std::span<const MesoSurfaceDescription> descriptions);

}  // namespace vcp
