// Decides which page is read next. Pure: no threads, and the caller says what time it is.
//
// The way of both: wished for (replace), begun (begin) as soon as it is the most urgent one, then
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

#include "octree/io/result.h"
#include "streaming/request.h"

namespace vcp {

/// When what failed is read again.
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

    /// The wishes from now on. What is under way stays so.
    void replace(std::vector<Wish> wishes);

    /// The most urgent wish that may begin at `now`, of those that `mayRead(Request)` returns true for.
    template <typename MayRead>
    [[nodiscard]] std::optional<Wish> next(double now, MayRead mayRead) const {
        for (const Wish& wish : wishes_)
            if (isIdle(wish.request) && mayRead(wish.request) && dueOf(wish.request) <= now) return wish;
        return std::nullopt;
    }
    [[nodiscard]] std::optional<Wish> next(double now) const {
        return next(now, [](Request) { return true; });
    }
    /// Whether this request may begin at `now`, wished for with at least this priority.
    [[nodiscard]] bool mayBegin(Request request, double leastPriority, double now) const;
    void begin(Request request) { underWay_.insert(request); }

    /// It was handed over.
    void delivered(Request request);
    /// True: it is given up, and the error is to be handed over (then delivered). False: it will be begun again.
    [[nodiscard]] bool failed(Request request, ErrorCode code, double now);
    /// It was neither read nor did it fail: Cancelled.
    void returned(Request request) { underWay_.erase(request); }

    /// When the next request that still waits at `now` may be begun; infinity where none waits.
    [[nodiscard]] double nextTry(double now) const;
    /// Requests wished for or under way.
    [[nodiscard]] size_t pending() const;
    /// Elements of all containers: bounded by the dataset's pages, blocks and pieces.
    [[nodiscard]] size_t entries() const {
        return wishes_.size() + priorities_.size() + underWay_.size() + over_.size() + givenUp_.size() + trials_.size();
    }

private:
    struct Trial {
        uint32_t failures = 0, damaged = 0;
        double due = 0;
    };
    [[nodiscard]] bool isIdle(Request request) const {
        return !underWay_.contains(request) && !over_.contains(request) && !givenUp_.contains(request);
    }
    [[nodiscard]] double dueOf(Request request) const;

    RetryPolicy policy_;
    std::vector<Wish> wishes_;  // the most urgent first
    std::unordered_map<Request, double, RequestHash> priorities_;
    std::unordered_set<Request, RequestHash> underWay_;  // until handed over
    std::unordered_set<Request, RequestHash> over_;      // handed over since the list came
    std::unordered_set<Request, RequestHash> givenUp_;
    std::unordered_map<Request, Trial, RequestHash> trials_;
};

}  // namespace vcp
