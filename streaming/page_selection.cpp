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

Selection selectPages(const Dataset& dataset, const SelectionView& view, uint64_t budgetBytes,
                      std::span<const uint64_t> pageBytes, std::span<const uint8_t> resident,
                      std::span<const uint8_t> unavailable) {
    Selection selection;
    selection.errorPixels = kInfinity;
    selection.complete = true;
    if (dataset.pages.empty() || unavailable[0] != 0 || pageBytes[0] > budgetBytes) return selection;

    const auto errorOf = [&](uint64_t page) {
        const PageEntry& entry = dataset.pages[page];
        return inFrustum(dataset, entry, view) ? projectedError(dataset, entry, view) : 0;
    };
    std::vector<uint8_t> refined(dataset.pages.size(), 0);
    std::priority_queue<Candidate> open;
    uint64_t bytes = pageBytes[0];
    selection.wanted.push_back({0, kInfinity});
    open.push({errorOf(0), 0});
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
            selection.relaxed = true;
            break;
        }
        bytes += more;
        refined[next.page] = 1;
        for (uint64_t child = children.first; child < children.end; ++child) {
            selection.wanted.push_back({child, next.error});
            open.push({errorOf(child), child});
        }
    }
    selection.complete = std::all_of(selection.wanted.begin(), selection.wanted.end(),
                                     [&](const WantedPage& wanted) { return resident[wanted.page] != 0; });

    // What is drawn: refined where all children are there.
    if (resident[0] == 0) return selection;
    selection.errorPixels = 0;
    std::vector<uint64_t> walk{0};
    while (!walk.empty()) {
        const uint64_t page = walk.back();
        walk.pop_back();
        const Children children = childrenOf(dataset.pages[page]);
        if (refined[page] != 0 && allOf(children, [&](uint64_t child) { return resident[child] != 0; })) {
            for (uint64_t child = children.first; child < children.end; ++child) walk.push_back(child);
            continue;
        }
        selection.cut.push_back(page);
        // Inside a page's box the error has no bound; it is reported as seen from a cell away.
        const PageEntry& entry = dataset.pages[page];
        const double fromACell = double(entry.certifiedError) * view.pixelsPerUnit / dataset.cellOf(entry.level);
        selection.errorPixels = std::max(selection.errorPixels, view.orthographic ? errorOf(page) : std::min(errorOf(page), fromACell));
    }
    std::sort(selection.cut.begin(), selection.cut.end());
    return selection;
}

}  // namespace vcp
