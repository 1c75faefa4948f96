// vcp meso base: decimates a scan's mesh to a base mesh.
#include "viewer/command/command_meso_base.h"

#include <chrono>

#include <fmt/format.h>

#include "builder/measure/indexed_mesh.h"
#include "mesostructure/base/base_file.h"
#include "mesostructure/base/decimation.h"
#include "mesostructure/base/surface_edges.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

using namespace meso;

struct MakeBase {
    std::string scan, out;
    size_t triangles = 0;
    bool overwrite = false;
    ReportOptions report;
};

constexpr uint64_t kMostTriangles = 20'000'000;

/// Reads the scan, with texture coordinates where all its triangles have them.
Result<BaseSurface> readScan(const MakeBase& command, ProgressDisplay& display) {
    LoadOptions loading;
    loading.coordinates = Coordinates::IfAny;
    loading.mostTriangles = kMostTriangles, loading.mostPositions = 3 * kMostTriangles;
    loading.progress = [&](double fraction) {
        display.update("reading the mesh", 0.3 * fraction);
        return !interrupted();
    };
    VCP_TRY_ASSIGN(auto mesh, loadMesh(command.scan, loading));
    display.update("joining corners", 0.3);
    BaseSurface surface{std::move(mesh.positions), std::move(mesh.triangles), std::move(mesh.coordinates)};
    joinPositions(surface);
    return surface;
}

std::string summary(const MakeBase& command, const SurfaceEdges& before, const SurfaceEdges& after, bool isMapped) {
    const std::string closed = after.border == 0 ? "closed" : formatCount(after.border, "edge") + " on its border";
    std::string text = fmt::format("{}: {} of {}, {}, {}", command.out, formatCount(after.triangles),
                                   formatCount(before.triangles, "triangle"), closed, formatCount(after.parts, "part"));
    text += isMapped ? ", " + formatCount(after.seams, "edge") + " on seams"
                     : std::string("\n  without texture coordinates: unwrap it before mesostructure is laid on it");
    if (after.triangles > command.triangles)
        text += "\n  no more edges can go without turning a face or changing how the surface hangs together";
    return text;
}

Result<int> runMakeBase(const MakeBase& command) {
    const auto start = std::chrono::steady_clock::now();
    const OutputRules rules{.overwrite = command.overwrite, .inputs = {command.scan}};
    VCP_TRY(checkOutput(command.out, OutputKind::Obj, rules));
    const InterruptScope catching;
    ProgressDisplay display(command.report.progressStyle(), stderr);
    const auto named = [&](Error error) {
        if (error.code != ErrorCode::Cancelled) error.file = command.scan;
        return error;
    };
    VCP_TRY_ASSIGN(const auto scan, readScan(command, display));
    const auto before = edgesOf(scan);
    if (!before) return named(before.error());
    DecimationOptions options{.triangles = command.triangles};
    options.progress = [&](double fraction) {
        display.update("collapsing edges", 0.4 + 0.6 * fraction);
        return !interrupted();
    };
    const auto base = decimated(scan, options);
    if (!base) return named(base.error());
    const auto after = edgesOf(*base);
    if (!after) return named(after.error());
    VCP_TRY(writeBase(command.out, *base, rules));
    display.finish();
    const bool isMapped = !base->uvs.empty();
    if (!command.report.json) {
        VCP_TRY(printLine(summary(command, *before, *after, isMapped)));
        return 0;
    }
    VCP_TRY(printJson({{"file", command.out},
                       {"triangles", after->triangles},
                       {"vertices", base->positions.size()},
                       {"closed", after->border == 0},
                       {"border_edges", after->border},
                       {"seam_edges", after->seams},
                       {"parts", after->parts},
                       {"texture_coordinates", isMapped},
                       {"triangles_of_scan", before->triangles},
                       {"seconds", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()}}));
    return 0;
}

}  // namespace

RunCommand addMesoBase(CLI::App& meso) {
    auto command = std::make_shared<MakeBase>();
    CLI::App* app = meso.add_subcommand("base", "Decimate a scan's mesh to a base mesh");
    app->add_option("SCAN", command->scan, "A mesh that fits in memory, up to 20 million triangles")
        ->type_name("")
        ->required();
    app->add_option("--triangles", command->triangles, "Triangles that are left")
        ->type_name("N")
        ->required()
        ->check(CLI::Range(uint64_t{4}, kMostTriangles));
    app->add_option("-o,--output", command->out, "The mesh to write")
        ->type_name("OUT.obj")
        ->required()
        ->check([](const std::string& name) { return extensionProblem(name, ".obj", false); });
    addOverwriteOption(*app, command->overwrite);
    addJsonOption(*app, command->report);
    addProgressOption(*app, command->report);
    return [command] { return runMakeBase(*command); };
}

}  // namespace vcp
