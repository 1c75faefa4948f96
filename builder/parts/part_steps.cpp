#include "builder/parts/part_steps.h"

#include <algorithm>
#include <atomic>
#include <deque>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <xxhash.h>

#include "builder/dataset_assembly.h"
#include "builder/lattice/mesh_textures.h"
#include "builder/level/vertex_step.h"
#include "builder/ordered_pages.h"
#include "builder/slab_pages.h"

namespace vcp {

namespace {

using nlohmann::json;

/// Makes the spools of all levels durable; returns their lengths, in bytes and entries.
Result<json> recordedSpools(std::deque<PageSpool>& spools) {
    json lengths = json::array();
    for (PageSpool& spool : spools) {
        if (spool.bytes() > 0) VCP_TRY(spool.sync());
        lengths.push_back({spool.bytes(), spool.entries().size()});
    }
    return lengths;
}

/// Appends the pages of a spool whose files are closed to another.
Result<void> appendPages(PageSpool& from, PageSpool& to) {
    VCP_TRY(from.wake());
    for (const PageEntry& entry : from.entries()) {
        VCP_TRY_ASSIGN(const auto page, from.read(entry));
        VCP_TRY(to.append(entry, page));
    }
    from.rest();
    return {};
}

std::deque<PageSpool> makeSpools(TempSpace& space, uint32_t levels, const char* prefix) {
    std::deque<PageSpool> spools;
    for (uint32_t level = 0; level < levels; ++level) spools.emplace_back(space, level, prefix);
    return spools;
}

/// Opens the spools of a part that is done, each with its entries, and closes their files again.
Result<void> openSpools(const DonePart& part, const char* field, std::deque<PageSpool>& spools) {
    const json& lengths = part.fields.at(field);
    for (size_t level = 0; level < spools.size(); ++level) {
        const auto bytes = lengths.at(level).at(0).get<uint64_t>();
        if (bytes > 0) VCP_TRY(spools[level].reopen(bytes, lengths.at(level).at(1).get<uint64_t>()));
        spools[level].rest();
    }
    return {};
}

using DoneParts = std::vector<std::shared_ptr<const DonePart>>;

/// Opens all parts of a stage. Errors: openPart's; Usage (PartContext::open).
Result<DoneParts> openStage(const PartContext& context, const std::string& stage) {
    DoneParts parts;
    for (unsigned k = 0; k < context.plan.parts; ++k) {
        VCP_TRY_ASSIGN(auto part, context.open(stage, k));
        parts.push_back(std::make_shared<const DonePart>(std::move(part)));
    }
    return parts;
}

/// Bins of one kind that the parts of a stage left, for those that have anything for a part.
template <class Record>
class GatheredBins {
public:
    /// `parts`: of the stage. `field`: which lists the parts that there is anything for.
    static Result<GatheredBins> open(const DoneParts& parts, const char* field, const std::string& name,
                                     unsigned number) {
        GatheredBins all;
        for (unsigned k = 0; k < parts.size(); ++k) {
            const auto wanted = parts[k]->fields.at(field).template get<std::vector<unsigned>>();
            if (std::find(wanted.begin(), wanted.end(), number) == wanted.end()) continue;
            auto bins = std::make_unique<RecordBins<Record>>(*parts[k]->space, name, 1, 0);
            VCP_TRY(reopenBins(parts[k]->fields, name, bins->raw()));
            all.sources_.push_back({k, parts[k], std::move(bins)});
        }
        return all;
    }
    /// Calls visit(records, number of the part that they are of) for each part's records of a bin.
    template <class Visit>
    Result<void> load(size_t bin, const Visit& visit) const {
        for (const Source& from : sources_) {
            VCP_TRY_ASSIGN(auto records, from.bins->load(bin));
            visit(std::move(records), from.part);
        }
        return {};
    }
    [[nodiscard]] Result<std::vector<Record>> load(size_t bin) const {
        std::vector<Record> all;
        VCP_TRY(load(bin, [&](std::vector<Record> records, unsigned) {
            if (all.empty())
                all = std::move(records);
            else
                all.insert(all.end(), records.begin(), records.end());
        }));
        return all;
    }

private:
    struct Source {
        unsigned part;
        std::shared_ptr<const DonePart> done;
        std::unique_ptr<RecordBins<Record>> bins;
    };
    std::vector<Source> sources_;
};

/// What the vertices' stage left for the bins of a part, all of its parts together.
class FinestBins {
public:
    static Result<FinestBins> open(const PartContext& context, unsigned number) {
        FinestBins all;
        all.folder_ = context.folder;
        VCP_TRY_ASSIGN(const auto parts, openStage(context, "vertices"));
        VCP_TRY_ASSIGN(all.triangles_, Triangles::open(parts, "for", "level", number));
        VCP_TRY_ASSIGN(all.vertices_, Vertices::open(parts, "for", "normals", number));
        std::vector<std::unique_ptr<PartNotes>> notes;
        std::vector<PartNotes*> joined;
        for (const auto& part : parts) {
            notes.push_back(std::make_unique<PartNotes>(*part->space, 0));
            VCP_TRY(reopenBins(part->fields, "parts", notes.back()->raw()));
            joined.push_back(notes.back().get());
        }
        VCP_TRY_ASSIGN(all.meshParts_, PartNotes::join(joined));
        return all;
    }

    [[nodiscard]] const PartCounts& counts() const { return meshParts_.counts; }

    /// Returns the triangles of a bin, with their normals. Errors: Io, InvalidInput.
    [[nodiscard]] Result<std::vector<LatticeTriangle>> load(size_t bin) const {
        std::vector<LatticeTriangle> soup;
        VCP_TRY(triangles_.load(bin, [&](std::vector<LatticeTriangle> triangles, unsigned part) {
            for (LatticeTriangle& t : triangles) t.part = meshParts_.decided(t.part, part);
            soup.insert(soup.end(), triangles.begin(), triangles.end());
        }));
        VCP_TRY_ASSIGN(auto known, vertices_.load(bin));
        if (joinVertices(soup, std::move(known))) return soup;
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "lack a normal that one of them must have; delete these folders and run them again",
                     .file = (folder_ / "vertices-*").string()};
    }

private:
    using Triangles = GatheredBins<LatticeTriangle>;
    using Vertices = GatheredBins<VertexImage>;
    std::filesystem::path folder_;
    Triangles triangles_;
    Vertices vertices_;
    MeshParts meshParts_;
};

/// Opens the images that `count` left; none where the file keeps none.
Result<std::deque<PageSpool>> openImages(const PartContext& context) {
    std::deque<PageSpool> images;
    for (const auto& [bytes, entries] : context.recorded.files.images) {
        images.emplace_back(*context.counted.space, uint32_t(images.size()), "image");
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
            VCP_TRY(keepSurfaces(below, each, kept[size_t(level) + 1]));
        }
        VCP_TRY(buildSlabPages(context.settingsOf(level, false, space), below, own, pages[size_t(level)],
                               level > 0 ? &surfaces[size_t(level)] : nullptr, *context.progress));
        below.remove();
    }
    return {};
}

// Shares of the time of `merge`, at which one is done and the next begins.
constexpr double kPagesAreOpen = 0.1, kTopIsBuilt = 0.3;

/// What a part of `pages` left: pages, and the surface in those whose parents belong to several parts.
struct PartPages {
    DonePart done;
    std::deque<PageSpool> pages, kept;
};

/// Opens what the parts of `pages` left, on all threads. Errors: openPart's; Usage (PartContext::open).
Result<std::vector<std::unique_ptr<PartPages>>> openPages(const PartContext& context) {
    const uint32_t levels = context.levels.frame.levels;
    std::vector<std::unique_ptr<PartPages>> parts(context.plan.parts);
    std::atomic<unsigned> opened = 0;
    const auto open = [&](size_t k) -> Result<void> {
        VCP_TRY_ASSIGN(auto done, context.open("pages", unsigned(k)));
        auto part = std::make_unique<PartPages>(PartPages{.done = std::move(done), .pages = {}, .kept = {}});
        part->pages = makeSpools(*part->done.space, levels, "");
        part->kept = makeSpools(*part->done.space, levels, "kept");
        VCP_TRY(openSpools(part->done, "pages", part->pages));
        VCP_TRY(openSpools(part->done, "kept", part->kept));
        parts[k] = std::move(part);
        const double share = double(++opened) / double(parts.size());
        return (*context.progress)(kPagesAreOpen * share) ? Result<void>() : Error::cancelled();
    };
    VCP_TRY(forEachInOrder(parts.size(), open));
    return parts;
}

/// Builds the pages that have something of several parts below them.
Result<void> buildTop(const PartContext& context, const std::vector<std::unique_ptr<PartPages>>& parts,
                      TempSpace& space, std::deque<PageSpool>& pages, std::deque<PageSpool>& surfaces) {
    const int levels = context.levels.levels();
    for (int level = levels - 2; level >= 0; --level) {
        PageSpool& below = surfaces[size_t(level) + 1];
        for (const auto& part : parts) VCP_TRY(appendPages(part->kept[size_t(level) + 1], below));
        below.sortEntries();
        const auto report = [&](double part) {
            const double share = (double(levels - 2 - level) + part) / double(levels - 1);
            return (*context.progress)(kPagesAreOpen + (kTopIsBuilt - kPagesAreOpen) * share);
        };
        VCP_TRY(buildSlabPages(context.settingsOf(level, false, space), below, siblingsIn(below), pages[size_t(level)],
                               level > 0 ? &surfaces[size_t(level)] : nullptr, report));
        below.remove();
    }
    return {};
}

}  // namespace

Result<void> recordBins(RawBins& bins, const std::string& name, json& files) {
    VCP_TRY(bins.sync());
    const RawBins::Index index = bins.index();
    files[name] = {{"bytes", bins.bytes()}, {"last", index.last}, {"counts", index.counts}};
    return {};
}

Result<void> reopenBins(const json& fields, const std::string& name, RawBins& bins) {
    const json& recorded = fields.at("files").at(name);
    const auto bytes = recorded.at("bytes").get<uint64_t>();
    if (bytes == 0) return {};
    return bins.reopen(
        bytes, {recorded.at("last").get<std::vector<uint64_t>>(), recorded.at("counts").get<std::vector<uint64_t>>()});
}

std::vector<unsigned> partsWith(const PartContext& context, std::initializer_list<const RawBins*> bins) {
    const auto hasAny = [&](unsigned part) {
        for (size_t bin = context.firstBins[part]; bin < context.firstBins[part + 1]; ++bin)
            for (const RawBins* each : bins)
                if (each->count(bin) > 0) return true;
        return false;
    };
    std::vector<unsigned> parts;
    for (unsigned part = 0; part < context.plan.parts; ++part)
        if (hasAny(part)) parts.push_back(part);
    return parts;
}

Result<DonePart> PartContext::open(const std::string& stage, unsigned number) const {
    const PartName name = part(stage, number);
    VCP_TRY_ASSIGN(auto done, openPart(name));
    if (done.fields.value("bins", "") == bins) return done;
    return Error{.code = ErrorCode::Usage,
                 .message = fmt::format("was made before \"count 0\" was run again, with other bins; delete it and run "
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
    settings.buildBeside(space, memory.tempBytes);
    return settings;
}

Result<PartContext> openCounted(const PartSetting& setting) {
    PartContext context;
    static_cast<PartSetting&>(context) = setting;
    VCP_TRY_ASSIGN(context.counted, openPart(context.part("count", 0)));
    const std::filesystem::path journal = context.part("count", 0).folder() / kJournalName;
    VCP_TRY_ASSIGN(context.recorded, recordedFrom(context.counted.fields, journal));
    context.firstBins = context.counted.fields.at("first bins").get<std::vector<size_t>>();
    if (context.firstBins.size() != size_t{context.plan.parts} + 1) return damagedTempFile(journal);
    const Recorded& recorded = context.recorded;
    const std::string chosen = json{recorded.levelsLess,
                                    recorded.parted,
                                    recorded.partition,
                                    context.firstBins,
                                    context.counted.fields.at("placed"),
                                    context.counted.fields.at("read")}
                                   .dump();
    context.bins = fmt::format("{:016x}", XXH3_64bits(chosen.data(), chosen.size()));
    return context;
}

Result<PartContext> openContext(const PartSetting& setting) {
    VCP_TRY_ASSIGN(auto context, openCounted(setting));
    const Recorded& recorded = context.recorded;
    VCP_TRY_ASSIGN(context.levels, planLevels(context.plan.options, recorded.measures, recorded.levelsLess));
    LevelPlan& levels = context.levels;
    levels.setPages(levels.frame, FinestPages(levels.gridOf(levels.levels() - 1), recorded.parted));
    levels.finest = PagePartition(recorded.partition);
    VCP_TRY_ASSIGN(context.memory, memoryOf(setting.plan.options));
    VCP_TRY_ASSIGN(context.memory, planPages(context.memory, recorded.pages, levels.finest.bins()));
    levels.pageBytes = context.memory.pageBytes;
    context.hasColour = colourUseOf(context.plan.options, recorded.measures).any();
    return context;
}

Result<void> runVertices(const PartContext& context, unsigned number, NewPart& made) {
    const LevelPlan& levels = context.levels;
    const size_t bins = levels.finest.bins();
    TempSpace& space = made.space(context.memory.tempBytes);
    VCP_TRY_ASSIGN(const auto parts, openStage(context, "deal"));
    VCP_TRY_ASSIGN(const auto dealt, GatheredBins<LatticeTriangle>::open(parts, "for", "level", number));
    RecordBins<LatticeTriangle> triangles(space, "level", bins, context.memory.bufferBytes);
    RecordBins<VertexImage> vertices(space, "normals", bins, context.memory.bufferBytes / 4);
    PartNotes notes(space, context.memory.bufferBytes / 16);
    const PageGrid grid = levels.gridOf(levels.levels() - 1);
    LevelSink sink(levels.pages, levels.finest, triangles, levels.marginCells());
    VertexStep step(grid, levels.finest, vertices, sink);
    const size_t first = context.firstBins[number], end = context.firstBins[number + 1];
    for (size_t bin = first; bin < end; ++bin) {
        if (!(*context.progress)(double(bin - first) / double(end - first))) return Error::cancelled();
        VCP_TRY_ASSIGN(auto soup, dealt.load(bin));
        if (soup.empty()) continue;
        VCP_TRY_ASSIGN(const auto mesh, meshWithNormals(levels, std::move(soup), bin, context.hasColour, notes));
        VCP_TRY(step.run(bin, mesh));
    }
    json files;
    VCP_TRY(recordBins(triangles.raw(), "level", files));
    VCP_TRY(recordBins(vertices.raw(), "normals", files));
    VCP_TRY(recordBins(notes.raw(), "parts", files));
    return made.finish(
        {{"bins", context.bins}, {"files", files}, {"for", partsWith(context, {&triangles.raw(), &vertices.raw()})}});
}

Result<void> runPages(const PartContext& context, unsigned number, NewPart& made) {
    const LevelPlan& levels = context.levels;
    VCP_TRY_ASSIGN(const auto finest, FinestBins::open(context, number));
    TempSpace& space = made.space(context.memory.tempBytes);
    std::deque<PageSpool> pages = makeSpools(space, levels.frame.levels, ""),
                          surfaces = makeSpools(space, levels.frame.levels, "surface"),
                          kept = makeSpools(space, levels.frame.levels, "kept");
    GatheredBins<TexturedTriangle> textures;
    const bool hasTextures = !context.counted.fields.at("placed").empty();
    if (hasTextures) {
        VCP_TRY_ASSIGN(const auto dealt, openStage(context, "deal"));
        VCP_TRY_ASSIGN(textures, GatheredBins<TexturedTriangle>::open(dealt, "textured", "textures", number));
    }
    const size_t first = context.firstBins[number], end = context.firstBins[number + 1];
    for (size_t bin = first; bin < end; ++bin) {
        const auto report = [&](double part) {
            return (*context.progress)((double(bin - first) + part) / double(end - first));
        };
        VCP_TRY_ASSIGN(auto soup, finest.load(bin));
        if (soup.empty()) continue;
        LatticeMesh mesh = meshOf(soup, context.hasColour);
        std::vector<LatticeTriangle>().swap(soup);
        if (hasTextures) {
            VCP_TRY_ASSIGN(auto known, textures.load(bin));
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
    VCP_TRY_ASSIGN(const auto parts, openPages(context));
    TempSpace& space = made.space(context.memory.tempBytes);
    std::deque<PageSpool> pages = makeSpools(space, levels.frame.levels, ""),
                          surfaces = makeSpools(space, levels.frame.levels, "surface");
    VCP_TRY(buildTop(context, parts, space, pages, surfaces));
    std::vector<JoinedSpools> joined(pages.size());
    for (size_t level = 0; level < joined.size(); ++level) {
        joined[level].add(pages[level]);
        for (const auto& part : parts) joined[level].add(part->pages[level]);
    }
    const json& noted = parts.back()->done.fields.at("mesh parts");
    const PartCounts counts{noted.at(0).get<uint64_t>(), noted.at(1).get<uint64_t>(), noted.at(2).get<uint64_t>()};
    FileHeader header = headerOf(levels, context.recorded.measures, context.hasColour, counts);
    OutputRules rules{.overwrite = context.plan.options.overwrite, .inputs = context.plan.options.inputs};
    for (const SideFile& each : context.recorded.sideFiles) rules.inputs.push_back(each.path);
    VCP_TRY_ASSIGN(const auto images, openImages(context));
    BuildFigures figures;
    VCP_TRY_ASSIGN(
        figures.fileBytes,
        assembleDataset(joined, header, context.plan.options.output, rules, images.empty() ? nullptr : &images.front(),
                        [&](double part) { return (*context.progress)(kTopIsBuilt + (1 - kTopIsBuilt) * part); }));
    describe(header, figures);
    return figures;
}

}  // namespace vcp
