// A part of a mesh that is built to foretell the rest: cubes all over it, with all of their triangles.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/build.h"
#include "builder/stream/material.h"
#include "octree/surface/vertex_normal.h"

namespace vcp {

/// Chooses cubes by a hash of their place; ever fewer of them, so that it holds a bounded number of triangles. One
/// thread.
class BuildSample {
public:
    struct Triangle {
        glm::dvec3 corner[3];  ///< world units
        Rgba8 colour[3];
        uint32_t normal[3] = {kUnknownNormal, kUnknownNormal, kUnknownNormal};  ///< the mesh's own (packDirection)
    };

    /// `most`: triangles, unless all cubes but one have gone.
    explicit BuildSample(size_t most = 300000) : most_(most) {}

    /// Takes a triangle that has an area.
    void add(const Triangle& triangle);

    [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }

private:
    [[nodiscard]] uint64_t hashOfCube(const Triangle& triangle) const;
    [[nodiscard]] bool isChosen(const Triangle& triangle) const;
    void chooseCube();
    void thinOut();

    size_t most_;
    double cube_ = 0;      ///< edge, world units; 0: not chosen yet
    unsigned halved_ = 0;  ///< one of 2^halved_ cubes is chosen
    std::vector<Triangle> triangles_;
};

/// What the build of a sample took, by triangle of it.
struct SampleFigures {
    double fileBytes = 0;
    double seconds = 0;  ///< from its first byte in memory to the file, without reading
};

/// Builds the sample, in a folder of its own among the system's temporary files that is gone afterwards. `options`: of
/// the whole; `cell`: its cell, world units. Errors: as buildOctree's; Io (no room for temporary files).
Result<SampleFigures> buildSample(const BuildOptions& options, double cell, const BuildSample& sample, bool hasColour);

}  // namespace vcp
