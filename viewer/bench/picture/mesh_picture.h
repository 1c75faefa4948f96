// A picture of the mesh itself, by Embree, with many samples a pixel: what every picture of it should look like.
//
// The light is that of the shade pass (render/shaders/shade.comp) on white. Normals are the means, weighted by area, of
// the triangles about a vertex, found by its position; across creases, where a sixteenth of them turns away from the
// mean by more than 40 degrees, a triangle keeps its own (octree/surface/vertex_normal.h has the same rule). Normals of
// the mesh's file count in place of these. Samples are added as light, and the sum is encoded in 8 bits, as the
// product's pictures are: without that, what rounding leaves between the two counts as 0.01 of FLIP where nothing else
// differs.
#pragma once

#include <memory>

#include "builder/measure/indexed_mesh.h"
#include "octree/io/result.h"
#include "render/frame_request.h"
#include "viewer/bench/picture/picture_difference.h"

namespace vcp {

/// Returns a request for a picture of light alone: white, before an even background.
FrameRequest lightRequest(const Camera& camera, glm::ivec2 size);

/// The light that falls on a surface with this normal, 0 to 1, not encoded; both directions are units.
float lightOn(glm::vec3 normal, glm::vec3 towardsLight, glm::vec3 towardsSky);

class MeshPicture {
public:
    /// Errors: Usage where this build has no Embree. `mesh` must outlive the object.
    static Result<std::unique_ptr<MeshPicture>> create(const IndexedMesh& mesh, unsigned threads);
    virtual ~MeshPicture() = default;

    /// Returns the picture with `samples` x `samples` rays a pixel, on the points of an even grid; 1: its middle.
    /// Depth is the mean over the samples that hit, and so is the normal. Precondition: a perspective camera.
    [[nodiscard]] virtual LightPicture draw(const FrameRequest& request, int samples) const = 0;
    [[nodiscard]] virtual uint64_t bytes() const = 0;
};

}  // namespace vcp
