// The pages of a cut as the processor draws them, wherever their bytes lie, and what the rays of a picture say of them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "octree/dataset_reader.h"
#include "render/host/host_picture.h"
#include "render/pages/residency.h"
#include "streaming/load_order.h"

namespace vcp {

/// A page of a cut.
struct CutPage {
    uint64_t number = 0;  ///< in the directory
    PageEntry entry;
    uint32_t octants = 0;              ///< bits of those that alone are drawn; 0: all of them
    std::span<const std::byte> bytes;  ///< geometry and then colour, 16-byte aligned
};

/// Returns what a view draws of a dataset, in directory order: valid until the residency's next update. Precondition:
/// the processor sees the pool (PageMemory::bytesOf).
std::vector<CutPage> cutPages(Residency& residency, ViewNumber view = {});

/// A cut as rays are cast through it. The pages' bytes must outlive it.
class CutScene {
public:
    /// `cut`: in directory order, of pages that were checked (parsePage); may be a part of a cut, where rays meet
    /// nothing else. Errors: as of HostScene::create.
    static Result<CutScene> create(const FileHeader& header, bool withColour, std::vector<CutPage> cut);

    /// As HostScene's.
    void showImages(std::shared_ptr<const ImageSet> images) { scene_.showImages(std::move(images)); }
    [[nodiscard]] const HostScene& scene() const { return scene_; }
    /// Returns the numbers of the pages that rays marked, and of those in whose place these are drawn.
    [[nodiscard]] std::vector<uint64_t> marked(const PageMarks& marks) const;

private:
    std::vector<CutPage> cut_;
    std::vector<PageView> views_;  // of the cut; the scene points to them
    HostScene scene_;
};

/// Which rows of a whole a picture holds, and which of these are asked of it.
struct RowsOfWhole {
    int first = 0;           ///< row of the whole that is the picture's first
    int begin = 0, end = 0;  ///< rows of the whole
    int wholeHeight = 0;
};

/// Returns the pixel of a picture that a ray of a grid of 24 x 16 goes through: the middle of its part.
glm::ivec2 probedPixel(uint32_t ray, glm::ivec2 size);

/// A point of a picture that rays hit a page in.
struct ProbedHit {
    uint32_t ray = 0;   ///< of the grid over the whole picture
    uint64_t page = 0;  ///< number in the directory
    double depth = 0;   ///< along the ray, units of the dataset
    glm::dvec2 point;   ///< where the ray goes through, pixels of the rays' picture
};
void addTo(RayFeedback& feedback, const Dataset& dataset, const PictureRays& rays, const ProbedHit& hit);

/// Returns what those rays of a grid over the whole picture that lie in the rows met of one dataset: the pages that
/// they hit.
RayFeedback feedbackOf(const HostLayer& layer, const Dataset& dataset, const HostPicture& picture, RowsOfWhole rows);

}  // namespace vcp
