#include "streaming/request_queue.h"

#include <algorithm>
#include <cmath>

namespace vcp {

std::optional<double> RetryPolicy::delayAfter(uint32_t failures, uint32_t damaged) const {
    if (failures >= attempts || damaged >= damagedAttempts) return std::nullopt;
    return std::min(firstDelaySeconds * std::pow(growth, double(failures) - 1), longestDelaySeconds);
}

void RequestQueue::replace(std::vector<PageRequest> wishes) {
    std::stable_sort(wishes.begin(), wishes.end(),
                     [](const PageRequest& a, const PageRequest& b) { return a.priority > b.priority; });
    wishes_ = std::move(wishes);
    over_.clear();
    priorities_.clear();
    for (const PageRequest& wish : wishes_) priorities_.emplace(wish.page, wish.priority);
}

double RequestQueue::dueOf(uint64_t page) const {
    const auto trial = trials_.find(page);
    return trial != trials_.end() ? trial->second.due : 0;
}

std::optional<PageRequest> RequestQueue::next(double now) const {
    for (const PageRequest& wish : wishes_)
        if (isIdle(wish.page) && dueOf(wish.page) <= now) return wish;
    return std::nullopt;
}

bool RequestQueue::mayBegin(uint64_t page, double leastPriority, double now) const {
    const auto wish = priorities_.find(page);
    return wish != priorities_.end() && wish->second >= leastPriority && isIdle(page) && dueOf(page) <= now;
}

void RequestQueue::delivered(uint64_t page) {
    underWay_.erase(page);
    over_.insert(page);
    trials_.erase(page);
}

bool RequestQueue::failed(uint64_t page, ErrorCode code, double now) {
    Trial& trial = trials_[page];
    ++trial.failures;
    if (code != ErrorCode::Io) ++trial.damaged;
    if (const auto delay = policy_.delayAfter(trial.failures, trial.damaged)) {
        trial.due = now + *delay;
        underWay_.erase(page);
        return false;
    }
    givenUp_.insert(page);
    return true;
}

double RequestQueue::nextTry() const {
    double first = std::numeric_limits<double>::infinity();
    for (const auto& [page, trial] : trials_)
        if (isIdle(page) && priorities_.contains(page)) first = std::min(first, trial.due);
    return first;
}

size_t RequestQueue::pending() const {
    const auto waits = [&](const PageRequest& wish) { return isIdle(wish.page); };
    return static_cast<size_t>(std::count_if(wishes_.begin(), wishes_.end(), waits)) + underWay_.size();
}

}  // namespace vcp
