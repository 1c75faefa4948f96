#include "builder/mask/mask_outline.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/mask/edge_cuts.h"

namespace vcp {

namespace {

using Edges = std::array<EdgeCuts, 3>;  // from corner 0 to 1, 1 to 2, 2 to 0
using Texels = std::array<glm::dvec2, 3>;

/// A point of the lattice that cuts a triangle's edges into 2^log2 steps: `i` steps towards corner 1, `j` towards 2.
struct Place {
    uint32_t i, j;
};

/// Numbers an edge between neighbours of the lattice: `along` 0 is (i, j) to (i+1, j), 1: (i, j) to (i, j+1), 2: (i+1,
/// j) to (i, j+1).
uint64_t edgeKey(uint32_t i, uint32_t j, uint32_t along) { return (uint64_t{i} << 24 | j) * 3 + along; }

/// A straight piece of outline, across a small triangle: from the lattice's edge `out`, where one leaves what is kept
/// when going round the triangle to the left, to `in`, where one comes back.
struct Step {
    uint64_t out, in;
    Weights at;  ///< the point on `out`
};

/// Finds the pieces of outline at one level of the mask.
class Lattice {
public:
    Lattice(const AlphaMask& mask, const Texels& texels, const Edges& edges, int log2, uint32_t level, size_t mostCells)
        : mask_(mask),
          texels_(texels),
          edges_(edges),
          count_(1u << log2),
          step_(Weights::kOne >> log2),
          level_(level),
          mostCells_(mostCells) {}

    /// Returns false where there are too many small triangles to look at.
    bool run() {
        visit({0, 0}, count_, true);
        std::sort(steps_.begin(), steps_.end(), [](const Step& a, const Step& b) { return a.out < b.out; });
        return cells_ <= mostCells_;
    }
    std::vector<Step> steps() { return std::move(steps_); }

    /// Returns the number of the lattice's edge that has a cut of an edge of the triangle.
    [[nodiscard]] uint64_t keyOf(int edge, int32_t cut) const {
        const uint32_t k = uint32_t(cut / step_), last = count_ - 1 - k;
        return edge == 0 ? edgeKey(k, 0, 0) : edge == 1 ? edgeKey(last, k, 2) : edgeKey(0, last, 1);
    }

private:
    struct Sample {
        Place place;
        double margin;
        bool isKept;
    };

    [[nodiscard]] Weights weightsOf(Place p) const {
        const auto i = int32_t(p.i) * step_, j = int32_t(p.j) * step_;
        return {{Weights::kOne - i - j, i, j}};
    }
    [[nodiscard]] Sample sampleAt(Place p) const {
        const double margin = mask_.marginAt(placeOf(texels_, weightsOf(p)), level_);
        // What the edges say is kept; steps from an edge's first end.
        const auto onEdge = [&](int edge, uint32_t steps) {
            return Sample{p, margin, edges_[size_t(edge)].isKept(int32_t(steps) * step_)};
        };
        if (p.j == 0) return p.i == count_ ? cornerSample(p, margin, 1) : onEdge(0, p.i);
        if (p.i + p.j == count_) return p.i == 0 ? cornerSample(p, margin, 2) : onEdge(1, p.j);
        if (p.i == 0) return onEdge(2, count_ - p.j);
        return {p, margin, margin >= 0};
    }
    [[nodiscard]] Sample cornerSample(Place p, double margin, int corner) const {
        return {p, margin, edges_[size_t(corner)].startsKept};
    }

    /// Whether the edges of the triangle that a part of the lattice touches say the same as the mask.
    [[nodiscard]] bool edgesAre(bool kept, Place p, uint32_t size, bool isUpright) const {
        const auto all = [&](int edge, uint32_t from, uint32_t to) {
            return edges_[size_t(edge)].isAll(kept, int32_t(from) * step_, int32_t(to) * step_);
        };
        // A part that is turned touches an edge with one corner.
        const uint32_t reach = isUpright ? 0 : size, sum = p.i + p.j + (isUpright ? size : 2 * size);
        if (p.j == 0 && !all(0, p.i + reach, p.i + size)) return false;
        if (sum == count_ && !all(1, p.j + reach, p.j + size)) return false;
        return p.i != 0 || all(2, count_ - p.j - size, count_ - p.j - reach);
    }

    [[nodiscard]] bool isUniform(const std::array<Place, 3>& corners, Place p, uint32_t size, bool isUpright) const {
        glm::dvec2 low = placeOf(texels_, weightsOf(corners[0])), high = low;
        for (int k = 1; k < 3; ++k) {
            const glm::dvec2 at = placeOf(texels_, weightsOf(corners[size_t(k)]));
            low = glm::min(low, at);
            high = glm::max(high, at);
        }
        const glm::dvec2 around(level_ > 0 ? double(2u << level_) : 0.0);
        const auto content = mask_.contentOf(low - around, high + around);
        return content != AlphaMask::kBoth && edgesAre(content == AlphaMask::kKept, p, size, isUpright);
    }

    /// Visits a part with its corners, to the left: upright it is similar to the triangle, else turned by half.
    void visit(Place p, uint32_t size, bool isUpright) {
        if (cells_ > mostCells_) return;
        const uint32_t i = p.i, j = p.j, half = size / 2;
        const std::array<Place, 3> corners =
            isUpright ? std::array<Place, 3>{{{i, j}, {i + size, j}, {i, j + size}}}
                      : std::array<Place, 3>{{{i + size, j}, {i + size, j + size}, {i, j + size}}};
        if (isUniform(corners, p, size, isUpright)) return;
        if (size == 1) return cut(corners, p, isUpright);
        visit({i + half, j}, half, isUpright);
        visit({i, j + half}, half, isUpright);
        visit(isUpright ? p : Place{i + half, j + half}, half, isUpright);
        visit(isUpright ? p : Place{i + half, j + half}, half, !isUpright);
    }

    void cut(const std::array<Place, 3>& corners, Place p, bool isUpright) {
        ++cells_;
        const Sample samples[3] = {sampleAt(corners[0]), sampleAt(corners[1]), sampleAt(corners[2])};
        const uint64_t keys[3] = {isUpright ? edgeKey(p.i, p.j, 0) : edgeKey(p.i + 1, p.j, 1),
                                  isUpright ? edgeKey(p.i, p.j, 2) : edgeKey(p.i, p.j + 1, 0),
                                  isUpright ? edgeKey(p.i, p.j, 1) : edgeKey(p.i, p.j, 2)};
        int out = -1, in = -1;
        for (int k = 0; k < 3; ++k) {
            const bool from = samples[k].isKept, to = samples[(k + 1) % 3].isKept;
            if (from && !to) out = k;
            if (!from && to) in = k;
        }
        if (out < 0) return;
        steps_.push_back({keys[out], keys[in], pointBetween(samples[out], samples[(out + 1) % 3])});
    }

    [[nodiscard]] Weights pointBetween(const Sample& a, const Sample& b) const {
        const Weights first = weightsOf(a.place), second = weightsOf(b.place);
        const glm::dvec2 from = placeOf(texels_, first), to = placeOf(texels_, second);
        const double part = crossingBetween(
            a.margin, b.margin, [&](double along) { return mask_.marginAt(from + (to - from) * along, level_); });
        Weights w{};
        for (int k = 1; k < 3; ++k) w.of[k] = first.of[k] + int32_t(part * (second.of[k] - first.of[k]));
        w.of[0] = Weights::kOne - w.of[1] - w.of[2];
        return w;
    }

    const AlphaMask& mask_;
    const Texels& texels_;
    const Edges& edges_;
    uint32_t count_;
    int32_t step_;
    uint32_t level_;
    size_t mostCells_, cells_ = 0;
    std::vector<Step> steps_;
};

/// Joins pieces of outline to loops, along the triangle's edges where they end there.
class LoopJoin {
public:
    LoopJoin(const Lattice& lattice, const Edges& edges, std::vector<Step> steps)
        : edges_(edges), steps_(std::move(steps)), isTaken_(steps_.size(), 0) {
        for (int e = 0; e < 3; ++e) {
            bool isKept = edges[size_t(e)].startsKept;
            for (const int32_t cut : edges[size_t(e)].cuts) {
                cuts_.push_back({Weights::onEdge(e, cut), lattice.keyOf(e, cut), e, isKept, false});
                isKept = !isKept;
            }
        }
    }

    std::vector<MaskLoop> run() {
        std::vector<MaskLoop> loops;
        if (cuts_.empty() && edges_[0].startsKept) {
            loops.emplace_back();
            for (int corner = 0; corner < 3; ++corner) addCorner(corner, loops.back());
        }
        for (size_t first = 0; first < cuts_.size(); ++first)
            if (cuts_[first].leaves && !cuts_[first].isTaken) loops.push_back(loopFrom(first));
        for (size_t s = 0; s < steps_.size(); ++s)
            if (!isTaken_[s]) follow(s, loops.emplace_back());
        return loops;
    }

private:
    /// Where the outline meets an edge of the triangle.
    struct Cut {
        Weights at;
        uint64_t key;
        int edge;
        bool leaves;  ///< what is kept ends here, going round to the left
        bool isTaken;
    };

    static void addCorner(int corner, MaskLoop& loop) { loop.points.push_back({Weights::onEdge(corner, 0), true}); }

    /// Returns the number of the piece that starts at a lattice's edge, or of all where there is none.
    [[nodiscard]] size_t stepFrom(uint64_t key) const {
        const auto found = std::lower_bound(steps_.begin(), steps_.end(), key,
                                            [](const Step& step, uint64_t wanted) { return step.out < wanted; });
        return found == steps_.end() || found->out != key ? steps_.size() : size_t(found - steps_.begin());
    }
    /// Adds the points of a chain, or a loop, from a piece on. Returns the lattice's edge where it ends.
    uint64_t follow(size_t step, MaskLoop& loop) {
        uint64_t end = 0;
        for (; step < steps_.size() && !isTaken_[step]; step = stepFrom(end)) {
            isTaken_[step] = 1;
            loop.points.push_back({steps_[step].at, false});
            end = steps_[step].in;
        }
        return end;
    }
    MaskLoop loopFrom(size_t first) {
        MaskLoop loop;
        for (size_t cut = first; !cuts_[cut].isTaken;) {
            cuts_[cut].isTaken = true;
            const size_t at = loop.points.size();
            const uint64_t end = follow(stepFrom(cuts_[cut].key), loop);
            // The first point is the edge's own.
            if (at == loop.points.size()) loop.points.emplace_back();
            loop.points[at] = {cuts_[cut].at, true};
            const auto entry =
                std::find_if(cuts_.begin(), cuts_.end(), [&](const Cut& c) { return !c.leaves && c.key == end; });
            if (entry == cuts_.end()) break;
            loop.points.push_back({entry->at, true});
            const size_t next = size_t(entry + 1 - cuts_.begin()) % cuts_.size();
            addCornersBetween(*entry, cuts_[next], loop);
            cut = next;
        }
        return loop;
    }
    static void addCornersBetween(const Cut& from, const Cut& to, MaskLoop& loop) {
        int corners = (to.edge - from.edge + 3) % 3;
        // Of two cuts of one edge, the second may come after a round.
        const auto place = [](const Cut& c) { return c.at.of[(c.edge + 1) % 3]; };
        if (corners == 0 && place(to) <= place(from)) corners = 3;
        for (int c = 1; c <= corners; ++c) addCorner((from.edge + c) % 3, loop);
    }

    const Edges& edges_;
    std::vector<Step> steps_;
    std::vector<uint8_t> isTaken_;
    std::vector<Cut> cuts_;
};

}  // namespace

bool MaskOutline::isWhole(const std::vector<MaskLoop>& left) const {
    return keepsEdges && left.size() == 1 && left[0].points.size() == 3 && left[0].points[0].isFixed;
}

std::optional<MaskOutline> findOutline(const AlphaMask& mask, const Texels& texels, uint32_t leastLevel) {
    Edges edges;
    int log2OfEdges = 0;
    double longest = 0;
    for (size_t e = 0; e < 3; ++e) {
        auto cuts = cutsBetween(mask, texels[e], texels[(e + 1) % 3]);
        if (!cuts) return std::nullopt;
        edges[e] = *std::move(cuts);
        log2OfEdges = std::max(log2OfEdges, edges[e].log2Steps);
        longest = std::max(longest, glm::distance(texels[e], texels[(e + 1) % 3]));
    }
    constexpr double kLongestStep = 1.5;  // texels
    int log2 = log2StepsOf(longest / kLongestStep);
    uint32_t level = 0;
    while (kLongestStep * std::ldexp(1.0, log2 + int(level)) < longest) ++level;
    for (; level < leastLevel; ++level) log2 = std::max(log2 - 1, 0);
    const auto mostCells = size_t(std::clamp(longest * longest / 8, double(1 << 15), double(1 << 19)));
    for (; level <= mask.coarsestLevel(); ++level, log2 = std::max(log2 - 1, 0)) {
        Lattice lattice(mask, texels, edges, std::max(log2, log2OfEdges), level, mostCells);
        if (!lattice.run()) continue;
        const bool keepsEdges =
            edges[0].startsKept && std::ranges::all_of(edges, [](const auto& e) { return e.cuts.empty(); });
        return MaskOutline{LoopJoin(lattice, edges, lattice.steps()).run(), level, keepsEdges};
    }
    return std::nullopt;
}

}  // namespace vcp
