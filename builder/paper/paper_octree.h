// Vector-to-Closest-Point octree of Demir and Westermann 2015, as published, in memory and on the CPU.
//
//   structure       corner_octree.h: blocks of 2^3 cells within `band` of the surface, merging, 32-bit nodes
//   vectors         32 bits: square root of the length over the longest one 13, azimuth 9, polar angle 10 (4.1)
//   interpolation   of the eight corners' planes the nearest one's perpendicular, the trilinear vector, or the longer
//                   of the two (2.2; their Fig. 4 b, a and c)
//   march           step by the stored or interpolated distance; near the surface by that of the plane, if that is
//                   more, up to twice epsilon, or up to that beyond it (4.2); hit where the distance falls below
//                   epsilon, moved back to where it is epsilon between the last two samples (2.1)
//   memory traffic  the parent of the last node and the vectors of the last leaf are remembered (4.2)
//
// Each rule can be switched, so that its effect can be measured (PaperOptions). Where the paper is silent: epsilon, the
// merging threshold, k, and the longest vector (we take the longest that is stored). Where we deviate: the distance to
// a triangle is exact (region_growing.h); a vector of length 0 has no plane (their formula divides 0 by 0);
// trigonometry is tabulated here, one entry a code, and computed on the GPU (octree/shared/paper_math.h, which holds
// what both share).
#pragma once

#include <cmath>
#include <memory>

#include "builder/paper/corner_octree.h"
#include "builder/paper/node_finder.h"
#include "octree/page/paper_page.h"

namespace vcp {

using paper::LeafVectors;

struct PaperOptions {
    PaperMarch march;
    float band = 3.4641016f;                        ///< t, cells: twice the diagonal
    float mergeThreshold = 0.05f;                   ///< cells; below 0: no merging
    PaperScheme mergeScheme = PaperScheme::Longer;  ///< interpolation by which merging is judged
    PaperPacking packing = PaperPacking::Spherical;
    /// k: rounds of region growing, or CornerOctreeOptions::kExactPoints. 5 reach every point of the default band.
    int growRounds = 5;
    bool safeEmpty = false;  ///< CornerOctreeOptions::safeEmpty
    int subvolumeCells = 0;  ///< edge of the file's subvolumes (paper_subvolumes.h); 0: a file has one page

    bool operator==(const PaperOptions&) const = default;
};

/// Returns the vector at `at` (0 to 1 an axis) of a leaf of edge `size` cells.
glm::vec3 interpolateVectors(const LeafVectors& corners, float size, glm::vec3 at, PaperScheme scheme);
/// Returns the Euclidean distance of that vector to the exact one (section 3), in cells.
float vectorMergeError(const CornerSamples& corners, float size, glm::vec3 at, const CornerSample& exact,
                       PaperScheme scheme = PaperScheme::Longer);

uint32_t packPaperVector(glm::vec3 v, float longest, PaperPacking packing);
/// Decodes what packPaperVector packed.
class PaperDecoder {
public:
    PaperDecoder(float longest, PaperPacking packing) : packing_(packing), perStep_(std::sqrt(longest) / 8191) {}
    [[nodiscard]] glm::vec3 operator()(uint32_t code) const {
        const float root = float(code & 8191u) * perStep_;
        return root * root * (packing_ == PaperPacking::Spherical ? spherical(code) : paper::octahedralDirection(code));
    }
    /// Decodes the vectors of a leaf's corners.
    [[nodiscard]] LeafVectors leaf(const uint32_t* codes) const;

private:
    [[nodiscard]] static glm::vec3 spherical(uint32_t code);

    PaperPacking packing_;
    float perStep_;
};

/// Returns the least halo of regions of such an octree.
float vectorHalo(const PaperOptions& options);
/// Builds the octree. `build`: its growRounds and safeEmpty are those of `options`.
Result<CornerOctree> buildVectorOctree(const MeshBvh& mesh, const PaperOptions& options,
                                       const CornerOctreeOptions& build);

class PaperCaster {
public:
    /// Builds the octree, as buildVectorOctree does.
    static Result<PaperCaster> create(const MeshBvh& mesh, const PaperOptions& options,
                                      const CornerOctreeOptions& build);

    [[nodiscard]] const RootGrid& frame() const { return tree_->frame; }
    [[nodiscard]] const CornerOctree& tree() const { return *tree_; }
    [[nodiscard]] const PaperOptions& options() const { return options_; }
    [[nodiscard]] uint64_t bytes() const { return tree_->bytes(); }
    void setMarch(const PaperMarch& march) { options_.march = march; }

    /// Casts a ray. Any thread.
    template <class Work>
    [[nodiscard]] GridHit cast(const GridRay& ray, Work& work) const;

private:
    PaperCaster(CornerOctree tree, const PaperOptions& options)
        : tree_(std::make_shared<const CornerOctree>(std::move(tree))),
          options_(options),
          decode_(tree_->largest, options.packing) {}

    std::shared_ptr<const CornerOctree> tree_;  // shared by copies with other rules of the march
    PaperOptions options_;
    PaperDecoder decode_;
};

/// What a step of the march finds, in cells. `epsilon`: a ray hits where the distance is below this.
struct PaperSample {
    float distance, epsilon;
    bool isLeaf;
    glm::vec3 vector;  ///< of a leaf
};

/// Marches along a ray. `sampleAt(t)` returns the PaperSample there.
template <class SampleAt>
GridHit marchPaper(const PaperMarch& rules, const GridRay& ray, const SampleAt& sampleAt) {
    float t = 0, lastT = 0, lastDistance = 0;
    for (uint32_t step = 0; step < paper::kPaperMostSteps && t <= ray.tMax; ++step) {
        const PaperSample at = sampleAt(t);
        if (at.isLeaf && at.distance < at.epsilon) {
            if (!rules.back) return {t, at.vector};
            const float hit = lastT + paper::marchBack(lastDistance, at.distance, at.epsilon) * (t - lastT);
            // The normal is that of the point moved back to: here the vector may be too short to point anywhere.
            const PaperSample back = sampleAt(hit);
            return {hit, back.isLeaf && back.distance > 0 ? back.vector : at.vector};
        }
        lastT = t;
        lastDistance = at.distance;
        t += at.isLeaf
                 ? paper::marchStep(at.distance, glm::dot(at.vector, ray.direction), at.epsilon, uint32_t(rules.step))
                 : std::max(at.distance, at.epsilon);
    }
    if (t <= ray.tMax) return {std::numeric_limits<float>::quiet_NaN(), {}};
    return {};
}

template <class Work>
GridHit PaperCaster::cast(const GridRay& ray, Work& work) const {
    const PaperMarch& rules = options_.march;
    NodeFinder finder(*tree_);
    LeafVectors corners;
    int32_t known = 0;
    const glm::ivec3 last = tree_->frame.cells() - 1;
    const auto sampleAt = [&](float t) -> PaperSample {
        work.step();
        const glm::vec3 p = ray.origin + t * ray.direction;
        if (!rules.cached) {
            finder.forget();
            known = 0;
        }
        const int32_t word = finder.find(cellAt(p, last), work);
        if (!CornerOctree::isLeaf(word)) return {tree_->emptyDistance(word), rules.epsilon, false, glm::vec3(0)};
        if (word != known) {
            corners = decode_.leaf(tree_->leafCodes(word));
            known = word;
            work.cell();
            work.fetch(2);
        }
        const auto size = float(1 << finder.level());
        const glm::vec3 v = interpolateVectors(corners, size, (p - glm::vec3(finder.low())) / size, rules.scheme);
        return {glm::length(v), rules.epsilon, true, v};
    };
    return marchPaper(rules, ray, sampleAt);
}

}  // namespace vcp
