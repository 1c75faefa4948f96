// Times the remeshing of single views on a device of its own (passes/remesh_sweep.h), and beside it the tessellator of
// the device, which gets the same pieces as patches: for measuring. Renderer::setSurfaces draws pictures of remeshed
// surfaces.
//
// The tessellator parts an edge as the sweep does, in whole parts of one length, up to 64; longer ones are halved
// first. Points of edges are the sweep's, bit for bit (shaders/remesh_patch.tesc, remesh_patch.tese). Within a patch it
// has one level, from which it makes rings: about as many triangles as the sweep, elsewhere.
//
// One thread at a time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <glm/vec4.hpp>

#include "mesostructure/remesh/certified_cells.h"
#include "mesostructure/remesh/remesher.h"
#include "octree/io/result.h"
#include "render/vulkan/device_info.h"

namespace vcp {

/// One view, as medians of several rounds. Processor times are of all threads of the process.
struct RemeshTimes {
    double piecesMs = 0;          ///< processor: culling, halving and uploading pieces
    double sweepMs = 0;           ///< the queue's time, or the call's where the queue has no clock
    double sweepProcessorMs = 0;  ///< what a software device computes with
    uint64_t vertices = 0, triangles = 0;
    uint64_t bytes = 0;  ///< of the device's memory for them
};

enum class RemeshWay { Sweep, Tessellation };

/// A view that was drawn.
struct RemeshDrawn {
    double ms = 0;           ///< of sweep, or tessellation, and drawing, as RemeshTimes::sweepMs; median
    double processorMs = 0;  ///< what a software device computes with
    uint64_t vertices = 0, triangles = 0;
    std::vector<glm::vec4> hits;  ///< row by row: depth along the unit ray, place in the tile, 1 where anything is hit
};

class RemeshMeter {
public:
    /// `device`: as RendererOptions::device. Errors: Device; Unsupported (a device that does not rasterize).
    static Result<std::unique_ptr<RemeshMeter>> create(const std::string& device, bool validation = false);
    ~RemeshMeter();
    RemeshMeter(const RemeshMeter&) = delete;
    RemeshMeter& operator=(const RemeshMeter&) = delete;

    [[nodiscard]] const DeviceInfo& device() const;
    /// One round to warm up, and `rounds`, at least 1, that count. Errors: Device; those of meso::makeRemeshPieces.
    Result<RemeshTimes> measure(const meso::RemeshSurface& surface, const meso::RemeshCamera& camera,
                                const meso::RemeshOptions& options, int rounds);
    /// The same with certified cells, whose choice is timed with the pieces.
    Result<RemeshTimes> measure(meso::CertifiedCells& cells, const meso::RemeshCamera& camera,
                                const meso::RemeshOptions& options, int rounds);
    /// Draws a view of `width` x `height` pixels. Errors: as measure(); Unsupported (no tessellator).
    Result<RemeshDrawn> draw(const meso::RemeshSurface& surface, const meso::RemeshCamera& camera,
                             const meso::RemeshOptions& options, RemeshWay way, uint32_t width, uint32_t height,
                             int rounds);
    [[nodiscard]] std::vector<std::string> validationMessages() const;

private:
    struct State;
    template <class Make>
    Result<RemeshTimes> timed(const std::shared_ptr<const meso::HeightLevels>& heights, const Make& make, int rounds);
    explicit RemeshMeter(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace vcp
