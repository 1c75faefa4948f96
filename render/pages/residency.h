// What views draw of one dataset among those that share a pool (scene_residency.h). Pages have the dataset's own
// numbers here.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "render/pages/image_residency.h"
#include "render/pages/page_memory.h"
#include "render/pages/page_table.h"
#include "render/pages/update_result.h"
#include "streaming/residency_policy.h"

namespace vcp {

class SceneResidency;

class Residency {
public:
    /// `scene` must outlive it. `images`: null, where the colours of vertices are shown.
    Residency(SceneResidency& scene, size_t number, PooledDataset dataset, std::unique_ptr<ImageResidency> images)
        : scene_(scene), number_(number), dataset_(std::move(dataset)), images_(std::move(images)) {}

    /// Among the datasets of its scene.
    [[nodiscard]] size_t number() const { return number_; }
    [[nodiscard]] SceneResidency& scene() { return scene_; }

    /// Takes what the view draws after the scene's update, and reports on it; what holds for all datasets is empty.
    UpdateResult cutOf(const SelectionView& view, const DrawableCut& drawable, ViewNumber number);
    /// The view does not show the dataset any more.
    void forgetView(ViewNumber number);
    /// All that was in the pool is gone: all views are to be drawn again.
    void forgetCuts() { cuts_.clear(); }

    /// Whether the rays' feedback would be used: pages are missing, and are read in the order that rays ask for them.
    [[nodiscard]] bool listens() const;
    void hear(const RayFeedback& feedback, const SelectionView& view);

    /// A number of what the view draws: frames of one cut, with the same levels of images, have the same.
    [[nodiscard]] uint64_t cutNumber(ViewNumber number = 0) { return current(number).number; }
    /// The same of the pages alone: rays hit the same ones, whatever their colours.
    [[nodiscard]] uint64_t pagesNumber(ViewNumber number = 0) { return current(number).pagesNumber; }
    /// Whether the view's next frame is to say which pages its rays hit: some that could be refined are in the cut, and
    /// no frame of it has said so yet.
    [[nodiscard]] bool asksRays(ViewNumber number = 0) {
        const ViewCut& cut = current(number);
        return cut.pagesUnseen > 0 && cut.answered != cut.pagesNumber;
    }
    /// Takes in which pages a frame of `view` hit that drew the pages of that number.
    void see(const PagesHit& hit, const SelectionView& view, uint64_t pagesNumber, ViewNumber number = 0);
    /// Says what else throws rays of light in the view: any number that differs when that does. The next frame is then
    /// to say anew which pages its rays hit.
    void surroundWith(uint64_t others, ViewNumber number = 0);
    [[nodiscard]] uint64_t others(ViewNumber number = 0) { return current(number).others; }
    /// Whether pages that rays ask for are there, or cannot be read.
    [[nodiscard]] bool hasAll(const std::vector<uint64_t>& pages) const;

    [[nodiscard]] const Dataset& dataset() const { return *dataset_.dataset; }
    /// The pages that the view can draw now, in directory order.
    [[nodiscard]] const std::vector<uint64_t>& cut(ViewNumber number = 0) { return current(number).pages; }
    /// Those of them that it draws only in some octants.
    [[nodiscard]] const std::vector<PartialPage>& partial(ViewNumber number = 0) { return current(number).partial; }
    [[nodiscard]] std::vector<frame::TableRecord> table(ViewNumber number = 0);
    /// A number that changes whenever the page table may, or the images: with another cut, or with pages in other
    /// places.
    [[nodiscard]] uint64_t version() const;
    /// The pool, which holds the pages of all datasets of the scene.
    [[nodiscard]] const PageMemory& pages() const;
    /// Returns the slot of a page that is resident.
    [[nodiscard]] PoolSlot slotOf(uint64_t page) const;
    [[nodiscard]] bool hasColour() const { return dataset_.withColour; }
    /// The tiles of the file's images to draw from, the same until the scene's next update; null: the colours of
    /// vertices are shown.
    [[nodiscard]] std::shared_ptr<const ImageSet> images() const { return images_ ? images_->shown() : nullptr; }
    /// Whether some material has channels that images() may show.
    [[nodiscard]] bool hasChannels() const { return images_ && !images_->pieces().tables().channels.empty(); }
    /// How much the view needs each piece of the images on some of its pages (ImageResidency::needsOn). Precondition:
    /// images() is not null.
    [[nodiscard]] std::vector<float> needsOn(const SelectionView& view, const std::vector<uint64_t>& pages) const {
        return images_->needsOn(dataset(), view, pages);
    }
    /// Precondition: images() is not null.
    [[nodiscard]] const ImagePieces& pieces() const { return images_->pieces(); }
    /// Counts the sets of tiles.
    [[nodiscard]] uint64_t imagesVersion() const { return images_ ? images_->version() : 0; }
    /// The most bytes that these take.
    [[nodiscard]] uint64_t mostImageBytes() const { return images_ ? images_->mostBytes() : 0; }
    [[nodiscard]] std::vector<uint64_t> residentPages() const;
    /// Bytes of colour of the dataset's pages in the pool.
    [[nodiscard]] uint64_t colourBytes() const;

private:
    struct ViewCut {
        std::vector<uint64_t> pages;
        std::vector<PartialPage> partial;
        uint64_t version = UINT64_MAX;
        uint64_t imagesVersion = 0;
        uint64_t pagesNumber = 0;           // of its pages, whatever the images
        uint64_t number = 0, reported = 0;  // of the cut, and of that of its last update
        uint64_t answered = 0;              // number of the pages of which a frame of this view said which its rays hit
        uint64_t others = 0;                // as surroundWith() said
        uint64_t pagesUnseen = 0;
        SelectionView view;
    };
    /// Returns what a view draws as pages are now.
    ViewCut& current(ViewNumber number);
    void take(DrawableCut drawable, ViewCut& cut);
    UpdateResult report(const DrawableCut& drawable, const ViewCut& drawn) const;

    friend class SceneResidency;
    SceneResidency& scene_;
    const size_t number_;
    const PooledDataset dataset_;
    std::unique_ptr<ImageResidency> images_;
    size_t pagesKept_ = 0;  // once `images_` knows so many pages, it forgets those that were evicted
    std::map<ViewNumber, ViewCut> cuts_;
    uint64_t cutsDrawn_ = 0;  // number of the last cut
};

}  // namespace vcp
