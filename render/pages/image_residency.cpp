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
/// How many steps of a level tell apart what is needed more where not all has room.
constexpr float kNeedSteps = 4;

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
    if (look.view == view && look.cut == cut && !look.needs.empty()) return;
    look = {view, cut, needsOn(dataset, view, cut)};
    replan();
}

std::vector<float> ImageResidency::needsOn(const Dataset& dataset, const SelectionView& view,
                                           const std::vector<uint64_t>& pages) const {
    std::vector<float> needs(pieces().count());
    for (const uint64_t page : pages) {
        const auto shown = pages_.find(page);
        if (shown == pages_.end() || !inFrustum(dataset, dataset.pages[page], view)) continue;
        const glm::dvec3 origin = dataset.originOf(dataset.pages[page]);
        const double cell = dataset.cellOf(dataset.pages[page].level);
        for (const Shown& of : shown->second) {
            const glm::dvec3 low = origin + cell * glm::dvec3(of.low), high = origin + cell * glm::dvec3(of.high);
            if (!inFrustum(low, high, view)) continue;
            addNeeds(of, pixelEdgeAt(low, high, view) / cell, needs);
        }
    }
    return needs;
}

/// Adds what a part of a page needs where pixels are so wide, cells of the page.
void ImageResidency::addNeeds(const Shown& shown, double pixelEdge, std::vector<float>& needs) const {
    const auto levels = uint32_t(pieces().levelsOf(shown.image).size());
    const double needed = levelNeeded(shown.texelsPerCell, pixelEdge, levels);
    for (size_t level = 0; level < shown.begin.size(); ++level) {
        const bool isFirst = level + 1 == shown.begin.size();  // with all that are coarser
        const auto need = float((isFirst ? levels : double(level + 1)) - needed);
        const size_t end = isFirst ? shown.pieces.size() : shown.begin[level + 1];
        for (size_t i = shown.begin[level]; i < end; ++i)
            needs[shown.pieces[i]] = std::max(needs[shown.pieces[i]], need);
    }
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
    std::vector<float> needs(planned_.size());
    for (const auto& [number, look] : looks_)
        std::transform(needs.begin(), needs.end(), look.needs.begin(), needs.begin(),
                       [](float a, float b) { return std::max(a, b); });
    for (uint64_t piece = 0; piece < planned_.size(); ++piece) {
        if (needs[piece] > 0) needed_[piece] = plans_;
        planned_[piece] = needs[piece] > 0 && !unreadable_[piece];
    }
    leaveOut(needs);
    makeRoom();
}

/// Leaves the plan with what is needed the most and has room.
void ImageResidency::leaveOut(const std::vector<float>& needs) {
    uint64_t bytes = 0;
    std::vector<std::pair<float, uint64_t>> order;
    for (uint64_t piece = 0; piece < planned_.size(); ++piece) {
        if (!planned_[piece]) continue;
        bytes += bytes_[piece];
        // What is needed about as much has an order of its own, which small moves do not change.
        order.emplace_back(-std::floor(needs[piece] * kNeedSteps), piece);
    }
    if (bytes <= mostBytes_) return;
    std::sort(order.begin(), order.end());
    bytes = 0;
    for (const auto& [step, piece] : order) {
        bytes += bytes_[piece];
        if (bytes > mostBytes_) planned_[piece] = false;
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
        if (look->second.needs[piece] > 0 && !planned_[piece] && !unreadable_[piece]) return true;
    return false;
}

bool ImageResidency::isComplete(ViewNumber number) const {
    const auto look = looks_.find(number);
    if (look == looks_.end()) return true;
    for (uint64_t piece = 0; piece < planned_.size(); ++piece)
        if (look->second.needs[piece] > 0 && planned_[piece] && !shownPieces_[piece]) return false;
    return true;
}

}  // namespace vcp
