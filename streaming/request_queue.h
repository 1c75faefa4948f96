// Decides which page is read next. Pure: no threads, and the caller says what time it is.
//
// A page's way: wished for (replace), begun (begin) as soon as it is the most urgent one, then
//   delivered    it is not begun again until a new list wishes for it
//   failed       it waits, longer after each failure, and is begun again while it is wished for; after a few
//                failures it is given up: reported once, and never begun again
// A page that waits does not delay others: the next most urgent one is begun in its place.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "octree/result.h"

namespace vcp {

struct PageRequest {
    uint64_t page;
    double priority;  ///< larger is more urgent; among equals the order of the list decides

    bool operator==(const PageRequest&) const = default;
};

/// When a page that failed is read again.
struct RetryPolicy {
    uint32_t attempts = 8;         ///< most attempts of a read that fails
    uint32_t damagedAttempts = 4;  ///< most of these attempts where bytes came and were wrong
    double firstDelaySeconds = 0.05;
    double growth = 2;
    double longestDelaySeconds = 0.5;

    /// Returns the seconds to wait after so many failures, `damaged` of them by wrong bytes; nothing: it is given up.
    [[nodiscard]] std::optional<double> delayAfter(uint32_t failures, uint32_t damaged) const;
};

class RequestQueue {
public:
    explicit RequestQueue(const RetryPolicy& policy = {}) : policy_(policy) {}

    /// Replaces all wishes. Pages that are under way stay so.
    void replace(std::vector<PageRequest> wishes);

    /// Returns the most urgent page that may begin at `now`.
    [[nodiscard]] std::optional<PageRequest> next(double now) const;
    /// Whether this page is wished for with at least this priority and may begin at `now`.
    [[nodiscard]] bool mayBegin(uint64_t page, double leastPriority, double now) const;
    void begin(uint64_t page) { underWay_.insert(page); }

    /// Records that the page was handed over.
    void delivered(uint64_t page);
    /// True: the page is given up, and its error is to be handed over (then delivered). False: it will be begun again.
    [[nodiscard]] bool failed(uint64_t page, ErrorCode code, double now);
    /// Records that the page was neither read nor failed, as its read was cancelled.
    void returned(uint64_t page) { underWay_.erase(page); }

    /// Returns when a page that waits may be begun; infinity where none waits.
    [[nodiscard]] double nextTry() const;
    /// The number of pages wished for or under way.
    [[nodiscard]] size_t pending() const;
    /// The elements of all containers: bounded by the dataset's pages.
    [[nodiscard]] size_t entries() const {
        return wishes_.size() + priorities_.size() + underWay_.size() + over_.size() + givenUp_.size() + trials_.size();
    }

private:
    struct Trial {
        uint32_t failures = 0, damaged = 0;
        double due = 0;
    };
    [[nodiscard]] bool isIdle(uint64_t page) const {
        return !underWay_.contains(page) && !over_.contains(page) && !givenUp_.contains(page);
    }
    [[nodiscard]] double dueOf(uint64_t page) const;

    RetryPolicy policy_;
    std::vector<PageRequest> wishes_;  // the most urgent first
    std::unordered_map<uint64_t, double> priorities_;
    std::unordered_set<uint64_t> underWay_;  // pages from begin() until they are handed over
    std::unordered_set<uint64_t> over_;      // pages handed over since the list came
    std::unordered_set<uint64_t> givenUp_;
    std::unordered_map<uint64_t, Trial> trials_;
};

}  // namespace vcp
