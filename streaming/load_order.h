// Decides in which order missing pages are read: what the rays ask for first. Pure: no threads, no clock, no GPU.
//
// A frame that misses pages traces 24 x 16 of its rays through the page tree (render/passes/feedback.h) and reports
// what they met. From that follows, for each page that could be refined (its children be drawn in its place):
//
//   exact requests  a ray that hit a page whose certified error is above the view's at that distance would have
//                   liked a descendant. Each page on the way down to it gains what its refinement takes off the
//                   ray's error, in pixels.
//   counters        a page that a ray passed has the sum of 1 / (a + eps), a: the distance travelled.
//
// Children of pages with requests come first, most gain for the bytes they take; then those of pages that were
// passed, by their counters; then the rest of what the view wants, by projected error. Reports add up over views
// and fade over frames, whose rays are jittered. Order alone is decided here: what is wanted, and when a view has
// settled, follows from the view (page_selection.h).
//
// Source: Demir and Westermann 2015, section 4.4, with exact requests before its counters.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "streaming/page_selection.h"

namespace vcp {

/// Feedback is the order to use; the others are there to be compared with it. All read parents before children and give
/// the children of one page the same priority: they are drawn together.
enum class LoadOrder : uint8_t {
    Feedback,
    Error,    ///< largest projected error of the parent first
    Nearest,  ///< parent nearest to the eye first
    Breadth,  ///< level by level
    Random,   ///< by a hash of the parent's number
};

/// Parses "feedback", "error", "nearest", "breadth" or "random"; nothing for another text.
std::optional<LoadOrder> loadOrderNamed(std::string_view name);
std::string_view nameOf(LoadOrder order);

/// What the rays of one frame met.
struct RayFeedback {
    /// A ray that hit a page of the cut, at a point of the dataset: in units of 2^-30 of the root's edge, from its
    /// lowest corner.
    struct Hit {
        uint64_t page = 0;
        glm::ivec3 place{0};
        uint32_t ray = 0;  ///< number of the ray among the 24 x 16, row by row
    };
    /// A page of the cut that rays went into, and the sum of 1 / (a + eps) over them, in any unit.
    struct Passed {
        uint64_t page = 0;
        double nearness = 0;
    };
    std::vector<Hit> hits;
    std::vector<Passed> passed;
};

class LoadPriorities {
public:
    /// `pageUnits[i]`: the units that page i takes of the pool; 0 where its entry is not known yet. Only those of known
    /// entries are read.
    LoadPriorities(std::shared_ptr<const Dataset> dataset, std::span<const uint64_t> pageUnits, LoadOrder order);

    [[nodiscard]] LoadOrder order() const { return order_; }
    void setOrder(LoadOrder order) { order_ = order; }

    /// Records that the page's entry is known now, and that it takes `units` units of the pool.
    void learn(uint64_t page, uint64_t units);

    /// Takes in what the rays of a frame of `view` met; `views` such frames in turn are a round of all views.
    void hear(const RayFeedback& feedback, const SelectionView& view, size_t views = 1);

    /// `missing`: wanted pages that are not resident, as choosePages ordered them. Returns them most urgent first;
    /// priorities are 0.001 to 10^6, the root's is infinite; with LoadOrder::Error, `missing` as it is. With several
    /// views, the view to which a page is most urgent counts.
    [[nodiscard]] std::vector<WantedPage> ordered(std::vector<WantedPage> missing,
                                                  std::span<const SelectionView> views) const;

    /// Pixels of error that refining `page` takes off the rays heard of; 0: no ray asked for it.
    [[nodiscard]] double gainOf(uint64_t page) const;

    /// Approximate bytes of memory that this object takes.
    [[nodiscard]] uint64_t bytesHeld() const;

private:
    [[nodiscard]] double priorityBelow(uint64_t page, std::span<const SelectionView> views, uint64_t units) const;
    [[nodiscard]] double feedbackPriority(uint64_t page, std::span<const SelectionView> views, uint64_t units) const;
    [[nodiscard]] double nearnessOf(uint64_t page) const;

    std::shared_ptr<const Dataset> dataset_;
    SparseArray<uint64_t> pageUnits_;
    SparseArray<uint32_t> parents_;  // the root's parent is itself
    LoadOrder order_;
    std::unordered_map<uint64_t, double> gains_, nearness_;  // for each page, by its number, what refining it gains
};

}  // namespace vcp
