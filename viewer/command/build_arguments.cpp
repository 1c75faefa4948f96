#include "viewer/command/build_arguments.h"

#include <charconv>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "builder/mesh/open_mesh.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

std::optional<ColourChoice> colourNamed(const std::string& name) {
    if (name == "auto") return ColourChoice::Auto;
    if (name == "vertex") return ColourChoice::Vertex;
    if (name == "texture") return ColourChoice::Texture;
    if (name == "none") return ColourChoice::None;
    return std::nullopt;
}

std::optional<VertexNormals> normalsNamed(const std::string& name) {
    if (name == "mesh") return VertexNormals::Mesh;
    if (name == "computed") return VertexNormals::Computed;
    return std::nullopt;
}

std::optional<ImageQuality> imageQualityNamed(const std::string& name) {
    if (name == "source") return ImageQuality();
    if (name == "lossless") return ImageQuality{0, 0};
    int quality = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), quality);
    if (error != std::errc() || end != name.data() + name.size() || quality < 1 || quality > 100) return std::nullopt;
    return ImageQuality{quality, quality};
}

std::optional<CoarseLeaves> leavesNamed(const std::string& name) {
    if (name == "slabs") return CoarseLeaves::Slabs;
    if (name == "mesh") return CoarseLeaves::Mesh;
    return std::nullopt;
}

void addError(CLI::App& app, BuildOptions& options) {
    const auto take = [&options](const CLI::results_t& texts) {
        const auto length = parseLength(texts.back());
        if (!length) throw notTaken("--error", "a length like 0.25 or 0.01%", texts.back());
        options.error = length->value;
        options.errorIsRelative = length->isRelative;
        return true;
    };
    app.add_option("--error", take,
                   "Tolerated distance to the mesh, for a file with fewer triangles in it: world units, or a part of "
                   "the bounding box's diagonal like 0.01% [none: the finest level is the mesh]")
        ->type_name("LENGTH");
}

}  // namespace

void addBuildSettings(CLI::App& app, BuildOptions& options, const char* group) {
    const ScopedGroup scope(app, group);
    addCell(app, options.cell);
    addOrigin(app, options);
    addError(app, options);
    addColourChoice(app, options);
    addImages(app, options);
    addVertexNormals(app, options);
    addMasks(app, options.masks);
    addAllowOutside(app, options.allowOutside);
    addParsed(app, "--leaves", options.coarseLeaves, leavesNamed, "slabs or mesh",
              "What coarser levels are made of: slabs (one plane a cell) or mesh (triangles of clustered vertices, and "
              "vectors at corners where they suffice; always with --error)")
        ->type_name("KIND:{slabs,mesh}")
        ->group(help_group::kMeasuring)
        ->default_str(options.coarseLeaves == CoarseLeaves::Slabs ? "slabs" : "mesh");
    app.add_option("--threads", options.threads, "Threads that build [one a processor]")
        ->type_name("N")
        ->check(CLI::Range(1, 1024));
    addFormat(app, options);
    addMemory(app, options.memoryBytes, "Memory that the build may take: 512M, 4G, 50% [half of the machine's]");
    addTempFolder(app, options, "Folder for temporary files [that of the output]");
}

void addBuildInputs(CLI::App& app, std::vector<std::string>& inputs, const std::string& description) {
    app.add_option("IN", inputs, description)->type_name("")->required();
}

void addBuildOutput(CLI::App& app, std::string& output) {
    app.add_option("-o,--output", output, "The .vcp file to write")
        ->type_name("OUT.vcp")
        ->group(help_group::kOutput)
        ->check([](const std::string& name) { return extensionProblem(name, ".vcp", false); });
}

void addOrigin(CLI::App& app, BuildOptions& options) {
    const auto parse = [](const std::string& text) -> std::optional<glm::dvec3> {
        const auto numbers = parseNumbers(text);
        return numbers.size() == 3 ? std::optional(glm::dvec3(numbers[0], numbers[1], numbers[2])) : std::nullopt;
    };
    addParsed(
        app, "--origin", options.origin, parse, "three numbers like -10,0,2.5",
        "Where the grid begins, at least a cell before the mesh: with the same origin and cell, what of a scan stays "
        "as it was is built as it was (`vcp info` has both) [a cell before the mesh]")
        ->type_name("X,Y,Z")
        ->needs("--cell");
}

void addColourChoice(CLI::App& app, BuildOptions& options) {
    addParsed(app, "--colour,--color", options.colour, colourNamed, "auto, vertex, texture or none",
              "Colour to keep: auto (all there is), vertex, texture or none")
        ->type_name("WHICH:{auto,vertex,texture,none}")
        ->default_str("auto");
}

void addImages(CLI::App& app, BuildOptions& options) {
    app.add_flag_function(
        "--images,!--no-images", [&options](int64_t times) { options.keepImages = times > 0; },
        "Keep the images of materials, too, as sharp as they are, with their place on the triangles [on, but "
        "with --error]");
    app.add_flag(
        "--channels,!--no-channels", options.channels,
        "Keep with them what materials have beside their colour: normals, roughness, metalness, emission [on]");
    addParsed(
        app, "--colour-quality,--color-quality", options.imageQuality, imageQualityNamed,
        "source, lossless or 1 to 100",
        "How images are coded: source (the finest level as the mesh brings it: a JPEG's own blocks, and without "
        "loss what is PNG; coarser ones as JPEGs that are as good), lossless, or all as JPEGs of a quality of 1 to "
        "100 where these are smaller")
        ->type_name("source|lossless|N")
        ->default_str("source");
}

void addVertexNormals(CLI::App& app, BuildOptions& options) {
    addParsed(app, "--vertex-normals", options.vertexNormals, normalsNamed, "mesh or computed",
              "Normals that the surface is lit by: mesh (the file's own, where it has them) or computed (from the "
              "triangles around a vertex)")
        ->type_name("WHICH:{mesh,computed}")
        ->default_str("mesh");
}

void addMasks(CLI::App& app, bool& masks) {
    app.add_flag("--masks,!--no-masks", masks,
                 "Cut out what the alpha of materials leaves out, as of leaves and fences [on]");
}

void addAllowOutside(CLI::App& app, bool& allowOutside) {
    app.add_flag(
        "--allow-outside", allowOutside,
        "Read also images, material files and buffers that lie outside the folder of the mesh that names them");
}

void addFormat(CLI::App& app, BuildOptions& options) {
    app.add_option("--format", options.format,
                   fmt::format("Format of meshes whose content does not tell it: {}", fmt::join(meshFormats(), ", ")))
        ->type_name("NAME")
        ->check(CLI::IsMember(std::vector<std::string>(meshFormats().begin(), meshFormats().end()), CLI::ignore_case));
}

void addTempFolder(CLI::App& app, BuildOptions& options, const std::string& description) {
    const auto folder = [](const std::string& name) { return std::optional(std::filesystem::path(name)); };
    addParsed(app, "--temp", options.temp, folder, "a folder", description)
        ->type_name("DIR")
        ->check(CLI::ExistingDirectory);
}

Json toJson(const BuildFigures& figures) {
    return {{"triangles", figures.triangles},         {"degenerate_triangles", figures.degenerateTriangles},
            {"vertices", figures.vertices},           {"seconds", figures.seconds},
            {"peak_rss_bytes", figures.peakRssBytes}, {"temp_bytes", figures.tempBytes},
            {"file_bytes", figures.fileBytes},        {"levels", figures.levels},
            {"subvolumes", figures.subvolumes},       {"leaves", figures.leaves},
            {"hard_leaves", figures.hardLeaves},      {"cell", figures.cell},
            {"error_target", figures.errorTarget},    {"certified_error_max", figures.certifiedErrorMax}};
}

ProgressDetails detailsOf(const BuildProgress& at) {
    return {.triangles = at.triangles, .tempBytes = at.tempBytes, .begun = at.begun};
}

std::function<bool(const BuildProgress&)> shownProgress(ProgressStyle style) {
    return [display = std::make_shared<ProgressDisplay>(style, stderr)](const BuildProgress& at) {
        display->update(at.stage, at.fraction, detailsOf(at));
        return !interrupted();
    };
}

Result<OpenedScene> openSceneShown(const std::vector<std::string>& inputs, BuildOptions build,
                                   const SourceAccess& source, ProgressStyle style, const SurfaceChoices& instead) {
    const InterruptScope catching;
    build.progress = shownProgress(style);
    return openScene(inputs, build, source, instead);
}

}  // namespace vcp
