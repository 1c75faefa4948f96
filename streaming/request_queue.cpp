#include "streaming/request_queue.h"

#include <algorithm>
#include <cmath>

namespace vcp {

std::optional<double> RetryPolicy::delayAfter(uint32_t failures, uint32_t damaged) const {
    if (failures >= attempts || damaged >= damagedAttempts) return std::nullopt;
    return std::min(firstDelaySeconds * std::pow(growth, double(failures) - 1), longestDelaySeconds);
}

void RequestQueue::replace(std::vector<Wish> wishes) {
    std::stable_sort(wishes.begin(), wishes.end(),
                     [](const Wish& a, const Wish& b) { return a.priority > b.priority; });
    wishes_ = std::move(wishes);
    over_.clear();
    priorities_.clear();
    for (const Wish& wish : wishes_) priorities_.emplace(wish.request, wish.priority);
}

double RequestQueue::dueOf(Request request) const {
    const auto trial = trials_.find(request);
    return trial != trials_.end() ? trial->second.due : 0;
}

bool RequestQueue::mayBegin(Request request, double leastPriority, double now) const {
    const auto wish = priorities_.find(request);
    return wish != priorities_.end() && wish->second >= leastPriority && isIdle(request) && dueOf(request) <= now;
}

void RequestQueue::delivered(Request request) {
    underWay_.erase(request);
    over_.insert(request);
    trials_.erase(request);
}

bool RequestQueue::failed(Request request, ErrorCode code, double now) {
    Trial& trial = trials_[request];
    ++trial.failures;
    if (code != ErrorCode::Io) ++trial.damaged;
    if (const auto delay = policy_.delayAfter(trial.failures, trial.damaged)) {
        trial.due = now + *delay;
        underWay_.erase(request);
        return false;
    }
    givenUp_.insert(request);
    return true;
}

double RequestQueue::nextTry(double now) const {
    double first = std::numeric_limits<double>::infinity();
    for (const auto& [request, trial] : trials_)
        if (trial.due > now && isIdle(request) && priorities_.contains(request)) first = std::min(first, trial.due);
    return first;
}

size_t RequestQueue::pending() const {
    const auto waits = [&](const Wish& wish) { return isIdle(wish.request); };
    return size_t(std::count_if(wishes_.begin(), wishes_.end(), waits)) + underWay_.size();
}

}  // namespace vcp
