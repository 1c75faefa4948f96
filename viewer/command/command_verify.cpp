// vcp verify: is every byte of a .vcp intact? With --against: how far are its surface and the mesh apart?
#include <algorithm>

#include <fmt/format.h>

#include "builder/measure/surface_distance.h"
#include "octree/image/image_assembly.h"
#include "octree/vcp_verify.h"
#include "streaming/http_reader.h"
#include "streaming/read_ahead.h"
#include "streaming/shard/shard_folder.h"
#include "viewer/command/build_arguments.h"
#include "viewer/command/commands.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/source_arguments.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

struct VerifyCommand {
    std::string file;
    std::vector<std::string> against;
    bool masks = true, allowOutside = false;
    uint64_t samples = 200'000;
    uint32_t level = UINT32_MAX;
    unsigned threads = 0;
    SourceAccess source;
    ReportOptions report;
};

struct ByteProgress {
    ProgressDisplay* display;
    uint64_t size;
};

bool showBytes(void* user, uint64_t done) {
    const auto* progress = static_cast<const ByteProgress*>(user);
    progress->display->update("checking", double(done) / double(std::max<uint64_t>(progress->size, 1)));
    return !interrupted();
}

/// Checks header, directory and every byte of the file; of shards also what each has beside.
Result<Dataset> checkBytes(const ByteReader& reader, const ShardedReader* shards, ProgressStyle style) {
    auto dataset = readDataset(reader);
    if (!dataset) return dataset;
    ProgressDisplay display(style, stderr);
    if (shards != nullptr)
        VCP_TRY(verifyShards(*shards, [&](double share) {
            display.update("checking the shards", share);
            return !interrupted();
        }));
    ByteProgress progress{&display, reader.size()};
    VCP_TRY(verifyFile(reader, showBytes, &progress));
    return dataset;
}

/// Reads the images of a file; none of those that take too much memory, with a warning.
Result<ImageSet> imagesOf(const ByteReader& file, const Dataset& dataset) {
    constexpr uint64_t kMostBytes = uint64_t{4} << 30;
    if (!dataset.hasImages()) return ImageSet();
    VCP_TRY_ASSIGN(const auto pieces, ImagePieces::read(file, dataset.header.images));
    if (pieces->bytes() <= kMostBytes) return readAllImages(file, pieces);
    warnOnTerminal(
        fmt::format("{}: its images take {} MiB, and colours are compared where they take {} at most; the "
                    "colours of vertices are compared",
                    file.name(), pieces->bytes() >> 20, kMostBytes >> 20));
    return ImageSet();
}

Result<SurfaceDistance> measure(const VerifyCommand& command, const std::shared_ptr<const ByteReader>& reader) {
    ProgressDisplay display(command.report.progressStyle(), stderr);
    display.update("reading the mesh", 0);
    const std::vector<std::filesystem::path> meshes(command.against.begin(), command.against.end());
    MeshPaint paint;
    LoadOptions load;
    load.masks = command.masks;
    load.allowOutside = command.allowOutside;
    load.chunk = [&](size_t file, const MeshStream& stream, const MeshChunk& chunk) { paint.add(file, stream, chunk); };
    VCP_TRY_ASSIGN(const auto mesh, loadMesh(meshes, load));
    display.update("sorting the mesh", 0.1);
    const MeshBvh bvh(mesh);
    display.update("reading the level", 0.2);
    VCP_TRY_ASSIGN(auto cache, PageCache::open(reader));
    const uint32_t levels = cache.dataset().header.levels;
    if (command.level != UINT32_MAX && command.level >= levels)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("has no level {}, only 0 to {}", command.level, levels - 1),
                     .file = command.file};
    VCP_TRY(cache.loadLevel(std::min(command.level, levels - 1)));
    if (cache.dataset().hasColour()) paint.loadImages();
    VCP_TRY_ASSIGN(const auto images, imagesOf(*reader, cache.dataset()));
    for (const std::string& warning : paint.warnings()) warnOnTerminal(warning);

    SurfaceDistanceOptions options;
    options.samples = command.samples;
    options.level = command.level;
    options.threads = command.threads;
    options.paint = &paint;
    options.images = &images;
    options.progress = [&](double fraction) {
        display.update("measuring", 0.3 + 0.7 * fraction);
        return !interrupted();
    };
    return measureSurfaceDistance(cache, bvh, options);
}

/// Whether a distance is within its bound; measured ones are kept in single precision, whose rounding is forgiven.
bool isWithin(const SurfaceDistance& distance) {
    const double bound = distance.certifiedErrorMax * (1 + 1e-6);
    return distance.meshToSurface.max <= bound && distance.surfaceToMesh.max <= bound;
}

Json toJson(const Quantiles& q) { return {{"p50", q.p50}, {"p95", q.p95}, {"p99", q.p99}, {"max", q.max}}; }

void addDistances(Json& json, const SurfaceDistance& distance) {
    json["mesh_to_surface"] = toJson(distance.meshToSurface);
    json["surface_to_mesh"] = toJson(distance.surfaceToMesh);
    json["mesh_to_surface_cells"] = toJson(inCells(distance.meshToSurface, distance.cell));
    json["surface_to_mesh_cells"] = toJson(inCells(distance.surfaceToMesh, distance.cell));
    json["normal_degrees"] = toJson(distance.normalDegrees);
    if (distance.colourSamples > 0) json["colour_delta_e"] = toJson(distance.colourDifference);
    if (const SlabColours& slabs = distance.slabColours; slabs.max > 0)
        json["slab_colours"] = {{"samples", slabs.samples},
                                {"rms", slabs.rms},
                                {"colour_error_p95", slabs.p95},
                                {"colour_error_max", slabs.max}};
    json["cell"] = distance.cell;
    json["certified_error_max"] = distance.certifiedErrorMax;
    json["samples"] = distance.samples;
}

std::string row(const char* name, const Quantiles& world, double cell) {
    const Quantiles cells = inCells(world, cell);
    return fmt::format("  {:<16} {:>11} {:>11} {:>11} {:>11}\n  {:<16} {:>11.5f} {:>11.5f} {:>11.5f} {:>11.5f}\n", name,
                       formatLength(world.p50), formatLength(world.p95), formatLength(world.p99),
                       formatLength(world.max), "  in cells", cells.p50, cells.p95, cells.p99, cells.max);
}

std::string distanceTable(const SurfaceDistance& distance) {
    std::string text = fmt::format("\n  {:<16} {:>11} {:>11} {:>11} {:>11}   ({} samples)\n", "distance", "p50", "p95",
                                   "p99", "max", formatCount(distance.samples));
    text += row("mesh to surface", distance.meshToSurface, distance.cell);
    text += row("surface to mesh", distance.surfaceToMesh, distance.cell);
    const Quantiles& degrees = distance.normalDegrees;
    text += fmt::format("  {:<16} {:>11.2f} {:>11.2f} {:>11.2f} {:>11.2f}\n", "normals, degrees", degrees.p50,
                        degrees.p95, degrees.p99, degrees.max);
    if (distance.colourSamples > 0) {
        const Quantiles& colour = distance.colourDifference;
        text += fmt::format("  {:<16} {:>11.2f} {:>11.2f} {:>11.2f} {:>11.2f}\n", "colour, \u0394E", colour.p50,
                            colour.p95, colour.p99, colour.max);
    }
    if (const SlabColours& slabs = distance.slabColours; slabs.max > 0)
        text += fmt::format("  {:<16} {:>11.2f}; pages say {:.2f} of 95 %, {:.2f} of all\n", "  of slabs, rms",
                            slabs.rms, slabs.p95, slabs.max);
    text += fmt::format("  {:<16} {:>47}\n  {:<16} {:>47.5f}", "certified", formatLength(distance.certifiedErrorMax),
                        "  in cells", distance.certifiedErrorMax / distance.cell);
    return text;
}

Error exceeds(const VerifyCommand& command, const SurfaceDistance& distance) {
    return {ErrorCode::InvalidInput,
            fmt::format("the surface and the mesh are {} apart, more than the certified {}; is it the mesh the file "
                        "was built from?",
                        formatLength(std::max(distance.meshToSurface.max, distance.surfaceToMesh.max)),
                        formatLength(distance.certifiedErrorMax)),
            command.file};
}

/// Reports a broken file: with --json a program learns it from `ok`, and a person from stderr.
Result<int> broken(const VerifyCommand& command, const Error& error) {
    if (command.report.json && error.code != ErrorCode::Cancelled)
        VCP_TRY(printJson({{"ok", false}, {"error", error.line()}}));
    return error;
}

Result<int> run(const VerifyCommand& command) {
    if (isHttpUrl(command.file) && !command.against.empty())
        return Error{.code = ErrorCode::Usage, .message = "--against needs a local file"};
    const InterruptScope catching;
    VCP_TRY_ASSIGN(const auto reader, openReader(command.file, command.source));
    const ReadAhead ahead(reader);
    const auto* shards = dynamic_cast<const ShardedReader*>(reader.get());
    const auto dataset = checkBytes(ahead, shards, command.report.progressStyle());
    if (!dataset) return broken(command, dataset.error());

    Json json = {{"ok", true}, {"pages", dataset->header.pages}, {"bytes", dataset->header.fileBytes}};
    std::string text = fmt::format("{}: intact, {}, {}", ahead.name(), formatCount(dataset->header.pages, "subvolume"),
                                   formatBytes(dataset->header.fileBytes));
    if (shards != nullptr) {
        json["shards"] = shards->manifest().header().shards;
        text += fmt::format(" in {}", formatCount(shards->manifest().header().shards, "shard"));
    }
    bool within = true;
    std::optional<SurfaceDistance> distance;
    if (!command.against.empty()) {
        VCP_TRY_ASSIGN(distance, measure(command, reader));
        within = isWithin(*distance);
        json["ok"] = within;
        addDistances(json, *distance);
        text += distanceTable(*distance);
    }
    if (command.report.json)
        VCP_TRY(printJson(json));
    else
        VCP_TRY(printLine(text));
    if (!within) return exceeds(command, *distance);
    return 0;
}

}  // namespace

Command addVerify(CLI::App& vcp) {
    auto command = std::make_shared<VerifyCommand>();
    CLI::App* app = vcp.add_subcommand("verify", "Check every byte of a .vcp file, and its surface against the mesh");
    app->add_option("FILE", command->file, "A .vcp file, a folder of shards, or the http(s) address of either")
        ->type_name("")
        ->required();
    beginGroup(*app, help_group::kMeasured);
    app->add_option("--against", command->against, "The meshes it was built from: measures the distance, both ways")
        ->type_name("MESH");
    addMasks(*app, command->masks);
    addAllowOutside(*app, command->allowOutside);
    app->add_option("--samples", command->samples, "Samples, each way")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 1'000'000'000));
    app->add_option("--level", command->level, "Level to measure, 0 the coarsest [the finest]")->type_name("N");
    app->add_option("--threads", command->threads, "Threads that measure [one a processor]")
        ->type_name("N")
        ->check(CLI::Range(1, 1024));
    addSourceSettings(*app, command->source);
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
