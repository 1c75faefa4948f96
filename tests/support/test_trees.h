// Directories without pages: trees for tests of selection and policy.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "streaming/page_selection.h"
#include "streaming/slot_allocator.h"

namespace vcp::test {

/// Bytes of a chunk of a small pool.
inline constexpr uint64_t kChunkBytes = 64 * kPoolUnitBytes;

/// What a view sees where there is one dataset.
inline std::array<std::optional<SelectionView>, 1> only(const SelectionView& view) { return {view}; }

/// A tree of at most `levels` levels over the unit cube: each octant of a page has a page with probability
/// `density`, of up to `maxBytes`; a page errs by about 0.01 of its edge.
inline Dataset randomTree(uint64_t seed, uint32_t levels, double density, uint32_t maxBytes) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    Dataset dataset;
    dataset.header.levels = levels;
    dataset.header.log2Cells = 5;
    dataset.header.cell = std::exp2(-5.0 - (levels - 1));
    dataset.header.flags = seed % 2 != 0 ? kFlagColour : 0;
    std::vector<uint64_t> places{0};
    for (uint32_t level = 0; level < levels; ++level) {
        std::vector<uint64_t> next;
        const uint64_t firstOfNext = dataset.pages.size() + places.size();
        for (const uint64_t place : places) {
            PageEntry page;
            page.morton = place;
            page.level = uint8_t(level);
            page.certifiedError = float((0.005 + 0.01 * unit(random)) * std::exp2(-double(level)));
            page.pageBytes = 16 + uint32_t(random() % maxBytes) / 16 * 16;
            page.storedBytes = page.pageBytes / 3 + 1;
            if (dataset.hasColour()) page.colourBytes = page.colourStoredBytes = page.pageBytes / 64 * 16 + 16;
            page.firstChild = uint32_t(firstOfNext + next.size());
            for (uint32_t octant = 0; octant < 8 && level + 1 < levels; ++octant) {
                if (unit(random) > density) continue;
                page.childMask = uint8_t(page.childMask | 1u << octant);
                next.push_back(place << 3 | octant);
            }
            if (page.childMask == 0) page.firstChild = 0;
            dataset.pages.push_back(page);
        }
        places = std::move(next);
    }
    dataset.header.pages = dataset.pages.size();
    return dataset;
}

/// Looks somewhere at the unit cube.
inline SelectionView randomView(std::mt19937_64& random, double errorPixels) {
    std::uniform_real_distribution<double> wide(-1, 2), sloped(-0.5, 1);
    SelectionView view;
    view.eye = {wide(random), wide(random), wide(random)};
    view.orthographic = random() % 8 == 0;
    view.pixelsPerUnit = 1000;
    view.errorPixels = errorPixels;
    for (glm::dvec4& plane : view.planes) plane = {sloped(random), sloped(random), sloped(random), 0.5};
    return view;
}

}  // namespace vcp::test
