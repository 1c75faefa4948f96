#include "builder/parts/part_dealing.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "builder/deal.h"
#include "builder/estimate.h"
#include "builder/image_store.h"
#include "builder/lattice_soup.h"
#include "builder/page_plan.h"
#include "builder/parts/part_materials.h"
#include "builder/spill/journal.h"
#include "builder/texture/material_colours.h"

namespace vcp {

namespace {

using nlohmann::json;

json jsonOf(const SoupTally& tally) {
    SoupMeasures m = tally.counted;
    // A part without triangles has no bounds, and numbers must be finite.
    if (m.triangles == 0) m.boundsMin = m.boundsMax = glm::dvec3(0);
    return {{"measures", vcp::jsonOf(m)},
            {"area", tally.area.words()},
            {"length", tally.length.words()},
            {"too large", tally.isTooLarge},
            {"content", tally.content}};
}

std::optional<SoupTally> tallyFrom(const json& j) {
    SoupTally tally;
    auto counted = measuresFrom(j.at("measures"));
    if (!counted) return std::nullopt;
    if (counted->triangles == 0) {
        counted->boundsMin = tally.counted.boundsMin;
        counted->boundsMax = tally.counted.boundsMax;
    }
    tally.counted = *counted;
    tally.area.add(j.at("area").get<std::vector<uint64_t>>());
    tally.length.add(j.at("length").get<std::vector<uint64_t>>());
    tally.isTooLarge = j.at("too large").get<bool>();
    tally.content = j.at("content").get<uint64_t>();
    return tally;
}

std::vector<InputShare> sharesOf(const PartPlan& plan) {
    std::vector<uint64_t> bytes;
    for (const PlannedInput& each : plan.inputs) bytes.push_back(each.bytes);
    return inputShares(bytes, plan.parts);
}

json jsonOf(const PlannedInput& file) { return {bytesJson(file.path.native()), file.stamp, file.hash, file.bytes}; }
PlannedInput plannedFrom(const json& j) {
    return {textFromBytes(j.at(0)), j.at(1).get<std::string>(), j.at(2).get<uint64_t>(), j.at(3).get<uint64_t>()};
}

/// What the parts of `read` left: all of it, or what goes to one part of `deal`.
class ReadParts {
public:
    static Result<ReadParts> open(const PartSetting& setting, std::optional<unsigned> dealt) {
        ReadParts all;
        for (unsigned k = 0; k < setting.plan.parts; ++k) {
            VCP_TRY_ASSIGN(auto part, openPart({setting.folder, "read", k}));
            all.spaces_.push_back(std::move(part.space));
            VCP_TRY(all.add(part.fields, *all.spaces_.back(), setting.plan.parts, dealt));
        }
        return all;
    }

    SoupTally tally;
    std::vector<uint64_t> contents;  ///< of each part
    std::vector<Material> materials;
    std::vector<std::string> warnings;
    std::vector<SideFile> sideFiles;
    std::vector<SoupShare> soups;

private:
    Result<void> add(const json& fields, TempSpace& space, unsigned parts, std::optional<unsigned> dealt) {
        const auto wanted = fields.at("for").get<std::vector<unsigned>>();
        const bool isWanted = dealt ? std::ranges::find(wanted, *dealt) != wanted.end() : !wanted.empty();
        const auto before = uint32_t(materials.size());
        VCP_TRY_ASSIGN(const auto more, recordedMaterials(fields.at("materials"), space, isWanted));
        materials.insert(materials.end(), more.begin(), more.end());
        const auto own = tallyFrom(fields.at("tally"));
        if (!own) return damagedTempFile(space.folder().path() / kJournalName);
        tally.add(*own);
        contents.push_back(own->content);
        const auto said = fields.at("warnings").get<std::vector<std::string>>();
        warnings.insert(warnings.end(), said.begin(), said.end());
        for (const json& each : fields.at("side files")) {
            const PlannedInput file = plannedFrom(each);
            if (!named_.insert(file.path).second) continue;
            // Images are read anew, maybe hours later and elsewhere.
            VCP_TRY(checkInput(file));
            sideFiles.push_back({file.path, file.stamp});
        }
        if (!isWanted) return {};
        auto soup = std::make_unique<Soup>(space, 0, parts);
        VCP_TRY(reopenBins(fields, "floats", soup->floats.raw()));
        VCP_TRY(reopenBins(fields, "doubles", soup->doubles.raw()));
        soups.push_back({.soup = *soup, .bin = dealt, .materialsBefore = before});
        soups_.push_back(std::move(soup));
        return {};
    }

    std::vector<std::unique_ptr<TempSpace>> spaces_;
    std::vector<std::unique_ptr<Soup>> soups_;
    std::set<std::filesystem::path> named_;
};

/// Checks the free space for the stages to come: of a part that finds no room hours have gone by.
Result<void> checkSpace(const PartSetting& setting, const SoupMeasures& measures, uint64_t imageBytes) {
    return checkBuildSpace(
        {setting.folder, expectedTempBytes(measures.triangles, 0, imageBytes, 0), "folder for the plan"},
        setting.plan.options.output, expectedFileBytes(measures.triangles) + imageBytes);
}

/// Codes the images that the file keeps; records where they are, and what the file has of each material.
Result<void> keepImages(const PartSetting& setting, const ReadParts& read, const MemoryPlan& memory, NewPart& made,
                        std::vector<std::string>& warnings, json& fields) {
    PageSpool images(made.space(memory.tempBytes), 0, "image");
    VCP_TRY_ASSIGN(const auto placed,
                   storeImages(read.materials, setting.plan.options, memory.pageBytes, made.space(memory.tempBytes),
                               images, warnings, [&](double part) { return (*setting.progress)(0.5 + part / 2); }));
    VCP_TRY(images.sync());
    fields["images"].push_back({images.bytes(), images.entries().size()});
    for (const PlacedMaterial& each : placed) fields["placed"].push_back({each.number, each.shift});
    return {};
}

}  // namespace

std::vector<InputShare> inputShares(const std::vector<uint64_t>& bytes, unsigned parts) {
    // An empty file counts a byte, so that there is a whole.
    double total = 0;
    for (const uint64_t each : bytes) total += double(each + 1);
    const auto partAt = [&](double at) { return std::min(parts - 1, unsigned(at / total * parts)); };
    std::vector<InputShare> shares;
    double begin = 0;
    for (const uint64_t each : bytes) {
        const double end = begin + double(each + 1);
        // The last byte's part, not that of the byte behind it.
        shares.push_back({partAt(begin), partAt(begin), partAt(end - 1)});
        begin = end;
    }
    return shares;
}

Result<void> runRead(const PartSetting& setting, unsigned number, NewPart& made) {
    const std::vector<InputShare> shares = sharesOf(setting.plan);
    VCP_TRY_ASSIGN(const auto memory, memoryOf(setting.plan.options));
    TempSpace& space = made.space(memory.tempBytes);
    Soup soup(space, memory.bufferBytes, setting.plan.parts);
    SoupTally tally;
    std::vector<std::string> warnings;
    std::vector<SideFile> sideFiles;
    BuildOptions options = setting.plan.options;
    const auto own = size_t(std::ranges::count(shares, number, &InputShare::reader));
    size_t done = 0;
    for (size_t i = 0; i < shares.size(); ++i) {
        if (shares[i].reader != number) continue;
        VCP_TRY(checkInput(setting.plan.inputs[i]));
        options.inputs = {setting.plan.inputs[i].path};
        soup.firstBin = shares[i].firstPart;
        soup.lastBin = shares[i].lastPart;
        const auto report = [&](double part, uint64_t) {
            return (*setting.progress)((double(done) + part) / double(own));
        };
        VCP_TRY_ASSIGN(const auto more,
                       readInputs(options, space, memory.vertexBytes, soup, report, warnings, sideFiles));
        tally.add(more);
        ++done;
    }
    json fields{{"tally", jsonOf(tally)}, {"warnings", warnings}, {"side files", json::array()}};
    for (const SideFile& each : sideFiles) fields["side files"].push_back(jsonOf(describeSideFile(each)));
    VCP_TRY_ASSIGN(fields["materials"], recordMaterials(soup.materials, space));
    VCP_TRY(recordBins(soup.floats.raw(), "floats", fields["files"]));
    VCP_TRY(recordBins(soup.doubles.raw(), "doubles", fields["files"]));
    fields["for"] = json::array();
    for (unsigned part = 0; part < setting.plan.parts; ++part)
        if (SoupShare{.soup = soup, .bin = part}.triangles() > 0) fields["for"].push_back(part);
    return made.finish(fields);
}

Result<void> runCount(const PartSetting& setting, NewPart& made) {
    const BuildOptions& options = setting.plan.options;
    VCP_TRY_ASSIGN(auto read, ReadParts::open(setting, {}));
    VCP_TRY_ASSIGN(const auto measures, measuresOf(read.tally, options));
    VCP_TRY_ASSIGN(auto memory, memoryOf(setting.plan.options));
    const bool withImages = mayKeepImages(options, measures, read.materials);
    VCP_TRY_ASSIGN(const auto plan,
                   planPagesOf({.options = options,
                                .measures = measures,
                                .soups = read.soups,
                                .memory = memory,
                                .mayKeepImages = withImages,
                                .parts = setting.plan.parts,
                                .progress = [&](double part) { return (*setting.progress)(part / 2); }}));
    VCP_TRY_ASSIGN(memory, planPages(memory, plan.pages, plan.levels.finest.bins()));
    VCP_TRY(checkSpace(setting, measures, withImages ? expectedImageBytes(read.materials) : 0));
    made.space(memory.tempBytes);
    std::vector<std::string> warnings = read.warnings;
    if (auto wide = wideCellWarning(options, measures)) warnings.push_back(std::move(*wide));
    // As a journal says it where nothing but the plan is done (checkpoint.h).
    json fields{{"stage", "levels"},
                {"build", ""},
                {"measures", vcp::jsonOf(measures)},
                {"side files", vcp::jsonOf(read.sideFiles)},
                {"files", json::object()},
                {"spools", json::array()},
                {"surfaces", json::array()},
                {"images", json::array()},
                {"partition", plan.levels.finest.first()},
                {"parted", plan.levels.pages.parted()},
                {"levels less", plan.levelsLess},
                {"pages", plan.pages},
                {"pass", 0},
                {"bin", 0u},
                {"first bins", plan.firstBins},
                {"placed", json::array()},
                {"read", read.contents}};
    if (withImages) VCP_TRY(keepImages(setting, read, memory, made, warnings, fields));
    fields["warnings"] = warnings;
    return made.finish(fields);
}

Result<void> runDeal(const PartContext& context, unsigned number, NewPart& made) {
    const BuildOptions& options = context.plan.options;
    const LevelPlan& levels = context.levels;
    const MemoryPlan& memory = context.memory;
    const SoupMeasures& measures = context.recorded.measures;
    VCP_TRY_ASSIGN(const auto read, ReadParts::open(context, number));
    const auto counted = context.counted.fields.at("read").get<std::vector<uint64_t>>();
    for (unsigned k = 0; k < context.plan.parts; ++k)
        if (read.contents[k] != counted.at(k))
            return Error{.code = ErrorCode::Usage,
                         .message =
                             "was run again with another memory since \"count 0\": delete count-0, and run the "
                             "step \"count 0\" of this plan again",
                         .file = context.part("read", k).folder().string()};
    TempSpace& space = made.space(memory.tempBytes);
    const size_t bins = levels.finest.bins();
    RecordBins<LatticeTriangle> triangles(space, "level", bins, memory.bufferBytes);
    RecordBins<TexturedTriangle> textures(space, "textures", bins, memory.bufferBytes / 4);
    std::vector<PlacedMaterial> placed;
    for (const json& each : context.counted.fields.at("placed"))
        placed.push_back({each.at(0).get<uint32_t>(), each.at(1).get<uint32_t>()});
    const ColourUse use = colourUseOf(options, measures);
    std::optional<MaterialColours> colours;
    if (use.materials) colours.emplace(read.materials, memory.vertexBytes);
    const LatticeSnapper snapper(levels.frame, colours ? &*colours : nullptr, use.vertices, levels.pages, placed);
    std::atomic<uint64_t> tiny = 0;
    const Dealing dealing{read.soups,
                          snapper,
                          levels.gridOf(levels.levels() - 1),
                          placed.empty() ? nullptr : &textures,
                          levels.pages,
                          levels.marginCells(),
                          tiny,
                          *context.progress};
    VCP_TRY(dealTriangles(dealing, levels.finest, triangles));
    json fields{{"bins", context.bins}, {"tiny", tiny.load()}, {"warnings", json::array()}};
    if (colours) fields["warnings"] = colours->warnings();
    fields["for"] = partsWith(context, {&triangles.raw()});
    fields["textured"] = partsWith(context, {&textures.raw()});
    VCP_TRY(recordBins(triangles.raw(), "level", fields["files"]));
    VCP_TRY(recordBins(textures.raw(), "textures", fields["files"]));
    return made.finish(fields);
}

Result<std::vector<std::string>> warningsOf(const PartContext& context) {
    auto warnings = context.counted.fields.at("warnings").get<std::vector<std::string>>();
    std::vector<std::string> ofColours;
    uint64_t tiny = 0;
    for (unsigned k = 0; k < context.plan.parts; ++k) {
        VCP_TRY_ASSIGN(const auto part, context.open("deal", k));
        tiny += part.fields.at("tiny").get<uint64_t>();
        for (auto& each : part.fields.at("warnings").get<std::vector<std::string>>())
            if (std::ranges::find(ofColours, each) == ofColours.end()) ofColours.push_back(std::move(each));
    }
    const SoupMeasures& measures = context.recorded.measures;
    if (auto warning = tinyWarning(tiny, measures.triangles, context.levels.frame)) warnings.push_back(*warning);
    warnings.insert(warnings.end(), ofColours.begin(), ofColours.end());
    return warnings;
}

}  // namespace vcp
