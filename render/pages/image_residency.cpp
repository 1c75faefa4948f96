#include "render/pages/image_residency.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "octree/image_needs.h"

namespace vcp {

namespace {

/// A picture without the last so many levels of its images is about as far from settled as one without pages.
constexpr int kUrgentLevels = 6;
/// How many levels of an image are read at once.
constexpr uint32_t kLevelsAhead = 3;

/// Returns the edge of a pixel at the point of a page's box nearest to the eye, in the page's cells.
double pixelEdgeAt(const Dataset& dataset, const PageEntry& page, const SelectionView& view) {
    const double edge = 1 / (view.pixelsPerUnit * dataset.cellOf(page.level));
    if (view.orthographic) return edge;
    const glm::dvec3 lo = dataset.originOf(page), hi = lo + dataset.edgeOf(page);
    return edge * glm::length(glm::clamp(view.eye, lo, hi) - view.eye);
}

}  // namespace

ImageResidency::ImageResidency(std::shared_ptr<const ImagePieces> pieces, uint64_t mostBytes)
    : assembly_(std::move(pieces)),
      mostBytes_(mostBytes),
      planned_(nothing()),
      readable_(images().size()),
      shown_(std::make_shared<const ImageSet>(assembly_.set())) {}

std::vector<uint32_t> ImageResidency::nothing() const {
    std::vector<uint32_t> levels;
    for (const ImageRow& image : images()) levels.push_back(image.levels);
    return levels;
}

void ImageResidency::learn(uint64_t page, std::vector<ImageNeed> needs) {
    if (!needs.empty()) needs_[page] = std::move(needs);
}

void ImageResidency::look(const Dataset& dataset, const SelectionView& view, const std::vector<uint64_t>& cut,
                          ViewNumber number) {
    Look& look = looks_[number];
    if (look.view == view && look.cut == cut && !look.finest.empty()) return;
    look = {view, cut, finestOn(dataset, view, cut)};
    replan();
}

std::vector<uint32_t> ImageResidency::finestOn(const Dataset& dataset, const SelectionView& view,
                                               const std::vector<uint64_t>& pages) const {
    std::vector<uint32_t> all = nothing();
    for (const uint64_t page : pages) {
        const auto needs = needs_.find(page);
        if (needs == needs_.end() || !inFrustum(dataset, dataset.pages[page], view)) continue;
        const double edge = pixelEdgeAt(dataset, dataset.pages[page], view);
        for (const ImageNeed& need : needs->second) {
            uint32_t& finest = all[need.image];
            finest = std::min(finest, finestNeeded(need.texelsPerCell, edge, images()[need.image].levels));
        }
    }
    return all;
}

void ImageResidency::forgetView(ViewNumber number) {
    if (looks_.erase(number) > 0) replan();
}

void ImageResidency::replan() {
    stale_ = true;
    isIdle_ = false;
}

void ImageResidency::take(uint64_t piece, std::span<const uint32_t> texels) {
    // What is not planned any more has no room.
    const ImagePiece what = assembly_.pieces().piece(piece);
    const uint32_t planned = planned_[what.image];
    const bool isFirst = what.level == assembly_.pieces().firstLevel(what.image);
    if (planned == images()[what.image].levels || (what.level < planned && !isFirst)) return;
    assembly_.take(piece, texels);
    assembly_.drop(what.image, planned);
    isIdle_ = false;
}

void ImageResidency::giveUp(uint64_t piece) {
    const ImagePiece what = assembly_.pieces().piece(piece);
    // Some levels of a first piece may be there.
    const bool isFirst = what.level == assembly_.pieces().firstLevel(what.image);
    const uint32_t next = isFirst ? assembly_.set().images()[what.image].finest : what.level + 1;
    readable_[what.image] = std::max(readable_[what.image], next);
    replan();
}

/// Chooses the levels that are to be in memory, and drops those that have no room beside them.
void ImageResidency::plan() {
    std::vector<uint32_t> needed = nothing(), kept, coarsest;
    for (const auto& [number, look] : looks_)
        for (size_t i = 0; i < needed.size(); ++i)
            needed[i] = std::min(needed[i], std::max(look.finest[i], readable_[i]));
    for (size_t i = 0; i < needed.size(); ++i) {
        kept.push_back(std::min(needed[i], assembly_.set().images()[i].finest));
        coarsest.push_back(std::max(needed[i], images()[i].levels - 1));
    }
    // What no view needs goes first.
    kept = finestWithin(images(), std::move(kept), needed, mostBytes_);
    planned_ = finestWithin(images(), std::move(kept), coarsest, mostBytes_);
    for (uint32_t i = 0; i < planned_.size(); ++i) assembly_.drop(i, planned_[i]);
}

std::vector<Wish> ImageResidency::wishes() {
    if (isIdle_) return {};
    const bool moved = std::exchange(stale_, false);
    if (moved) plan();
    std::vector<Wish> wishes;
    const ImagePieces& pieces = assembly_.pieces();
    const ImageSet& there = assembly_.set();
    bool dropped = false;
    for (uint32_t image = 0; image < planned_.size(); ++image) {
        const uint32_t finest = there.images()[image].finest, planned = planned_[image];
        dropped = dropped || shown_->images()[image].finest < finest;
        if (finest <= planned) continue;
        const uint32_t first = pieces.firstLevel(image), last = std::min(planned, first);
        uint32_t level = std::min(finest - 1, first) + 1;
        for (uint32_t ahead = 0; ahead < kLevelsAhead && level-- > last; ++ahead) {
            // Each level that is missing is twice as wide a blur; with the first piece comes the coarsest.
            const uint32_t missing = (level == first ? images()[image].levels : level + 1) - planned;
            const double urgency = std::ldexp(1.0, int(missing) - kUrgentLevels);
            const auto [begin, end] = pieces.piecesOf(image, level);
            for (uint64_t piece = begin; piece < end; ++piece)
                if (!assembly_.has(piece)) wishes.push_back({Request::imagePiece(piece), urgency});
        }
    }
    const bool isWhole = wishes.empty() && !moved;
    if (isWhole || dropped || 2 * there.bytes() >= 3 * shown_->bytes()) show();
    isIdle_ = isWhole;
    return wishes;
}

/// Shows the levels that are there.
void ImageResidency::show() {
    const auto levels = [](const ImageSet& set) {
        std::vector<const void*> all;
        for (const ImageSet::Image& image : set.images())
            all.push_back(image.levels.empty() ? nullptr : image.levels.front().texels.get());
        return all;
    };
    if (levels(assembly_.set()) == levels(*shown_)) return;
    shown_ = std::make_shared<const ImageSet>(assembly_.set());
    ++version_;
}

template <class Finest>
bool ImageResidency::lacks(ViewNumber number, const Finest& finest) const {
    const auto look = looks_.find(number);
    if (look == looks_.end()) return false;
    for (size_t i = 0; i < planned_.size(); ++i)
        if (finest(i) > std::max(look->second.finest[i], readable_[i])) return true;
    return false;
}

bool ImageResidency::isLimited(ViewNumber number) const {
    return lacks(number, [&](size_t i) { return planned_[i]; });
}

bool ImageResidency::isComplete(ViewNumber number) const {
    return !lacks(number, [&](size_t i) {
        const uint32_t shown = shown_->images()[i].finest;
        return shown > planned_[i] ? shown : 0;
    });
}

}  // namespace vcp
