// The colours of a tile's hits, from images where their triangles have some.
#pragma once

#include <optional>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "octree/imaged_triangle.h"
#include "render/host/host_scene.h"
#include "render/host/tile_hits.h"

namespace vcp {

/// One thread. What the pixels of a triangle share is found once.
class HitColours {
public:
    /// Both must outlive it.
    HitColours(const HostScene& scene, const TileHits& hits) : scene_(scene), hits_(hits) {}

    /// Returns the colour of a hit. `pixel`: element of the arrays of the hits at which there is one; `direction`: of
    /// its ray, unit; `pixelEdge`: of a pixel there, finest cells.
    glm::vec4 at(int pixel, glm::vec3 direction, float pixelEdge);

private:
    /// A triangle in an image, and how coordinates change over it.
    struct Textured {
        ImagedTriangle triangle;
        f32::TextureSlope slope;  // by cells of the page's level
        glm::vec3 normal;         // unit
    };
    const std::optional<Textured>& texturedOf(uint32_t leaf);
    [[nodiscard]] std::optional<Textured> find(const HitLeaf& leaf) const;

    const HostScene& scene_;
    const TileHits& hits_;
    std::vector<std::optional<std::optional<Textured>>>
        leaves_;  // of hits_.leaves: nothing is known, or no image is there
};

}  // namespace vcp
