// Makes mesostructure surfaces from a person's description: asset, method, base. A scene hands them to
// the renderer (Renderer::setSurfaces).
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mesostructure/method.h"
#include "render/meso_surface.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {

/// Where heights that are many are kept: in the folder of the cache (mesh_cache.h), else in the system's for temporary
/// files.
meso::HeightStore heightStore();

/// Opens a procedural height field (256 texels) or solid by name, or a .meso file. Errors: Usage (no such name); those
/// of readAsset.
Result<meso::Asset> openMesoAsset(const std::string& name);

/// The place of a value in a scene file; without a file the value comes from elsewhere.
struct ScenePlace {
    std::string file;
    size_t line = 0;
    std::string key;  ///< key of the value; empty: the line as a whole

    /// Turns an error of that value into one of the file, where it would be one of a person's arguments.
    [[nodiscard]] Error blamed(Error error) const;
};

/// The method that draws displaced surfaces as triangles, remeshed for each view (mesostructure/remesh/remesher.h). It
/// is for height fields only.
inline constexpr std::string_view kRemeshMethod = "remesh";

/// What a surface may be drawn by: the methods that march, and kRemeshMethod.
inline std::span<const std::string_view> surfaceMethodNames() {
    static const std::vector<std::string_view> names = [] {
        std::vector<std::string_view> all(meso::methodNames().begin(), meso::methodNames().end());
        all.push_back(kRemeshMethod);
        return all;
    }();
    return names;
}

/// Points that a surface goes along at even speed: to the last one and back again, or round and round where that is the
/// first one.
struct SurfacePath {
    static constexpr double kUsualSeconds = 8;

    std::vector<glm::dvec3> points;  ///< none: it stays; else at least two
    double seconds = kUsualSeconds;  ///< from the first to the last, above 0

    /// Returns the time after which it begins again; 0 where it stays.
    [[nodiscard]] double period() const;
    /// Returns the place at a time from 0 on. Precondition: there are points.
    [[nodiscard]] glm::dvec3 at(double time) const;
};

struct MesoSurfaceDescription {
    std::string asset;           ///< as openMesoAsset
    std::string displacement;    ///< in its place, a picture of heights (viewer/asset/height_image.h) 1 tile edge high
    meso::MethodOptions method;  ///< its name may be kRemeshMethod
    double cell = 1;             ///< kRemeshMethod: pixels of a cell; with an error, beside jumps of the map
    double errorPixels = 0.5;    ///< kRemeshMethod: what is certified; 0: nothing is, and cells have one size
    std::string base = "quad";   ///< a name of baseSurfaceNames(), or a mesh file with texture coordinates
    double tiles = 4;            ///< tile edges along the base (makeBaseSurface, readBaseMesh)
    int subdivide = 0;           ///< times that Loop's rules are applied to the base (meso::subdivided)
    double heightScale = 1;      ///< height of the slab; 1: in the asset's own proportion to its tile's edge
    double offset = 0;       ///< by how much the slab's bottom lies over the base, in the base's units; below 0 under
    bool withFilter = true;  ///< kRemeshMethod: with coarser levels of the heights
    bool withLightRays = true;  ///< kRemeshMethod: it may cast shadows and occlude, for which more is made
    glm::dvec3 place{0};        ///< the base's origin, world
    SurfacePath path;           ///< of the origin, world; not of kRemeshMethod
    double scale = 1;           ///< scale of the base, of mesh files too
    UpAxis up = UpAxis::Z;      ///< which way the base's z points; mesh files stay as they are
    glm::vec3 colour{0.8f};     ///< encoded
    std::string colourTexture, normalTexture;  ///< pictures over the tile (viewer/scene/tile_texture.h); empty: none
    bool withBase = true;
    bool withFar = true;        ///< far away it is not marched (MesoLook::errorPixels)
    bool withTransfer = false;  ///< light from everywhere comes as the asset's transfer says; then it has no far look
    bool withBaseTransfer = true;  ///< and as the bases of the scene let it through, which shade each other
    ScenePlace from = {};
};

/// Turns a direction or place from a world where z is up to one where `up` is.
inline glm::dvec3 turnedUp(glm::dvec3 p, UpAxis up) { return up == UpAxis::Z ? p : glm::dvec3(p.x, p.z, -p.y); }

struct MesoScene {
    std::vector<MesoSurface> surfaces;
    std::vector<SurfacePath> paths;     ///< of the surfaces, one each, from where they lie: FrameRequest::surfacesMoved
    Box bounds = Box::nothing();        ///< wherever they go
    std::vector<std::string> warnings;  ///< properties of shells and maps that a picture may show
};

/// Returns the longest period of the paths; 0: nothing moves.
double periodOf(std::span<const SurfacePath> paths);
/// Returns FrameRequest::surfacesMoved at a time from 0 on; empty where nothing moves.
std::vector<glm::dvec3> surfacesMovedAt(std::span<const SurfacePath> paths, double time);

/// Is told what is being made, and how far it is, from 0 to 1; false cancels. May be empty.
using SurfaceProgress = std::function<bool(const char* stage, double part)>;

/// Makes the surfaces. Errors: those of the assets, methods, bases and shells, with the file where there is one;
/// Cancelled, between two surfaces, while a displacement map or light between their bases is traced, and while a
/// remeshed surface is cut.
Result<MesoScene> makeMesoScene(std::span<const MesoSurfaceDescription> descriptions,
                                const SurfaceProgress& progress = {});

}  // namespace vcp
