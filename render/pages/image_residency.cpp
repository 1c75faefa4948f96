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

/// Returns the edge of a pixel at the point of a box nearest to the eye.
double pixelEdgeAt(glm::dvec3 low, glm::dvec3 high, const SelectionView& view) {
    const double edge = 1 / view.pixelsPerUnit;
    return view.orthographic ? edge : edge * glm::length(glm::clamp(view.eye, low, high) - view.eye);
}

}  // namespace

ImageResidency::ImageResidency(std::shared_ptr<const ImagePieces> pieces, uint64_t mostBytes)
    : assembly_(std::move(pieces)),
      mostBytes_(mostBytes),
      planned_(this->pieces().count()),
      unreadable_(this->pieces().count()),
      needed_(this->pieces().count()),
      shown_(std::make_shared<const ImageSet>(assembly_.set())),
      shownPieces_(this->pieces().count()) {
    for (uint64_t piece = 0; piece < planned_.size(); ++piece)
        bytes_.push_back(uint32_t(this->pieces().bytesOf(piece)));
}

ImageResidency::Shown ImageResidency::shownOf(const ImageNeed& need) const {
    Shown shown{need.image, need.texelsPerCell, need.low, need.high, {}, {}};
    for (uint32_t level = 0; level <= pieces().firstLevel(need.image); ++level) {
        const auto added = piecesNeeded(pieces(), need, level);
        shown.begin.push_back(uint32_t(shown.pieces.size()));
        shown.pieces.insert(shown.pieces.end(), added.begin(), added.end());
    }
    return shown;
}

void ImageResidency::learn(uint64_t page, std::vector<ImageNeed> needs) {
    if (needs.empty()) return;
    std::vector<Shown>& shown = pages_[page];
    shown.clear();
    for (const ImageNeed& need : needs) shown.push_back(shownOf(need));
}

void ImageResidency::forgetOthers(const std::vector<uint64_t>& pages) {
    std::unordered_map<uint64_t, std::vector<Shown>> kept;
    for (const uint64_t page : pages)
        if (auto found = pages_.extract(page)) kept.insert(std::move(found));
    pages_ = std::move(kept);
}

void ImageResidency::look(const Dataset& dataset, const SelectionView& view, const std::vector<uint64_t>& cut,
                          ViewNumber number) {
    Look& look = looks_[number];
    if (look.view == view && look.cut == cut && !look.needed.empty()) return;
    look = {view, cut, neededOn(dataset, view, cut)};
    replan();
}

std::vector<bool> ImageResidency::neededOn(const Dataset& dataset, const SelectionView& view,
                                           const std::vector<uint64_t>& pages) const {
    std::vector<bool> needed(pieces().count());
    for (const uint64_t page : pages) {
        const auto shown = pages_.find(page);
        if (shown == pages_.end() || !inFrustum(dataset, dataset.pages[page], view)) continue;
        const glm::dvec3 origin = dataset.originOf(dataset.pages[page]);
        const double cell = dataset.cellOf(dataset.pages[page].level);
        for (const Shown& of : shown->second) {
            const glm::dvec3 low = origin + cell * glm::dvec3(of.low), high = origin + cell * glm::dvec3(of.high);
            if (!inFrustum(low, high, view)) continue;
            const uint32_t finest = finestNeeded(of.texelsPerCell, pixelEdgeAt(low, high, view) / cell,
                                                 uint32_t(pieces().levelsOf(of.image).size()));
            const uint32_t begin = of.begin[std::min(size_t{finest}, of.begin.size() - 1)];
            for (size_t i = begin; i < of.pieces.size(); ++i) needed[of.pieces[i]] = true;
        }
    }
    return needed;
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
    if (!planned_[piece]) return;
    assembly_.take(piece, texels);
    isIdle_ = false;
}

void ImageResidency::giveUp(uint64_t piece) {
    const ImagePiece what = pieces().piece(piece);
    unreadable_[piece] = true;
    if (what.level == pieces().firstLevel(what.image)) {
        const auto [first, end] = pieces().piecesOf(what.image, 0);
        std::fill(unreadable_.begin() + std::ptrdiff_t(piece), unreadable_.begin() + std::ptrdiff_t(end), true);
    }
    replan();
}

/// Chooses the pieces that are to be in memory, and drops those that have no room beside them.
void ImageResidency::plan() {
    ++plans_;
    std::fill(planned_.begin(), planned_.end(), false);
    for (uint64_t piece = 0; piece < planned_.size(); ++piece) {
        for (const auto& [number, look] : looks_) planned_[piece] = planned_[piece] || look.needed[piece];
        if (planned_[piece]) needed_[piece] = plans_;
        planned_[piece] = planned_[piece] && !unreadable_[piece];
    }
    leaveOut();
    makeRoom();
}

/// Takes levels out of the plan until it is within what is allowed: again and again, of the finest that each image is
/// planned to have, the one that takes the most.
void ImageResidency::leaveOut() {
    struct Planned {
        uint32_t image, level;
        uint64_t bytes;
    };
    std::vector<Planned> levels;  // image by image, the finest first
    uint64_t bytes = 0;
    for (uint32_t image = 0; image < pieces().tables().images.size(); ++image)
        for (uint32_t level = 0; level <= pieces().firstLevel(image); ++level) {
            const auto [first, end] = pieces().piecesOf(image, level);
            uint64_t taken = 0;
            for (uint64_t piece = first; piece < end; ++piece)
                if (planned_[piece]) taken += bytes_[piece];
            if (taken > 0) levels.push_back({image, level, taken});
            bytes += taken;
        }
    while (bytes > mostBytes_) {
        auto most = levels.begin();
        for (auto level = levels.begin(); level != levels.end(); ++level)
            if ((level == levels.begin() || level->image != (level - 1)->image) && level->bytes > most->bytes)
                most = level;
        const auto [first, end] = pieces().piecesOf(most->image, most->level);
        std::fill(planned_.begin() + std::ptrdiff_t(first), planned_.begin() + std::ptrdiff_t(end), false);
        bytes -= most->bytes;
        levels.erase(most);
    }
}

/// Drops pieces that are not planned where the others have no room: some more than must go, so that the next ones can
/// come without.
void ImageResidency::makeRoom() {
    uint64_t bytes = 0;
    std::vector<uint64_t> others;
    for (uint64_t piece = 0; piece < planned_.size(); ++piece) {
        if (planned_[piece] || assembly_.has(piece)) bytes += bytes_[piece];
        if (!planned_[piece] && assembly_.has(piece)) others.push_back(piece);
    }
    // Pieces of one plan go with their highest numbers first, since finer levels have these.
    std::sort(others.begin(), others.end(),
              [&](uint64_t a, uint64_t b) { return needed_[a] != needed_[b] ? needed_[a] < needed_[b] : a > b; });
    const uint64_t kept = bytes > mostBytes_ ? mostBytes_ - mostBytes_ / 8 : mostBytes_;
    for (auto piece = others.begin(); piece != others.end() && bytes > kept; ++piece) {
        assembly_.drop(*piece);
        bytes -= bytes_[*piece];
        dropped_ = dropped_ || shownPieces_[*piece];
    }
}

std::vector<Wish> ImageResidency::wishes() {
    if (isIdle_) return {};
    const bool moved = std::exchange(stale_, false);
    if (moved) plan();
    std::vector<Wish> wishes;
    for (uint32_t image = 0; image < pieces().tables().images.size(); ++image) addWishes(image, wishes);
    const bool isWhole = wishes.empty() && !moved;
    if (isWhole || dropped_ || 2 * assembly_.set().bytes() >= 3 * shown_->bytes()) show();
    isIdle_ = isWhole;
    return wishes;
}

/// Wishes for what is missing of the coarsest levels of an image that are not whole.
void ImageResidency::addWishes(uint32_t image, std::vector<Wish>& wishes) const {
    const uint32_t first = pieces().firstLevel(image);
    const auto planned = [&](uint32_t level) {
        const auto [begin, end] = pieces().piecesOf(image, level);
        for (uint64_t piece = begin; piece < end; ++piece)
            if (planned_[piece]) return true;
        return false;
    };
    uint32_t finest = 0;
    while (finest <= first && !planned(finest)) ++finest;
    uint32_t ahead = 0;
    for (uint32_t level = first + 1; level-- > finest && ahead < kLevelsAhead;) {
        // Each level that is missing is twice as wide a blur; with the first piece comes the coarsest.
        const auto levels = uint32_t(pieces().levelsOf(image).size());
        const uint32_t missing = (level == first ? levels : level + 1) - finest;
        const double urgency = std::ldexp(1.0, int(missing) - kUrgentLevels);
        const size_t before = wishes.size();
        const auto [begin, end] = pieces().piecesOf(image, level);
        for (uint64_t piece = begin; piece < end; ++piece)
            if (planned_[piece] && !assembly_.has(piece)) wishes.push_back({Request::imagePiece(piece), urgency});
        ahead += ahead > 0 || wishes.size() > before ? 1 : 0;
    }
}

/// Shows what is there.
void ImageResidency::show() {
    dropped_ = false;
    std::vector<bool> there(planned_.size());
    for (uint64_t piece = 0; piece < there.size(); ++piece) there[piece] = assembly_.has(piece);
    if (there == shownPieces_) return;
    shownPieces_ = std::move(there);
    shown_ = std::make_shared<const ImageSet>(assembly_.set());
    ++version_;
}

bool ImageResidency::isLimited(ViewNumber number) const {
    const auto look = looks_.find(number);
    if (look == looks_.end()) return false;
    for (uint64_t piece = 0; piece < planned_.size(); ++piece)
        if (look->second.needed[piece] && !planned_[piece] && !unreadable_[piece]) return true;
    return false;
}

bool ImageResidency::isComplete(ViewNumber number) const {
    const auto look = looks_.find(number);
    if (look == looks_.end()) return true;
    for (uint64_t piece = 0; piece < planned_.size(); ++piece)
        if (look->second.needed[piece] && planned_[piece] && !shownPieces_[piece]) return false;
    return true;
}

}  // namespace vcp
