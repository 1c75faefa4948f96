#include "viewer/command/paper_arguments.h"

#include <cmath>
#include <cstdlib>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "builder/paper/paper_subvolumes.h"
#include "viewer/command/manual/help_text.h"

namespace vcp {

namespace {

void addLength(CLI::App& app, const char* name, float& value, const char* what) {
    app.add_option(name, value, what)->type_name("CELLS")->capture_default_str()->check([](const std::string& text) {
        const double length = std::strtod(text.c_str(), nullptr);
        return std::isfinite(length) && std::abs(length) <= 1e3
                   ? std::string()
                   : "must be a number of cells up to 1000, not \"" + text + "\"";
    });
}

/// Parses values by name; the first one is the default.
template <class Value>
void addChoice(CLI::App& app, const char* name, Value& value, const std::string& what,
               const std::vector<std::pair<std::string, Value>>& values) {
    std::vector<std::string> names;
    for (const auto& [key, ignored] : values) names.push_back(key);
    app.add_option_function<std::string>(
           name,
           [&value, values](const std::string& wanted) {
               for (const auto& [key, chosen] : values)
                   if (key == wanted) value = chosen;
           },
           fmt::format("{} [{}]", what, names.front()))
        ->type_name(fmt::format("{}", fmt::join(names, "|")))
        ->check(CLI::IsMember(names));
}

}  // namespace

void addPaperStructureOptions(CLI::App& app, PaperOptions& options) {
    const ScopedGroup paper(app, help_group::kPaper);
    addLength(app, "--paper-band", options.band, "Vectors are kept in blocks nearer than this (t)");
    addLength(app, "--paper-merge", options.mergeThreshold,
              "Cells are merged where their vectors err by less; negative: never");
    app.add_option_function<std::string>(
           "--paper-k",
           [&options](const std::string& text) {
               options.growRounds = text == "exact" ? CornerOctreeOptions::kExactPoints : std::stoi(text);
           },
           fmt::format("Rounds of region growing that find the vectors (k); exact: the closest points of the "
                       "whole mesh [{}]",
                       options.growRounds))
        ->type_name("ROUNDS|exact")
        ->check([](const std::string& text) {
            const bool isCount =
                !text.empty() && text.size() <= 2 && text.find_first_not_of("0123456789") == std::string::npos;
            return text == "exact" || isCount ? std::string() : "must be 0 to 99 or exact, not \"" + text + "\"";
        });
    addChoice<PaperPacking>(app, "--paper-packing", options.packing, "Directions of the vectors",
                            {{"spherical", PaperPacking::Spherical}, {"octahedral", PaperPacking::Octahedral}});
    addChoice<bool>(app, "--paper-empty", options.safeEmpty,
                    "Distances of empty nodes, rounded up as published, or so that they are safe to step",
                    {{"published", false}, {"safe", true}});
}

void addPaperSubvolumesOption(CLI::App& app, int& cells, const std::string& otherwise) {
    const ScopedGroup paper(app, help_group::kPaper);
    std::vector<std::string> sizes;
    for (int size = kLeastSubvolumeCells; size <= kMostSubvolumeCells; size *= 2) sizes.push_back(std::to_string(size));
    app.add_option(
           "--paper-subvolumes", cells,
           fmt::format("Edge of subvolumes of finest cells, which are drawn where they are near, with one octree "
                       "of larger cells for the rest [{}]",
                       otherwise))
        ->type_name(fmt::format("{}", fmt::join(sizes, "|")))
        ->check(CLI::IsMember(sizes));
}

void addPaperSchemeOption(CLI::App& app, PaperScheme& scheme) {
    const ScopedGroup paper(app, help_group::kPaper);
    addChoice<PaperScheme>(
        app, "--paper-scheme", scheme, "Interpolation of the vectors",
        {{"longer", PaperScheme::Longer}, {"min-plane", PaperScheme::MinPlane}, {"trilinear", PaperScheme::Trilinear}});
}

void addPaperMarchOptions(CLI::App& app, PaperMarch& march) {
    const ScopedGroup paper(app, help_group::kPaper);
    addLength(app, "--paper-epsilon", march.epsilon, "A ray hits nearer than this");
    addPaperSchemeOption(app, march.scheme);
    addChoice<PaperStep>(
        app, "--paper-step", march.step, "Steps near the surface",
        {{"planar", PaperStep::Planar}, {"onward", PaperStep::Onward}, {"distance", PaperStep::Distance}});
    addChoice<bool>(app, "--paper-back", march.back, "A hit is moved back to where the distance is epsilon",
                    {{"on", true}, {"off", false}});
    addChoice<bool>(app, "--paper-cache", march.cached, "A step reuses the node and vectors of the step before",
                    {{"on", true}, {"off", false}});
    app.add_option("--paper-reach", march.reach,
                   "Subvolumes nearer than this part of the dataset's diagonal are of finest cells")
        ->type_name("PART")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1e6));
}

}  // namespace vcp
