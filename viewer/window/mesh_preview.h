// The mesh that is being built, as far as it was read, drawn over the window: patches of the sampled triangles, far
// ones first. It stands for a picture until there is a dataset, without a device's help and at little cost to the
// build.
//
// Times as in viewer.h. One thread; the sample is filled by another.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/mesh_sample.h"
#include "render/frame_request.h"
#include "viewer/camera/orbit_camera.h"

struct ImDrawList;

namespace vcp {

class MeshPreview {
public:
    /// Takes in what was read since, a few times a second. Returns whether there is more to see than before.
    bool update(const MeshSample& sample, double now);

    /// Whether anything was read.
    [[nodiscard]] bool isShown() const { return version_ > 0; }
    [[nodiscard]] Box bounds() const { return {read_.low, read_.high}; }

    /// Draws it as the request shows it, without shadows and sections. Triangles that stand for others are squares on
    /// their planes, as large as twice all of them; vertices are dots of `dot` pixels, behind all triangles.
    void draw(ImDrawList& list, const FrameRequest& request, float dot);

private:
    /// A filled shape of three or four corners.
    struct Patch {
        float depth;      ///< before the eye
        uint32_t colour;  ///< as the screen shows it
        uint32_t corners;
        std::array<glm::vec2, 4> pixel;
    };
    class Sight;

    /// Adds nothing where a corner is behind the eye, or the triangle has no area.
    void addTriangle(const MeshSample::Triangle& triangle, const Sight& sight);
    void addDot(glm::vec3 vertex, float radius, uint32_t colour, const Sight& sight);

    uint64_t version_ = 0;
    double takenAt_ = 0;
    MeshSample::Snapshot read_;
    // What was drawn last, and for what: panels are laid out more often than anything moves.
    uint64_t drawnVersion_ = 0;
    FrameRequest drawn_;
    std::vector<Patch> patches_;
};

}  // namespace vcp
