// Which pieces of a file's images are in memory: those that the pages in views need, coarse levels first. Pure: no
// threads, no clock.
//
// A view needs of an image what its pages show of it, from the finest level on that a pixel can read there: from how
// finely the page's triangles show the image, and where (octree/image_needs.h), and the point of the page's box that is
// nearest to the eye. Images that no page shows need nothing. Where all that views need takes more than is allowed, all
// images are a little coarser, by as much everywhere in the picture; what no view needs any more stays while there is
// room, and what was needed last stays longest.
//
// What is drawn is a set, which changes by bounds: with the first piece, once half as many bytes came as there were,
// when all came while the views stand still, and when some go. So for a still view, whoever copies each set copies at
// most four times what there is in the end.
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
    /// How many pages are remembered.
    [[nodiscard]] size_t pagesKnown() const { return pages_.size(); }
    /// Forgets all pages but these.
    void forgetOthers(const std::vector<uint64_t>& pages);
    /// Says which pages a view draws. Precondition: needs of those that have any were learnt.
    void look(const Dataset& dataset, const SelectionView& view, const std::vector<uint64_t>& cut,
              ViewNumber number = 0);
    /// Returns how much a view needs each piece on some of its pages: so many levels coarser could its images be, and
    /// it would need the piece still; 0 where it does not.
    [[nodiscard]] std::vector<float> needsOn(const Dataset& dataset, const SelectionView& view,
                                             const std::vector<uint64_t>& pages) const;
    /// The view does not show the dataset any more.
    void forgetView(ViewNumber number);
    /// Takes in the texels of a piece that was wished for.
    void take(uint64_t piece, std::span<const uint32_t> texels);
    /// A piece cannot be read: it is not wished for any more. What it would show is seen in a coarser level; without
    /// the first piece of an image, nothing of it is.
    void giveUp(uint64_t piece);
    /// Chooses what is to be in memory, and returns the pieces to read, by their number.
    std::vector<Wish> wishes();

    /// What to draw from; the same until the next wishes(). Never null.
    [[nodiscard]] const std::shared_ptr<const ImageSet>& shown() const { return shown_; }
    /// Counts the sets.
    [[nodiscard]] uint64_t version() const { return version_; }
    /// Whether all that the view needs is shown, as far as it is allowed and can be read.
    [[nodiscard]] bool isComplete(ViewNumber number = 0) const;
    /// Whether the view needs more than is allowed.
    [[nodiscard]] bool isLimited(ViewNumber number = 0) const;
    [[nodiscard]] const ImagePieces& pieces() const { return assembly_.pieces(); }
    /// The most bytes that images take.
    [[nodiscard]] uint64_t mostBytes() const { return mostBytes_; }

private:
    /// What a part of a page shows of an image.
    struct Shown {
        uint32_t image = 0;
        float texelsPerCell = 0;
        glm::vec3 low{0}, high{0};     // the part's box, cells of the page
        std::vector<uint32_t> pieces;  // of all levels, the finest first
        std::vector<uint32_t> begin;   // of each level among them, up to that of the first piece
    };
    struct Look {
        SelectionView view;
        std::vector<uint64_t> cut;
        std::vector<float> needs;  // of pieces
    };
    [[nodiscard]] Shown shownOf(const ImageNeed& need) const;
    void addNeeds(const Shown& shown, double pixelEdge, std::vector<float>& needs) const;
    void replan();
    void plan();
    void leaveOut(const std::vector<float>& needs);
    void makeRoom();
    void addWishes(uint32_t image, std::vector<Wish>& wishes) const;
    void show();

    ImageAssembly assembly_;
    const uint64_t mostBytes_;
    std::vector<uint32_t> bytes_;  // of each piece
    std::unordered_map<uint64_t, std::vector<Shown>> pages_;
    std::map<ViewNumber, Look> looks_;
    std::vector<bool> planned_;     // pieces that are to be in memory
    std::vector<bool> unreadable_;  // pieces
    std::vector<uint64_t> needed_;  // of each piece, the number of the plan that needed it last
    uint64_t plans_ = 0;
    bool stale_ = false;    // planned_ is of other looks
    bool dropped_ = false;  // something that is shown went
    bool isIdle_ = false;   // all that is planned is shown
    std::shared_ptr<const ImageSet> shown_;
    std::vector<bool> shownPieces_;
    uint64_t version_ = 0;
};

}  // namespace vcp
