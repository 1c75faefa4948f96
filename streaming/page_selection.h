// Which pages a view wants and which it draws: the cut through the tree of pages. Pure: no threads, no
// clock, no GPU; the same input gives the same output.
//
// A page is refined, that is replaced by all its children, where its certified error projects to more than
// errorPixels at the point of its box nearest to the eye. Where the colours of its slabs are farther off than
// colourError, it counts as if it erred by a whole slab: what is wrong with them cannot be seen where a slab is no
// larger than the error that may be. The largest projected error goes first, while the
// children fit into the budget; so a budget too small for the view relaxes the error evenly over the
// picture. Where the directory has come in part (octree/vcp_file.h), a page whose children are not known yet counts as
// missing them. Pages outside of the view's frustum are not refined. A refined page stays wanted beneath its
// children: it is what is drawn when they have to go.
//
// Where pages cover the surface of those below them (kFlagCovering), a page is refined octant by octant: a child
// replaces its parent there, and elsewhere the parent is drawn. So its error counts at the point of the octant nearest
// to the eye, and only children that the view's rays ask for are wanted (streaming/pages_seen.h), and the others only
// where their parent's error is above kUnseenErrors times what is allowed: what lies behind other surfaces is not read,
// but what comes into view is nearly fine enough. What is drawn is as fine as what is there allows. Elsewhere a page is
// replaced by all its children or none.
//
// Nothing is certified of files of the method Paper. There a page is refined, octant by octant, where that is nearer
// than a part of the dataset's diagonal (PaperMarch::reach), the nearest first, whatever rays hit.
//
// Several views, and several datasets of one scene, share one choice and one budget: a page is refined where any of
// them needs it, the largest error as a multiple of what its view allows first. Each view draws the choice only as fine
// as it needs, so where the budget suffices it draws what it would draw alone, and where it does not, all are relaxed
// together.
//
// Source: Demir and Westermann 2015, section 4.4, with certified errors in place of voxel sizes.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include "octree/dataset_reader.h"
#include "streaming/pages_seen.h"

namespace vcp {

/// A page is refined where no ray hit it, too, while its error is more than so many times what its view allows.
inline constexpr double kUnseenErrors = 8;

/// What selection must know of a camera.
struct SelectionView {
    glm::dvec3 eye{0};
    bool orthographic = false;
    /// Pixels per world unit: at distance 1 (perspective) or anywhere (orthographic).
    double pixelsPerUnit = 1;
    /// Inward planes of the frustum: a point x is outside of a plane where dot(xyz, x - eye) + w < 0.
    std::array<glm::dvec4, 4> planes{};
    double errorPixels = 0.5;
    double colourError = std::numeric_limits<double>::infinity();  ///< ΔE, as colourErrorOf() has it
    double pixels = 0;                                             ///< of the picture
    double paperReach = 0.25;                                      ///< PaperMarch::reach
    uint64_t rays = 0;  ///< any number that differs where other rays are cast from the same place

    bool operator==(const SelectionView&) const = default;
};

struct WantedPage {
    uint64_t page;
    double priority;  ///< projected error of what is drawn without it, as a multiple of what views allow; the root's is
                      ///< infinite
};

/// Whether a page's children may be drawn in its place.
enum PageState : uint8_t {
    kAvailable,
    kUnavailable,  ///< it cannot be read: its parent is drawn in its place
};
/// Beside octants in PageChoice::refined: their children will be wanted once they are known.
inline constexpr uint16_t kAwaited = 256;

/// What the views want, whatever is resident.
struct PageChoice {
    /// The ideal cut and all pages above it, parents before children, most urgent first.
    std::vector<WantedPage> wanted;
    std::vector<uint64_t> awaited;  ///< pages to refine next, once their children are known; most urgent first
    SparseArray<uint16_t> refined;  ///< for each page of the dataset, the octants (bits) that its children replace
    uint64_t bytes = 0;             ///< what all of them take of the budget, those awaited too
    bool relaxed = false;           ///< the budget kept a page from being refined
};

/// `pageBytes[i]`: what page i takes of the budget (any unit); 0: its entry is not known yet. `states[i]`: a PageState.
/// Both have one element for each page of the dataset. `seen[i]`: what the rays of view i hit; empty: all pages count
/// as hit.
PageChoice choosePages(const Dataset& dataset, std::span<const SelectionView> views, uint64_t budgetBytes,
                       std::span<const uint64_t> pageBytes, std::span<const uint8_t> states,
                       std::span<const PagesSeen* const> seen = {});

/// One of several datasets that share a budget; the fields are what choosePages takes.
struct ChoosingDataset {
    const Dataset& dataset;
    std::span<const SelectionView> views;  ///< none: only the coarsest page is wanted
    std::span<const uint64_t> pageBytes;
    std::span<const uint8_t> states;
    std::span<const PagesSeen* const> seen;
};

/// Does choosePages for several datasets: the page that errs most in its view goes first, whichever dataset it is of.
/// Where the budget keeps a page of one of them from being refined, all are relaxed. Returns a choice for each.
std::vector<PageChoice> chooseTogether(std::span<const ChoosingDataset> datasets, uint64_t budgetBytes);

/// A page of a cut that is drawn only in some octants, each by itself: children are drawn in the others, or nothing
/// where there is no child.
struct PartialPage {
    uint64_t page = 0;
    uint8_t octants = 0;  ///< a bit each; they have children
    bool operator==(const PartialPage&) const = default;
};

/// What one view can draw of a choice.
struct DrawableCut {
    std::vector<uint64_t> cut;         ///< what can be drawn now, in directory order; empty without the root
    std::vector<PartialPage> partial;  ///< those of the cut that are not drawn whole, in directory order
    double errorPixels = 0;   ///< largest projected certified error of pages in view but those that no ray hit, seen
                              ///< from no nearer than a cell; infinite without a cut
    double colourPixels = 0;  ///< edge of the widest slabs whose colours are off, likewise
    uint64_t pagesWanted = 0, pagesMissing = 0;  ///< pages of the choice that this view needs; of these, not resident
    uint64_t pagesUnseen = 0;  ///< pages that this view would need if rays hit their parents, which are drawn there
    bool complete = false;     ///< no page is missing; also where nothing can be drawn
    bool isRelaxed = false;    ///< the budget kept a page of this view from being refined
};

/// `view` is one of the views of the choice, and `seen` what its rays hit; null: all pages count as hit. `resident[i]`:
/// page i may be drawn.
DrawableCut drawableCut(const Dataset& dataset, const SelectionView& view, const PageChoice& choice,
                        std::span<const uint8_t> resident, const PagesSeen* seen = nullptr);

/// Choice and cut in one, for a single view and what is resident.
struct Selection : PageChoice, DrawableCut {};
Selection selectPages(const Dataset& dataset, const SelectionView& view, uint64_t budgetBytes,
                      std::span<const uint64_t> pageBytes, std::span<const uint8_t> resident,
                      std::span<const uint8_t> states);

/// Whether the colours of a page's slabs are farther off than the view allows, for more than 5 % of them.
bool isColourOff(const PageEntry& page, const SelectionView& view);

/// Returns the error of a page for which it is refined, world units: its certified one or, where its colours are off,
/// the edge of a slab.
double refinedError(const Dataset& dataset, const PageEntry& page, const SelectionView& view);

/// Returns the same in pixels, at the point of its box nearest to the eye; infinite where the eye is inside of the box.
double projectedError(const Dataset& dataset, const PageEntry& page, const SelectionView& view);

/// Returns the certified error of a page in pixels, seen from no nearer than a cell: inside of the box the error has no
/// bound.
double shownError(const Dataset& dataset, const PageEntry& page, const SelectionView& view);

/// Whether a page's box touches the view's frustum (no false negatives).
bool inFrustum(const Dataset& dataset, const PageEntry& page, const SelectionView& view);
/// The same of any box in the world.
bool inFrustum(glm::dvec3 low, glm::dvec3 high, const SelectionView& view);

}  // namespace vcp
