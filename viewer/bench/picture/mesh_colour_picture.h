// A picture of the surface's own colours, without light, by Embree: what a textured mesh should look like.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "builder/measure/indexed_mesh.h"
#include "builder/measure/mesh_paint.h"
#include "octree/io/result.h"
#include "render/frame_request.h"

namespace vcp {

/// A picture of surface colours, upper row first; all vectors have a value for each pixel.
struct SurfaceColours {
    glm::ivec2 size{0};
    std::vector<glm::dvec3> light;  ///< linear, 0 to 1, mean over the part of the pixel that shows surface
    std::vector<float> coverage;    ///< part of the pixel whose rays meet a triangle
    std::vector<float> opacity;     ///< part of the pixel that shows surface: what images cut out is not

    SurfaceColours() = default;
    explicit SurfaceColours(glm::ivec2 pictureSize)
        : size(pictureSize), light(size_t(size.x) * size_t(size.y)), coverage(light.size()), opacity(light.size()) {}
};

class MeshColourPicture {
public:
    using Paint = std::function<PaintedLight(uint64_t triangle, glm::dvec3 weights)>;

    /// Errors: Usage where this build has no Embree. `mesh` must outlive the object.
    static Result<std::unique_ptr<MeshColourPicture>> create(const IndexedMesh& mesh, unsigned threads);
    virtual ~MeshColourPicture() = default;

    /// Returns the picture with `samples` x `samples` rays a pixel, on the points of an even grid; 1: its middle.
    /// `paint` says the light at a point of a triangle, from any thread. Precondition: a perspective camera.
    [[nodiscard]] virtual SurfaceColours draw(const FrameRequest& request, int samples, const Paint& paint) const = 0;
    /// Bytes of the tree and its buffers.
    [[nodiscard]] virtual uint64_t bytes() const = 0;
};

/// Colours at the vertices of a mesh alone: the plainest way to keep them.
class VertexColours {
public:
    /// Takes for each vertex the mean of the paint on its triangles, weighted by how much each point counts for the
    /// vertex: what it takes of the light where colours are blended.
    VertexColours(const IndexedMesh& mesh, const MeshPaint& paint, unsigned threads);
    /// Returns the light at a point, of the stored values blended as screens get them.
    [[nodiscard]] PaintedLight lightAt(uint64_t triangle, glm::dvec3 weights) const;
    /// Four bytes a vertex.
    [[nodiscard]] uint64_t bytes() const { return 4 * encoded_.size(); }

private:
    const IndexedMesh& mesh_;
    std::vector<glm::vec3> encoded_;  // 0 to 1, of 8 bits
};

}  // namespace vcp
