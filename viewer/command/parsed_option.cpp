#include "viewer/command/parsed_option.h"

#include <fmt/format.h>

#include "builder/memory_plan.h"
#include "viewer/scene/option_values.h"

namespace vcp {

CLI::Option* addSize(CLI::App& app, glm::ivec2& size, const std::string& example, const std::string& description) {
    return addParsed(app, "--size", size, parseSize, fmt::format("like {}, at most {} each way", example, kLargestSize),
                     description)
        ->type_name("WxH");
}

CLI::Option* addBudget(CLI::App& app, const std::string& name, uint64_t& bytes, const std::string& description) {
    return addParsed(app, name, bytes, parseBudget, "at least 1M, like 64M or 1G", description)->type_name("BYTES");
}

CLI::Option* addCell(CLI::App& app, double& cell) {
    const auto parse = [](const std::string& text) -> std::optional<double> {
        const auto length = parseLength(text);
        return length && !length->isRelative ? std::optional(length->value) : std::nullopt;
    };
    return addParsed(app, "--cell", cell, parse, "a length in world units like 0.25",
                     "Edge of the finest cells where triangles are not crowded, world units [chosen from the mesh]")
        ->type_name("LENGTH");
}

CLI::Option* addUnit(CLI::App& app, std::optional<LengthUnit>& unit, const std::string& description) {
    return addParsed(app, "--unit", unit, unitNamed, "um, mm, cm, m, km, in or ft", description)->type_name("UNIT");
}

CLI::Option* addMemory(CLI::App& app, uint64_t& bytes, const std::string& description) {
    const auto parse = [](const std::string& text) { return parseMemory(text, 2 * defaultMemoryBytes()); };
    return addParsed(app, "--memory", bytes, parse, "like 512M, 4G or 50%", description)->type_name("BYTES");
}

std::string sizeText(glm::ivec2 size) { return fmt::format("{}x{}", size.x, size.y); }

}  // namespace vcp
