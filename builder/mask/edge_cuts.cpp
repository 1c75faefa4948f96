#include "builder/mask/edge_cuts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/mask/triangle_weights.h"

namespace vcp {

namespace {

/// Finds cuts at one level of the mask.
class EdgeWalk {
public:
    EdgeWalk(const AlphaMask& mask, glm::dvec2 from, glm::dvec2 to, int log2Steps, uint32_t level, size_t most)
        : mask_(mask), from_(from), to_(to), steps_(1u << log2Steps), level_(level), most_(most) {
        found_.log2Steps = log2Steps;
    }

    /// Returns nothing where there are more than `most`.
    std::optional<EdgeCuts> run() {
        const double first = marginAt(0), last = marginAt(steps_);
        found_.startsKept = first >= 0;
        visit(0, steps_, first, last);
        if (found_.cuts.size() > most_) return std::nullopt;
        return std::move(found_);
    }

private:
    [[nodiscard]] glm::dvec2 placeOf(uint32_t step) const {
        return step == steps_ ? to_ : from_ + (to_ - from_) * (double(step) / steps_);
    }
    /// Ends are looked at in the finest level, since other edges have them, too.
    [[nodiscard]] double marginAt(uint32_t step) const {
        return mask_.marginAt(placeOf(step), step == 0 || step == steps_ ? 0 : level_);
    }
    [[nodiscard]] bool isUniform(uint32_t begin, uint32_t end) const {
        const glm::dvec2 a = placeOf(begin), b = placeOf(end), around(level_ > 0 ? double(2u << level_) : 0.0);
        return mask_.contentOf(glm::min(a, b) - around, glm::max(a, b) + around) != AlphaMask::kBoth;
    }
    void visit(uint32_t begin, uint32_t end, double first, double last) {
        if (found_.cuts.size() > most_ || isUniform(begin, end)) return;
        if (end - begin > 1) {
            const uint32_t middle = (begin + end) / 2;
            const double margin = marginAt(middle);
            visit(begin, middle, first, margin);
            visit(middle, end, margin, last);
        } else if ((first >= 0) != (last >= 0)) {
            const glm::dvec2 a = placeOf(begin), b = placeOf(end);
            const double part =
                crossingBetween(first, last, [&](double along) { return mask_.marginAt(a + (b - a) * along, level_); });
            const double at = (begin + part) / steps_;
            found_.cuts.push_back(int32_t(std::ldexp(at, Weights::kLog2One)));
        }
    }

    const AlphaMask& mask_;
    glm::dvec2 from_, to_;
    uint32_t steps_, level_;
    size_t most_;
    EdgeCuts found_;
};

/// Whether each step has at most one of the cuts.
bool areApart(const std::vector<int32_t>& cuts, int log2Steps) {
    const int shift = Weights::kLog2One - log2Steps;
    return std::ranges::adjacent_find(cuts, [&](int32_t a, int32_t b) { return a >> shift == b >> shift; }) ==
           cuts.end();
}

}  // namespace

int log2StepsOf(double texels) {
    int log2 = 0;
    while (log2 < EdgeCuts::kMostLog2Steps && std::ldexp(1.0, log2) < texels) ++log2;
    return log2;
}

bool EdgeCuts::isKept(int32_t at) const {
    const auto before = std::lower_bound(cuts.begin(), cuts.end(), at) - cuts.begin();
    return startsKept != (before % 2 == 1);
}

bool EdgeCuts::isAll(bool kept, int32_t from, int32_t to) const {
    const auto next = std::lower_bound(cuts.begin(), cuts.end(), from);
    return (next == cuts.end() || *next >= to) && isKept(from) == kept;
}

std::optional<EdgeCuts> cutsBetween(const AlphaMask& mask, glm::dvec2 from, glm::dvec2 to) {
    // One order of the ends, so that one edge has one answer.
    const bool isTurned = std::pair(to.x, to.y) < std::pair(from.x, from.y);
    if (isTurned) std::swap(from, to);
    const double texels = glm::length(to - from);
    const auto most = size_t(std::clamp(texels / 8, 16.0, 1024.0));
    int log2Steps = log2StepsOf(texels);
    uint32_t level = 0;
    while (std::ldexp(1.0, log2Steps + int(level)) < texels && level <= mask.coarsestLevel()) ++level;
    std::optional<EdgeCuts> found;
    for (; level <= mask.coarsestLevel() && !found; ++level, log2Steps = std::max(log2Steps - 1, 0))
        found = EdgeWalk(mask, from, to, log2Steps, level, most).run();
    if (found && isTurned) {
        found->startsKept = found->startsKept != (found->cuts.size() % 2 == 1);
        std::reverse(found->cuts.begin(), found->cuts.end());
        for (int32_t& cut : found->cuts) cut = Weights::kOne - cut;
    }
    // Few cuts ask for few steps.
    while (found && found->log2Steps > 0 && areApart(found->cuts, found->log2Steps - 1)) --found->log2Steps;
    return found;
}

}  // namespace vcp
