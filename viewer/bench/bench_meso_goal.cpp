// Which knob of a method makes a right picture, and what ours takes beside its rivals where both are as right.
#include <algorithm>
#include <array>
#include <optional>

#include "viewer/bench/bench_meso.h"

namespace vcp {

namespace {

constexpr double kMostWrong = 1e-3, kMostTexels = 0.25;
constexpr std::string_view kOurs = "boxes";
constexpr std::array<std::string_view, 4> kRivals = {"gdm", "gdm-visibility", "vdm", "slices"};

/// A method at a knob over all views: means, but p95 of the worst view.
struct Setting {
    std::string asset, method, knob;
    double wrong = 0, p95 = 0, fetches = 0, time = 0, views = 0;

    [[nodiscard]] bool isRight() const { return wrong <= kMostWrong && p95 <= kMostTexels; }
};

std::vector<Setting> settingsOf(const std::vector<BenchMesoRow>& rows) {
    std::vector<Setting> all;
    for (const BenchMesoRow& row : rows) {
        const auto isOf = [&](const Setting& s) {
            return s.asset == row.asset && s.method == row.method && s.knob == row.knob;
        };
        auto found = std::ranges::find_if(all, isOf);
        if (found == all.end()) found = all.insert(found, Setting{row.asset, row.method, row.knob});
        found->wrong += row.shape.wrong(), found->p95 = std::max(found->p95, row.shape.p95);
        found->fetches += row.fetchesMean, found->time += row.ratioToPeer, ++found->views;
    }
    for (Setting& s : all)
        for (double* sum : {&s.wrong, &s.fetches, &s.time}) *sum /= s.views;
    return all;
}

/// Returns the setting of a method on an asset that is the first by `isBefore`, of those that `holds` is true of.
template <class Holds, class Before>
const Setting* firstOf(const std::vector<Setting>& all, std::string_view asset, std::string_view method,
                       const Holds& holds, const Before& isBefore) {
    const Setting* first = nullptr;
    for (const Setting& s : all)
        if (s.asset == asset && s.method == method && holds(s) && (first == nullptr || isBefore(s, *first))) first = &s;
    return first;
}

bool isFaster(const Setting& a, const Setting& b) { return a.time < b.time; }
bool isRighter(const Setting& a, const Setting& b) {
    return a.wrong != b.wrong ? a.wrong < b.wrong : a.p95 != b.p95 ? a.p95 < b.p95 : a.time < b.time;
}

}  // namespace

std::vector<MesoHeadline> headlinesOf(const std::vector<BenchMesoRow>& rows) {
    std::vector<MesoHeadline> headlines;
    for (const Setting& s : settingsOf(rows)) {
        if (!s.isRight()) continue;
        const auto isOf = [&](const MesoHeadline& h) { return h.asset == s.asset && h.method == s.method; };
        const auto found = std::ranges::find_if(headlines, isOf);
        if (found == headlines.end()) {
            headlines.push_back({s.asset, s.method, s.knob, s.knob, s.fetches, s.time});
            continue;
        }
        if (s.fetches < found->fetches) found->fetches = s.fetches, found->fetchesKnob = s.knob;
        if (s.time < found->ratioToPeer) found->ratioToPeer = s.time, found->timeKnob = s.knob;
    }
    return headlines;
}

std::vector<MesoGoal> goalsOf(const std::vector<BenchMesoRow>& rows) {
    const std::vector<Setting> all = settingsOf(rows);
    std::vector<std::string> assets;
    for (const Setting& s : all)
        if (std::ranges::find(assets, s.asset) == assets.end()) assets.push_back(s.asset);
    std::vector<MesoGoal> goals;
    for (const std::string& asset : assets)
        for (const std::string_view method : kRivals) {
            const auto right = [](const Setting& s) { return s.isRight(); };
            const Setting* rival = firstOf(all, asset, method, right, isFaster);
            const bool isRight = rival != nullptr;
            if (!isRight)
                rival = firstOf(
                    all, asset, method, [](const Setting&) { return true; }, isRighter);
            if (rival == nullptr) continue;
            const auto isAsRight = [&](const Setting& s) {
                return isRight ? s.isRight() : s.wrong <= rival->wrong && s.p95 <= rival->p95;
            };
            const Setting *ours = firstOf(all, asset, kOurs, isAsRight, isFaster),
                          *strict = firstOf(all, asset, kOurs, right, isFaster);
            if (ours == nullptr) continue;
            MesoGoal goal{asset, std::string(method), rival->knob, isRight, rival->wrong, rival->p95};
            goal.oursKnob = ours->knob, goal.oursWrong = ours->wrong, goal.oursP95 = ours->p95;
            goal.time = ours->time / rival->time, goal.fetches = ours->fetches / rival->fetches;
            if (strict != nullptr) goal.rightKnob = strict->knob, goal.rightTime = strict->time / rival->time;
            goals.push_back(goal);
        }
    return goals;
}

}  // namespace vcp
