#include "streaming/page_selection.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <queue>
#include <tuple>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

namespace vcp {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Candidate {
    double error;
    uint64_t page;
    uint8_t octants;   // whose children are wanted
    uint32_t dataset;  // its number among those that share the budget

    /// The largest error comes first; among equals, the first dataset, and there the first in the directory.
    bool operator<(const Candidate& other) const {
        if (error != other.error) return error < other.error;
        return std::tie(dataset, page) > std::tie(other.dataset, other.page);
    }
};

}  // namespace

bool isColourOff(const PageEntry& page, const SelectionView& view) {
    return page.colourErrorP95 != 0 && colourErrorOf(page.colourErrorP95) > view.colourError;
}

double refinedError(const Dataset& dataset, const PageEntry& page, const SelectionView& view) {
    const double certified = double(page.certifiedError);
    return isColourOff(page, view) ? std::max(certified, dataset.slabEdgeOf(page.level)) : certified;
}

namespace {

/// A cube of the world: a page's, or that of one of its octants.
struct WorldCube {
    glm::dvec3 low;
    double edge;

    [[nodiscard]] WorldCube octant(uint32_t octant) const {
        const double half = 0.5 * edge;
        return {low + half * glm::dvec3(octant & 1, octant >> 1 & 1, octant >> 2), half};
    }
};

WorldCube cubeOf(const Dataset& dataset, const PageEntry& page) {
    return {dataset.originOf(page), dataset.edgeOf(page)};
}

/// Returns a length in pixels, at the point of a cube nearest to the eye; infinite where the eye is inside of it.
double projected(double length, const WorldCube& cube, const SelectionView& view) {
    if (length <= 0) return 0;
    const double wide = length * view.pixelsPerUnit;
    if (view.orthographic) return wide;
    const double distance = glm::length(glm::clamp(view.eye, cube.low, cube.low + cube.edge) - view.eye);
    return distance > 0 ? wide / distance : kInfinity;
}

/// Returns the same, seen from no nearer than a cell.
double shown(double length, double cell, const WorldCube& cube, const SelectionView& view) {
    const double wide = projected(length, cube, view);
    return view.orthographic ? wide : std::min(wide, length * view.pixelsPerUnit / cell);
}

// Where a view allows no error, errors are compared as multiples of this.
constexpr double kLeastErrorPixels = 1e-9;

/// Returns the error of what stands for a cube of the method Paper: too much where the cube is near.
double nearness(const Dataset& dataset, const WorldCube& cube, const SelectionView& view) {
    const FileHeader& h = dataset.header;
    const glm::dvec3 low(h.boundsMin[0], h.boundsMin[1], h.boundsMin[2]),
        high(h.boundsMax[0], h.boundsMax[1], h.boundsMax[2]);
    const double reach = view.paperReach * glm::length(high - low);
    const double distance = glm::length(glm::clamp(view.eye, cube.low, cube.low + cube.edge) - view.eye);
    if (distance >= reach) return 0;
    return distance > 0 ? std::max(view.errorPixels, kLeastErrorPixels) * (reach / distance) : kInfinity;
}

/// Returns the error of a page, in pixels, where it is shown in a cube.
double errorIn(const Dataset& dataset, const PageEntry& page, const WorldCube& cube, const SelectionView& view) {
    if (dataset.header.method == Method::Paper) return nearness(dataset, cube, view);
    return projected(refinedError(dataset, page, view), cube, view);
}

}  // namespace

double projectedError(const Dataset& dataset, const PageEntry& page, const SelectionView& view) {
    return errorIn(dataset, page, cubeOf(dataset, page), view);
}

double shownError(const Dataset& dataset, const PageEntry& page, const SelectionView& view) {
    return shown(double(page.certifiedError), dataset.cellOf(page.level), cubeOf(dataset, page), view);
}

bool inFrustum(const Dataset& dataset, const PageEntry& page, const SelectionView& view) {
    const glm::dvec3 low = dataset.originOf(page);
    return inFrustum(low, low + dataset.edgeOf(page), view);
}

bool inFrustum(glm::dvec3 low, glm::dvec3 high, const SelectionView& view) {
    const glm::dvec3 lo = low - view.eye, hi = high - view.eye;
    for (const glm::dvec4& plane : view.planes) {
        const glm::dvec3 normal(plane);
        const glm::dvec3 farthest(normal.x > 0 ? hi.x : lo.x, normal.y > 0 ? hi.y : lo.y, normal.z > 0 ? hi.z : lo.z);
        if (glm::dot(normal, farthest) + plane.w < 0) return false;
    }
    return true;
}

namespace {

bool isTooCoarse(double error, const SelectionView& view) { return error > view.errorPixels; }

/// Whether single children may replace a page in their octants: it has to have nodes that lie in one octant each.
bool canBePartial(const Dataset& dataset, const PageEntry& page) {
    return dataset.header.method == Method::Paper || (dataset.isCovering() && page.leaves > 1);
}

/// A page as a view sees it: its error octant by octant where single children may replace it.
struct PageInView {
    WorldCube cube;
    bool isInView, isPartial;
    std::array<double, 8> error{};  ///< pixels, of octants that have a child; 0 outside of the view
    uint8_t coarse = 0;             ///< octants in which that is more than the view allows

    PageInView(const Dataset& dataset, const PageEntry& page, const SelectionView& view)
        : cube(cubeOf(dataset, page)),
          isInView(inFrustum(cube.low, cube.low + cube.edge, view)),
          isPartial(canBePartial(dataset, page)) {
        if (page.childMask == 0 || !isInView) return;
        if (!isPartial) error.fill(errorIn(dataset, page, cube, view));
        for (uint32_t o = 0; o < 8; ++o) {
            if ((page.childMask >> o & 1) == 0) continue;
            if (isPartial) error[o] = errorIn(dataset, page, cube.octant(o), view);
            if (isTooCoarse(error[o], view)) coarse = uint8_t(coarse | 1u << o);
        }
    }
    /// Returns the largest error of some octants.
    [[nodiscard]] double errorOf(uint8_t octants) const {
        double most = 0;
        for (uint32_t o = 0; o < 8; ++o)
            if ((octants >> o & 1) != 0) most = std::max(most, error[o]);
        return most;
    }
};

/// Whether rays may begin inside of a cube: those of a parallel projection begin in a plane through the eye.
bool holdsOrigins(const WorldCube& cube, const SelectionView& view) {
    const glm::dvec3 half(0.5 * cube.edge), middle = cube.low + half - view.eye;
    if (!view.orthographic) return glm::all(glm::lessThanEqual(glm::abs(middle), half));
    const glm::dvec3 forward = glm::cross(glm::dvec3(view.planes[0]), glm::dvec3(view.planes[2]));
    return std::abs(glm::dot(middle, forward)) <= glm::dot(half, glm::abs(forward));
}

/// Returns the octants whose children a page's view wants. `seen`: what its rays hit; null: all pages count as hit.
uint8_t octantsWanted(const Dataset& dataset, uint64_t page, const PageInView& inView, const SelectionView& view,
                      const PagesSeen* seen) {
    if (seen == nullptr || inView.coarse == 0) return inView.coarse;
    const double unseen = kUnseenErrors * view.errorPixels;
    if (!inView.isPartial)
        return inView.error[0] > unseen || seen->contains(page) || holdsOrigins(inView.cube, view) ? inView.coarse
                                                                                                   : uint8_t{0};
    uint8_t wanted = 0;
    for (uint32_t o = 0; o < 8; ++o)
        if ((inView.coarse >> o & 1) != 0 &&
            (inView.error[o] > unseen || seen->contains(childIn(dataset.pages[page], o)) ||
             holdsOrigins(inView.cube.octant(o), view)))
            wanted = uint8_t(wanted | 1u << o);
    return wanted;
}

/// Returns what views want of a page's children; the error is a multiple of what is allowed, in the view where that is
/// largest, and 0 where no view wants any.
Candidate candidate(const ChoosingDataset& of, uint32_t number, uint64_t page) {
    Candidate made{0, page, 0, number};
    for (size_t i = 0; i < of.views.size(); ++i) {
        const SelectionView& view = of.views[i];
        const PageInView inView(of.dataset, of.dataset.pages[page], view);
        const uint8_t octants = octantsWanted(of.dataset, page, inView, view, of.seen.empty() ? nullptr : of.seen[i]);
        if (octants == 0) continue;
        made.octants |= octants;
        made.error = std::max(made.error, inView.errorOf(octants) / std::max(view.errorPixels, kLeastErrorPixels));
    }
    return made;
}

/// Calls visit(child, octant) for the children in octants that have one.
template <class Visit>
void forEachChild(const PageEntry& page, uint32_t octants, const Visit& visit) {
    for (uint32_t rest = octants; rest != 0; rest &= rest - 1) {
        const auto octant = uint32_t(std::countr_zero(rest));
        visit(childIn(page, octant), octant);
    }
}

/// Returns the octants whose children fulfil a condition; all or none where the page cannot be drawn in parts.
template <class Fulfils>
uint8_t octantsWhere(const Dataset& dataset, const PageEntry& page, uint8_t octants, const Fulfils& fulfils) {
    uint8_t found = 0;
    forEachChild(page, octants, [&](uint64_t child, uint32_t octant) {
        if (fulfils(child)) found = uint8_t(found | 1u << octant);
    });
    return found == page.childMask || canBePartial(dataset, page) ? found : uint8_t{0};
}

struct ChildrenBytes {
    uint64_t bytes = 0;
    bool areKnown = true;
};
/// Returns the bytes of a page's children; those that are not known count as about as large as their parent.
ChildrenBytes bytesOf(const PageEntry& parent, uint8_t octants, uint64_t parentBytes,
                      std::span<const uint64_t> pageBytes) {
    ChildrenBytes sum;
    forEachChild(parent, octants, [&](uint64_t child, uint32_t) {
        const bool isKnown = pageBytes[child] != 0;
        sum.bytes += isKnown ? pageBytes[child] : parentBytes;
        sum.areKnown = sum.areKnown && isKnown;
    });
    return sum;
}

}  // namespace

namespace {

/// Goes down the trees of several datasets, the page that errs most first, until the budget is spent.
class ChoosingWalk {
public:
    ChoosingWalk(std::span<const ChoosingDataset> datasets, uint64_t budgetBytes)
        : datasets_(datasets), budgetBytes_(budgetBytes), choices_(datasets.size()) {}

    std::vector<PageChoice> run() {
        for (uint32_t i = 0; i < datasets_.size(); ++i) begin(i);
        while (!open_.empty()) {
            const Candidate next = open_.top();
            open_.pop();
            if (next.error <= 0 || !refine(next)) break;
        }
        for (PageChoice& choice : choices_) choice.relaxed = isRelaxed_;
        return std::move(choices_);
    }

private:
    void begin(uint32_t number) {
        const ChoosingDataset& of = datasets_[number];
        PageChoice& choice = choices_[number];
        choice.refined = SparseArray<uint16_t>(of.dataset.pages.size());
        if (of.dataset.pages.empty() || of.states[0] != kAvailable || bytes_ + of.pageBytes[0] > budgetBytes_) return;
        take(choice, of.pageBytes[0]);
        choice.wanted.push_back({0, kInfinity});
        open_.push(candidate(of, number, 0));
    }

    /// Returns false where the budget is spent.
    bool refine(const Candidate& next) {
        const ChoosingDataset& of = datasets_[next.dataset];
        PageChoice& choice = choices_[next.dataset];
        const PageEntry& entry = of.dataset.pages[next.page];
        const uint8_t octants = octantsWhere(of.dataset, entry, next.octants,
                                             [&](uint64_t child) { return of.states[child] != kUnavailable; });
        if (octants == 0) return true;
        const ChildrenBytes more = bytesOf(entry, octants, of.pageBytes[next.page], of.pageBytes);
        if (!more.areKnown) {
            choice.awaited.push_back(next.page);
            choice.refined[next.page] = octants | kAwaited;
        }
        if (bytes_ + more.bytes > budgetBytes_) {
            isRelaxed_ = more.areKnown;
            return false;
        }
        // Room is kept for children that are not there yet, so that less urgent pages do not take it.
        take(choice, more.bytes);
        if (!more.areKnown) return true;
        choice.refined[next.page] = octants;
        forEachChild(entry, octants, [&](uint64_t child, uint32_t) {
            choice.wanted.push_back({child, next.error});
            open_.push(candidate(of, next.dataset, child));
        });
        return true;
    }

    void take(PageChoice& choice, uint64_t bytes) {
        choice.bytes += bytes;
        bytes_ += bytes;
    }

    const std::span<const ChoosingDataset> datasets_;
    const uint64_t budgetBytes_;
    uint64_t bytes_ = 0;  // of all choices
    bool isRelaxed_ = false;
    std::vector<PageChoice> choices_;
    std::priority_queue<Candidate> open_;
};

}  // namespace

std::vector<PageChoice> chooseTogether(std::span<const ChoosingDataset> datasets, uint64_t budgetBytes) {
    return ChoosingWalk(datasets, budgetBytes).run();
}

PageChoice choosePages(const Dataset& dataset, std::span<const SelectionView> views, uint64_t budgetBytes,
                       std::span<const uint64_t> pageBytes, std::span<const uint8_t> states,
                       std::span<const PagesSeen* const> seen) {
    const ChoosingDataset one{dataset, views, pageBytes, states, seen};
    return std::move(chooseTogether({&one, 1}, budgetBytes).front());
}

namespace {

/// Goes down the pages that a view draws or wants.
class CutWalk {
public:
    CutWalk(const Dataset& dataset, const SelectionView& view, const PageChoice& choice,
            std::span<const uint8_t> resident, const PagesSeen* seen)
        : dataset_(dataset), view_(view), choice_(choice), resident_(resident), seen_(seen) {}

    DrawableCut run() {
        drawable_.errorPixels = kInfinity;
        drawable_.complete = true;
        if (choice_.wanted.empty()) return std::move(drawable_);
        const bool hasRoot = resident_[0] != 0;
        if (hasRoot) drawable_.errorPixels = 0;
        places_.push_back({0, true, hasRoot});
        while (!places_.empty()) {
            const Place at = places_.back();
            places_.pop_back();
            visit(at);
        }
        drawable_.complete = drawable_.pagesMissing == 0;
        std::sort(drawable_.cut.begin(), drawable_.cut.end());
        std::sort(drawable_.partial.begin(), drawable_.partial.end(),
                  [](const PartialPage& a, const PartialPage& b) { return a.page < b.page; });
        return std::move(drawable_);
    }

private:
    struct Place {
        uint64_t page;
        bool isWanted, isSeen;  // by this view; not beneath a page that is drawn there
    };

    void visit(const Place& at) {
        const PageEntry& entry = dataset_.pages[at.page];
        const PageInView inView(dataset_, entry, view_);
        const uint8_t asked = octantsWanted(dataset_, at.page, inView, view_, seen_);
        const uint8_t wanted = at.isWanted ? count(at.page, asked) : uint8_t{0};
        // What nobody wants any more is drawn as long as it is there, but not where all are relaxed together.
        const uint8_t allowed = choice_.relaxed ? wanted : inView.coarse;
        const uint8_t there =
            at.isSeen ? octantsWhere(dataset_, entry, allowed, [&](uint64_t child) { return resident_[child] != 0; })
                      : uint8_t{0};
        forEachChild(entry, wanted | there, [&](uint64_t child, uint32_t octant) {
            places_.push_back({child, (wanted >> octant & 1) != 0, (there >> octant & 1) != 0});
        });
        if (at.isSeen && (there != entry.childMask || there == 0)) draw(at.page, inView, asked, there);
    }

    /// Counts a wanted page, and children that are not known. Returns the octants whose children are wanted.
    uint8_t count(uint64_t page, uint8_t asked) {
        const uint16_t refined = choice_.refined[page];
        const auto chosen = uint8_t(asked & refined);
        ++drawable_.pagesWanted;
        drawable_.pagesMissing += resident_[page] != 0 ? 0 : 1;
        drawable_.isRelaxed = drawable_.isRelaxed || (choice_.relaxed && chosen != asked);
        if ((refined & kAwaited) == 0) return chosen;
        drawable_.pagesWanted += uint64_t(std::popcount(chosen));
        drawable_.pagesMissing += uint64_t(std::popcount(chosen));
        return 0;
    }

    /// Draws a page but where children are drawn in its place.
    void draw(uint64_t page, const PageInView& inView, uint8_t asked, uint8_t there) {
        const PageEntry& entry = dataset_.pages[page];
        const auto own = uint8_t(entry.childMask & ~there);
        const auto unseen = uint8_t(own & inView.coarse & ~asked);
        drawable_.cut.push_back(page);
        drawable_.pagesUnseen += uint64_t(std::popcount(unseen));
        if (inView.isPartial && (there != 0 || unseen != 0)) drawable_.partial.push_back({page, own});
        if (!inView.isInView || (unseen != 0 && unseen == own)) return;
        if (!inView.isPartial || entry.childMask == 0) return show(entry, inView.cube);
        for (uint32_t o = 0; o < 8; ++o)
            if (((own & ~unseen) >> o & 1) != 0) show(entry, inView.cube.octant(o));
    }

    /// Counts a page's error, or that of an octant in which it is drawn.
    void show(const PageEntry& entry, const WorldCube& cube) {
        const double cell = dataset_.cellOf(entry.level);
        drawable_.errorPixels = std::max(drawable_.errorPixels, shown(double(entry.certifiedError), cell, cube, view_));
        if (isColourOff(entry, view_))
            drawable_.colourPixels =
                std::max(drawable_.colourPixels, shown(dataset_.slabEdgeOf(entry.level), cell, cube, view_));
    }

    const Dataset& dataset_;
    const SelectionView& view_;
    const PageChoice& choice_;
    const std::span<const uint8_t> resident_;
    const PagesSeen* const seen_;
    DrawableCut drawable_;
    std::vector<Place> places_;
};

}  // namespace

DrawableCut drawableCut(const Dataset& dataset, const SelectionView& view, const PageChoice& choice,
                        std::span<const uint8_t> resident, const PagesSeen* seen) {
    return CutWalk(dataset, view, choice, resident, seen).run();
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
