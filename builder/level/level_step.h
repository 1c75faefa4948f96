// The step from one level's triangles to the next coarser one's, bin by bin.
//
// Each vertex has an image: where it goes, with which colour and normal (coarsen.h). A bin knows the images of its
// own vertices and of those nearby, because it has all triangles around them; and every bin that knows an image
// knows the same. Short triangles are stepped together, each image by the lowest bin that has one of its corners. A
// long triangle is stepped by itself, from the lowest bin that has one of its corners. Where another corner is too far
// away, it waits for the bin that has that corner, and takes the known images along. Bins are worked on in ascending
// order, so none is visited twice.
//
// How triangles first come to the finest level is told in vertex_step.h.
#pragma once

#include <atomic>

#include "builder/lattice/finest_pages.h"
#include "builder/lattice/lattice_mesh.h"
#include "builder/lattice/soup.h"
#include "builder/level/coarsen.h"
#include "builder/spill/record_bins.h"

namespace vcp {

/// How far around a bin, in cells, it is given triangles: what pages need (kBinMarginCells), and what the images and
/// strays of its triangles depend on. From a page's wall, a short triangle reaches 2 cells, its clusters 2 more; the
/// triangles measured against it, and those that these are measured against, 4 each.
inline constexpr double kStepMarginCells = 12;

/// A triangle whose images are not all known yet.
struct WaitingTriangle {
    LatticeTriangle from;
    VertexImage image[3];
    uint32_t known;  ///< bit i: corner i's image is there
};

/// Finds which bins need a triangle. One thread.
class BinsNear {
public:
    /// `partition`: by codes of the deepest of `pages`. `marginCells`: how far around a page it needs triangles.
    BinsNear(const FinestPages& pages, const PagePartition& partition, double marginCells)
        : pages_(pages), partition_(partition), marginCells_(marginCells), touched_{0} {}

    /// Returns the bins; valid until the next call.
    const std::vector<size_t>& of(const glm::i32vec3 (&corner)[3]);

private:
    /// Returns the page of the base level that the triangle lies in, and its margin, too; or kNoPage.
    [[nodiscard]] uint64_t pageAround(const glm::i32vec3 (&corner)[3]) const;

    static constexpr uint64_t kNoPage = ~uint64_t{0};
    const FinestPages& pages_;
    const PagePartition& partition_;
    double marginCells_;
    std::vector<size_t> touched_;
    /// The last page that lay in one bin with all that is below it, which is the one in touched_.
    uint64_t page_ = kNoPage;
};

/// Where the next level's triangles go: into every bin that needs them.
class LevelSink {
public:
    /// `partition`: by codes of the deepest of `pages`.
    LevelSink(FinestPages pages, const PagePartition& partition, RecordBins<LatticeTriangle>& bins,
              double marginCells = kStepMarginCells)
        : pages_(std::move(pages)), partition_(partition), bins_(bins), marginCells_(marginCells) {}

    /// Collects triangles; each thread has a batch of its own, and flushes it when done.
    class Batch {
    public:
        explicit Batch(LevelSink& sink) : near_(sink.pages_, sink.partition_, sink.marginCells_), batch_(sink.bins_) {}
        Result<void> add(const LatticeTriangle& triangle);
        /// Returns the bins that a triangle goes into; valid until the next call.
        const std::vector<size_t>& binsOf(const LatticeTriangle& triangle) { return near_.of(triangle.corner); }
        Result<void> flush() { return batch_.flush(); }

    private:
        BinsNear near_;
        BinBatch<LatticeTriangle> batch_;
    };

private:
    FinestPages pages_;
    const PagePartition& partition_;
    RecordBins<LatticeTriangle>& bins_;
    double marginCells_;
};

/// Steps one level. One thread calls, in ascending order of bins; the calling arena's threads do the work.
class LevelStep {
public:
    /// `grid`, `partition`: those of the level stepped from.
    LevelStep(const PageGrid& grid, const PagePartition& partition, RecordBins<WaitingTriangle>& waiting,
              LevelSink& sink)
        : grid_(grid), partition_(partition), waiting_(waiting), sink_(sink) {}

    /// `mesh`: all triangles of the bin, with their normals.
    Result<void> run(size_t bin, const LatticeMesh& mesh);

private:
    struct Images;
    [[nodiscard]] Images imagesOf(size_t bin, const LatticeMesh& mesh) const;
    [[nodiscard]] bool isKnown(size_t bin, glm::i32vec3 p) const;
    [[nodiscard]] size_t binOf(glm::i32vec3 p) const { return partition_.binOf(grid_.pageOf(p)); }
    Result<void> stepShort(size_t bin, const LatticeMesh& mesh, const VertexClusters& clusters);
    Result<void> stepLong(size_t bin, const LatticeMesh& mesh, const Images& images);
    Result<void> stepWaiting(size_t bin, const LatticeMesh& mesh, const Images& images);
    /// Emits a triangle whose images are all known; else lets it wait.
    Result<void> pass(const WaitingTriangle& w, LevelSink::Batch& batch);

    const PageGrid& grid_;
    const PagePartition& partition_;
    RecordBins<WaitingTriangle>& waiting_;
    LevelSink& sink_;
};

}  // namespace vcp
