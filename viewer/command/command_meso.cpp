// vcp meso: builds mesostructure assets, and shows what they hold.
#include <array>
#include <charconv>
#include <chrono>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "mesostructure/method.h"
#include "mesostructure/solids.h"
#include "viewer/asset/height_image.h"
#include "viewer/asset/share_out.h"
#include "viewer/asset/tile_mesh.h"
#include "viewer/command/command_meso_bake.h"
#include "viewer/command/command_meso_base.h"
#include "viewer/command/commands.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/command/terminal/progress_display.h"
#include "viewer/scene/meso_scene.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

using namespace meso;

struct BuildMeso {
    std::string source, out, grid = "auto", cones = "4x2", rule = "any-point", blocks = "4", crossings = "direct",
                             up = "z", period;
    double height = 0;  // 0: the generator's own, 0.1 for pictures
    int texels = 256, samples = 2;
    uint32_t seed = 1;
    double cap = 0.25;
    bool onlyHeights = false, noBoxes = false, noPatches = false, overwrite = false, guesses = false,
         noVisibility = false;
    std::string gdm, vdm, directions = "16x32";
    Curvatures curvatures = MethodOptions().curvatures;
    int rank = 16, bits = 16;
    int transfer = 0;  // cells along x; 0: none
    TransferOptions traced;
    uint64_t memoryBytes = uint64_t{1} << 30;
    ReportOptions report;
};

struct InfoMeso {
    std::string file;
    ReportOptions report;
};

/// Parses "4x2", "64x64x16", "4,2": whole numbers, all above 0. Returns nothing when malformed.
std::vector<int> wholeNumbers(std::string_view text, char between) {
    std::vector<int> numbers;
    while (true) {
        int number = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        if (error != std::errc() || number < 1) return {};
        numbers.push_back(number);
        text.remove_prefix(size_t(end - text.data()));
        if (text.empty()) return numbers;
        if (text.front() != between) return {};
        text.remove_prefix(1);
    }
}

Error wrong(std::string message) { return {.code = ErrorCode::Usage, .message = std::move(message)}; }

Result<AssetOptions> optionsOf(const BuildMeso& c) {
    AssetOptions options;
    const std::vector<int> cones = wholeNumbers(c.cones, 'x');
    if (cones.size() != 2) return wrong("--cones must be like 4x2, not \"" + c.cones + "\"");
    options.distances.cones = {cones[0], cones[1]};
    options.distances.cap = c.cap;
    options.distances.rule = c.rule == "paper"        ? DistanceRule::Paper
                             : c.rule == "paper-safe" ? DistanceRule::PaperSafe
                                                      : DistanceRule::AnyPoint;
    options.factors = c.blocks == "none" ? std::vector<int>{} : wholeNumbers(c.blocks, ',');
    if (options.factors.empty() && c.blocks != "none")
        return wrong("--blocks must be like 4 or 4,2, or none, not \"" + c.blocks + "\"");
    options.crossings = c.crossings == "fitted" ? CrossingRule::Fitted : CrossingRule::Direct;
    options.samples = c.samples;
    options.withBoxes = !c.noBoxes, options.withPatches = !c.noPatches;
    options.withGuesses = c.guesses;
    if (c.transfer > 0) {
        options.transfer = c.traced;
        options.transfer->cells = c.transfer, options.transfer->seed = c.seed;
        options.transfer->memoryBytes = c.memoryBytes;
    }
    return options;
}

/// Reads what a displacement map is to be, of points like `text`; `extent` is the tile's.
Result<AssetOptions::Displacement> displacementOf(const BuildMeso& c, const std::string& text, glm::dvec3 extent) {
    AssetOptions::Displacement map{.traced = {}, .rank = c.rank, .bits = c.bits, .withVisibility = !c.noVisibility};
    const std::vector<int> points = wholeNumbers(text, 'x'), directions = wholeNumbers(c.directions, 'x');
    if (points.size() != 1 && points.size() != 3)
        return wrong("--gdm and --vdm must be like 32 or 64x64x32, not \"" + text + "\"");
    if (directions.size() != 2) return wrong("--directions must be like 16x32, not \"" + c.directions + "\"");
    map.traced.points = points.size() == 3 ? glm::ivec3(points[0], points[1], points[2])
                                           : glm::ivec3(points[0], std::lround(points[0] * extent.y),
                                                        std::lround(points[0] * extent.z) + 1);
    map.traced.directions = {directions[0], directions[1]};
    map.traced.memoryBytes = c.memoryBytes;
    return map;
}

/// Adds the displacement maps that are asked for.
Result<void> addMaps(const BuildMeso& c, glm::dvec3 extent, AssetOptions& options) {
    if (!c.gdm.empty()) {
        VCP_TRY_ASSIGN(options.gdm, displacementOf(c, c.gdm, extent));
    }
    if (c.vdm.empty()) return {};
    VCP_TRY_ASSIGN(options.vdm, displacementOf(c, c.vdm, extent));
    options.vdm->traced.curvatures = c.curvatures;
    options.vdm->withVisibility = c.curvatures.samples > 1;
    return {};
}

Result<glm::ivec3> cellsOf(const std::string& text, glm::dvec3 extent) {
    if (text == "auto") return glm::ivec3(0);
    const std::vector<int> n = wholeNumbers(text, 'x');
    if (n.size() == 3) return glm::ivec3(n[0], n[1], n[2]);
    if (n.size() != 1) return wrong("--grid must be like 64 or 64x64x16, not \"" + text + "\"");
    return glm::ivec3(n[0], std::max(1, int(std::lround(n[0] * extent.y))),
                      std::max(1, int(std::ceil(extent.z * n[0]))));
}

Result<void> readSource(const BuildMeso& c, Asset& asset) {
    const auto isIn = [&](const auto& names) { return std::ranges::find(names, c.source) != names.end(); };
    asset.name = std::filesystem::path(c.source).stem().string();
    if (isIn(solidNames())) {
        asset.solid = c.source, asset.seed = c.seed;
        return {};
    }
    std::string extension = std::filesystem::path(c.source).extension().string();
    std::ranges::transform(extension, extension.begin(), [](unsigned char letter) { return std::tolower(letter); });
    if (isIn(heightFieldNames()) || extension == ".png" || extension == ".exr") {
        VCP_TRY_ASSIGN(asset.heights, isIn(heightFieldNames())
                                          ? makeHeightField(c.source, c.texels, c.seed)
                                          : readHeightImage(c.source, c.height > 0 ? c.height : 0.1, heightStore()));
        if (c.height > 0) asset.heights->range = c.height;
        return {};
    }
    if (extension.empty())
        return wrong(fmt::format("\"{}\" is no file with an extension, and no procedural one: {}, {}", c.source,
                                 fmt::join(heightFieldNames(), ", "), fmt::join(solidNames(), ", ")));
    TileMeshOptions options{.up = c.up[0], .period = std::nullopt};
    if (!c.period.empty()) {
        const size_t comma = c.period.find(',');
        const auto x = parseLength(c.period.substr(0, comma)),
                   y = comma == std::string::npos ? x : parseLength(c.period.substr(comma + 1));
        if (!x || !y || x->isRelative || y->isRelative)
            return wrong("--period must be like 4 or 4,2 in the mesh's units, not \"" + c.period + "\"");
        options.period = glm::dvec2(x->value, y->value);
    }
    VCP_TRY_ASSIGN(auto mesh, readTileMesh(c.source, options));
    asset.triangles = std::move(mesh.triangles), asset.extent = mesh.extent;
    return {};
}

Json toJson(const std::string& file, uint64_t fileBytes, const Asset& a) {
    const auto cells = [](glm::ivec3 c) { return Json::array({c.x, c.y, c.z}); };
    Json json = {{"file", file}, {"version", kAssetVersion}, {"file_bytes", fileBytes}, {"name", a.name}};
    json["source"] = a.heights ? "height_field" : !a.solid.empty() ? "solid" : "mesh";
    json["extent"] = Json::array({a.extent.x, a.extent.y, a.extent.z});
    json["texels"] = a.heights ? Json::array({a.heights->size.x, a.heights->size.y}) : Json();
    json["solid"] = a.solid.empty() ? Json() : Json(a.solid);
    json["triangles"] = a.triangles.size();
    json["grid"] = a.occupancy ? cells(a.occupancy->grid.cells) : Json();
    json["occupied_cells"] = a.occupancy ? Json(a.occupancy->count()) : Json();
    json["cones"] = a.distances ? Json::array({a.distances->cones.azimuth, a.distances->cones.elevation}) : Json();
    json["distance_bytes"] = a.distances ? Json(a.distances->bytes()) : Json();
    json["blocks"] = a.factors;
    json["compressed_bytes"] = a.compressed ? Json(a.compressed->bytes()) : Json();
    json["texel_ratio"] = a.compressed ? Json(a.compressed->texelRatio()) : Json();
    json["box_bytes"] = a.boxes ? Json(a.boxes->bytes()) : Json();
    json["patches"] = a.patches ? Json(a.patches->patches.size()) : Json();
    json["cells_without_patch"] = a.patches ? Json(a.patches->cellsWithout) : Json();
    json["patch_bytes"] = a.patches ? Json(a.patches->bytes()) : Json();
    json["gdm"] = a.gdm ? Json::array({a.gdm->table.nodes.x, a.gdm->table.nodes.y, a.gdm->table.nodes.z}) : Json();
    json["gdm_rank"] = a.gdm ? Json(a.gdm->factors ? a.gdm->factors->rank : 0) : Json();
    json["gdm_bytes"] = a.gdm ? Json(a.gdm->bytes()) : Json();
    json["vdm"] = a.vdm ? Json::array({a.vdm->table.nodes.x, a.vdm->table.nodes.y}) : Json();
    json["vdm_curvatures"] = a.vdm ? Json(a.vdm->table.curvatures.samples) : Json();
    json["vdm_rank"] = a.vdm ? Json(a.vdm->factors ? a.vdm->factors->rank : 0) : Json();
    json["vdm_bytes"] = a.vdm ? Json(a.vdm->bytes()) : Json();
    json["guess_bytes"] = a.guesses ? Json(a.guesses->bytes()) : Json();
    json["transfer"] = a.transfer ? cells(a.transfer->grid.cells) : Json();
    json["transfer_cells"] = a.transfer ? Json(a.transfer->cells()) : Json();
    json["transfer_albedo"] = a.transfer ? Json(a.transfer->albedo) : Json();
    json["transfer_bytes"] = a.transfer ? Json(a.transfer->bytes()) : Json();
    json["field_bytes"] = a.field ? Json(a.field->bytes()) : Json();
    return json;
}

std::string summary(const std::string& file, uint64_t fileBytes, const Asset& a) {
    std::string text =
        fmt::format("{}: mesostructure asset version {}, {}\n", file, kAssetVersion, formatBytes(fileBytes));
    if (a.heights)
        text += fmt::format("  source      height field of {} x {} texels\n", a.heights->size.x, a.heights->size.y);
    else if (!a.solid.empty())
        text += fmt::format("  source      the solid {}, seed {}\n", a.solid, a.seed);
    else
        text += fmt::format("  source      mesh of {} triangles\n", formatCount(a.triangles.size()));
    text += fmt::format("  tile        {:.6g} x {:.6g}, {:.6g} high", a.extent.x, a.extent.y, a.extent.z);
    if (a.occupancy) {
        const glm::ivec3 n = a.occupancy->grid.cells;
        text += fmt::format("\n  grid        {} x {} x {} cells, {} with surface", n.x, n.y, n.z,
                            formatCount(a.occupancy->count()));
    }
    if (a.distances)
        text += fmt::format("\n  distances   {} x {} cones, {}", a.distances->cones.azimuth,
                            a.distances->cones.elevation, formatBytes(a.distances->bytes()));
    if (a.compressed)
        text += fmt::format("\n  compressed  {}: {:.2f} times fewer bytes, {:.2f} times fewer texels",
                            formatBytes(a.compressed->bytes()),
                            double(a.distances->bytes()) / double(a.compressed->bytes()), a.compressed->texelRatio());
    if (a.boxes) text += fmt::format("\n  boxes       {}", formatBytes(a.boxes->bytes()));
    if (a.patches)
        text += fmt::format("\n  patches     {}, {}; {} cells with surface have none",
                            formatCount(a.patches->patches.size()), formatBytes(a.patches->bytes()),
                            formatCount(a.patches->cellsWithout));
    if (a.gdm) {
        const DistanceTable& t = a.gdm->table;
        text += fmt::format("\n  gdm         {} x {} x {} points, {} x {} directions, {}, {}", t.nodes.x, t.nodes.y,
                            t.nodes.z, t.directions.thetas, t.directions.phis,
                            a.gdm->factors ? fmt::format("rank {}", a.gdm->factors->rank) : "all distances",
                            formatBytes(a.gdm->bytes()));
    }
    if (a.vdm) {
        const DistanceTable& t = a.vdm->table;
        text += fmt::format("\n  vdm         {} x {} points, {} x {} directions, {} curvatures, {}, {}", t.nodes.x,
                            t.nodes.y, t.directions.thetas, t.directions.phis, t.curvatures.samples,
                            a.vdm->factors ? fmt::format("rank {}", a.vdm->factors->rank) : "all distances",
                            formatBytes(a.vdm->bytes()));
    }
    if (a.guesses) text += fmt::format("\n  guesses     {}", formatBytes(a.guesses->bytes()));
    if (a.transfer) {
        const glm::ivec3 n = a.transfer->grid.cells;
        text += fmt::format("\n  transfer    {} x {} x {} cells, {} with surface, {} paths each, albedo {:.3g}, {}",
                            n.x, n.y, n.z, formatCount(a.transfer->cells()), a.transfer->paths, a.transfer->albedo,
                            formatBytes(a.transfer->bytes()));
    }
    if (a.field) {
        const glm::ivec3 n = a.field->grid.cells;
        text += fmt::format("\n  samples     {} x {} x {}, {}", n.x, n.y, n.z + 1, formatBytes(a.field->bytes()));
    }
    return text;
}

Result<int> writeBuilt(const BuildMeso& command, const Asset& asset, const OutputRules& rules,
                       std::chrono::steady_clock::time_point start) {
    VCP_TRY_ASSIGN(const auto bytes, writeAsset(command.out, asset, rules));
    Json json = toJson(command.out, bytes, asset);
    json["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (command.report.json)
        VCP_TRY(printJson(json));
    else
        VCP_TRY(printLine(summary(command.out, bytes, asset)));
    return 0;
}

Result<int> runBuild(const BuildMeso& command) {
    const auto start = std::chrono::steady_clock::now();
    VCP_TRY_ASSIGN(auto options, optionsOf(command));
    const OutputRules rules{.overwrite = command.overwrite, .inputs = {command.source}};
    VCP_TRY(checkOutput(command.out, OutputKind::Asset, rules));
    Asset asset;
    VCP_TRY(readSource(command, asset));
    const auto named = [&](Error error) {
        if (error.file.empty() && error.code != ErrorCode::Usage) error.file = command.source;
        return error;
    };
    if (command.onlyHeights) {
        if (!asset.heights) return wrong("--only-heights is for height maps");
        asset.extent = asset.heights->extent();
        return writeBuilt(command, asset, rules, start);
    }
    // The shape gives the extent, by which --grid N is measured.
    const auto shape = shapeOf(asset);
    if (!shape) return named(shape.error());
    VCP_TRY_ASSIGN(options.cells, cellsOf(command.grid, (*shape)->extent()));
    VCP_TRY(addMaps(command, (*shape)->extent(), options));
    const InterruptScope catching;
    ProgressDisplay display(command.report.progressStyle(), stderr);
    const auto sharedOut = [&display](const char* stage) {
        return [&display, stage](size_t count, const std::function<void(size_t first, size_t last)>& fill) {
            return shareOut(count, fill, [&display, stage](double part) {
                display.update(stage, part);
                return !interrupted();
            });
        };
    };
    if (options.gdm) options.gdm->traced.shareOut = sharedOut("distances");
    if (options.vdm) options.vdm->traced.shareOut = sharedOut("view-dependent distances");
    if (options.transfer) options.transfer->shareOut = sharedOut("light");
    if (const auto built = buildAsset(asset, options); !built) return named(built.error());
    display.finish();
    return writeBuilt(command, asset, rules, start);
}

Result<int> runInfo(const InfoMeso& command) {
    VCP_TRY_ASSIGN(const auto asset, readAsset(command.file, heightStore()));
    std::error_code ignored;
    const uint64_t bytes = std::filesystem::file_size(command.file, ignored);
    if (command.report.json)
        VCP_TRY(printJson(toJson(command.file, bytes, asset)));
    else
        VCP_TRY(printLine(summary(command.file, bytes, asset)));
    return 0;
}

RunCommand addMesoBuild(CLI::App& meso) {
    auto command = std::make_shared<BuildMeso>();
    CLI::App* app = meso.add_subcommand("build", "Make an asset from a height map, a mesh, or a procedural one");
    app->add_option("SOURCE", command->source,
                    fmt::format("A PNG or EXR of heights, a closed mesh, or one of {}; {}",
                                fmt::join(heightFieldNames(), ", "), fmt::join(solidNames(), ", ")))
        ->type_name("")
        ->required();
    app->add_option("-o,--output", command->out, "The asset to write")
        ->type_name("OUT.meso")
        ->required()
        ->check([](const std::string& name) {
            // Scenes know an asset by its ending.
            return name.ends_with(".meso") ? std::string() : fmt::format("must end in .meso, not \"{}\"", name);
        });
    addOverwriteOption(*app, command->overwrite);
    app->add_option("--height", command->height,
                    "Height of a PNG's white, of an EXR's greatest value over its least, in tile edges [0.1, or the "
                    "procedural one's own]")
        ->type_name("H")
        ->check(CLI::Range(1e-4, 16.0));
    app->add_option("--texels", command->texels, "Texels an edge of a procedural height field")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(8, kMaxMapEdge));
    app->add_option("--seed", command->seed, "Of procedural ones")->type_name("N")->capture_default_str();
    app->add_option("--grid", command->grid, "Cells: 64 along x, or 64x64x16")->type_name("N")->capture_default_str();
    app->add_option("--samples", command->samples, "Samples of a solid's distance a cell, along each axis")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 16));
    app->add_option("--cones", command->cones, "Directional distance maps: azimuths x elevations")
        ->type_name("MxN")
        ->capture_default_str();
    app->add_option("--cap", command->cap, "Longest distance that is stored, in tile edges")
        ->type_name("D")
        ->capture_default_str()
        ->check(CLI::Range(1e-3, 16.0));
    app->add_option("--distances", command->rule,
                    "any-point: conservative; paper: as published, which oversteps; paper-safe: less a diagonal")
        ->capture_default_str()
        ->check(CLI::IsMember({"any-point", "paper", "paper-safe"}));
    app->add_option("--blocks", command->blocks,
                    "Edges of the compression's blocks, coarse first: 4 is two levels, 4,2 three; none")
        ->type_name("N,N")
        ->capture_default_str();
    app->add_option("--crossings", command->crossings,
                    "Points of the quadrics: found on the cells' edges, or of fitted quadrics as published")
        ->capture_default_str()
        ->check(CLI::IsMember({"direct", "fitted"}));
    app->add_flag("--only-heights", command->onlyHeights,
                  "Of a height map nothing but its heights: all that the method remesh needs, and the only way above "
                  "4096 texels along an edge");
    app->add_flag("--no-boxes", command->noBoxes, "Without octant boxes");
    app->add_flag("--no-patches", command->noPatches, "Without quadrics");
    app->add_option("--gdm", command->gdm,
                    "With a generalized displacement map of so many points along x, or 64x64x32 (methods gdm, "
                    "gdm-visibility)")
        ->type_name("N");
    app->add_option(
           "--vdm", command->vdm,
           "With a view-dependent displacement map of so many points along x, over bases of several curvatures "
           "(method vdm)")
        ->type_name("N");
    app->add_option("--curvatures", command->curvatures.samples,
                    "Its curvatures of the base, an odd number; 1: of flat bases")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, kMostCurvatureSamples));
    app->add_option("--curvature", command->curvatures.most, "The greatest of them, slab heights over a radius")
        ->type_name("C")
        ->capture_default_str()
        ->check(CLI::Range(1e-3, kMostCurvature));
    app->add_option("--directions", command->directions, "Directions of the maps: elevations x azimuths")
        ->type_name("MxN")
        ->capture_default_str();
    app->add_option("--rank", command->rank, "Their terms; 0 keeps all distances")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(0, kMostRank));
    app->add_option("--bits", command->bits, "Bits of their values")
        ->capture_default_str()
        ->check(CLI::IsMember({8, 16}));
    app->add_flag("--no-visibility", command->noVisibility,
                  "Without the bits of --gdm that say what is hit, as published");
    app->add_flag("--guesses", command->guesses, "With guesses of safe lengths (method gdm-safe)");
    app->add_option(
           "--transfer", command->transfer,
           "With what the walls do to light from everywhere, in so many cells along x (\"transfer\" of scenes)")
        ->type_name("N")
        ->check(CLI::Range(1, kMaxGridEdge));
    app->add_option("--albedo", command->traced.albedo, "Its walls give back so much of the light that they get")
        ->type_name("A")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1.0));
    app->add_option("--paths", command->traced.paths, "Paths of light that are traced for each of its cells")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 1 << 24));
    addMemory(*app, command->memoryBytes, "Memory for the maps' distances and for the light [1G]");
    app->add_option("--up", command->up, "The mesh's axis out of the surface")
        ->capture_default_str()
        ->check(CLI::IsMember({"x", "y", "z"}));
    app->add_option("--period", command->period,
                    "After how much the mesh repeats, in its units [it stands alone in its tile]")
        ->type_name("X,Y");
    addJsonOption(*app, command->report);
    addProgressOption(*app, command->report);
    return [command] { return runBuild(*command); };
}

/// Says where the command of that name went, whatever it is given.
RunCommand addMesoRender(CLI::App& meso) {
    CLI::App* app = meso.add_subcommand("render", "Moved: `vcp render SCENE.json`, with --methods")->group("");
    app->allow_extras();
    return []() -> Result<int> {
        return wrong(
            "surfaces stand in a scene file now (docs/scenes.md): `vcp render SCENE.json -o OUT.png`, with --methods "
            "A,B side by side, --shading steps for heat, --camera AZIMUTH,ELEVATION");
    };
}

}  // namespace

Command addMeso(CLI::App& vcp) {
    CLI::App* app = vcp.add_subcommand("meso", "Make mesostructure: fine relief for the surfaces of scenes");
    app->require_subcommand(1);
    const RunCommand build = addMesoBuild(*app), render = addMesoRender(*app);
    const RunCommand base = addMesoBase(*app), bake = addMesoBake(*app);
    const CLI::App *renderApp = app->get_subcommand("render"), *baseApp = app->get_subcommand("base"),
                   *bakeApp = app->get_subcommand("bake");
    auto info = std::make_shared<InfoMeso>();
    CLI::App* infoApp = app->add_subcommand("info", "Say what is in an asset");
    infoApp->add_option("FILE", info->file, "An asset made by `vcp meso build`")->type_name("")->required();
    addJsonOption(*infoApp, info->report);
    return {app, [=] {
                return infoApp->parsed()     ? runInfo(*info)
                       : renderApp->parsed() ? render()
                       : baseApp->parsed()   ? base()
                       : bakeApp->parsed()   ? bake()
                                             : build();
            }};
}

}  // namespace vcp
