// Which meshes a glTF scene shows, and where.
#pragma once

#include <vector>

#include <glm/mat4x4.hpp>

#include "builder/mesh/gltf/gltf_accessor.h"
#include "builder/mesh/gltf/gltf_document.h"

namespace vcp {

struct GltfPlacement {
    uint32_t mesh = 0;
    uint32_t node = 0;
    glm::dmat4 worldFromNode{1};
};

/// Returns the nodes with a mesh, depth first, in the order of the file. A node with several parents, which glTF does
/// not allow but some exporters write, is shown once for each. Errors, without file: InvalidInput (a ring of nodes),
/// Limit (more than 2^21 nodes so).
Result<std::vector<GltfPlacement>> placementsOf(const GltfDocument& document);

/// The transforms of EXT_mesh_gpu_instancing, one after another; a single identity without.
class GltfInstances {
public:
    GltfInstances(const GltfDocument& document, GltfBuffers& buffers, const GltfNode& node);

    [[nodiscard]] bool done() const { return next_ == count_; }
    Result<glm::dmat4> next();

private:
    std::optional<GltfAccessorReader> translation_, rotation_, scale_;
    std::vector<double> t_, r_, s_;
    uint64_t count_ = 1;
    uint64_t next_ = 0;
};

}  // namespace vcp
