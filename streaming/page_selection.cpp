#include "streaming/page_selection.h"

#include <algorithm>
#include <limits>
#include <queue>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Candidate {
    double error;
    uint64_t page;

    /// The largest error comes first; among equals, the first in the directory.
    bool operator<(const Candidate& other) const {
        return error != other.error ? error < other.error : page > other.page;
    }
};

}  // namespace

double projectedError(const Dataset& dataset, const PageEntry& page, const SelectionView& view) {
    if (page.certifiedError <= 0) return 0;
    const double error = double(page.certifiedError) * view.pixelsPerUnit;
    if (view.orthographic) return error;
    const glm::dvec3 lo = dataset.originOf(page), hi = lo + dataset.edgeOf(page);
    const double distance = glm::length(glm::clamp(view.eye, lo, hi) - view.eye);
    return distance > 0 ? error / distance : kInfinity;
}

bool inFrustum(const Dataset& dataset, const PageEntry& page, const SelectionView& view) {
    const glm::dvec3 lo = dataset.originOf(page) - view.eye, hi = lo + dataset.edgeOf(page);
    for (const glm::dvec4& plane : view.planes) {
        const glm::dvec3 normal(plane);
        const glm::dvec3 farthest(normal.x > 0 ? hi.x : lo.x, normal.y > 0 ? hi.y : lo.y, normal.z > 0 ? hi.z : lo.z);
        if (glm::dot(normal, farthest) + plane.w < 0) return false;
    }
    return true;
}

namespace {

// Where a view allows no error, errors are compared as multiples of this.
constexpr double kLeastErrorPixels = 1e-9;

/// Returns the page's error in the view; 0 for pages outside of the view.
double errorInView(const Dataset& dataset, uint64_t page, const SelectionView& view) {
    const PageEntry& entry = dataset.pages[page];
    return inFrustum(dataset, entry, view) ? projectedError(dataset, entry, view) : 0;
}

bool isTooCoarse(double error, const SelectionView& view) { return error > view.errorPixels; }

/// The page's error as a multiple of what is allowed, in the view where that is largest; 0: fine enough for all.
double excessOf(const Dataset& dataset, uint64_t page, std::span<const SelectionView> views) {
    double excess = 0;
    for (const SelectionView& view : views)
        if (const double error = errorInView(dataset, page, view); isTooCoarse(error, view))
            excess = std::max(excess, error / std::max(view.errorPixels, kLeastErrorPixels));
    return excess;
}

bool mayBeRefined(const PageEntry& page, std::span<const uint8_t> states) {
    const EntryRange children = childrenOf(page);
    return page.childMask != 0 &&
           std::all_of(children.begin(), children.end(), [&](uint64_t child) { return states[child] != kUnavailable; });
}

struct ChildrenBytes {
    uint64_t bytes = 0;
    bool areKnown = true;
};
/// Returns the bytes of a page's children; those that are not known count as about as large as their parent.
ChildrenBytes bytesOf(const PageEntry& parent, uint64_t parentBytes, std::span<const uint64_t> pageBytes) {
    ChildrenBytes sum;
    for (const uint64_t child : childrenOf(parent)) {
        const bool isKnown = pageBytes[child] != 0;
        sum.bytes += isKnown ? pageBytes[child] : parentBytes;
        sum.areKnown = sum.areKnown && isKnown;
    }
    return sum;
}

}  // namespace

PageChoice choosePages(const Dataset& dataset, std::span<const SelectionView> views, uint64_t budgetBytes,
                       std::span<const uint64_t> pageBytes, std::span<const uint8_t> states) {
    PageChoice choice;
    choice.refined = SparseArray<uint8_t>(dataset.pages.size());  // all are kNotRefined
    if (dataset.pages.empty() || states[0] != kAvailable || pageBytes[0] > budgetBytes) return choice;
    std::priority_queue<Candidate> open;
    uint64_t bytes = pageBytes[0];
    choice.wanted.push_back({0, kInfinity});
    open.push({excessOf(dataset, 0, views), 0});
    while (!open.empty()) {
        const Candidate next = open.top();
        open.pop();
        if (next.error <= 0) break;
        const PageEntry& entry = dataset.pages[next.page];
        if (!mayBeRefined(entry, states)) continue;
        const ChildrenBytes more = bytesOf(entry, pageBytes[next.page], pageBytes);
        if (!more.areKnown) {
            choice.awaited.push_back(next.page);
            choice.refined[next.page] = kAwaited;
        }
        if (bytes + more.bytes > budgetBytes) {
            choice.relaxed = more.areKnown;
            break;
        }
        // Room is kept for children that are not there yet, so that less urgent pages do not take it.
        bytes += more.bytes;
        if (!more.areKnown) continue;
        choice.refined[next.page] = kRefined;
        for (const uint64_t child : childrenOf(entry)) {
            choice.wanted.push_back({child, next.error});
            open.push({excessOf(dataset, child, views), child});
        }
    }
    return choice;
}

DrawableCut drawableCut(const Dataset& dataset, const SelectionView& view, const PageChoice& choice,
                        std::span<const uint8_t> resident) {
    DrawableCut drawable;
    drawable.errorPixels = kInfinity;
    drawable.complete = true;
    if (choice.wanted.empty()) return drawable;
    const bool hasRoot = resident[0] != 0;
    if (hasRoot) drawable.errorPixels = 0;
    // A page is refined where all its children are there; pages beneath what is drawn are only counted.
    struct Place {
        uint64_t page;
        bool isCovered;
    };
    std::vector<Place> walk{{0, !hasRoot}};
    while (!walk.empty()) {
        const Place at = walk.back();
        walk.pop_back();
        ++drawable.pagesWanted;
        drawable.pagesMissing += resident[at.page] != 0 ? 0 : 1;
        const PageEntry& entry = dataset.pages[at.page];
        const EntryRange children = childrenOf(entry);
        const double error = errorInView(dataset, at.page, view);
        const bool refined = choice.refined[at.page] == kRefined && isTooCoarse(error, view);
        if (choice.refined[at.page] == kAwaited && isTooCoarse(error, view)) {
            drawable.pagesWanted += children.size();
            drawable.pagesMissing += children.size();
        }
        const bool drawn =
            !at.isCovered && !(refined && std::all_of(children.begin(), children.end(),
                                                      [&](uint64_t child) { return resident[child] != 0; }));
        if (refined)
            for (const uint64_t child : children) walk.push_back({child, at.isCovered || drawn});
        if (!refined && isTooCoarse(error, view) && entry.childMask != 0)
            drawable.isRelaxed = drawable.isRelaxed || choice.relaxed;
        if (!drawn) continue;
        drawable.cut.push_back(at.page);
        // Inside a page's box the error has no bound; it is reported as seen from a cell away.
        const double fromACell = double(entry.certifiedError) * view.pixelsPerUnit / dataset.cellOf(entry.level);
        drawable.errorPixels = std::max(drawable.errorPixels, view.orthographic ? error : std::min(error, fromACell));
    }
    drawable.complete = drawable.pagesMissing == 0;
    std::sort(drawable.cut.begin(), drawable.cut.end());
    return drawable;
}

Selection selectPages(const Dataset& dataset, const SelectionView& view, uint64_t budgetBytes,
                      std::span<const uint64_t> pageBytes, std::span<const uint8_t> resident,
                      std::span<const uint8_t> states) {
    Selection selection;
    static_cast<PageChoice&>(selection) = choosePages(dataset, {&view, 1}, budgetBytes, pageBytes, states);
    static_cast<DrawableCut&>(selection) = drawableCut(dataset, view, selection, resident);
    return selection;
}

}  // namespace vcp
