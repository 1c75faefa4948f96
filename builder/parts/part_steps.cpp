#include "builder/parts/part_steps.h"

#include <algorithm>
#include <deque>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <xxhash.h>

#include "builder/dataset_assembly.h"
#include "builder/lattice/mesh_textures.h"
#include "builder/level/vertex_step.h"
#include "builder/slab_pages.h"

namespace vcp {

namespace {

using nlohmann::json;

/// Bins of a part that is done.
template <class Record>
Result<std::unique_ptr<RecordBins<Record>>> openBins(const DonePart& part, const std::string& name, size_t bins) {
    auto opened = std::make_unique<RecordBins<Record>>(*part.space, name, bins, 0);
    if (const uint64_t bytes = part.fields.at("files").at(name).get<uint64_t>(); bytes > 0)
        VCP_TRY(opened->raw().reopen(bytes));
    return opened;
}

/// Makes bins durable and notes their length.
Result<void> record(RawBins& bins, const std::string& name, json& files) {
    VCP_TRY(bins.sync());
    files[name] = bins.bytes();
    return {};
}

/// Makes the spools of all levels durable; returns their lengths, in bytes and entries.
Result<json> recordedSpools(std::deque<PageSpool>& spools) {
    json lengths = json::array();
    for (PageSpool& spool : spools) {
        if (spool.bytes() > 0) VCP_TRY(spool.sync());
        lengths.push_back({spool.bytes(), spool.entries().size()});
    }
    return lengths;
}

/// Appends the pages of a part that is done to those that are at hand.
Result<void> gather(const DonePart& part, const char* field, const char* prefix, std::deque<PageSpool>& to) {
    const json& lengths = part.fields.at(field);
    for (uint32_t level = 0; level < to.size(); ++level) {
        PageSpool from(*part.space, level, prefix);
        const auto bytes = lengths.at(level).at(0).get<uint64_t>();
        if (bytes == 0) continue;
        VCP_TRY(from.reopen(bytes, lengths.at(level).at(1).get<uint64_t>()));
        for (const PageEntry& entry : from.entries()) {
            VCP_TRY_ASSIGN(const auto page, from.read(entry));
            VCP_TRY(to[level].append(entry, page));
        }
    }
    return {};
}

std::deque<PageSpool> makeSpools(TempSpace& space, uint32_t levels, const char* prefix) {
    std::deque<PageSpool> spools;
    for (uint32_t level = 0; level < levels; ++level) spools.emplace_back(space, level, prefix);
    return spools;
}

/// Returns the parts whose bins have any of the triangles or vertices.
std::vector<unsigned> partsWith(const PartContext& context, const RawBins& triangles, const RawBins& vertices) {
    std::vector<unsigned> parts;
    for (unsigned part = 0; part < context.plan.parts; ++part)
        for (size_t bin = context.firstBins[part]; bin < context.firstBins[part + 1]; ++bin)
            if (triangles.count(bin) + vertices.count(bin) > 0) {
                parts.push_back(part);
                break;
            }
    return parts;
}

/// What the vertices' stage left for the bins of a part, all of its parts together.
class FinestBins {
public:
    static Result<FinestBins> open(const PartContext& context, unsigned number) {
        FinestBins all;
        const size_t bins = context.levels.finest.bins();
        for (unsigned k = 0; k < context.plan.parts; ++k) {
            VCP_TRY_ASSIGN(auto part, context.open("vertices", k));
            all.parts_.push_back(std::move(part));
            const DonePart& done = all.parts_.back();
            const auto wanted = done.fields.at("for").get<std::vector<unsigned>>();
            if (std::find(wanted.begin(), wanted.end(), number) != wanted.end()) {
                VCP_TRY_ASSIGN(auto triangles, openBins<LatticeTriangle>(done, "level", bins));
                VCP_TRY_ASSIGN(auto vertices, openBins<VertexImage>(done, "normals", bins));
                all.sources_.push_back({k, std::move(triangles), std::move(vertices)});
            }
            all.notes_.push_back(std::make_unique<PartNotes>(*done.space, 0));
            if (const uint64_t bytes = done.fields.at("files").at("parts").get<uint64_t>(); bytes > 0)
                VCP_TRY(all.notes_.back()->raw().reopen(bytes));
        }
        std::vector<PartNotes*> notes;
        for (const auto& each : all.notes_) notes.push_back(each.get());
        VCP_TRY_ASSIGN(all.meshParts_, PartNotes::join(notes));
        return all;
    }

    [[nodiscard]] const PartCounts& counts() const { return meshParts_.counts; }

    /// Returns the triangles of a bin, with their normals. Errors: Io, InvalidInput.
    [[nodiscard]] Result<std::vector<LatticeTriangle>> load(size_t bin) const {
        std::vector<LatticeTriangle> soup;
        std::vector<VertexImage> known;
        for (const Source& from : sources_) {
            VCP_TRY_ASSIGN(auto triangles, from.triangles->load(bin));
            for (LatticeTriangle& t : triangles) t.part = meshParts_.decided(t.part, from.part);
            soup.insert(soup.end(), triangles.begin(), triangles.end());
            VCP_TRY_ASSIGN(const auto vertices, from.vertices->load(bin));
            known.insert(known.end(), vertices.begin(), vertices.end());
        }
        if (joinVertices(soup, std::move(known))) return soup;
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "lack a normal that one of them must have; delete these folders and run them again",
                     .file = (parts_.front().space->folder().path().parent_path() / "vertices-*").string()};
    }

private:
    struct Source {
        unsigned part;
        std::unique_ptr<RecordBins<LatticeTriangle>> triangles;
        std::unique_ptr<RecordBins<VertexImage>> vertices;
    };
    std::vector<DonePart> parts_;
    std::vector<Source> sources_;  ///< those that have anything for the part
    std::vector<std::unique_ptr<PartNotes>> notes_;
    MeshParts meshParts_;
};

/// Returns what `deal` left of triangles with images; null where the file keeps none.
Result<std::unique_ptr<RecordBins<TexturedTriangle>>> openTextures(const PartContext& context) {
    std::unique_ptr<RecordBins<TexturedTriangle>> textures;
    const auto recorded = context.recorded.files.bins.find("textures");
    if (recorded == context.recorded.files.bins.end()) return textures;
    textures = std::make_unique<RecordBins<TexturedTriangle>>(*context.dealt.space, "textures",
                                                              context.levels.finest.bins(), 0);
    if (recorded->second > 0) VCP_TRY(textures->raw().reopen(recorded->second));
    return textures;
}

/// Opens the images that `deal` left; none where the file keeps none.
Result<std::deque<PageSpool>> openImages(const PartContext& context) {
    std::deque<PageSpool> images;
    for (const auto& [bytes, entries] : context.recorded.files.images) {
        images.emplace_back(*context.dealt.space, uint32_t(images.size()), "image");
        if (bytes > 0) VCP_TRY(images.back().reopen(bytes, entries));
    }
    return images;
}

/// Whether all that lies below pages with one parent, of a level, belongs to a part.
bool isWithin(const PartContext& context, unsigned part, int level, uint64_t parent) {
    const FinestPages& pages = context.levels.pages;
    return pages.firstCode(uint32_t(level), parent) >= context.firstCode(part) &&
           pages.firstCode(uint32_t(level), parent + 1) <= context.firstCode(part + 1);
}

/// Builds the pages of slabs above a part's own, as far as these are all that lies below them; the surface in the
/// others goes to `kept`.
Result<void> buildAbove(const PartContext& context, unsigned part, TempSpace& space, std::deque<PageSpool>& pages,
                        std::deque<PageSpool>& surfaces, std::deque<PageSpool>& kept) {
    for (int level = context.levels.levels() - 2; level >= 0; --level) {
        PageSpool& below = surfaces[size_t(level) + 1];
        below.sortEntries();
        std::vector<Siblings> own;
        for (const Siblings& each : siblingsIn(below)) {
            if (isWithin(context, part, level, below.entries()[each.first].morton >> 3)) {
                own.push_back(each);
                continue;
            }
            for (size_t i = each.first; i < each.end; ++i) {
                VCP_TRY_ASSIGN(const auto surface, below.read(below.entries()[i]));
                VCP_TRY(kept[size_t(level) + 1].append({.morton = below.entries()[i].morton}, surface));
            }
        }
        VCP_TRY(buildSlabPages(context.settingsOf(level, false, space), below, own, pages[size_t(level)],
                               level > 0 ? &surfaces[size_t(level)] : nullptr, *context.progress));
        below.remove();
    }
    return {};
}

}  // namespace

Result<DonePart> PartContext::open(const std::string& stage, unsigned number) const {
    const PartName name = part(stage, number);
    VCP_TRY_ASSIGN(auto done, openPart(name));
    if (done.fields.value("bins", "") == bins) return done;
    return Error{.code = ErrorCode::Usage,
                 .message = fmt::format("was made before \"deal 0\" was run again, with other bins; delete it and run "
                                        "the step \"{}\" of this plan again",
                                        name.step()),
                 .file = name.folder().string()};
}

uint64_t PartContext::firstCode(unsigned part) const {
    const size_t bin = firstBins[part];
    const std::vector<uint64_t>& first = levels.finest.first();
    return bin < first.size() ? first[bin] : uint64_t{1} << 3 * (levels.levels() - 1);
}

LevelSettings PartContext::settingsOf(int level, bool isFinest, TempSpace& space) const {
    LevelSettings settings = levels.settingsOf(level, isFinest);
    settings.withColour = hasColour;
    settings.codesSurface = true;
    settings.roomBytes = memory.tempBytes;
    settings.makeRoom = [&space] { return space.spill(); };
    return settings;
}

Result<PartContext> openDealt(const std::filesystem::path& folder, const PartPlan& plan) {
    PartContext context;
    context.folder = folder;
    context.plan = plan;
    VCP_TRY_ASSIGN(context.dealt, openPart(context.part("deal", 0)));
    const std::filesystem::path journal = context.part("deal", 0).folder() / kJournalName;
    VCP_TRY_ASSIGN(context.recorded, recordedFrom(context.dealt.fields, journal));
    context.firstBins = context.dealt.fields.at("first bins").get<std::vector<size_t>>();
    if (context.firstBins.size() != size_t{plan.parts} + 1) return damagedTempFile(journal);
    const Recorded& recorded = context.recorded;
    const std::string chosen = json{recorded.levelsLess, recorded.parted, recorded.partition, context.firstBins}.dump();
    context.bins = fmt::format("{:016x}", XXH3_64bits(chosen.data(), chosen.size()));
    return context;
}

Result<PartContext> openContext(const std::filesystem::path& folder, const PartPlan& plan) {
    VCP_TRY_ASSIGN(auto context, openDealt(folder, plan));
    const Recorded& recorded = context.recorded;
    VCP_TRY_ASSIGN(context.levels, planLevels(plan.options, recorded.measures, recorded.levelsLess));
    LevelPlan& levels = context.levels;
    levels.setPages(levels.frame, FinestPages(levels.gridOf(levels.levels() - 1), recorded.parted));
    levels.finest = PagePartition(recorded.partition);
    context.threads = threadsOf(plan.options);
    const uint64_t memory = plan.options.memoryBytes > 0 ? plan.options.memoryBytes : defaultMemoryBytes();
    VCP_TRY_ASSIGN(context.memory, planMemory(memory, context.threads));
    VCP_TRY_ASSIGN(context.memory, planPages(context.memory, recorded.pages, levels.finest.bins()));
    levels.pageBytes = context.memory.pageBytes;
    context.hasColour = colourUseOf(plan.options, recorded.measures).any();
    return context;
}

Result<void> runVertices(const PartContext& context, unsigned number, NewPart& made) {
    const LevelPlan& levels = context.levels;
    const size_t bins = levels.finest.bins();
    TempSpace& space = made.space(context.memory.tempBytes);
    RecordBins<LatticeTriangle> dealt(*context.dealt.space, fmt::format("level{}", levels.levels()), bins, 0);
    if (const uint64_t bytes = context.recorded.files.bins.at("current"); bytes > 0) VCP_TRY(dealt.raw().reopen(bytes));
    RecordBins<LatticeTriangle> triangles(space, "level", bins, context.memory.bufferBytes);
    RecordBins<VertexImage> vertices(space, "normals", bins, context.memory.bufferBytes / 4);
    PartNotes parts(space, context.memory.bufferBytes / 16);
    const PageGrid grid = levels.gridOf(levels.levels() - 1);
    LevelSink sink(levels.pages, levels.finest, triangles, levels.marginCells());
    VertexStep step(grid, levels.finest, vertices, sink);
    const size_t first = context.firstBins[number], end = context.firstBins[number + 1];
    for (size_t bin = first; bin < end; ++bin) {
        if (!(*context.progress)(double(bin - first) / double(end - first))) return Error::cancelled();
        VCP_TRY_ASSIGN(auto soup, dealt.load(bin));
        if (soup.empty()) continue;
        VCP_TRY_ASSIGN(const auto mesh, meshWithNormals(levels, std::move(soup), bin, context.hasColour, parts));
        VCP_TRY(step.run(bin, mesh));
    }
    json files;
    VCP_TRY(record(triangles.raw(), "level", files));
    VCP_TRY(record(vertices.raw(), "normals", files));
    VCP_TRY(record(parts.raw(), "parts", files));
    return made.finish(
        {{"bins", context.bins}, {"files", files}, {"for", partsWith(context, triangles.raw(), vertices.raw())}});
}

Result<void> runPages(const PartContext& context, unsigned number, NewPart& made) {
    const LevelPlan& levels = context.levels;
    VCP_TRY_ASSIGN(const auto finest, FinestBins::open(context, number));
    TempSpace& space = made.space(context.memory.tempBytes);
    std::deque<PageSpool> pages = makeSpools(space, levels.frame.levels, ""),
                          surfaces = makeSpools(space, levels.frame.levels, "surface"),
                          kept = makeSpools(space, levels.frame.levels, "kept");
    VCP_TRY_ASSIGN(const auto textures, openTextures(context));
    const size_t first = context.firstBins[number], end = context.firstBins[number + 1];
    for (size_t bin = first; bin < end; ++bin) {
        const auto report = [&](double part) {
            return (*context.progress)((double(bin - first) + part) / double(end - first));
        };
        VCP_TRY_ASSIGN(auto soup, finest.load(bin));
        if (soup.empty()) continue;
        LatticeMesh mesh = meshOf(soup, context.hasColour);
        std::vector<LatticeTriangle>().swap(soup);
        if (textures) {
            VCP_TRY_ASSIGN(auto known, textures->load(bin));
            addTextures(mesh, std::move(known));
        }
        settleNormals(mesh);
        VCP_TRY(buildBinPages(levels, mesh,
                              {.pass = levels.levels() - 1,
                               .first = levels.finest.first()[bin],
                               .end = LevelPlan::endOf(levels.finest, bin, levels.levels() - 1),
                               .settings = [&](int level) { return context.settingsOf(level, true, space); },
                               .pages = pages,
                               .surfaces = surfaces,
                               .progress = report}));
    }
    VCP_TRY(buildAbove(context, number, space, pages, surfaces, kept));
    VCP_TRY_ASSIGN(const auto pageLengths, recordedSpools(pages));
    VCP_TRY_ASSIGN(const auto keptLengths, recordedSpools(kept));
    const PartCounts& counts = finest.counts();
    return made.finish({{"bins", context.bins},
                        {"pages", pageLengths},
                        {"kept", keptLengths},
                        {"mesh parts", {counts.parts, counts.closed, counts.openEdges}}});
}

Result<BuildFigures> runMerge(const PartContext& context, NewPart& made) {
    const LevelPlan& levels = context.levels;
    TempSpace& space = made.space(context.memory.tempBytes);
    std::deque<PageSpool> pages = makeSpools(space, levels.frame.levels, ""),
                          surfaces = makeSpools(space, levels.frame.levels, "surface");
    PartCounts counts;
    for (unsigned k = 0; k < context.plan.parts; ++k) {
        VCP_TRY_ASSIGN(const auto part, context.open("pages", k));
        VCP_TRY(gather(part, "pages", "", pages));
        VCP_TRY(gather(part, "kept", "kept", surfaces));
        const json& noted = part.fields.at("mesh parts");
        counts = {noted.at(0).get<uint64_t>(), noted.at(1).get<uint64_t>(), noted.at(2).get<uint64_t>()};
        if (!(*context.progress)(double(k) / double(2 * context.plan.parts))) return Error::cancelled();
    }
    for (int level = levels.levels() - 2; level >= 0; --level) {
        PageSpool& below = surfaces[size_t(level) + 1];
        below.sortEntries();
        VCP_TRY(buildSlabPages(context.settingsOf(level, false, space), below, siblingsIn(below), pages[size_t(level)],
                               level > 0 ? &surfaces[size_t(level)] : nullptr,
                               [&](double) { return (*context.progress)(0.5); }));
        below.remove();
    }
    const SoupMeasures& measures = context.recorded.measures;
    FileHeader header = headerOf(levels, measures, context.hasColour, counts);
    OutputRules rules{.overwrite = context.plan.options.overwrite, .inputs = context.plan.options.inputs};
    for (const SideFile& each : context.recorded.sideFiles) rules.inputs.push_back(each.path);
    VCP_TRY_ASSIGN(const auto images, openImages(context));
    BuildFigures figures;
    VCP_TRY_ASSIGN(figures.fileBytes, assembleDataset(pages, header, context.plan.options.output, rules,
                                                      images.empty() ? nullptr : &images.front(), [&](double part) {
                                                          return (*context.progress)(0.5 + part / 2);
                                                      }));
    describe(header, figures);
    return figures;
}

}  // namespace vcp
