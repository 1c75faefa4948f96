#include "builder/lattice/finest_pages.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/gtc/type_precision.hpp>

#include "builder/lattice/lattice_mesh.h"

namespace vcp {

namespace {

void makeSet(std::vector<uint64_t>& codes) {
    std::sort(codes.begin(), codes.end());
    codes.erase(std::unique(codes.begin(), codes.end()), codes.end());
}

}  // namespace

FinestPages::FinestPages(PageGrid base, std::vector<std::vector<uint64_t>> parted)
    : grid_(base), parted_(std::move(parted)) {
    while (!parted_.empty() && parted_.back().empty()) parted_.pop_back();
    for (size_t i = parted_.size(); i-- > 0;) {
        makeSet(parted_[i]);
        if (i == 0) break;
        for (const uint64_t code : parted_[i]) parted_[i - 1].push_back(code >> 3);
    }
    if (parted_.empty()) return;
    first_ = last_ = glm::i64vec3(mortonDecode(parted_[0][0]));
    for (const uint64_t code : parted_[0]) {
        const glm::i64vec3 at(mortonDecode(code));
        first_ = glm::min(first_, at);
        last_ = glm::max(last_, at);
    }
    Parts whole;
    whole.fill(kWhole);
    for (size_t i = 0; i < parted_.size(); ++i) {
        const size_t first = parts_.size();
        parts_.resize(first + parted_[i].size(), whole);
        if (i == 0) continue;
        const std::vector<uint64_t>& above = parted_[i - 1];
        size_t page = 0;
        for (size_t k = 0; k < parted_[i].size(); ++k) {
            const uint64_t code = parted_[i][k];
            while (above[page] != code >> 3) ++page;
            parts_[first - above.size() + page][code & 7] = uint32_t(first + k);
        }
    }
}

uint32_t FinestPages::numberOf(uint64_t code) const {
    const auto at = std::lower_bound(parted_[0].begin(), parted_[0].end(), code);
    return at != parted_[0].end() && *at == code ? uint32_t(at - parted_[0].begin()) : kWhole;
}

void FinestPages::addLevels(uint32_t level, uint32_t number, const glm::i64vec3& corner, const glm::i64vec3& low,
                            const glm::i64vec3& high, Levels& levels) const {
    if (number == kWhole) {
        levels.coarsest = std::min(levels.coarsest, level);
        levels.deepest = std::max(levels.deepest, level);
        return;
    }
    const int64_t half = int64_t{1} << log2PageSteps(level + 1);
    const glm::i64vec3 middle = corner + half;
    const int first[3] = {low.x > middle.x, low.y > middle.y, low.z > middle.z};
    const int last[3] = {high.x >= middle.x, high.y >= middle.y, high.z >= middle.z};
    for (int z = first[2]; z <= last[2]; ++z)
        for (int y = first[1]; y <= last[1]; ++y)
            for (int x = first[0]; x <= last[0]; ++x)
                addLevels(level + 1, parts_[number][size_t(x + 2 * y + 4 * z)], corner + half * glm::i64vec3(x, y, z),
                          low, high, levels);
}

FinestPages::Levels FinestPages::levelsAround(glm::i32vec3 p, glm::i64vec3 reach) const {
    const int bits = log2PageSteps(base());
    const glm::i64vec3 low = glm::i64vec3(p) - reach, high = glm::i64vec3(p) + reach;
    // A page holds its walls.
    glm::i64vec3 first = glm::max((low - int64_t{1}) >> int64_t(bits), int64_t{0}),
                 last = glm::min(high >> int64_t(bits), int64_t(grid_.lastPage()));
    Levels levels{deepest(), base()};
    // No page outside of the box is parted.
    if (glm::any(glm::lessThan(first, first_)) || glm::any(glm::greaterThan(last, last_))) levels.coarsest = base();
    first = glm::max(first, first_);
    last = glm::min(last, last_);
    for (int64_t z = first.z; z <= last.z; ++z)
        for (int64_t y = first.y; y <= last.y; ++y)
            for (int64_t x = first.x; x <= last.x; ++x) {
                const glm::i64vec3 at(x, y, z);
                addLevels(base(), numberOf(mortonEncode(glm::u32vec3(at))), at << int64_t(bits), low, high, levels);
            }
    return levels;
}

int FinestPages::stepAt(glm::i32vec3 p) const {
    if (isUniform()) return 1;
    const Levels here = levelsAround(p, glm::i64vec3(0));
    uint32_t coarsest = here.coarsest;
    if (coarsest > base()) {
        // A cell more than the longest edge: pages take what is a step of their lattice away as well.
        coarsest = levelsAround(p, glm::i64vec3(stepsOf(kPartedEdgeCells + 1, here.deepest))).coarsest;
    }
    return 1 << (deepest() - coarsest);
}

FinestPages::Vertex FinestPages::vertexOf(glm::dvec3 point, glm::i32vec3 at) const {
    // Rounding may move it nearer to a page that is coarser still.
    int step = 1;
    for (int here; (here = stepAt(at)) > step; step = here) at = glm::i32vec3(point / double(here) + 0.5) * here;
    return {at, step};
}

bool FinestPages::isTooLong(glm::i32vec3 a, glm::i32vec3 b) const {
    if (isUniform()) return false;
    const double length = glm::length(glm::dvec3(a) - glm::dvec3(b));
    const auto exceeds = [&](int cells, uint32_t level) {
        return level > base() && length > double(stepsOf(cells, level));
    };
    if (!exceeds(kPartedEdgeCells, deepest())) return false;
    const glm::i64vec3 from(a), to(b);
    // A fourth of its length around the edge: so what is cut from an edge that may stay is never cut further without
    // end.
    constexpr int kParts = 4;
    const glm::i64vec3 reach = glm::abs(to - from) / int64_t{2 * kParts} + int64_t(length / 4) + int64_t{2};
    for (int i = 1; i < 2 * kParts; i += 2) {
        const glm::i64vec3 middle = (from * int64_t{2 * kParts - i} + to * int64_t{i}) / int64_t{2 * kParts};
        if (exceeds(kPartedEdgeCells, levelsAround(glm::i32vec3(middle), reach).deepest)) return true;
    }
    if (!exceeds(kMaxEdgeCells, deepest())) return false;
    const glm::i32vec3 middle((from + to) >> int64_t{1});
    return exceeds(kMaxEdgeCells, levelsAround(middle, glm::i64vec3(int64_t(length) + 2)).deepest);
}

}  // namespace vcp
