// Picks on the finest level, whatever the picture shows: the pages along one ray are read, nearest first, and cast in
// double precision (octree/reference_caster.h). Pages are kept for the next pick, up to 256 MiB.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "octree/io/result.h"
#include "octree/reference_caster.h"
#include "render/surface_pick.h"
#include "render/view/renderer.h"

namespace vcp {

class FinestPick {
public:
    FinestPick(std::shared_ptr<const ByteReader> reader, const Dataset& dataset)
        : reader_(std::move(reader)), pages_(reader_, dataset) {}

    /// Returns the first hit on what the section planes keep; nothing where the ray hits nothing. Reads from the file
    /// or server, so it may take long. One thread at a time. Errors: those of readPage.
    Result<std::optional<RayHit>> cast(Ray ray, std::span<const SectionPlane> sections = {});
    [[nodiscard]] uint64_t bytesKept() const { return pages_.bytes(); }
    /// Makes a cast that reads from a server end soon, with Cancelled. Any thread.
    void interrupt() const { reader_->interrupt(); }
    void forget() { pages_ = PageCache(reader_, pages_.dataset()); }

private:
    std::shared_ptr<const ByteReader> reader_;
    PageCache pages_;
};

/// `certifiedError` of a hit on mesostructure is what is known of its method (mesostructure/known_error.h); infinite
/// where nothing is.
struct SceneHit : RayHit {
    size_t dataset = 0;      ///< number of the dataset, in the order of add()
    bool onSurface = false;  ///< on mesostructure: only t, position, normal and certifiedError mean something
};

/// Picks in several datasets, each where it is placed; the nearest hit, in the world.
class ScenePick {
public:
    void add(std::shared_ptr<const ByteReader> reader, const Dataset& dataset, const Similarity& placement) {
        parts_.push_back({FinestPick(std::move(reader), dataset), placement});
    }
    /// `hidden`: numbers of datasets that are not there. `onSurface`: what pickOnSurfaces says of this ray.
    Result<std::optional<SceneHit>> cast(const Ray& ray, std::span<const SectionPlane> sections = {},
                                         std::span<const uint32_t> hidden = {},
                                         const std::optional<SurfacePoint>& onSurface = {});
    /// Interrupts the pick of each dataset. The read that is under way ends; another may follow.
    void interrupt() const {
        for (const Part& part : parts_) part.pick.interrupt();
    }

private:
    struct Part {
        FinestPick pick;
        Similarity placement;
    };
    std::vector<Part> parts_;
};

}  // namespace vcp
