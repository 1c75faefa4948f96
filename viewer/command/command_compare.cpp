// vcp compare: how far one surface lies from another, with a sign: figures, a picture, a mesh with distances.
#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "builder/measure/mesh_deviation.h"
#include "viewer/command/build_arguments.h"
#include "viewer/command/commands.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/render_arguments.h"
#include "viewer/command/source_arguments.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/export/deviation_picture.h"
#include "viewer/export/deviation_report.h"
#include "viewer/export/surface_mesh.h"
#include "viewer/scene/inputs.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

struct CompareCommand {
    std::vector<std::string> inputs;
    std::vector<std::string> outputs;
    std::string csv;
    bool overwrite = false;
    bool both = false;
    bool masks = true, allowOutside = false;
    uint64_t samples = 200'000;
    std::optional<Length> error, within, range;
    std::optional<LengthUnit> unit;
    glm::ivec2 size{1600, 1000};
    RenderSettings render;  ///< of it the camera and the source
    unsigned threads = 0;
    ReportOptions report;
};

/// Part of the way, for the progress.
struct Stage {
    const char* name;
    double from, to;
};

class Comparison {
public:
    explicit Comparison(const CompareCommand& command)
        : command_(command), display_(command.report.progressStyle(), stderr) {}

    Result<int> run() {
        VCP_TRY(checkOutputs());
        VCP_TRY(load(command_.inputs[0], a_, {"reading the first", 0, 0.1}));
        VCP_TRY(load(command_.inputs[1], b_, {"reading the second", 0.1, 0.2}));
        const Box bounds = Box::of(a_.mesh.positions);
        diagonal_ = glm::distance(bounds.low, bounds.high);
        within_ = command_.within ? lengthOf(*command_.within) : within_;
        display_.update("sorting the second", 0.2);
        const DeviationTarget target(b_.mesh);
        VCP_TRY_ASSIGN(const auto deviation, measure(a_.mesh, target, {"measuring", 0.3, 0.5}));
        range_ = command_.range ? lengthOf(*command_.range) : usualRange(deviation, diagonal_);
        Json json = deviationJson(deviation, compared(), "a_to_b");
        std::string text = table(deviation);
        VCP_TRY(writeCsv(deviation));
        VCP_TRY(writeOutputs(target, deviation, bounds));
        if (command_.both) {
            const DeviationTarget other(a_.mesh);
            VCP_TRY_ASSIGN(const auto back, measure(b_.mesh, other, {"measuring back", 0.9, 1}));
            json.update(deviationJson(back, compared(), "b_to_a"));
            text += "\n  and back\n" + table(back);
        }
        display_.finish();
        if (!command_.report.json) {
            VCP_TRY(printLine(heading() + text));
            return 0;
        }
        VCP_TRY(printJson(json));
        return 0;
    }

private:
    [[nodiscard]] std::function<bool(double)> progress(const Stage& stage) {
        return [this, stage](double fraction) {
            display_.update(stage.name, stage.from + (stage.to - stage.from) * fraction);
            return !interrupted();
        };
    }

    [[nodiscard]] OutputRules rules() const {
        OutputRules rules{.overwrite = command_.overwrite, .inputs = {command_.render.source.caFile}};
        for (const std::string& input : command_.inputs) rules.inputs.emplace_back(input);
        if (const auto* file = std::get_if<std::filesystem::path>(&command_.render.camera))
            rules.inputs.push_back(*file);
        return rules;
    }

    /// Finds what would be refused, before anything is read.
    [[nodiscard]] Result<void> checkOutputs() const {
        std::vector<std::string> names = command_.outputs;
        if (!command_.csv.empty()) names.push_back(command_.csv);
        for (size_t i = 0; i < names.size(); ++i) {
            if (std::find(names.begin(), names.begin() + std::ptrdiff_t(i), names[i]) !=
                names.begin() + std::ptrdiff_t(i))
                return Error{.code = ErrorCode::Usage, .message = "outputs must be different files"};
            VCP_TRY(checkOutput(names[i], *outputKindOf(names[i]), rules()));
        }
        return {};
    }

    Result<void> load(const std::string& input, LoadedSurface& surface, const Stage& stage) {
        VCP_TRY_ASSIGN(const InputKind kind, kindOf({input}));
        if (kind == InputKind::Scene)
            return Error{.code = ErrorCode::Usage, .message = "is a scene; give a .vcp file or a mesh", .file = input};
        if (kind == InputKind::Meshes) {
            VCP_TRY_ASSIGN(surface.mesh, loadMesh(input, {.masks = command_.masks,
                                                          .allowOutside = command_.allowOutside,
                                                          .progress = progress(stage)}));
            return {};
        }
        VCP_TRY_ASSIGN(const auto reader, openReader(input, command_.render.source));
        VCP_TRY_ASSIGN(const auto dataset, readDataset(*reader));
        uint32_t level = dataset.header.levels - 1;
        if (command_.error) {
            const Box bounds = boundsOf(dataset.header);
            const double scale = command_.error->isRelative ? glm::distance(bounds.low, bounds.high) : 1;
            VCP_TRY_ASSIGN(level, coarsestLevelWithin(command_.error->value * scale, dataset, input));
        }
        VCP_TRY_ASSIGN(const auto cut, SurfaceCut::create(dataset, input, level));
        VCP_TRY_ASSIGN(
            surface,
            loadSurface(*reader, cut, {.colour = false, .threads = command_.threads, .progress = progress(stage)}));
        return {};
    }

    /// Returns a length in world units; parts are of the first surface's diagonal.
    [[nodiscard]] double lengthOf(const Length& length) const {
        return length.isRelative ? length.value * diagonal_ : length.value;
    }

    Result<Deviation> measure(const IndexedMesh& mesh, const DeviationTarget& target, const Stage& stage) {
        return measureDeviation(
            mesh, target,
            {.samples = command_.samples, .within = within_, .threads = command_.threads, .progress = progress(stage)});
    }

    [[nodiscard]] ComparedSurfaces compared() const {
        return {.a = command_.inputs[0],
                .b = command_.inputs[1],
                .unit = command_.unit ? std::string(command_.unit->name) : "",
                .certifiedA = a_.certified,
                .certifiedB = b_.certified,
                .range = range_};
    }

    [[nodiscard]] std::string heading() const {
        std::string text = fmt::format("{} from {}", command_.inputs[0], command_.inputs[1]);
        if (a_.certified + b_.certified > 0)
            text += fmt::format(", each figure within {}", formatLength(a_.certified + b_.certified));
        return text + "\n";
    }

    [[nodiscard]] std::string table(const Deviation& d) const {
        const std::string unit = command_.unit ? " " + std::string(command_.unit->name) : "";
        std::string text = fmt::format("  {:<10}{}{}\n  {:<10}{}{}\n", "mean", formatLength(d.mean), unit, "rms",
                                       formatLength(d.rms), unit);
        text += "  signed    ";
        for (const auto& [word, part] : kDeviationQuantiles)
            text += fmt::format(" {} {}", word, formatLength(d.quantile(part)));
        text +=
            fmt::format("\n  size       p50 {} p95 {} p99 {} max {}\n  {:<10}{}", formatLength(d.absoluteQuantile(0.5)),
                        formatLength(d.absoluteQuantile(0.95)), formatLength(d.absoluteQuantile(0.99)),
                        formatLength(d.absoluteQuantile(1)), "samples", formatCount(d.samples));
        if (d.withoutCounterpart() > 0)
            text += fmt::format(", {} without a counterpart", formatCount(d.withoutCounterpart()));
        return text;
    }

    [[nodiscard]] Result<void> writeCsv(const Deviation& deviation) const {
        if (command_.csv.empty()) return {};
        return writeFile(command_.csv, OutputKind::Text, std::string_view(deviationCsv(deviation, range_)), rules());
    }

    Result<void> writeOutputs(const DeviationTarget& target, const Deviation& deviation, const Box& bounds) {
        for (const std::string& output : command_.outputs) {
            if (outputKindOf(output) == OutputKind::Png)
                VCP_TRY(writePicture(output, target, deviation, bounds));
            else
                VCP_TRY(writeMesh(output, target));
        }
        return {};
    }

    Result<void> writePicture(const std::string& output, const DeviationTarget& target, const Deviation& deviation,
                              const Box& bounds) {
        const glm::ivec2 drawn(command_.size.x - int(scaleWidth(uint32_t(command_.size.x))), command_.size.y);
        VCP_TRY_ASSIGN(const auto camera, command_.render.cameraFor(bounds, command_.render.upFor(bounds), drawn));
        const MeshBvh surface(a_.mesh);
        VCP_TRY_ASSIGN(const auto picture, drawDeviation(surface, target, deviation,
                                                         {.camera = camera.current(),
                                                          .width = uint32_t(command_.size.x),
                                                          .height = uint32_t(command_.size.y),
                                                          .range = range_,
                                                          .within = within_,
                                                          .unit = command_.unit ? std::string(command_.unit->name) : "",
                                                          .threads = command_.threads,
                                                          .progress = progress({"drawing", 0.5, 0.7})}));
        return writePng(picture, output, rules());
    }

    Result<void> writeMesh(const std::string& output, const DeviationTarget& target) {
        VCP_TRY_ASSIGN(const auto distances, distancesOf(a_.mesh.positions, target,
                                                         {.within = within_,
                                                          .threads = command_.threads,
                                                          .progress = progress({"measuring vertices", 0.7, 0.9})}));
        const Notes notes = {{"source", command_.inputs[0]},
                             {"distances_from", command_.inputs[1]},
                             {"colours_from_to", fmt::format("{} {}", -range_, range_)},
                             {"unit", command_.unit ? std::string(command_.unit->name) : "unknown"}};
        return writeDistances(a_.mesh, distances, range_, output, rules(), notes);
    }

    const CompareCommand& command_;
    ProgressDisplay display_;
    LoadedSurface a_, b_;
    double diagonal_ = 0, range_ = 1, within_ = std::numeric_limits<double>::infinity();
};

std::string checkName(const std::string& name) {
    const auto kind = outputKindOf(name);
    return kind == OutputKind::Png || kind == OutputKind::Ply ? std::string()
                                                              : "must end in .png or .ply, not \"" + name + "\"";
}

}  // namespace

Command addCompare(CLI::App& vcp) {
    auto command = std::make_shared<CompareCommand>();
    CLI::App* app = vcp.add_subcommand("compare", "Measure how far one surface lies from another, with a sign");
    app->add_option("A B", command->inputs,
                    "Two surfaces: .vcp files, their http(s) addresses, or meshes. Distances are A's, from B: positive "
                    "where A lies in front of B's faces, outside of it")
        ->type_name("")
        ->required()
        ->expected(2);
    beginGroup(*app, help_group::kOutput);
    app->add_option("-o,--output", command->outputs,
                    "A picture of A coloured by distance (.png), or A's vertices with their distances and colours "
                    "(.ply); both with two -o")
        ->type_name("OUT")
        ->take_all()
        ->allow_extra_args(false)
        ->check(checkName);
    app->add_option("--csv", command->csv, "Write the figures and the histogram as a table")
        ->type_name("OUT.csv")
        ->check([](const std::string& name) { return extensionProblem(name, ".csv", false); });
    addOverwriteOption(*app, command->overwrite);
    beginGroup(*app, help_group::kMeasured);
    app->add_flag("--both", command->both, "Measure B from A as well");
    addMasks(*app, command->masks);
    addAllowOutside(*app, command->allowOutside);
    app->add_option("--samples", command->samples, "Points of the surface, evenly by area, for the figures")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 100'000'000));
    addParsed(*app, "--within", command->within, parseLength, "like 0.25 or 1%",
              "Leave out what is farther away: it has no counterpart (a length, or a part of A's diagonal)")
        ->type_name("LENGTH");
    addParsed(*app, "--range", command->range, parseLength, "like 0.25 or 1%",
              "Distance at the ends of the colours and the histogram [that of 99 % of the points]")
        ->type_name("LENGTH");
    addParsed(*app, "--error", command->error, parseLength, "like 0.25 or 0.01%",
              "Take of .vcp files the coarsest level within this distance [the finest]: surfaces are held in memory")
        ->type_name("LENGTH");
    addUnit(*app, command->unit, "What one unit of the files is");
    beginGroup(*app, help_group::kCamera);
    addSize(*app, command->size, "1600x1000", "Width and height of the picture in pixels")
        ->default_str(sizeText(command->size));
    addCameraSettings(*app, command->render);
    addSourceSettings(*app, command->render.source);
    beginGroup(*app, help_group::kReport);
    app->add_option("--threads", command->threads, "Threads that measure [one a processor]")
        ->type_name("N")
        ->check(CLI::Range(1, 1024));
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    return {app, [command] {
                const InterruptScope catching;
                return Comparison(*command).run();
            }};
}

}  // namespace vcp
