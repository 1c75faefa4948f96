// Vector-to-Closest-Point octree of Demir and Westermann 2015, as published, in memory and on the CPU.
//
//   structure       corner_octree.h: blocks of 2^3 cells within `band` of the surface, merging, 32-bit nodes
//   vectors         32 bits: square root of the length over the longest one 13, azimuth 9, polar angle 10 (4.1)
//   interpolation   of the eight corners' planes the nearest one's perpendicular, the trilinear vector, or the longer
//                   of the two (2.2; their Fig. 4 b, a and c)
//   march           step by the stored or interpolated distance; near the surface by that of the plane, if that is
//                   more, up to twice epsilon (4.2); hit where the distance falls below epsilon, moved back to where it
//                   is epsilon between the last two samples (2.1)
//   memory traffic  the parent of the last node and the vectors of the last leaf are remembered (4.2)
//
// Where the paper is silent: epsilon, the merging threshold and the longest vector (we take the longest that is
// stored). Where we deviate: closest points are exact, of the whole mesh, instead of found by k rounds of region
// growing (3.1), so there is no k; a vector of length 0 has no plane (their formula divides 0 by 0); trigonometry is
// tabulated, one entry a code.
#pragma once

#include <memory>

#include "viewer/peers/corner_octree.h"
#include "viewer/peers/node_finder.h"

namespace vcp {

enum class PaperScheme : uint8_t { Trilinear, MinPlane, Longer };
enum class PaperStep : uint8_t { Distance, Planar };
/// Octahedral: 13 bits of length as before, 10 + 9 of direction, for comparison.
enum class PaperPacking : uint8_t { Spherical, Octahedral };

struct PaperOptions {
    float epsilon = 0.25f;         ///< cells
    float band = 3.4641016f;       ///< t, cells: twice the diagonal
    float mergeThreshold = 0.05f;  ///< cells; below 0: no merging
    PaperScheme scheme = PaperScheme::Longer;
    PaperStep step = PaperStep::Planar;
    PaperPacking packing = PaperPacking::Spherical;
};

/// The eight vectors of a leaf, cells; corner 4 x + 2 z + y.
struct LeafVectors {
    alignas(32) float x[8], y[8], z[8];
};

/// The vector at `at` (0 to 1 an axis) of a leaf of edge `size` cells.
glm::vec3 interpolateVectors(const LeafVectors& corners, float size, glm::vec3 at, PaperScheme scheme);
/// Euclidean distance of that vector to the exact one (section 3), cells.
float vectorMergeError(const CornerSamples& corners, float size, glm::vec3 at, const CornerSample& exact,
                       PaperScheme scheme = PaperScheme::Longer);

uint32_t packPaperVector(glm::vec3 v, float longest, PaperPacking packing);
/// Decodes what packPaperVector packed.
class PaperDecoder {
public:
    PaperDecoder(float longest, PaperPacking packing);
    [[nodiscard]] glm::vec3 operator()(uint32_t code) const {
        const float root = static_cast<float>(code & 8191u) * perStep_;
        return root * root * (packing_ == PaperPacking::Spherical ? spherical(code) : octahedral(code));
    }

private:
    [[nodiscard]] glm::vec3 spherical(uint32_t code) const;
    static glm::vec3 octahedral(uint32_t code);

    PaperPacking packing_;
    float perStep_;
};

class PaperCaster {
public:
    static Result<PaperCaster> create(const MeshBvh& mesh, const PaperOptions& options,
                                      const CornerOctreeOptions& build);

    [[nodiscard]] const GridFrame& frame() const { return tree_->frame; }
    [[nodiscard]] const CornerOctree& tree() const { return *tree_; }
    [[nodiscard]] uint64_t bytes() const { return tree_->bytes(); }
    /// The march's options may change; those of the structure (band, threshold, packing) may not.
    void setEpsilon(float cells) { options_.epsilon = cells; }
    void setScheme(PaperScheme scheme) { options_.scheme = scheme; }
    void setStep(PaperStep step) { options_.step = step; }

    /// Any thread.
    template <class Work>
    [[nodiscard]] GridHit cast(const GridRay& ray, Work& work) const;

private:
    static constexpr int kMaxSteps = 4096;

    PaperCaster(CornerOctree tree, const PaperOptions& options)
        : tree_(std::make_shared<const CornerOctree>(std::move(tree))),
          options_(options),
          decode_(tree_->largest, options.packing) {}
    [[nodiscard]] LeafVectors vectorsOf(int32_t leaf) const;
    [[nodiscard]] float stepFrom(float d, glm::vec3 v, glm::vec3 direction) const;

    std::shared_ptr<const CornerOctree> tree_;  // shared by copies that march otherwise
    PaperOptions options_;
    PaperDecoder decode_;
};

template <class Work>
GridHit PaperCaster::cast(const GridRay& ray, Work& work) const {
    NodeFinder finder(*tree_);
    LeafVectors corners;
    int32_t known = 0;
    float t = 0, lastT = 0, lastDistance = 0;
    const glm::ivec3 last = tree_->frame.cells() - 1;
    for (int step = 0; step < kMaxSteps && t <= ray.tMax; ++step) {
        work.step();
        const glm::vec3 p = ray.origin + t * ray.direction;
        const int32_t word = finder.find(cellAt(p, last), work);
        float d, advance;
        if (CornerOctree::isLeaf(word)) {
            if (word != known) {
                corners = vectorsOf(word);
                known = word;
                work.fetch(2);
            }
            const auto size = static_cast<float>(1 << finder.level());
            const glm::vec3 v =
                interpolateVectors(corners, size, (p - glm::vec3(finder.low())) / size, options_.scheme);
            d = glm::length(v);
            if (d < options_.epsilon) {
                const float back =
                    lastDistance > options_.epsilon ? (lastDistance - options_.epsilon) / (lastDistance - d) : 1;
                return {lastT + back * (t - lastT), v};
            }
            advance = stepFrom(d, v, ray.direction);
        } else {
            d = tree_->emptyDistance(word);
            advance = std::max(d, options_.epsilon);
        }
        lastT = t;
        lastDistance = d;
        t += advance;
    }
    if (t <= ray.tMax) return {std::numeric_limits<float>::quiet_NaN(), {}};
    return {};
}

inline float PaperCaster::stepFrom(float d, glm::vec3 v, glm::vec3 direction) const {
    if (options_.step == PaperStep::Distance) return d;
    // Not approaching: the plane is never met.
    const float approach = glm::dot(v, direction);
    const float planar = approach > 0 ? d * d / approach : std::numeric_limits<float>::infinity();
    return std::max(d, std::min(planar, 2 * options_.epsilon));
}

}  // namespace vcp
