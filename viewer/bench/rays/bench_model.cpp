#include "viewer/bench/rays/bench_model.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "builder/build.h"

namespace vcp {

namespace {

/// Names the files: datasets of one mesh with several cells, and those with images, have names of their own. `cell` 0:
/// chosen from the mesh.
Result<ModelFiles> filesOf(const std::filesystem::path& model, const std::filesystem::path& folder, double cell,
                           bool withImages) {
    if (model.extension() != ".vcp") {
        const std::string name = model.stem().string(), kind = name + (withImages ? "-images" : "");
        return ModelFiles{model, folder / (cell > 0 ? fmt::format("{}-cell-{}.vcp", kind, cell) : kind + ".vcp"), name};
    }
    for (const char* extension : {".ply", ".obj", ".stl", ".gltf", ".glb"}) {
        std::filesystem::path mesh = model;
        mesh.replace_extension(extension);
        if (std::filesystem::exists(mesh)) return ModelFiles{mesh, model, model.stem().string()};
    }
    return Error{.code = ErrorCode::Usage,
                 .message = "no mesh of the same name lies beside it (.ply, .obj, .stl, .gltf, .glb)",
                 .file = model.string()};
}

}  // namespace

Result<void> checkNames(const std::vector<std::string>& wanted, const std::vector<std::string>& known,
                        const char* kind) {
    for (const std::string& name : wanted)
        if (std::ranges::find(known, name) == known.end())
            return Error{.code = ErrorCode::Usage,
                         .message = fmt::format("unknown {} \"{}\"; there are {}", kind, name, fmt::join(known, ", "))};
    return {};
}

Result<std::unique_ptr<BenchModel>> loadBenchModel(const std::filesystem::path& path,
                                                   const std::filesystem::path& folder, double cell, unsigned threads,
                                                   const std::function<Result<void>(const std::string& what)>& report,
                                                   const LoadOptions& load, bool withImages) {
    VCP_TRY_ASSIGN(auto files, filesOf(path, folder, cell, withImages));
    auto model = std::make_unique<BenchModel>();
    model->files = files;
    VCP_TRY(report(fmt::format("{}: reading the mesh", files.name)));
    LoadOptions withNormals = load;
    withNormals.normals = true;
    VCP_TRY_ASSIGN(auto mesh, loadMesh(files.mesh, withNormals));
    model->mesh = std::move(mesh);
    if (!std::filesystem::exists(files.vcp)) {
        VCP_TRY(report(fmt::format("{}: building", files.name)));
        BuildOptions build;
        build.inputs = {files.mesh};
        build.output = files.vcp;
        build.cell = cell;
        build.threads = threads;
        build.keepImages = withImages;
        VCP_TRY(buildOctree(build));
    }
    VCP_TRY_ASSIGN(auto cache, PageCache::open(files.vcp));
    model->cache = std::make_unique<PageCache>(std::move(cache));
    model->bvh = std::make_unique<MeshBvh>(model->mesh);
    return model;
}

}  // namespace vcp
