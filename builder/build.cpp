#include "builder/build.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <utility>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <fmt/format.h>

#include "builder/bin_passes.h"
#include "builder/checkpoint.h"
#include "builder/dataset_assembly.h"
#include "builder/deal.h"
#include "builder/estimate.h"
#include "builder/image_store.h"
#include "builder/lattice/mesh_textures.h"
#include "builder/level_plan.h"
#include "builder/memory_plan.h"
#include "builder/mesh/open_mesh.h"
#include "builder/page_plan.h"
#include "builder/progress_meter.h"
#include "builder/slab_pages.h"
#include "builder/spill/journal.h"
#include "builder/work_arena.h"
#include "octree/io/output_claim.h"
#include "octree/io/output_file.h"

namespace vcp {

namespace {

// A level of slabs is built in runs of so many pages, with checkpoints between them.
constexpr size_t kSlabPagesPerBin = 256;

// Shares of the whole time; what is left after reading, dealing and the vertices is shared by the levels.
constexpr double kReadingShare = 0.08, kDealingShare = 0.04, kVerticesShare = 0.06, kWritingShare = 0.02;
// Images come on top of these, by what is expected of them and of the mesh.
constexpr double kSecondsOfTriangle = 10e-6;

class Builder {
public:
    Builder(const BuildOptions& options, const MemoryPlan& plan, unsigned threads,
            const std::filesystem::path& tempFolder)
        : options_(options),
          memory_(plan),
          meter_(options.progress),
          space_(tempFolder, plan.tempBytes),
          arena_(threads) {}

    Result<BuildReport> run() {
        auto built = caught([this] { return stages(); });
        if (built) {
            space_.folder().remove();
            finishReport();
            return report_;
        }
        Error error = built.error();
        const bool mayPass = error.code == ErrorCode::Cancelled || error.code == ErrorCode::Io,
                   needsMore = error.code == ErrorCode::Limit && (files_.current || !files_.surfaces.empty());
        const bool hasWork = journal_.active() || isResumed_;
        if (hasWork && isOfTempFiles(error)) {
            // Once the disk is repaired, it may give back what was written after all.
            error.message += fmt::format(" (until then what there is stays in {})", space_.folder().path().string());
        } else if (!hasWork || !(mayPass || needsMore)) {
            if (error.code != ErrorCode::Usage) space_.folder().remove();
            if (error.code == ErrorCode::Cancelled) error.message = "cancelled; nothing was written";
        } else {
            error.message += fmt::format("; the same build, resumed{}, goes on from here, or delete {}",
                                         needsMore ? " with that memory" : "", space_.folder().path().string());
        }
        if (error.file.empty()) error.file = options_.output.string();
        return error;
    }

private:
    /// Whether the error is that a temporary file is damaged.
    bool isOfTempFiles(const Error& error) const {
        return error.code == ErrorCode::InvalidInput &&
               std::filesystem::path(error.file).parent_path() == space_.folder().path();
    }

    template <class Work>
    Result<void> caught(const Work& work) {
        try {
            return work();
        } catch (const std::bad_alloc&) {
            return Error{
                .code = ErrorCode::Limit,
                .message = "the system has no more memory to give; use a smaller memory cap, or fewer threads"};
        }
    }

    Result<void> stages() {
        VCP_TRY_ASSIGN(claim_, OutputClaim::take(options_.output));
        // A wrong output is found before an hour's work, not after it.
        VCP_TRY(checkOutput(options_.output, OutputKind::Dataset, rules()));
        VCP_TRY(checkTempFolder());
        VCP_TRY(openJournal());
        const std::string& stage = done_.stage;
        if (stage.empty())
            VCP_TRY(read());
        else
            VCP_TRY(resumeMeasures());
        warnOfWideCells();
        if (stage.empty() || stage == "read")
            VCP_TRY(deal());
        else
            VCP_TRY(resumeBins());
        for (; pass_ >= 0; --pass_) VCP_TRY(runPass());
        return write();
    }

    // Progress and time

    bool progress(const std::string& stage, double fraction) {
        const double withImages = fraction * (1 - imagesShare_) + imagesDone_;
        return meter_.report(
            stage, {.fraction = withImages, .triangles = measures_.triangles, .tempBytes = space_.diskBytes()});
    }

    Error cancelled() const { return Error::cancelled(options_.output.string()); }

    /// Returns what the output may replace: no file that is read.
    [[nodiscard]] OutputRules rules() const {
        OutputRules rules{.overwrite = options_.overwrite, .inputs = options_.inputs};
        for (const SideFile& each : report_.sideFiles) rules.inputs.push_back(each.path);
        return rules;
    }

    /// Checks that no input lies among the temporary files, which are removed by their names.
    [[nodiscard]] Result<void> checkTempFolder() const {
        for (const auto& input : options_.inputs)
            if (isSameFile(input.parent_path().empty() ? "." : input.parent_path(), space_.folder().path()))
                return Error{
                    .code = ErrorCode::Usage,
                    .message = "lies in the folder of this build's temporary files; move it, or choose another output",
                    .file = input.string()};
        return {};
    }

    // The journal

    Result<void> openJournal() {
        TempFolder& folder = space_.folder();
        if (!folder.exists()) return {};
        VCP_TRY(folder.take());
        if (options_.resume) {
            VCP_TRY_ASSIGN(const auto journal, Journal::read(folder));
            // Whatever the journal says, it shows earlier work.
            isResumed_ = !journal.is_null();
            VCP_TRY_ASSIGN(done_, recordedFrom(journal, folder.path() / kJournalName));
        }
        if (!isResumed_) {
            folder.clear();
            return {};
        }
        if (done_.build != buildFingerprint(options_))
            return Error{
                .code = ErrorCode::Usage,
                .message = "the unfinished build here is of other inputs or options; build again from the start",
                .file = folder.path().string()};
        for (const SideFile& each : done_.sideFiles)
            if (fileStamp(each.path) != each.stamp)
                return Error{.code = ErrorCode::Usage,
                             .message = fmt::format("was changed since the unfinished build in {} read it; build "
                                                    "again from the start",
                                                    folder.path().string()),
                             .file = each.path.string()};
        return {};
    }

    /// Makes what is done durable, and records it in the journal: everything up to bin `bin` of the pass. `always`:
    /// even if the last checkpoint was a moment ago.
    Result<void> checkpoint(const char* stage, size_t bin, bool always = false) {
        if (!always && meter_.seconds() - lastCheckpoint_ < options_.checkpointSeconds) return {};
        VCP_TRY(space_.folder().take());
        VCP_TRY_ASSIGN(auto fields, files_.sync());
        fields.update({{"stage", stage}, {"pass", pass_}, {"bin", bin}});
        if (!journal_.active())
            fields.update({{"build", buildFingerprint(options_)},
                           {"measures", jsonOf(measures_)},
                           {"side files", jsonOf(report_.sideFiles)}});
        if (!partitionRecorded_ && files_.current) {
            fields["partition"] = plan_.finest.first();
            fields["parted"] = plan_.pages.parted();
            fields["levels less"] = levelsLess_;
            fields["pages"] = finestPages_;
            partitionRecorded_ = true;
        }
        VCP_TRY(journal_.record(space_.folder(), fields));
        lastCheckpoint_ = meter_.seconds();
        return {};
    }

    Result<void> resumeMeasures() {
        measures_ = done_.measures;
        report_.sideFiles = done_.sideFiles;
        if (done_.stage != "read") return {};
        files_.soup = std::make_unique<Soup>(space_, memory_.bufferBytes);
        VCP_TRY(files_.reopen(done_, space_));
        return reactivate(kReadingShare);
    }

    /// Continues the journal in the same file; what it says stays true. `done`: fraction of the whole.
    Result<void> reactivate(double done) {
        meter_.beginAt(done);
        return journal_.record(space_.folder(), {{"resumed", true}});
    }

    Result<void> resumeBins() {
        levelsLess_ = done_.levelsLess;
        VCP_TRY_ASSIGN(plan_, planLevels(options_, measures_, levelsLess_));
        plan_.setPages(plan_.frame, FinestPages(plan_.gridOf(plan_.levels() - 1), done_.parted));
        setUpLevels();
        plan_.finest = PagePartition(done_.partition);
        finestPages_ = done_.pages;
        VCP_TRY(planForPages());
        partitionRecorded_ = true;
        pass_ = done_.pass;
        firstBin_ = done_.bin;
        if (pass_ >= 0) openPass();
        openImages(done_.files.images.size());
        if (done_.files.bins.contains("textures")) openTextures();
        VCP_TRY(files_.reopen(done_, space_));
        if (firstBin_ >= std::max<size_t>(binsOfPass(), 1))
            return Error{.code = ErrorCode::InvalidInput,
                         .message = "names a bin that there is not; build again from the start",
                         .file = (space_.folder().path() / kJournalName).string()};
        return reactivate(pass_ < 0 ? 1 - kWritingShare : fractionAt(firstBin_));
    }

    // Reading and dealing

    void warnOfWideCells() {
        if (auto warning = wideCellWarning(options_, measures_)) report_.warnings.push_back(std::move(*warning));
    }

    Result<void> read() {
        if (!progress("reading", 0)) return cancelled();
        files_.soup = std::make_unique<Soup>(space_, memory_.bufferBytes);
        const auto report = [this](double fraction, uint64_t triangles) {
            measures_.triangles = triangles;
            return progress("reading", kReadingShare * fraction);
        };
        VCP_TRY_ASSIGN(const auto tally, arena_.execute([&] {
            return readInputs(options_, space_, memory_.vertexBytes, *files_.soup, report, report_.warnings,
                              report_.sideFiles);
        }));
        VCP_TRY_ASSIGN(measures_, measuresOf(tally, options_));
        VCP_TRY(checkOutput(options_.output, OutputKind::Dataset, rules()));
        releaseMemory();
        // Images are not kept, so a soup that needs them is dealt before its checkpoint. What was read is not lost
        // where there is too little room for the rest.
        const auto checked = checkSpace();
        const auto kept = files_.soup->materials.empty() ? checkpoint("read", 0, !checked) : Result<void>();
        if (checked) return kept;
        Error error = checked.error();
        if (kept && journal_.active()) error.code = ErrorCode::Io;
        return error;
    }

    /// Checks the free space now: a disk that is too small would be noticed only after hours.
    Result<void> checkSpace() const {
        const uint64_t images = mayKeepImages() ? expectedImageBytes(files_.soup->materials) : 0;
        const uint64_t soup = files_.soup->floats.raw().bytes() + files_.soup->doubles.raw().bytes();
        const uint64_t temp = expectedTempBytes(measures_.triangles, soup, images, memory_.tempBytes),
                       there = space_.diskBytes();
        return checkBuildSpace({space_.folder().path(), temp > there ? temp - there : 0, "temporary folder"},
                               options_.output, expectedFileBytes(measures_.triangles) + images);
    }

    [[nodiscard]] ColourUse colourUse() const { return colourUseOf(options_, measures_); }
    [[nodiscard]] bool hasColour() const { return colourUse().any(); }

    void setUpLevels() {
        for (uint32_t level = 0; level < plan_.frame.levels; ++level) {
            files_.spools.emplace_back(space_, level);
            if (plan_.hasSlabs) files_.surfaces.emplace_back(space_, level, "surface");
        }
        files_.neededSurfaces = files_.surfaces.size();
        files_.parts = std::make_unique<PartNotes>(space_, memory_.bufferBytes / 16);
    }

    /// Chooses the pages that hold the mesh, and the bins.
    Result<void> choosePlan() {
        const SoupShare all{.soup = *files_.soup};
        const PagePlanning planning{
            .options = options_,
            .measures = measures_,
            .soups = {&all, 1},
            .memory = memory_,
            .mayKeepImages = mayKeepImages(),
            .progress = [&](double part) { return progress("sorting", kReadingShare + kDealingShare / 2 * part); }};
        VCP_TRY_ASSIGN(auto chosen, arena_.execute([&] { return planPagesOf(planning); }));
        plan_ = std::move(chosen.levels);
        levelsLess_ = chosen.levelsLess;
        finestPages_ = chosen.pages;
        return planForPages();
    }

    Result<void> planForPages() {
        VCP_TRY_ASSIGN(memory_, planPages(memory_, finestPages_, plan_.finest.bins()));
        plan_.pageBytes = memory_.pageBytes;
        return {};
    }

    [[nodiscard]] bool mayKeepImages() const { return vcp::mayKeepImages(options_, measures_, files_.soup->materials); }

    /// Codes the images that the file is to keep. Returns what it has of each of the soup's materials; empty where that
    /// is nothing.
    Result<std::vector<PlacedMaterial>> keepImages() {
        std::vector<PlacedMaterial> placed;
        if (!mayKeepImages()) return placed;
        openImages(1);
        const double images = expectedImageSeconds(expectedImageBytes(files_.soup->materials));
        imagesShare_ = images / (images + kSecondsOfTriangle * double(measures_.triangles));
        const auto report = [&](double part) {
            imagesDone_ = imagesShare_ * part;
            return progress("images", kReadingShare + kDealingShare / 2);
        };
        // Nothing else takes the memory of pages yet.
        VCP_TRY_ASSIGN(placed, storeImages(files_.soup->materials, options_, memory_.pageBytes, space_,
                                           files_.images.front(), report_.warnings, report));
        imagesDone_ = imagesShare_;
        releaseMemory();
        if (!placed.empty()) openTextures();
        return placed;
    }

    void openImages(size_t count) {
        for (size_t i = 0; i < count; ++i) files_.images.emplace_back(space_, uint32_t(i), "image");
    }
    void openTextures() {
        files_.textures = std::make_unique<RecordBins<TexturedTriangle>>(space_, "textures", plan_.finest.bins(),
                                                                         memory_.bufferBytes / 4);
    }

    Result<void> dealSoup() {
        std::optional<MaterialColours> colours;
        if (colourUse().materials) colours.emplace(files_.soup->materials, memory_.vertexBytes);
        VCP_TRY_ASSIGN(const auto placed, arena_.execute([&] { return keepImages(); }));
        const LatticeSnapper snapper(plan_.frame, colours ? &*colours : nullptr, colourUse().vertices, plan_.pages,
                                     placed);
        const double begins = kReadingShare + kDealingShare / 2;
        std::atomic<uint64_t> tiny = 0;
        const SoupShare all{.soup = *files_.soup};
        const Dealing dealing{{&all, 1},
                              snapper,
                              plan_.gridOf(pass_ - 1),
                              files_.textures.get(),
                              plan_.pages,
                              plan_.marginCells(),
                              tiny,
                              [&](double part) { return progress("sorting", begins + kDealingShare / 2 * part); }};
        openPass();
        VCP_TRY(arena_.execute([&] { return dealTriangles(dealing, plan_.finest, *files_.current); }));
        if (auto warning = tinyWarning(tiny, measures_.triangles, plan_.frame)) report_.warnings.push_back(*warning);
        if (colours)
            report_.warnings.insert(report_.warnings.end(), colours->warnings().begin(), colours->warnings().end());
        return {};
    }

    Result<void> deal() {
        VCP_TRY(choosePlan());
        setUpLevels();
        pass_ = plan_.levels();
        VCP_TRY(dealSoup());
        auto soup = std::move(files_.soup);
        VCP_TRY(checkpoint("levels", 0, journal_.active()));
        soup->floats.raw().remove();
        soup->doubles.raw().remove();
        releaseMemory();
        return {};
    }

    // Levels

    /// Whether the pass ends with a mesh in memory that the next one begins with: the vertices of a build of one bin.
    [[nodiscard]] bool keepsMesh() const { return pass_ == plan_.levels() && plan_.finest.bins() == 1; }
    /// Whether the pass fills the bins of the next one.
    [[nodiscard]] bool steps() const { return plan_.steps(pass_) && !keepsMesh(); }

    /// Makes the bins of a pass and of the pass after it.
    void openPass() {
        const auto bins = [&](int pass) {
            return std::make_unique<RecordBins<LatticeTriangle>>(space_, fmt::format("level{}", pass),
                                                                 plan_.partitionOf(plan_.levelOf(pass)).bins(),
                                                                 memory_.bufferBytes);
        };
        if (plan_.isOfSlabs(pass_)) return;
        if (!files_.current) files_.current = bins(pass_);
        if (!files_.vertices && pass_ + 1 >= plan_.levels() && plan_.finest.bins() > 1)
            files_.vertices = std::make_unique<RecordBins<VertexImage>>(space_, "normals", plan_.finest.bins(),
                                                                        memory_.bufferBytes / 4);
        if (!steps()) return;
        files_.next = bins(pass_ - 1);
        if (pass_ == plan_.levels()) return;
        files_.waiting = std::make_unique<RecordBins<WaitingTriangle>>(space_, fmt::format("waiting{}", pass_),
                                                                       plan_.partitionOf(plan_.levelOf(pass_)).bins(),
                                                                       memory_.bufferBytes / 4);
    }

    /// Returns the settings of a level's pages in this pass.
    [[nodiscard]] LevelSettings settingsOf(int level) {
        LevelSettings settings = plan_.settingsOf(level, pass_ + 1 == plan_.levels());
        settings.withColour = hasColour();
        settings.codesSurface = space_.diskBytes() > 0 || !space_.isAmple(0);
        settings.roomBytes = memory_.tempBytes;
        settings.makeRoom = [this] { return space_.spill(); };
        return settings;
    }

    /// Returns the fraction of the whole at which a pass begins.
    [[nodiscard]] double passBegins(int pass) const {
        const double first = kReadingShare + kDealingShare;
        if (pass == plan_.levels()) return first;
        return first + kVerticesShare + (1 - first - kVerticesShare - kWritingShare) * plan_.timeBefore(pass);
    }

    [[nodiscard]] double passEnds(int pass) const { return pass == 0 ? 1 - kWritingShare : passBegins(pass - 1); }

    [[nodiscard]] std::string stageOf(int pass) const {
        if (pass == plan_.levels()) return "sorting";
        return fmt::format("level {} of {}", plan_.levels() - pass, plan_.frame.levels);
    }

    /// Returns in how many parts the pass is worked on, with checkpoints between them.
    [[nodiscard]] size_t binsOfPass() {
        if (pass_ < 0) return 0;
        if (plan_.isOfSlabs(pass_)) return binsOf(siblingsBelow());
        return plan_.partitionOf(plan_.levelOf(pass_)).bins();
    }
    static size_t binsOf(const std::vector<Siblings>& parents) {
        return (parents.size() + kSlabPagesPerBin - 1) / kSlabPagesPerBin;
    }

    /// Returns the fraction of the whole that is done where the pass comes to a bin.
    [[nodiscard]] double fractionAt(size_t bin) {
        double before = 0, all = 0;
        if (plan_.isOfSlabs(pass_)) {
            before = double(bin * kSlabPagesPerBin);
            all = double(siblingsBelow().size());
        } else {
            before = double(trianglesBefore(bin));
            all = double(files_.current->raw().total());
        }
        return passBegins(pass_) + (passEnds(pass_) - passBegins(pass_)) * before / std::max(all, 1.0);
    }
    [[nodiscard]] uint64_t trianglesBefore(size_t bin) const {
        uint64_t triangles = 0;
        for (size_t each = 0; each < bin; ++each) triangles += files_.current->count(each);
        return triangles;
    }

    /// Returns the pages below the pass's, which hold the mesh or have been made from those that do, by their parents.
    std::vector<Siblings> siblingsBelow() {
        PageSpool& below = files_.surfaces[size_t(pass_) + 1];
        below.sortEntries();
        return siblingsIn(below);
    }

    /// Returns what takes the surface in a level's pages; null where no level is made from it.
    [[nodiscard]] PageSpool* surfacesOf(int level) {
        return plan_.hasSlabs && level > 0 ? &files_.surfaces[size_t(level)] : nullptr;
    }

    /// Makes the pages of a level from the surface in those below.
    Result<void> runSlabPass() {
        const std::vector<Siblings> parents = siblingsBelow();
        const PageSpool& below = files_.surfaces[size_t(pass_) + 1];
        const size_t bins = binsOf(parents);
        const double begins = passBegins(pass_), share = passEnds(pass_) - begins;
        for (size_t bin = firstBin_; bin < bins; ++bin) {
            const size_t first = bin * kSlabPagesPerBin, end = std::min(parents.size(), first + kSlabPagesPerBin);
            Result<void> result;
            arena_.execute([&] {
                result =
                    buildSlabPages(settingsOf(pass_), below, std::span(parents).subspan(first, end - first),
                                   files_.spools[size_t(pass_)], surfacesOf(pass_), [&](double part) {
                                       const double done = double(first) + part * double(end - first);
                                       return progress(stageOf(pass_), begins + share * done / double(parents.size()));
                                   });
            });
            VCP_TRY(result);
            if (bin + 1 < bins) VCP_TRY(checkpoint("levels", bin + 1));
        }
        return endPass();
    }

    Result<void> runPass() {
        if (plan_.isOfSlabs(pass_)) return runSlabPass();
        if (pass_ + 1 == plan_.levels()) VCP_TRY(joinParts());
        if (!files_.next && steps()) openPass();
        const int level = plan_.levelOf(pass_);
        const PagePartition partition = plan_.partitionOf(level);
        const PageGrid grid = plan_.gridOf(level), coarser = plan_.gridOf(std::max(pass_ - 1, 0));
        const PagePartition nextPartition = plan_.partitionOf(std::max(pass_ - 1, 0));
        std::optional<LevelSink> sink;
        std::optional<LevelStep> step;
        std::optional<VertexStep> vertexStep;
        if (steps())
            sink.emplace(pass_ > level ? plan_.pages : FinestPages(coarser), nextPartition, *files_.next,
                         plan_.marginCells());
        if (sink && pass_ > level) vertexStep.emplace(grid, partition, *files_.vertices, *sink);
        if (sink && pass_ == level) step.emplace(grid, partition, *files_.waiting, *sink);
        const auto handOn = [&](size_t bin, const LatticeMesh& mesh) {
            return vertexStep ? vertexStep->run(bin, mesh) : step ? step->run(bin, mesh) : Result<void>();
        };
        const double begins = passBegins(pass_), ends = passEnds(pass_);
        const uint64_t total = std::max<uint64_t>(files_.current->raw().total(), 1);
        uint64_t done = trianglesBefore(firstBin_);
        for (size_t bin = firstBin_; bin < partition.bins(); ++bin) {
            const uint64_t count = files_.current->count(bin);
            const auto at = [&](double part) {
                return begins + (ends - begins) * (double(done) + part * double(count)) / double(total);
            };
            VCP_TRY(runBin(bin, partition.first()[bin], LevelPlan::endOf(partition, bin, level), handOn, at));
            releaseMemory();
            if (bin + 1 < partition.bins()) VCP_TRY(checkpoint("levels", bin + 1));
            done += count;
        }
        return endPass();
    }

    template <class HandOn, class At>
    Result<void> runBin(size_t bin, uint64_t first, uint64_t end, const HandOn& handOn, At&& at) {
        const bool vertices = pass_ == plan_.levels();
        const std::string stage = stageOf(pass_);
        if (!progress(stage, at(0))) return cancelled();
        return arena_.execute([&]() -> Result<void> {
            LatticeMesh mesh = std::exchange(mesh_, {});
            if (mesh.positions.empty()) {
                VCP_TRY_ASSIGN(mesh, loadMesh(bin));
            }
            // A bin without triangles has no corner that triangles could wait for, so nothing is passed on.
            if (mesh.positions.empty()) return {};
            if (pass_ + 1 == plan_.levels() && files_.textures) {
                VCP_TRY_ASSIGN(auto known, files_.textures->load(bin));
                addTextures(mesh, std::move(known));
            }
            if (pass_ + 1 == plan_.levels()) settleNormals(mesh);
            if (!vertices)
                VCP_TRY(buildBinPages(plan_, mesh,
                                      {.pass = pass_,
                                       .first = first,
                                       .end = end,
                                       .settings = [this](int level) { return settingsOf(level); },
                                       .pages = files_.spools,
                                       .surfaces = files_.surfaces,
                                       .progress = [&](double part) { return progress(stage, at(part)); }}));
            if (!keepsMesh()) return handOn(bin, mesh);
            mesh_ = std::move(mesh);
            return {};
        });
    }

    /// Returns the mesh of a bin; in the first pass, what is thin is kept, and normals and parts are found.
    Result<LatticeMesh> loadMesh(size_t bin) {
        VCP_TRY_ASSIGN(auto soup, files_.current->load(bin));
        if (pass_ < plan_.levels()) {
            if (pass_ + 1 == plan_.levels()) VCP_TRY(complete(soup, bin));
            return meshOf(soup, hasColour());
        }
        return meshWithNormals(plan_, std::move(soup), bin, hasColour(), *files_.parts);
    }

    /// Gives triangles of the finest level what was not known yet when they were handed on.
    Result<void> complete(std::vector<LatticeTriangle>& soup, size_t bin) {
        for (LatticeTriangle& t : soup) t.part = meshParts_->decided(t.part);
        if (!files_.vertices) return {};
        VCP_TRY_ASSIGN(auto vertices, files_.vertices->load(bin));
        if (joinVertices(soup, std::move(vertices))) return {};
        return damagedTempFile(space_.folder().path() / files_.vertices->raw().fileName());
    }

    /// Finds which parts of the mesh are closed, once all bins have noted theirs.
    Result<void> joinParts() {
        if (meshParts_) return {};
        PartNotes* const notes = files_.parts.get();
        VCP_TRY_ASSIGN(meshParts_, PartNotes::join(std::span(&notes, 1)));
        return {};
    }

    Result<void> endPass() {
        firstBin_ = 0;
        // What the mesh was made from stays until its pages are made: an interrupted build goes on from there.
        if (keepsMesh()) return {};
        if (files_.next) VCP_TRY(files_.next->raw().flush());
        if (files_.vertices) VCP_TRY(files_.vertices->raw().flush());
        std::unique_ptr<RecordBins<VertexImage>> joined;
        if (pass_ < plan_.levels()) joined = std::move(files_.vertices);
        std::unique_ptr<RecordBins<TexturedTriangle>> placed;
        if (pass_ < plan_.levels()) placed = std::move(files_.textures);
        auto finished = std::move(files_.current);
        auto waited = std::move(files_.waiting);
        files_.current = std::move(files_.next);
        if (plan_.isOfSlabs(pass_)) files_.neededSurfaces = size_t(pass_) + 1;
        --pass_;
        VCP_TRY(checkpoint("levels", 0, journal_.active()));
        ++pass_;
        if (finished) finished->raw().remove();
        if (waited) waited->raw().remove();
        if (joined) joined->raw().remove();
        if (placed) placed->raw().remove();
        if (plan_.isOfSlabs(pass_)) files_.surfaces[size_t(pass_) + 1].remove();
        return {};
    }

    /// Returns memory to the system: the allocator keeps what the threads freed, more with every bin.
    static void releaseMemory() {
#if defined(__GLIBC__)
        malloc_trim(0);
#endif
    }

    // Writing

    Result<void> write() {
        VCP_TRY(joinParts());
        FileHeader header = headerOf(plan_, measures_, hasColour(), meshParts_->counts);
        std::vector<JoinedSpools> levels(files_.spools.size());
        for (size_t i = 0; i < levels.size(); ++i) levels[i].add(files_.spools[i]);
        const PageSpool* const images = files_.images.empty() ? nullptr : &files_.images.front();
        const auto report = [this](double part) {
            return progress("writing", 1 - kWritingShare + kWritingShare * part);
        };
        VCP_TRY_ASSIGN(report_.fileBytes, arena_.execute([&] {
            return assembleDataset(levels, header, options_.output, rules(), images, report);
        }));
        describe(header, report_);
        report_.cutTriangles = measures_.cutTriangles;
        progress("done", 1);
        return {};
    }

    void finishReport() {
        report_.peakRssBytes = peakRssBytes();
        report_.tempBytes = space_.peakDiskBytes();
        report_.seconds = meter_.seconds();
    }

    const BuildOptions& options_;
    OutputClaim claim_;
    MemoryPlan memory_;
    ProgressMeter meter_;
    TempSpace space_;
    Journal journal_;
    Recorded done_;  ///< what an interrupted build recorded
    bool isResumed_ = false, partitionRecorded_ = false;
    double lastCheckpoint_ = 0;                ///< seconds
    double imagesShare_ = 0, imagesDone_ = 0;  ///< of the whole time
    WorkArena arena_;

    SoupMeasures measures_;
    LevelPlan plan_;
    uint32_t levelsLess_ = 0;   ///< as chooseFrame took it
    uint64_t finestPages_ = 0;  ///< that hold the mesh; 0 where these are so few that they were not counted
    BuildReport report_;
    WorkFiles files_;
    std::optional<MeshParts> meshParts_;  ///< once they are joined
    LatticeMesh mesh_;                    ///< what a pass hands to the next one, where it keepsMesh()
    int pass_ = 0;
    size_t firstBin_ = 0;  ///< where the pass that is resumed begins
};

}  // namespace

std::filesystem::path tempFolderOf(const BuildOptions& options) {
    std::filesystem::path name = options.output.filename();
    name += ".build";
    return (options.temp.empty() ? options.output.parent_path() : options.temp) / name;
}

Result<BuildReport> buildOctree(const BuildOptions& options) {
    if (options.inputs.empty()) return Error{.code = ErrorCode::Usage, .message = "no input mesh given"};
    if (keepsImages(options) && options.error > 0)
        return Error{.code = ErrorCode::Usage,
                     .message = "images lie on the mesh's own triangles; leave out the error that allows others"};
    VCP_TRY_ASSIGN(const auto memory, memoryOf(options));
    BuildOptions expanded = options;
    VCP_TRY_ASSIGN(expanded.inputs, expandInputs(options.inputs));
    auto built = Builder(expanded, memory, threadsOf(options), tempFolderOf(expanded)).run();
    if (built || !built.error().file.empty() || built.error().code == ErrorCode::Cancelled) return built;
    Error error = built.error();
    error.file = options.inputs.front().string();
    return error;
}

}  // namespace vcp
