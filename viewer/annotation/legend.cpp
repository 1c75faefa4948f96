#include "viewer/annotation/legend.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "render/false_colours.h"

namespace vcp {

namespace {

/// A legend of numbers from 0 to `end` and more, with a tick at each quarter.
Legend numbers(const char* name, const char* unit, double end) {
    Legend legend{.name = name, .unit = unit, .end = end, .ticks = {}};
    for (int quarter = 0; quarter <= 4; ++quarter)
        legend.ticks.push_back({quarter / 4.0, fmt::format("{:g}{}", end * quarter / 4, quarter == 4 ? "+" : "")});
    return legend;
}

Legend levels(const std::vector<uint32_t>& counts) {
    Legend legend{.name = "Level of detail", .unit = {}, .ticks = {}};
    const uint32_t count = counts.front();
    // The colours of each dataset go to its own finest level.
    if (count == 0 || std::ranges::count(counts, count) != std::ssize(counts)) {
        legend.ticks = {{0, "coarsest"}, {1, "finest"}};
        return legend;
    }
    legend.end = count - 1;
    legend.bands = count;
    for (uint32_t level = 0; level < count; ++level)
        legend.ticks.push_back({(level + 0.5) / count, fmt::format("{}", level)});
    return legend;
}

}  // namespace

glm::vec3 Legend::colourOf(double number) const { return falseColour(number / (end > 0 ? end : 1)); }

glm::vec3 Legend::colourAt(double part) const {
    if (!colours.empty()) {
        const double at = std::clamp(part, 0.0, 1.0) * double(colours.size() - 1);
        const size_t before = std::min(size_t(at), colours.size() - 2);
        return glm::mix(colours[before], colours[before + 1], float(at - double(before)));
    }
    if (bands == 0) return colourOf(part * end);
    return colourOf(std::clamp(std::floor(part * bands), 0.0, double(bands - 1)));
}

std::vector<Legend> legendsOf(ShadingMode mode, const LegendSubject& subject) {
    const bool hasDatasets = !subject.levels.empty();
    std::vector<Legend> legends;
    if (mode == ShadingMode::Steps && subject.hasRelief)
        legends.push_back(numbers("Iterations of each ray on relief", "", reliefColourEnd()));
    if (mode == ShadingMode::Steps && hasDatasets)
        legends.push_back(numbers("Steps of each ray", "", falseColourEnd(mode)));
    if (mode == ShadingMode::Cells && hasDatasets)
        legends.push_back(numbers("Cells of each ray", "", falseColourEnd(mode)));
    if (mode == ShadingMode::Fetches && hasDatasets)
        legends.push_back(numbers("Reads of each ray", "", falseColourEnd(mode)));
    if (mode == ShadingMode::Level && hasDatasets) legends.push_back(levels(subject.levels));
    // Nothing is certified of files of the method `paper`.
    if (mode == ShadingMode::Error && std::ranges::any_of(subject.levels, [](uint32_t count) { return count > 0; }))
        legends.push_back(numbers("Error", "pixels", falseColourEnd(mode)));
    return legends;
}

}  // namespace vcp
