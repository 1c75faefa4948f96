// Which levels of a file's images are in memory: those that the pages in views need, coarse ones first. Pure: no
// threads, no clock.
//
// A view needs of an image the finest level that a pixel can read on one of its pages: from how finely the page's
// triangles show the image (octree/image_needs.h) and the point of the page's box that is nearest to the eye. Images
// that no page shows need nothing. Where all that views need takes more than is allowed, the finest levels of the
// largest images are left out; levels that no view needs any more stay while there is room.
//
// What is drawn is a set of whole levels, which changes by bounds: with the first level, once half as many bytes came
// as there were, when all came while the views stand still, and when some go. So for a still view, whoever copies each
// set copies at most four times what there is in the end.
#pragma once

#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "octree/dataset_reader.h"
#include "octree/image/image_assembly.h"
#include "octree/image/image_need.h"
#include "streaming/page_selection.h"
#include "streaming/residency_policy.h"

namespace vcp {

/// One thread.
class ImageResidency {
public:
    ImageResidency(std::shared_ptr<const ImagePieces> pieces, uint64_t mostBytes);

    /// Remembers what a page needs.
    void learn(uint64_t page, std::vector<ImageNeed> needs);
    /// Says which pages a view draws. Precondition: needs of those that have any were learnt.
    void look(const Dataset& dataset, const SelectionView& view, const std::vector<uint64_t>& cut,
              ViewNumber number = 0);
    /// Returns, for each image, the number of the finest level that a view needs on some of its pages; of levels: none.
    [[nodiscard]] std::vector<uint32_t> finestOn(const Dataset& dataset, const SelectionView& view,
                                                 const std::vector<uint64_t>& pages) const;
    /// The view does not show the dataset any more.
    void forgetView(ViewNumber number);
    /// Takes in the texels of a piece that was wished for.
    void take(uint64_t piece, std::span<const uint32_t> texels);
    /// A piece cannot be read: its level and finer ones are not wished for any more.
    void giveUp(uint64_t piece);
    /// Chooses what is to be in memory, and returns the pieces to read, by their number.
    std::vector<Wish> wishes();

    /// The levels to draw from; the same until the next wishes(). Never null.
    [[nodiscard]] const std::shared_ptr<const ImageSet>& shown() const { return shown_; }
    /// Counts the sets.
    [[nodiscard]] uint64_t version() const { return version_; }
    /// Whether all that the view needs is shown, as far as it is allowed and can be read.
    [[nodiscard]] bool isComplete(ViewNumber number = 0) const;
    /// Whether the view needs more than is allowed.
    [[nodiscard]] bool isLimited(ViewNumber number = 0) const;
    /// The most bytes that levels take.
    [[nodiscard]] uint64_t mostBytes() const { return mostBytes_; }

private:
    struct Look {
        SelectionView view;
        std::vector<uint64_t> cut;
        std::vector<uint32_t> finest;  // for each image, the number of the finest level needed; of levels: none
    };
    [[nodiscard]] std::span<const ImageRow> images() const { return assembly_.pieces().tables().images; }
    /// Returns, for each image, that no level is needed.
    [[nodiscard]] std::vector<uint32_t> nothing() const;
    /// Whether finest(image), a number of a level, is coarser for some image than the view needs and can be read.
    template <class Finest>
    [[nodiscard]] bool lacks(ViewNumber number, const Finest& finest) const;
    void replan();
    void plan();
    void show();

    ImageAssembly assembly_;
    const uint64_t mostBytes_;
    std::unordered_map<uint64_t, std::vector<ImageNeed>> needs_;  // by page
    std::map<ViewNumber, Look> looks_;
    std::vector<uint32_t> planned_;   // for each image, the finest level that is to be in memory
    std::vector<uint32_t> readable_;  // for each image, the finest level that can be read
    bool stale_ = false;              // planned_ is of other looks
    bool isIdle_ = false;             // all that is planned is shown
    std::shared_ptr<const ImageSet> shown_;
    uint64_t version_ = 0;
};

}  // namespace vcp
