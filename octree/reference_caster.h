// The reference ray-caster: slow, obvious, in double. It says what a picture must show.
//
// A ray visits every page of a cut and every node of a page whose closed box it touches, nearest first,
// and tests every leaf it meets. It trusts no clearance and steps over nothing, so that what it does not
// hit is not there; the GPU's traversal is compared with it ray by ray. The surface inside a leaf is
// octree/shared/leaf_math.h, in double or, to show what single precision costs, in float.
//
// A hit is the first crossing of f = 0 in a soft leaf, a wall of a soft leaf where |f| is within the leaf's
// wall tolerance (not where the ray starts or ends inside the leaf), or a triangle of a hard leaf within
// the leaf's box, widened by kIntervalSlack (shared/leaf_math.h).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>
#include "octree/page_reader.h"

namespace vcp {

/// Pages of one dataset in memory. Loading is for one thread at a time; reading for any once it is done.
class PageCache {
public:
    PageCache(std::shared_ptr<const ByteReader> reader, Dataset dataset);
    /// Takes pages that are in memory already, one for each entry of `dataset.pages`; for tests and builders.
    /// Errors: what parsePage says.
    static Result<PageCache> fromPages(Dataset dataset, std::vector<PageBytes> pages);
    /// Opens a .vcp file without loading a page. Errors: what openFile and readDataset say; Unsupported where the file
    /// is not of the certified method.
    static Result<PageCache> open(const std::filesystem::path& path);
    /// Does so with a file that is open.
    static Result<PageCache> open(std::shared_ptr<const ByteReader> reader);

    /// Loads a page unless it is loaded. Errors: what readPage says; Usage for a page that does not exist.
    Result<void> load(uint64_t page);
    Result<void> load(std::span<const uint64_t> pages);
    Result<void> loadLevel(uint32_t level);
    Result<void> loadAll();

    [[nodiscard]] const Dataset& dataset() const { return dataset_; }
    /// Returns a loaded page, or null. It is valid as long as the cache.
    [[nodiscard]] const PageView* view(uint64_t page) const;
    /// Returns the decompressed bytes that are held.
    [[nodiscard]] uint64_t bytes() const;

private:
    struct Loaded {
        PageBytes bytes;
        PageView view;
    };
    void keep(uint64_t page, std::unique_ptr<const Loaded> loaded);

    std::shared_ptr<const ByteReader> reader_;
    Dataset dataset_;
    SparseArray<const Loaded*> pages_;  // elements of loaded_; null: not loaded
    std::vector<std::unique_ptr<const Loaded>> loaded_;
};

/// Returns the pages that hold the whole surface as a level has it: its pages, and those of coarser levels that have no
/// children. levels - 1 (or anything larger) is the finest.
std::vector<uint64_t> cutAtLevel(const Dataset& dataset, uint32_t level);

struct Ray {
    glm::dvec3 origin{0};     ///< world
    glm::dvec3 direction{0};  ///< |direction| = 1
    double tMin = 0;          ///< world units along the direction
    double tMax = std::numeric_limits<double>::infinity();
};

struct RayHit {
    double t = 0;            ///< distance along the ray, world units
    glm::dvec3 position{0};  ///< world
    glm::dvec3 normal{0};    ///< unit, world, facing the ray's origin
    uint64_t page = 0;       ///< number in the directory
    uint32_t level = 0;
    uint32_t node = 0;          ///< the leaf's node word; nodeType(node) is kNodeSoft, kNodeSlab or kNodeHard
    bool onWall = false;        ///< accepted by the wall tolerance, not by a crossing
    glm::dvec3 leafMin{0};      ///< the leaf's lowest corner, in cells from the page's
    double leafEdge = 0;        ///< in cells
    double certifiedError = 0;  ///< certified error of the page, world units
};

/// Exact counts of the work of rays; they add up over calls.
struct CastCounters {
    uint64_t rays = 0, pages = 0, nodes = 0, softLeaves = 0, slabLeaves = 0, hardLeaves = 0, triangles = 0;
};

struct CastOptions {
    bool singlePrecision = false;  ///< leaf maths in float (f32), as on the GPU; traversal stays in double
    int steps = 64;                ///< Illinois steps; 64 are full precision, a GPU makes a few
    /// A pixel's edge at a distance t: pixelEdge + pixelEdgePerT * t, world units. Normals of slab leaves that are
    /// wider are blended with those about them (shared/slab_blend.h).
    double pixelEdge = std::numeric_limits<double>::infinity(), pixelEdgePerT = 0;
};

class ReferenceCaster {
public:
    /// `cut`: pages, all loaded, none of which is an ancestor of another; every ray is cast against exactly
    /// these. `cache` must outlive the caster. Errors: Usage where a page is not loaded or the cut overlaps.
    static Result<ReferenceCaster> create(const PageCache& cache, std::span<const uint64_t> cut,
                                          CastOptions options = {});

    /// Returns the first hit with tMin <= t <= tMax. Any thread; counters belong to the caller.
    [[nodiscard]] std::optional<RayHit> cast(const Ray& ray, CastCounters* counters = nullptr) const;

    /// Returns the first hit in each leaf that the ray meets, sorted by t, no normals blended; for verification.
    [[nodiscard]] std::vector<RayHit> castAll(const Ray& ray, CastCounters* counters = nullptr) const;

    [[nodiscard]] const PageCache& cache() const { return *cache_; }

private:
    enum class Mark : uint8_t { None, Above, Chosen };
    ReferenceCaster(const PageCache& cache, CastOptions options) : cache_(&cache), options_(options) {}
    /// Returns the normal that is seen of a hit on a slab leaf.
    [[nodiscard]] glm::dvec3 blendedNormal(const Ray& ray, const RayHit& hit) const;

    const PageCache* cache_;
    CastOptions options_;
    std::shared_ptr<const SparseArray<Mark>> marks_;  ///< for each page: in the cut, above a page that is, or neither

    friend class CastWalk;
};

}  // namespace vcp
