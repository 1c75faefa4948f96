#include "viewer/scene/base_mesh.h"

#include "builder/measure/indexed_mesh.h"
#include "builder/mesh/obj.h"

namespace vcp {

namespace {

LoadOptions loading() {
    LoadOptions options;
    options.coordinates = Coordinates::Required;
    options.mostTriangles = 5'000'000, options.mostPositions = 15'000'000;
    return options;
}

Result<meso::BaseSurface> surfaceOf(Result<IndexedMesh> mesh, const std::string& name, double tiles) {
    if (!mesh) return mesh.error();
    meso::BaseSurface made{std::move(mesh->positions), std::move(mesh->triangles), std::move(mesh->coordinates)};
    for (auto& map : made.uvs)
        for (glm::dvec2& uv : map) uv *= tiles;
    if (!(meso::tileEdge(made) > 0))
        return Error{.message = "has no texture coordinates with an area; unwrap the mesh first", .file = name};
    meso::joinPositions(made);
    return made;
}

}  // namespace

Result<meso::BaseSurface> readBaseObj(ByteSource source, double tiles) {
    const std::string name = source.name();
    MeshOpenOptions open;
    open.coordinates = Coordinates::Required;
    VCP_TRY_ASSIGN(const auto stream, openObj(std::move(source), {}, open));
    return surfaceOf(loadMesh(*stream, name, loading()), name, tiles);
}

Result<meso::BaseSurface> readBaseMesh(const std::filesystem::path& path, double tiles) {
    return surfaceOf(loadMesh(path, loading()), path.string(), tiles);
}

}  // namespace vcp
