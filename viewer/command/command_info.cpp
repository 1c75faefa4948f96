// vcp info: what is in a .vcp, from its header and directory alone.
#include <fmt/format.h>

#include "streaming/shard/sharded_reader.h"
#include "viewer/command/commands.h"
#include "viewer/command/source_arguments.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

struct InfoCommand {
    std::vector<std::string> files;
    SourceAccess source;
    ReportOptions report;
};

/// Sums over the pages of a level.
struct LevelSums {
    uint64_t storedBytes = 0, colourStoredBytes = 0, pageBytes = 0, leaves = 0, slabLeaves = 0, hardLeaves = 0;
    uint32_t colourErrorP95 = 0, colourErrorMax = 0;  ///< of the page that has most, as its entry has them
};

LevelSums sumsOf(const Dataset& dataset, uint32_t level) {
    LevelSums sums;
    const LevelRow& row = dataset.header.level[level];
    for (uint64_t i = row.firstEntry; i < row.firstEntry + row.pages; ++i) {
        const PageEntry& page = dataset.pages[i];
        sums.storedBytes += uint64_t(page.storedBytes) + page.colourStoredBytes;
        sums.colourStoredBytes += page.colourStoredBytes;
        sums.pageBytes += uint64_t(page.pageBytes) + page.colourBytes;
        sums.leaves += page.leaves;
        sums.slabLeaves += page.slabLeaves;
        sums.hardLeaves += page.hardLeaves;
        sums.colourErrorP95 = std::max(sums.colourErrorP95, uint32_t{page.colourErrorP95});
        sums.colourErrorMax = std::max(sums.colourErrorMax, uint32_t{page.colourErrorMax});
    }
    return sums;
}

/// Bytes of all pages in the file.
struct StoredBytes {
    uint64_t geometry = 0, colour = 0;
};

StoredBytes storedBytesOf(const Dataset& dataset) {
    StoredBytes bytes;
    for (const PageEntry& page : dataset.pages) {
        bytes.geometry += page.storedBytes;
        bytes.colour += page.colourStoredBytes;
    }
    return bytes;
}

const char* methodName(Method method) { return method == Method::Paper ? "paper" : "certified"; }

/// Returns how many files a dataset is cut into; 0 where it is one.
uint64_t shardsOf(const ByteReader& reader) {
    const auto* sharded = dynamic_cast<const ShardedReader*>(&reader);
    return sharded != nullptr ? sharded->manifest().header().shards : 0;
}

Json toJson(const std::string& file, const Dataset& dataset, uint64_t shards) {
    const FileHeader& h = dataset.header;
    Json levels = Json::array();
    const StoredBytes bytes = storedBytesOf(dataset);
    const bool hasErrors = dataset.hasColourErrors();
    for (uint32_t level = 0; level < h.levels; ++level) {
        const LevelSums sums = sumsOf(dataset, level);
        const auto deltaE = [&](uint32_t code) { return hasErrors ? Json(colourErrorOf(code)) : Json(); };
        levels.push_back({{"level", level},
                          {"cell", dataset.cellOf(level)},
                          {"subvolumes", h.level[level].pages},
                          {"stored_bytes", sums.storedBytes},
                          {"colour_stored_bytes", sums.colourStoredBytes},
                          {"page_bytes", sums.pageBytes},
                          {"leaves", sums.leaves},
                          {"slab_leaves", sums.slabLeaves},
                          {"hard_leaves", sums.hardLeaves},
                          {"certified_error_max", h.level[level].certifiedError},
                          {"colour_error_p95", deltaE(sums.colourErrorP95)},
                          {"colour_error_max", deltaE(sums.colourErrorMax)}});
    }
    return {{"file", file},
            {"version", h.version},
            {"method", methodName(h.method)},
            {"file_bytes", h.fileBytes},
            {"shards", shards},
            {"triangles", h.triangles},
            {"degenerate_triangles", h.degenerateTriangles},
            {"vertices", h.vertices},
            {"parts", dataset.hasParts() ? Json(h.parts) : Json()},
            {"closed_parts", dataset.hasParts() ? Json(h.closedParts) : Json()},
            {"open_edges", dataset.hasParts() ? Json(h.openEdges) : Json()},
            {"colour", dataset.hasColour()},
            {"geometry_stored_bytes", bytes.geometry},
            {"colour_stored_bytes", bytes.colour},
            {"images", h.images.images},
            {"materials", h.images.materials},
            {"channels", h.images.channels > 0},
            {"images_stored_bytes", h.images.bytes},
            {"bounds_min", Json::array({h.boundsMin[0], h.boundsMin[1], h.boundsMin[2]})},
            {"bounds_max", Json::array({h.boundsMax[0], h.boundsMax[1], h.boundsMax[2]})},
            {"origin", Json::array({h.origin[0], h.origin[1], h.origin[2]})},
            {"cell", h.cell},
            {"cells_per_edge", 1u << h.log2Cells},
            {"levels", h.levels},
            {"subvolumes", h.pages},
            {"leaves", h.leaves},
            {"hard_leaves", h.hardLeaves},
            {"error_target", h.errorTarget},
            {"certified_error_max", h.method == Method::Certified ? Json(h.certifiedErrorMax) : Json()},
            {"level", levels}};
}

std::string paperLine(const PaperParameters& p) {
    return fmt::format(
        "  method      paper: band {:g} cells, {}, {}, {} vectors, {} empty nodes\n", p.band,
        p.mergeThreshold < 0 ? std::string("not merged") : fmt::format("merged below {:g} cells", p.mergeThreshold),
        p.growRounds < 0 ? std::string("exact points") : fmt::format("{} rounds of region growing", p.growRounds),
        p.packing == uint32_t(PaperPacking::Spherical) ? "spherical" : "octahedral",
        p.safeEmpty != 0 ? "safe" : "published");
}

std::string partsLine(const FileHeader& h) {
    const char* kind = h.closedParts == h.parts ? "closed" : h.closedParts == 0 ? "open" : "mixed";
    return fmt::format("  parts       {}: {} closed, {} open with {}\n", kind, formatCount(h.closedParts),
                       formatCount(h.parts - h.closedParts), formatCount(h.openEdges, "open edge"));
}

std::string bytesLine(const Dataset& dataset) {
    const StoredBytes bytes = storedBytesOf(dataset);
    std::string line = fmt::format("  stored      {} of geometry, {} of colour", formatBytes(bytes.geometry),
                                   formatBytes(bytes.colour));
    const ImagesPlace& images = dataset.header.images;
    if (dataset.hasImages())
        line += fmt::format(", {} of {} in {}", formatBytes(images.bytes), formatCount(images.images, "image"),
                            formatCount(images.materials, "material")) +
                (images.channels > 0 ? " with channels" : "");
    return line + '\n';
}

std::string summary(const std::string& file, const Dataset& dataset, uint64_t shards) {
    const FileHeader& h = dataset.header;
    std::string text = fmt::format("{}: .vcp version {}, {}{}\n", file, h.version, formatBytes(h.fileBytes),
                                   shards > 0 ? " in " + formatCount(shards, "shard") : "");
    const char* colour = dataset.hasColour() ? "with colour" : "no colour";
    // Shards do not count: what they say must not depend on the rest of the scan.
    text += h.triangles == 0 ? fmt::format("  mesh        a part of a scan, {}\n", colour)
                             : fmt::format("  mesh        {} ({} without area), {}, {}\n",
                                           formatCount(h.triangles, "triangle"), formatCount(h.degenerateTriangles),
                                           formatCount(h.vertices, "vertex", "vertices"), colour);
    text += bytesLine(dataset);
    if (dataset.hasParts()) text += partsLine(h);
    text += fmt::format("  bounds      {:.9g} {:.9g} {:.9g}  to  {:.9g} {:.9g} {:.9g}\n", h.boundsMin[0],
                        h.boundsMin[1], h.boundsMin[2], h.boundsMax[0], h.boundsMax[1], h.boundsMax[2]);
    text += fmt::format("  origin      {:.9g} {:.9g} {:.9g}\n", h.origin[0], h.origin[1], h.origin[2]);
    text += fmt::format("  cell        {}, subvolumes of {}^3 cells\n", formatLength(h.cell), 1u << h.log2Cells);
    if (h.method == Method::Paper)
        text += paperLine(h.paper) + "  error       nothing is certified\n";
    else
        text +=
            fmt::format("  error       certified {} ({:.3f} cells), asked for {}\n", formatLength(h.certifiedErrorMax),
                        h.certifiedErrorMax / h.cell, formatLength(h.errorTarget));
    const bool hasErrors = dataset.hasColourErrors();
    text += fmt::format("\n  {:>5} {:>11} {:>11} {:>11} {:>11} {:>13} {:>13} {:>13} {:>15}{}\n", "level", "cell",
                        "subvolumes", "stored", "in memory", "leaves", "slabs", "hard", "certified error",
                        hasErrors ? "  colour \u0394E, max" : "");
    for (uint32_t level = 0; level < h.levels; ++level) {
        const LevelSums sums = sumsOf(dataset, level);
        const std::string colours = hasErrors && sums.slabLeaves > 0
                                        ? fmt::format(" {:>10.2f}, {:.2f}", colourErrorOf(sums.colourErrorP95),
                                                      colourErrorOf(sums.colourErrorMax))
                                        : "";
        text += fmt::format("  {:>5} {:>11} {:>11} {:>11} {:>11} {:>13} {:>13} {:>13} {:>15}{}\n", level,
                            formatLength(dataset.cellOf(level)), formatCount(h.level[level].pages),
                            formatBytes(sums.storedBytes), formatBytes(sums.pageBytes), formatCount(sums.leaves),
                            formatCount(sums.slabLeaves), formatCount(sums.hardLeaves),
                            formatLength(h.level[level].certifiedError), colours);
    }
    text.pop_back();
    return text;
}

/// Prints what there is to say of a file, or returns it for --json.
Result<Json> describe(const std::string& file, const InfoCommand& command) {
    VCP_TRY_ASSIGN(const auto reader, openReader(file, command.source));
    VCP_TRY_ASSIGN(const auto dataset, readDataset(*reader));
    const uint64_t shards = shardsOf(*reader);
    if (command.report.json) return toJson(reader->name(), dataset, shards);
    VCP_TRY(printLine(summary(reader->name(), dataset, shards)));
    return Json();
}

Result<int> run(const InfoCommand& command) {
    const InterruptScope catching;
    const bool isOne = command.files.size() == 1;
    Json described = Json::array();
    size_t failed = 0;
    for (const std::string& file : command.files) {
        if (!command.report.json && &file != &command.files.front()) VCP_TRY(printLine(""));
        auto json = describe(file, command);
        if (!json) {
            // A file that cannot be read does not keep the others from being described.
            if (isOne || json.error().code == ErrorCode::Cancelled) return json.error();
            warnOnTerminal(json.error().line());
            ++failed;
            json = Json{{"error", json.error().line()}};
        }
        described.push_back(*std::move(json));
    }
    if (command.report.json) VCP_TRY(printJson(isOne ? described.front() : Json{{"files", described}}));
    if (failed == 0) return 0;
    return Error{.code = ErrorCode::InvalidInput,
                 .message = fmt::format("{} of {} files could not be read", failed, command.files.size())};
}

}  // namespace

Command addInfo(CLI::App& vcp) {
    auto command = std::make_shared<InfoCommand>();
    CLI::App* app = vcp.add_subcommand("info", "Say what is in .vcp files");
    app->add_option("FILE", command->files, ".vcp files, folders of shards, or the http(s) addresses of either")
        ->type_name("")
        ->required();
    addSourceSettings(*app, command->source);
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
