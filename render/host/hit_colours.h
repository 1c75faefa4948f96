// The colours of a tile's hits, from images where their triangles have some.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "octree/imaged_triangle.h"
#include "render/host/hit_surface.h"
#include "render/host/host_scene.h"
#include "render/host/tile_hits.h"

namespace vcp {

/// One thread. What the pixels of a triangle share is found once.
class HitColours {
public:
    /// Both must outlive it.
    HitColours(const HostScene& scene, const TileHits& hits) : scene_(scene), hits_(hits) {}

    /// How a pixel sees a hit. `direction`: of its ray, unit; `edge`: of the pixel there, finest cells.
    struct PixelView {
        glm::vec3 direction;
        float edge;
    };

    /// Returns the colour of a hit. `pixel`: element of the arrays of the hits at which there is one; `viewOf()`: its
    /// PixelView, which is not asked for at every pixel.
    template <class ViewOf>
    glm::vec4 at(int pixel, const ViewOf& viewOf) {
        Textured* const t = texturedAt(pixel);
        if (t == nullptr) return colourAt(scene_, hits_, pixel);
        const float depth = hits_.depth[pixel];
        if (!(std::abs(depth - t->depth) <= kSameFootprint * t->depth)) setPlaces(*t, pixel, viewOf());
        return t->triangle.factor * filteredColour(*t->triangle.image, t->triangle.wraps,
                                                   t->triangle.at(hits_.x[pixel], hits_.y[pixel]), t->places);
    }

private:
    /// A triangle in an image.
    struct Textured {
        ImagedTriangle triangle;
        f32::TextureSlope slope;  // by cells of the page's level
        glm::vec3 normal;         // unit
        float depth = -1;         // world units: where `places` was found; -1: nowhere yet
        ImagePlaces places;
    };
    /// Over a plane, footprints grow as depths and as slants do, and these as depths again: what differs by so small a
    /// part in depth has a footprint within twice that.
    static constexpr float kSameFootprint = 0.02f;

    /// Returns the triangle of a hit in its image; null where the hit has none.
    Textured* texturedAt(int pixel);
    [[nodiscard]] std::optional<Textured> find(const HitLeaf& leaf) const;
    void setPlaces(Textured& t, int pixel, const PixelView& view) const;

    const HostScene& scene_;
    const TileHits& hits_;
    std::vector<std::optional<std::optional<Textured>>> leaves_;  // of hits_.leaves: not known yet, or without an image
};

}  // namespace vcp
