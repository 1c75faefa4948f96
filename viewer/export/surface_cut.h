// What of a dataset is exported: the pages that hold its surface as a level has it, and where in them its points
// belong. Nothing here reads a page.
//
// Vertices of triangles lie on the lattice of the deepest level, so a vertex is three whole numbers, the same in every
// page that has it. An exact page holds nothing but triangles, each of its level that touches its closed cube. A vertex
// belongs to the first exact page, octant by octant, whose closed cube holds it: its home. A home knows every triangle
// at its vertices, so it can number them without asking another page.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/dataset_reader.h"
#include "octree/io/result.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {

/// A point in steps of the deepest level's lattice, 2048 a cell, from the dataset's origin.
using LatticePoint = glm::i64vec3;

/// A plane: dot(normal, x) = offset, world units; |normal| > 0.
struct CutPlane {
    glm::dvec3 normal{0, 0, 1};
    double offset = 0;
};

/// The bounds of the mesh that a dataset was built from.
Box boundsOf(const FileHeader& header);

class SurfaceCut {
public:
    /// `dataset`: its directory is known as a whole; it must outlive this. `level`: the finest where it is larger.
    /// `box`: only triangles whose centre lies in it are wanted; boxes side by side share none. `plane`: only pages
    /// that touch it are named. Errors: Unsupported, where the file is not of the certified method.
    static Result<SurfaceCut> create(const Dataset& dataset, const std::string& name, uint32_t level,
                                     const std::optional<Box>& box = {}, const std::optional<CutPlane>& plane = {});

    [[nodiscard]] const Dataset& dataset() const { return *dataset_; }
    /// The file's name, for errors.
    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] uint32_t level() const { return level_; }
    /// Whether all of the surface is the mesh's own triangles.
    [[nodiscard]] bool isMesh() const { return isMesh_; }
    /// The pages to read, in the file's order.
    [[nodiscard]] std::span<const uint64_t> pages() const { return pages_; }
    /// The largest certified error of the pages, world units.
    [[nodiscard]] double certifiedError() const { return certifiedError_; }

    [[nodiscard]] bool isExact(uint64_t page) const;
    [[nodiscard]] LatticePoint originOf(uint64_t page) const;
    /// Returns the edge of a page in steps of the lattice.
    [[nodiscard]] int64_t edgeOf(uint64_t page) const;
    /// A step of the page's own lattice is 2^shiftOf of the deepest level's.
    [[nodiscard]] uint32_t shiftOf(uint64_t page) const;
    /// Returns the exact page that a point belongs to, or none.
    [[nodiscard]] std::optional<uint64_t> homeOf(LatticePoint p) const;

    /// Edge of a step of the lattice, world units.
    [[nodiscard]] double step() const { return step_; }
    [[nodiscard]] glm::dvec3 worldOf(glm::dvec3 steps) const { return origin_ + steps * step_; }
    [[nodiscard]] glm::dvec3 worldOf(LatticePoint p) const { return worldOf(glm::dvec3(p)); }
    /// Whether a triangle is in the box, by its centre.
    [[nodiscard]] bool wants(glm::dvec3 centre) const;

private:
    explicit SurfaceCut(const Dataset& dataset) : dataset_(&dataset) {}
    [[nodiscard]] bool isInCut(const PageEntry& page) const;
    [[nodiscard]] bool isWanted(const PageEntry& page, const std::optional<CutPlane>& plane) const;
    [[nodiscard]] std::optional<uint64_t> homeBelow(uint64_t page, LatticePoint p) const;

    const Dataset* dataset_;
    std::string name_;
    uint32_t level_ = 0;
    bool isMesh_ = true;
    std::optional<Box> box_;
    std::vector<uint64_t> pages_;
    double certifiedError_ = 0, step_ = 0;
    glm::dvec3 origin_{0};
};

/// Returns the coarsest level all of whose pages, of those that box and plane want, are certified within `error`, world
/// units. Errors: Usage, where not even the finest is; those of SurfaceCut::create.
Result<uint32_t> coarsestLevelWithin(double error, const Dataset& dataset, const std::string& name,
                                     const std::optional<Box>& box = {}, const std::optional<CutPlane>& plane = {});

}  // namespace vcp
