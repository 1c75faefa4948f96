// Pages with leaves of all kinds, for tests of what codes them.
#pragma once

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

#include "octree/surface/packing.h"
#include "tests/support/soup_page.h"

namespace vcp::test {

/// Returns a page in which most empty leaves of `page` have become slab leaves and soft leaves of any content; with
/// colours where `page` has them. Vectors are in a random order.
inline WholePage withLeavesOfAllKinds(const WholePage& page, uint32_t seed) {
    std::mt19937 random(seed);
    const PageView view = page.view();
    PageHeader header = view.header;
    std::vector<uint32_t> nodes(view.nodes.begin(), view.nodes.end());
    std::vector<uint32_t*> slabs;
    uint32_t soft = 0;
    for (uint32_t& word : nodes) {
        if (nodeType(word) != kNodeEmpty) continue;
        const auto kind = random() % 4;
        if (kind < 2) slabs.push_back(&word);
        if (kind == 2) {
            word = kNodeSoft << kNodeTypeShift | (2 * soft++) | uint32_t(random() % 3) << kSoftAxisShift |
                   uint32_t(random() % 64) << kSoftWallShift;
        }
    }
    header.softLeaves = soft;
    header.slabLeaves = uint32_t(slabs.size());
    header.faces = 2 * soft + (header.slabLeaves + 3) / 4;
    std::shuffle(slabs.begin(), slabs.end(), random);
    for (uint32_t i = 0; i < slabs.size(); ++i) *slabs[i] = slabNode(1 + uint32_t(random() % 255), 8 * soft + i);
    const PageSections from = pageSections(view.header), to = pageSections(header);
    WholePage mixed{Block(to.end / 16, uint4(0)), {}};
    auto* out = reinterpret_cast<std::byte*>(mixed.geometry.data());
    const auto* in = reinterpret_cast<const std::byte*>(page.geometry.data());
    std::memcpy(out, &header, sizeof header);
    if (!nodes.empty()) std::memcpy(out + to.nodes, nodes.data(), nodes.size() * 4);
    for (size_t i = 0; i < 8 * soft + slabs.size(); ++i) {
        const auto word = uint32_t(random());
        std::memcpy(out + to.faces + 4 * i, &word, 4);
    }
    std::memcpy(out + to.vertices, in + from.vertices, from.end - from.vertices);
    if (page.colour.empty()) return mixed;
    // Words behind the last vector are zero.
    mixed.colour = randomColours(mixed.view(), seed);
    auto* words = reinterpret_cast<uint32_t*>(mixed.colour.data());
    std::fill(words + 8 * soft + slabs.size(), words + 4 * size_t{header.faces}, 0u);
    return mixed;
}

}  // namespace vcp::test
