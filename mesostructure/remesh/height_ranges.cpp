#include "mesostructure/remesh/height_ranges.h"

namespace vcp::meso {

namespace {

void join(HeightRanges::Range& range, HeightRanges::Range with) {
    range.least = std::min(range.least, with.least), range.most = std::max(range.most, with.most);
}

}  // namespace

HeightRanges::HeightRanges(const HeightLevel& map) {
    Level& first = levels_.emplace_back();
    first.size = (map.size + kBlock - 1) / kBlock;
    first.ranges.resize(size_t(first.size.x) * size_t(first.size.y));
    std::vector<Range> row(size_t(first.size.x));  // of each block's columns
    for (int j = 0; j < map.size.y; ++j) {
        const uint16_t* texels = &map.texels[size_t(map.size.x) * size_t(j)];
        for (int block = 0; block < first.size.x; ++block) {
            Range& range = row[size_t(block)] = {};
            const int from = block * kBlock, to = std::min(from + kBlock, map.size.x);
            for (int i = from; i < to; ++i) join(range, {texels[i], texels[i]});
            const uint16_t after = texels[to < map.size.x ? to : 0];
            join(range, {after, after});
        }
        // The first row of a block is the last that the block below reaches.
        const int block = j / kBlock, below = block > 0 ? block - 1 : first.size.y - 1;
        for (int i = 0; i < first.size.x; ++i) {
            join(first.ranges[size_t(i) + size_t(first.size.x) * size_t(block)], row[size_t(i)]);
            if (j % kBlock == 0) join(first.ranges[size_t(i) + size_t(first.size.x) * size_t(below)], row[size_t(i)]);
        }
    }
    while (std::max(levels_.back().size.x, levels_.back().size.y) > 1) {
        const Level& from = levels_.back();
        Level to{(from.size + 1) / 2, {}};
        to.ranges.resize(size_t(to.size.x) * size_t(to.size.y));
        for (int j = 0; j < from.size.y; ++j)
            for (int i = 0; i < from.size.x; ++i)
                join(to.ranges[size_t(i / 2) + size_t(to.size.x) * size_t(j / 2)],
                     from.ranges[size_t(i) + size_t(from.size.x) * size_t(j)]);
        levels_.push_back(std::move(to));
    }
}

}  // namespace vcp::meso
