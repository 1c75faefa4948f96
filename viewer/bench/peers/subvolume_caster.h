// The march through a file of the method `paper` in subvolumes, all of it in memory: Demir and Westermann 2015, 4.3.
//
// At each step the sample is taken from the octree of the subvolume where that is near the eye, and from the octree of
// larger cells elsewhere, whose lengths and epsilon are those of its cells.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "builder/paper/paper_octree.h"
#include "octree/io/result.h"
#include "octree/surface/morton.h"

namespace vcp {

class SubvolumeCaster {
public:
    /// Reads a file. Errors: what reading it reports; Usage where it has one page or is of another method.
    static Result<SubvolumeCaster> open(const std::filesystem::path& file, const PaperMarch& march);

    /// The grid of the finest cells.
    [[nodiscard]] const RootGrid& frame() const { return frame_; }
    [[nodiscard]] uint64_t bytes() const;
    [[nodiscard]] size_t subvolumes() const { return pages_->size() - 1; }
    void setMarch(const PaperMarch& march) { march_ = march; }

    /// Casts a ray. Any thread.
    template <class Work>
    [[nodiscard]] GridHit cast(const GridRay& ray, Work& work) const;

private:
    struct Page {
        CornerOctree tree;
        PaperDecoder decode;
        glm::ivec3 low;  ///< finest cells
        int shift;       ///< its cells are 2^shift finest ones an edge
    };
    using Pages = std::vector<Page>;

    SubvolumeCaster() = default;
    [[nodiscard]] const Page& pageAt(glm::ivec3 subvolume, glm::vec3 eye) const;

    RootGrid frame_;
    int level_ = 0;      // a subvolume has 2^level_ cells an edge
    double extent_ = 0;  // diagonal of the dataset's bounds, finest cells
    PaperMarch march_;
    std::shared_ptr<const Pages> pages_;  // the first is that of the larger cells
    std::shared_ptr<const std::unordered_map<uint64_t, size_t>> numbers_;
};

template <class Work>
GridHit SubvolumeCaster::cast(const GridRay& ray, Work& work) const {
    const glm::ivec3 last = frame_.cells() - 1;
    const glm::vec3 eye = ray.origin - float(ray.tStart) * ray.direction;
    const Page* page = nullptr;
    std::optional<NodeFinder> finder;
    glm::ivec3 subvolume(-1);
    LeafVectors corners;
    int32_t known = 0;
    const auto sampleAt = [&](float t) -> PaperSample {
        work.step();
        const glm::vec3 p = ray.origin + t * ray.direction;
        const glm::ivec3 cell = cellAt(p, last);
        if ((cell >> level_) != subvolume || !march_.cached) {
            subvolume = cell >> level_;
            const Page& next = pageAt(subvolume, eye);
            if (&next != page || !march_.cached) {
                page = &next;
                finder.emplace(page->tree);
                known = 0;
            }
        }
        const auto scale = float(1 << page->shift);
        const glm::vec3 q = (p - glm::vec3(page->low)) / scale;
        const int32_t word = finder->find(cellAt(q, page->tree.frame.cells() - 1), work);
        if (!CornerOctree::isLeaf(word))
            return {page->tree.emptyDistance(word) * scale, march_.epsilon * scale, false, glm::vec3(0)};
        if (word != known) {
            corners = page->decode.leaf(page->tree.leafCodes(word));
            known = word;
            work.cell();
            work.fetch(2);
        }
        const auto size = float(1 << finder->level());
        const glm::vec3 v =
            scale * interpolateVectors(corners, size, (q - glm::vec3(finder->low())) / size, march_.scheme);
        return {glm::length(v), march_.epsilon * scale, true, v};
    };
    return marchPaper(march_, ray, sampleAt);
}

}  // namespace vcp
