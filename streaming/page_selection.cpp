#include "streaming/page_selection.h"

#include <algorithm>
#include <bit>
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

    /// Largest error first; of equals the first in the directory.
    bool operator<(const Candidate& other) const {
        return error != other.error ? error < other.error : page > other.page;
    }
};

/// Numbers of a page's children.
struct Children {
    uint64_t first, end;
};
Children childrenOf(const PageEntry& page) {
    return {page.firstChild, uint64_t{page.firstChild} + std::popcount(page.childMask)};
}

template <class Test>
bool allOf(Children children, Test test) {
    for (uint64_t child = children.first; child < children.end; ++child)
        if (!test(child)) return false;
    return true;
}

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

/// Of pages outside of the view: none.
double errorInView(const Dataset& dataset, uint64_t page, const SelectionView& view) {
    const PageEntry& entry = dataset.pages[page];
    return inFrustum(dataset, entry, view) ? projectedError(dataset, entry, view) : 0;
}

}  // namespace

PageChoice choosePages(const Dataset& dataset, const SelectionView& view, uint64_t budgetBytes, std::span<const uint64_t> pageBytes,
                       std::span<const uint8_t> unavailable) {
    PageChoice choice;
    choice.refined.assign(dataset.pages.size(), 0);
    if (dataset.pages.empty() || unavailable[0] != 0 || pageBytes[0] > budgetBytes) return choice;
    std::priority_queue<Candidate> open;
    uint64_t bytes = pageBytes[0];
    choice.wanted.push_back({0, kInfinity});
    open.push({errorInView(dataset, 0, view), 0});
    while (!open.empty()) {
        const Candidate next = open.top();
        open.pop();
        if (next.error <= view.errorPixels) break;
        const PageEntry& entry = dataset.pages[next.page];
        const Children children = childrenOf(entry);
        if (entry.childMask == 0 || !allOf(children, [&](uint64_t child) { return unavailable[child] == 0; })) continue;
        uint64_t more = 0;
        for (uint64_t child = children.first; child < children.end; ++child) more += pageBytes[child];
        if (bytes + more > budgetBytes) {
            choice.relaxed = true;
            break;
        }
        bytes += more;
        choice.refined[next.page] = 1;
        for (uint64_t child = children.first; child < children.end; ++child) {
            choice.wanted.push_back({child, next.error});
            open.push({errorInView(dataset, child, view), child});
        }
    }
    return choice;
}

DrawableCut drawableCut(const Dataset& dataset, const SelectionView& view, const PageChoice& choice, std::span<const uint8_t> resident) {
    DrawableCut drawable;
    drawable.errorPixels = kInfinity;
    drawable.complete = std::all_of(choice.wanted.begin(), choice.wanted.end(), [&](const WantedPage& wanted) { return resident[wanted.page] != 0; });
    if (choice.wanted.empty() || resident[0] == 0) return drawable;
    drawable.errorPixels = 0;
    // Refined where all children are there.
    std::vector<uint64_t> walk{0};
    while (!walk.empty()) {
        const uint64_t page = walk.back();
        walk.pop_back();
        const Children children = childrenOf(dataset.pages[page]);
        if (choice.refined[page] != 0 && allOf(children, [&](uint64_t child) { return resident[child] != 0; })) {
            for (uint64_t child = children.first; child < children.end; ++child) walk.push_back(child);
            continue;
        }
        drawable.cut.push_back(page);
        // Inside a page's box the error has no bound; it is reported as seen from a cell away.
        const PageEntry& entry = dataset.pages[page];
        const double error = errorInView(dataset, page, view);
        const double fromACell = double(entry.certifiedError) * view.pixelsPerUnit / dataset.cellOf(entry.level);
        drawable.errorPixels = std::max(drawable.errorPixels, view.orthographic ? error : std::min(error, fromACell));
    }
    std::sort(drawable.cut.begin(), drawable.cut.end());
    return drawable;
}

Selection selectPages(const Dataset& dataset, const SelectionView& view, uint64_t budgetBytes,
                      std::span<const uint64_t> pageBytes, std::span<const uint8_t> resident,
                      std::span<const uint8_t> unavailable) {
    Selection selection;
    static_cast<PageChoice&>(selection) = choosePages(dataset, view, budgetBytes, pageBytes, unavailable);
    static_cast<DrawableCut&>(selection) = drawableCut(dataset, view, selection, resident);
    return selection;
}

}  // namespace vcp
