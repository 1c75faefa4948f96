#include "builder/mesh/gltf/gltf_scene.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

namespace vcp {

Result<std::vector<GltfPlacement>> placementsOf(const GltfDocument& document) {
    struct Visit {
        uint32_t node;
        size_t depth;
        glm::dmat4 worldFromParent;
    };
    constexpr size_t kMostNodes = size_t{1} << 21;
    size_t visited = 0;
    std::vector<Visit> stack;
    const glm::dmat4 world = glm::translate(glm::dmat4(1), document.centre);
    for (auto root = document.roots.rbegin(); root != document.roots.rend(); ++root) stack.push_back({*root, 1, world});
    std::vector<GltfPlacement> placements;
    while (!stack.empty()) {
        const Visit visit = stack.back();
        stack.pop_back();
        if (visit.depth > document.nodes.size())
            return Error{.code = ErrorCode::InvalidInput,
                         .message = "is its own ancestor",
                         .element = fmt::format("node {}", visit.node)};
        if (++visited + stack.size() > kMostNodes)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("its scene shows more than {} nodes", kMostNodes)};
        const GltfNode& node = document.nodes[visit.node];
        const glm::dmat4 worldFromNode = visit.worldFromParent * node.local;
        if (node.mesh && !document.meshes[*node.mesh].primitives.empty())
            placements.push_back({*node.mesh, visit.node, worldFromNode});
        for (auto child = node.children.rbegin(); child != node.children.rend(); ++child)
            stack.push_back({*child, visit.depth + 1, worldFromNode});
    }
    // Files without nodes show each mesh once.
    if (document.nodes.empty())
        for (uint32_t mesh = 0; mesh < document.meshes.size(); ++mesh)
            if (!document.meshes[mesh].primitives.empty()) placements.push_back({mesh, 0, world});
    return placements;
}

GltfInstances::GltfInstances(const GltfDocument& document, GltfBuffers& buffers, const GltfNode& node) {
    if (!node.instancing) return;
    count_ = node.instancing->count;
    if (node.instancing->translation) translation_.emplace(document, buffers, *node.instancing->translation);
    if (node.instancing->rotation) rotation_.emplace(document, buffers, *node.instancing->rotation);
    if (node.instancing->scale) scale_.emplace(document, buffers, *node.instancing->scale);
}

Result<glm::dmat4> GltfInstances::next() {
    glm::dmat4 transform(1);
    if (translation_) {
        VCP_TRY(translation_->read(1, t_));
        transform = glm::translate(transform, glm::dvec3(t_[0], t_[1], t_[2]));
    }
    if (rotation_) {
        VCP_TRY(rotation_->read(1, r_));
        const double length = std::sqrt(r_[0] * r_[0] + r_[1] * r_[1] + r_[2] * r_[2] + r_[3] * r_[3]);
        if (length > 0)
            transform =
                transform * glm::mat4_cast(glm::dquat(r_[3] / length, r_[0] / length, r_[1] / length, r_[2] / length));
    }
    if (scale_) {
        VCP_TRY(scale_->read(1, s_));
        transform = glm::scale(transform, glm::dvec3(s_[0], s_[1], s_[2]));
    }
    ++next_;
    return transform;
}

}  // namespace vcp
