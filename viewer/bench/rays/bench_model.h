// A model of the benchmarks: its mesh in memory, and the .vcp built from it.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "builder/measure/mesh_bvh.h"
#include "octree/io/result.h"
#include "octree/reference_caster.h"

namespace vcp {

/// The mesh of a model and its .vcp.
struct ModelFiles {
    std::filesystem::path mesh, vcp;
    std::string name;
};

/// Everything about one model that methods share.
struct BenchModel {
    ModelFiles files;
    IndexedMesh mesh;
    std::unique_ptr<MeshBvh> bvh;
    std::unique_ptr<PageCache> cache;  ///< no page is loaded
};

/// Loads a mesh and builds its .vcp in `folder`, unless it is there; of a .vcp, the mesh of the same name beside it.
/// `cell` 0: chosen from the mesh; `withImages`: as of vcp build. `report` hears what is being done. `load`: how the
/// mesh is read. Errors: Usage, where no mesh is beside a .vcp; those of loadMesh, buildOctree, PageCache::open and
/// `report`.
Result<std::unique_ptr<BenchModel>> loadBenchModel(const std::filesystem::path& model,
                                                   const std::filesystem::path& folder, double cell, unsigned threads,
                                                   const std::function<Result<void>(const std::string& what)>& report,
                                                   const LoadOptions& load = {}, bool withImages = false);

/// Checks that all names that were asked for are known. `kind`: "camera". Errors: Usage.
Result<void> checkNames(const std::vector<std::string>& wanted, const std::vector<std::string>& known,
                        const char* kind);

}  // namespace vcp
