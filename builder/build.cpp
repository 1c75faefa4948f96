#include "builder/build.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <sys/resource.h>
#include <unordered_map>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <fmt/format.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#include <xxhash.h>

#include "builder/collapsed_triangles.h"
#include "builder/estimate.h"
#include "builder/ingest.h"
#include "builder/journal.h"
#include "builder/lattice_soup.h"
#include "builder/level_pages.h"
#include "builder/level_step.h"
#include "builder/memory_plan.h"
#include "builder/page_spool.h"

namespace vcp {

namespace {

using nlohmann::json;

// Soft leaves of coarser levels may err by this many of their cells; they are looked at where a cell is
// about a pixel.
constexpr double kCoarseErrorCells = 0.12;

// Parts of the whole, in time: what is left after reading, dealing and the vertices is shared by the levels.
constexpr double kReadingShare = 0.08, kDealingShare = 0.04, kVerticesShare = 0.06, kWritingShare = 0.02;

// What the temporary files look like; a build does not go on where one of another version was.
constexpr int kTempVersion = 1;

/// What must be the same for a build to go on where another was.
std::string fingerprint(const BuildOptions& options) {
    std::string text = fmt::format("{} {} {:a} {:a} {} {} {}", kTempVersion, kFileVersion, options.cell, options.error, options.errorIsRelative, static_cast<int>(options.colour), options.format);
    for (const auto& input : options.inputs) {
        std::error_code ignored;
        const auto size = std::filesystem::file_size(input, ignored);
        const auto time = std::filesystem::last_write_time(input, ignored);
        text += fmt::format("|{} {} {}", std::filesystem::absolute(input, ignored).string(), size, time.time_since_epoch().count());
    }
    return fmt::format("{:016x}", XXH3_64bits(text.data(), text.size()));
}

json toJson(glm::dvec3 v) { return {v.x, v.y, v.z}; }
glm::dvec3 vectorFrom(const json& j) { return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()}; }

json toJson(const SoupMeasures& m) {
    return {{"min", toJson(m.boundsMin)}, {"max", toJson(m.boundsMax)}, {"area", m.area}, {"triangles", m.triangles}, {"degenerate", m.degenerateTriangles}, {"vertices", m.vertices}, {"vertex colours", m.hasVertexColours}, {"materials", m.hasMaterials}};
}

SoupMeasures measuresFrom(const json& j) {
    SoupMeasures m;
    m.boundsMin = vectorFrom(j.at("min"));
    m.boundsMax = vectorFrom(j.at("max"));
    m.area = j.at("area").get<double>();
    m.triangles = j.at("triangles").get<uint64_t>();
    m.degenerateTriangles = j.at("degenerate").get<uint64_t>();
    m.vertices = j.at("vertices").get<uint64_t>();
    m.hasVertexColours = j.at("vertex colours").get<bool>();
    m.hasMaterials = j.at("materials").get<bool>();
    return m;
}

/// First code after the pages of a level.
uint64_t endOfLevel(uint32_t level) { return uint64_t{1} << 3 * level; }

class Builder {
public:
    Builder(const BuildOptions& options, const MemoryPlan& plan, unsigned threads)
        : options_(options), plan_(plan), start_(std::chrono::steady_clock::now()), lastCheckpoint_(start_), space_(tempFolderOf(options), plan.tempBytes), arena_(static_cast<int>(threads)) {
        // Without it TBB gives no more threads than processors, and says so.
        if (threads > tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)) more_.emplace(tbb::global_control::max_allowed_parallelism, threads);
    }

    Result<BuildReport> run() {
        auto built = caught();
        if (built) {
            space_.remove();
            finishReport();
            return report_;
        }
        Error error = built.error();
        const bool mayPass = error.code == ErrorCode::Cancelled || error.code == ErrorCode::Io, needsMore = error.code == ErrorCode::Limit && current_;
        const bool worthKeeping = (journal_.active() || isResumed_) && (mayPass || needsMore);
        if (!worthKeeping) {
            if (error.code != ErrorCode::Usage) space_.remove();
            if (error.code == ErrorCode::Cancelled) error.message = "cancelled; nothing was written";
        } else {
            error.message += fmt::format("; the same command with --resume{} goes on from here, or delete {}", needsMore ? " and the memory" : "", space_.folder().string());
        }
        if (error.file.empty()) error.file = options_.output.string();
        return error;
    }

private:
    Result<void> caught() {
        try {
            return stages();
        } catch (const std::bad_alloc&) {
            return Error{.code = ErrorCode::Limit, .message = "the system has no more memory to give; use a smaller --memory, or fewer --threads"};
        }
    }

    Result<void> stages() {
        // A wrong output is found before an hour's work, not after it.
        if (auto probe = VcpWriter::create(options_.output, 1); !probe) return probe.error();
        VCP_TRY(openJournal());
        const std::string stage = done_.value("stage", "");
        if (stage.empty()) VCP_TRY(read());
        else VCP_TRY(resumeMeasures());
        auto frame = chooseFrame(options_, measures_);
        if (!frame) return frame.error();
        frame_ = *frame;
        VCP_TRY(chooseError());
        describe();
        if (stage.empty() || stage == "read") VCP_TRY(deal());
        else VCP_TRY(resumeBins());
        for (; pass_ >= 0; --pass_) VCP_TRY(runPass());
        return write();
    }

    // Progress and time

    [[nodiscard]] double secondsSince(std::chrono::steady_clock::time_point t) const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - t).count(); }

    bool progress(const std::string& stage, double fraction) {
        if (!options_.progress) return true;
        const std::scoped_lock lock(progressMutex_);
        fraction_ = std::max(fraction_, std::min(fraction, 1.0));
        const double seconds = secondsSince(start_);
        if (seconds - lastProgress_ < 0.1 && fraction < 1) return !cancelled_;
        lastProgress_ = seconds;
        if (!options_.progress({.stage = stage.c_str(), .fraction = fraction_, .triangles = measures_.triangles, .tempBytes = space_.diskBytes(), .seconds = seconds})) cancelled_ = true;
        return !cancelled_;
    }

    Error cancelled() const { return {.code = ErrorCode::Cancelled, .message = "cancelled", .file = options_.output.string()}; }

    // The journal

    Result<void> openJournal() {
        std::error_code ignored;
        if (!std::filesystem::exists(space_.folder(), ignored)) return {};
        VCP_TRY(space_.lock());
        if (options_.resume) {
            auto done = Journal::read(space_.folder());
            if (!done) return done.error();
            if (done->is_object()) done_ = *done;
        }
        if (done_.empty()) {
            space_.clear();
            return {};
        }
        if (done_.value("build", "") != fingerprint(options_))
            return Error{.code = ErrorCode::Usage, .message = "the unfinished build here is of other inputs or options; without --resume it is started again", .file = space_.folder().string()};
        isResumed_ = true;
        return {};
    }

    /// Makes what is done durable, and says so in the journal: everything up to bin `bin` of the pass.
    /// `always`: even if the last time was a moment ago.
    Result<void> checkpoint(const char* stage, size_t bin, bool always = false) {
        if (!always && secondsSince(lastCheckpoint_) < options_.checkpointSeconds) return {};
        VCP_TRY(space_.lock());
        json files = json::object();
        const auto sync = [&](auto& bins, const std::string& name) -> Result<void> {
            VCP_TRY(bins.raw().sync());
            files[name] = bins.raw().bytes();
            return {};
        };
        if (soup_) {
            VCP_TRY(sync(soup_->floats, "floats"));
            VCP_TRY(sync(soup_->doubles, "doubles"));
        }
        if (current_) VCP_TRY(sync(*current_, "current"));
        if (next_) VCP_TRY(sync(*next_, "next"));
        if (waiting_) VCP_TRY(sync(*waiting_, "waiting"));
        json spools = json::array();
        for (auto& spool : spools_) {
            if (spool.bytes() > 0) VCP_TRY(spool.sync());
            spools.push_back({spool.bytes(), spool.entries().size()});
        }
        json fields = {{"stage", stage}, {"pass", pass_}, {"bin", bin}, {"files", files}, {"spools", spools}};
        if (!journal_.active()) fields.update({{"build", fingerprint(options_)}, {"measures", toJson(measures_)}});
        if (!partitionRecorded_ && current_) {
            fields["partition"] = finest_.first();
            partitionRecorded_ = true;
        }
        VCP_TRY(journal_.record(space_.folder(), fields));
        lastCheckpoint_ = std::chrono::steady_clock::now();
        return {};
    }

    [[nodiscard]] uint64_t recordedBytes(const char* file) const { return done_.at("files").value(file, uint64_t{0}); }

    Result<void> resumeMeasures() {
        measures_ = measuresFrom(done_.at("measures"));
        if (done_.value("stage", "") != "read") return {};
        soup_ = std::make_unique<Soup>(space_, plan_.bufferBytes);
        space_.clear({kJournalName, soup_->floats.raw().fileName(), soup_->doubles.raw().fileName()});
        VCP_TRY(soup_->floats.raw().reopen(recordedBytes("floats")));
        VCP_TRY(soup_->doubles.raw().reopen(recordedBytes("doubles")));
        return reactivate();
    }

    /// The journal goes on in the same file; what it says stays true.
    Result<void> reactivate() { return journal_.record(space_.folder(), {{"resumed", true}}); }

    Result<void> resumeBins() {
        setUpLevels();
        finest_ = PagePartition(done_.at("partition").get<std::vector<uint64_t>>());
        partitionRecorded_ = true;
        pass_ = done_.at("pass").get<int>();
        firstBin_ = done_.at("bin").get<size_t>();
        if (pass_ >= 0) openPass();
        dropUnfinished();
        const json& spools = done_.at("spools");
        for (size_t i = 0; i < spools_.size(); ++i)
            if (const uint64_t bytes = spools.at(i).at(0).get<uint64_t>(); bytes > 0) VCP_TRY(spools_[i].reopen(bytes, spools.at(i).at(1).get<uint64_t>()));
        VCP_TRY(reactivate());
        if (pass_ < 0) return {};
        VCP_TRY(current_->raw().reopen(recordedBytes("current")));
        if (recordedBytes("next") > 0) VCP_TRY(next_->raw().reopen(recordedBytes("next")));
        if (recordedBytes("waiting") > 0) VCP_TRY(waiting_->raw().reopen(recordedBytes("waiting")));
        return {};
    }

    /// Files of work that was not recorded as done only take room.
    void dropUnfinished() {
        std::vector<std::string> kept{kJournalName};
        for (const PageSpool& spool : spools_) kept.insert(kept.end(), {spool.pagesFile(), spool.directoryFile()});
        for (const auto* bins : {current_.get(), next_.get()})
            if (bins) kept.push_back(bins->raw().fileName());
        if (waiting_) kept.push_back(waiting_->raw().fileName());
        space_.clear(kept);
    }

    // Reading and dealing

    Result<void> read() {
        soup_ = std::make_unique<Soup>(space_, plan_.bufferBytes);
        auto measures = readInputs(options_, space_, plan_.vertexBytes, *soup_, [this](double fraction, uint64_t triangles) {
            measures_.triangles = triangles;
            return progress("reading", kReadingShare * fraction);
        }, report_.warnings);
        if (!measures) return measures.error();
        measures_ = *measures;
        releaseMemory();
        VCP_TRY(checkFreeSpace());
        // Images are not kept: what has them is dealt before it is safe.
        return soup_->materials.empty() ? checkpoint("read", 0) : Result<void>();
    }

    /// A disk that is too small is found now, not after hours.
    Result<void> checkFreeSpace() const {
        const auto check = [](const std::filesystem::path& at, uint64_t needed, const char* option) -> Result<void> {
            const uint64_t free = freeBytesAt(at);
            if (needed <= free) return {};
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("about {} MB are needed here and {} MB are free; free some space or choose another folder{}", needed / 1000000, free / 1000000, option),
                         .file = at.string()};
        };
        const uint64_t temp = expectedTempBytes(measures_.triangles, plan_.tempBytes), there = space_.diskBytes();
        VCP_TRY(check(space_.folder(), temp > there ? temp - there : 0, " with --temp"));
        return check(options_.output, expectedFileBytes(measures_.triangles), "");
    }

    Result<void> chooseError() {
        double error = options_.error;
        if (options_.errorIsRelative) error *= glm::length(measures_.boundsMax - measures_.boundsMin);
        if (error <= 0) error = kDefaultErrorCells * frame_.cell;
        // Rounding to the lattice is part of the error; below a few steps nothing could be certified.
        const double least = 8 * kLatticeRounding * frame_.cell;
        if (error < least)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("an error of {:g} needs a finer cell than {:g}; use --cell {:g} or smaller", error, frame_.cell, error / (8 * kLatticeRounding))};
        report_.errorTarget = error;
        return {};
    }

    [[nodiscard]] bool usesVertexColours() const { return measures_.hasVertexColours && (options_.colour == ColourChoice::Auto || options_.colour == ColourChoice::Vertex); }
    [[nodiscard]] bool usesMaterials() const { return measures_.hasMaterials && (options_.colour == ColourChoice::Auto || options_.colour == ColourChoice::Texture); }
    [[nodiscard]] bool hasColour() const { return usesVertexColours() || usesMaterials(); }

    void describe() {
        report_.triangles = measures_.triangles;
        report_.degenerateTriangles = measures_.degenerateTriangles;
        report_.vertices = measures_.vertices;
        report_.levels = frame_.levels;
        report_.cell = frame_.cell;
        for (int i = 0; i < 3; ++i) {
            header_.origin[i] = frame_.origin[i];
            header_.boundsMin[i] = measures_.boundsMin[i];
            header_.boundsMax[i] = measures_.boundsMax[i];
        }
        header_.flags = hasColour() ? kFlagColour : 0;
    }

    void setUpLevels() {
        for (uint32_t level = 0; level < frame_.levels; ++level) spools_.emplace_back(space_, level);
    }

    [[nodiscard]] PageGrid gridOf(int level) const { return {frame_.log2Cells, static_cast<uint32_t>(level)}; }

    /// Calls visit(piece) for every triangle of the soup on the lattice, from many threads.
    template <class MakeVisit>
    Result<void> forLatticeTriangles(double before, bool painted, MakeVisit&& makeVisit) {
        const LatticeSnapper snapper(frame_, colours_ ? &*colours_ : nullptr, usesVertexColours());
        const uint64_t total = soup_->floats.raw().total() + soup_->doubles.raw().total();
        std::atomic<uint64_t> done = 0;
        std::atomic<bool> failed = false;
        std::mutex mutex;
        Result<void> result;
        const auto all = [&](const auto& bins) {
            const auto blocks = bins.raw().blocks(0);
            tbb::parallel_for(size_t{0}, blocks.size(), [&](size_t i) {
                if (cancelled_ || failed) return;
                auto visit = makeVisit();
                auto records = bins.read(blocks[i]);
                Result<void> here = records ? Result<void>() : Result<void>(records.error());
                if (records)
                    for (const auto& t : *records) snapper.add(t, [&](const LatticeTriangle& piece) { if (here) here = visit(piece); }, painted);
                if (here) here = visit.finish();
                progress("sorting", before + kDealingShare / 2 * double(done += blocks[i].records) / double(total));
                if (here) return;
                const std::scoped_lock lock(mutex);
                if (!failed.exchange(true)) result = here;
            });
        };
        arena_.execute([&] {
            all(soup_->floats);
            all(soup_->doubles);
        });
        if (result && cancelled_) return cancelled();
        return result;
    }

    /// Chooses the bins: one, or by how many triangles each page of the finest level needs.
    Result<void> choosePartition() {
        const uint64_t triangles = soup_->floats.raw().total() + soup_->doubles.raw().total();
        if (triangles <= plan_.binTriangles) return {};
        using Counts = std::unordered_map<uint64_t, uint64_t>;
        const PageGrid grid = gridOf(static_cast<int>(frame_.levels) - 1);
        tbb::enumerable_thread_specific<Counts> parts;
        struct Visit {
            const PageGrid& grid;
            Counts& counts;
            Result<void> operator()(const LatticeTriangle& t) {
                grid.forPagesNear(t.corner, kStepMarginCells, [&](uint64_t page) { ++counts[page]; });
                return {};
            }
            static Result<void> finish() { return {}; }
        };
        VCP_TRY(forLatticeTriangles(kReadingShare, false, [&] { return Visit{grid, parts.local()}; }));
        std::map<uint64_t, uint64_t> counts;
        for (Counts& part : parts) {
            for (const auto& [page, count] : part) counts[page] += count;
            Counts().swap(part);
        }
        finest_ = PagePartition({counts.begin(), counts.end()}, plan_.binTriangles);
        return {};
    }

    Result<void> deal() {
        setUpLevels();
        if (usesMaterials()) colours_.emplace(soup_->materials, plan_.vertexBytes);
        VCP_TRY(choosePartition());
        pass_ = static_cast<int>(frame_.levels);
        openPass();
        const PageGrid grid = gridOf(pass_ - 1);
        // A triangle goes to the bins that its corners lie in: that is where their normals are found.
        struct Visit {
            const PageGrid& grid;
            const PagePartition& partition;
            BinBatch<LatticeTriangle> batch;
            Result<void> operator()(const LatticeTriangle& t) {
                size_t bin[3];
                for (int i = 0; i < 3; ++i) bin[i] = partition.binOf(grid.pageOf(t.corner[i]));
                for (int i = 0; i < 3; ++i)
                    if (std::find(bin, bin + i, bin[i]) == bin + i) VCP_TRY(batch.add(bin[i], t));
                return {};
            }
            Result<void> finish() { return batch.flush(); }
        };
        VCP_TRY(forLatticeTriangles(kReadingShare + kDealingShare / 2, true, [&] { return Visit{grid, finest_, BinBatch(*current_)}; }));
        VCP_TRY(current_->raw().flush());
        if (colours_) report_.warnings.insert(report_.warnings.end(), colours_->warnings().begin(), colours_->warnings().end());
        colours_.reset();
        auto soup = std::move(soup_);
        VCP_TRY(checkpoint("levels", 0, journal_.active()));
        soup->floats.raw().remove();
        soup->doubles.raw().remove();
        releaseMemory();
        return {};
    }

    // Levels. Pass `levels` steps from the snapped triangles to the finest level; pass l builds level l's
    // pages and steps to level l - 1.

    /// Level whose grid and bins a pass works on.
    [[nodiscard]] int levelOf(int pass) const { return std::min(pass, static_cast<int>(frame_.levels) - 1); }

    [[nodiscard]] PagePartition partitionOf(int level) const {
        PagePartition partition = finest_;
        for (int l = static_cast<int>(frame_.levels) - 1; l > level; --l) partition = partition.coarser();
        return partition;
    }

    /// Makes the bins of a pass and of the one after it.
    void openPass() {
        const auto bins = [&](int pass) {
            return std::make_unique<RecordBins<LatticeTriangle>>(space_, fmt::format("level{}", pass), partitionOf(levelOf(pass)).bins(), plan_.bufferBytes);
        };
        if (!current_) current_ = bins(pass_);
        if (pass_ == 0) return;
        next_ = bins(pass_ - 1);
        waiting_ = std::make_unique<RecordBins<WaitingTriangle>>(space_, fmt::format("waiting{}", pass_), partitionOf(levelOf(pass_)).bins(), plan_.bufferBytes / 4);
    }

    [[nodiscard]] LevelSettings settingsOf(int level) {
        LevelSettings settings;
        settings.grid = gridOf(level);
        settings.finest = level + 1 == static_cast<int>(frame_.levels);
        settings.cell = std::ldexp(frame_.cell, static_cast<int>(frame_.levels) - 1 - level);
        settings.tolerance = settings.finest ? report_.errorTarget / settings.cell : kCoarseErrorCells;
        settings.pageBytes = plan_.pageBytes;
        settings.roomBytes = plan_.tempBytes;
        settings.makeRoom = [this] { return space_.spill(); };
        return settings;
    }

    /// Fraction of the whole at which a pass begins: each coarser level takes about a third of the one before.
    [[nodiscard]] double passBegins(int pass) const {
        const double first = kReadingShare + kDealingShare;
        if (pass == static_cast<int>(frame_.levels)) return first;
        const double rest = 1 - first - kVerticesShare - kWritingShare;
        return first + kVerticesShare + rest * (1 - std::pow(1.0 / 3, static_cast<double>(frame_.levels) - 1 - pass));
    }

    Result<void> runPass() {
        if (!next_ && pass_ > 0) openPass();
        const int level = levelOf(pass_);
        const PagePartition partition = partitionOf(level);
        const PageGrid grid = gridOf(level), coarser = gridOf(std::max(pass_ - 1, 0));
        const PagePartition nextPartition = partitionOf(std::max(pass_ - 1, 0));
        std::optional<LevelSink> sink;
        std::optional<LevelStep> step;
        if (pass_ > 0) {
            sink.emplace(coarser, nextPartition, *next_);
            step.emplace(pass_ > level, grid, partition, *waiting_, *sink);
        }
        const double begins = passBegins(pass_), ends = pass_ == 0 ? 1 - kWritingShare : passBegins(pass_ - 1);
        const uint64_t total = std::max<uint64_t>(current_->raw().total(), 1);
        uint64_t done = 0;
        for (size_t bin = 0; bin < partition.bins(); ++bin) {
            const uint64_t count = current_->count(bin);
            const auto at = [&](double part) { return begins + (ends - begins) * (double(done) + part * double(count)) / double(total); };
            if (bin >= firstBin_) {
                const uint64_t end = bin + 1 < partition.bins() ? partition.first()[bin + 1] : endOfLevel(static_cast<uint32_t>(level));
                VCP_TRY(runBin(bin, partition.first()[bin], end, step ? &*step : nullptr, at));
                releaseMemory();
                if (bin + 1 < partition.bins()) VCP_TRY(checkpoint("levels", bin + 1));
            }
            done += count;
        }
        return endPass();
    }

    template <class At>
    Result<void> runBin(size_t bin, uint64_t first, uint64_t end, LevelStep* step, At&& at) {
        const bool vertices = pass_ == static_cast<int>(frame_.levels);
        const std::string stage = vertices ? std::string("sorting") : fmt::format("level {} of {}", static_cast<int>(frame_.levels) - pass_, frame_.levels);
        if (!progress(stage, at(0))) return cancelled();
        auto soup = current_->load(bin);
        if (!soup) return soup.error();
        // A bin without triangles still passes on what waits for it: nothing does, there is no corner in it.
        if (soup->empty()) return {};
        Result<void> result;
        arena_.execute([&] {
            if (vertices) keepThin(*soup, bin);
            LatticeMesh mesh = meshOf(*soup, hasColour());
            std::vector<LatticeTriangle>().swap(*soup);
            if (vertices) computeNormals(mesh);
            if (!vertices) result = buildPages(settingsOf(pass_), mesh, first, end, spools_[static_cast<size_t>(pass_)], [&](double part) { return progress(stage, at(part)); });
            if (result && step) result = step->run(bin, mesh);
        });
        return result;
    }

    /// Slivers and crumbs that vanish on the lattice.
    void keepThin(std::vector<LatticeTriangle>& soup, size_t bin) const {
        const PageGrid grid = gridOf(levelOf(pass_));
        keepCollapsed(
            soup, [&](glm::i32vec3 p) { return finest_.binOf(grid.pageOf(p)) == bin; },
            [&](glm::i32vec3 p, glm::i32vec3 q) { return grid.pageOf(p) == grid.pageOf(q); });
    }

    Result<void> endPass() {
        firstBin_ = 0;
        if (next_) VCP_TRY(next_->raw().flush());
        auto finished = std::move(current_);
        auto waited = std::move(waiting_);
        current_ = std::move(next_);
        --pass_;
        VCP_TRY(checkpoint("levels", 0, journal_.active()));
        ++pass_;
        finished->raw().remove();
        if (waited) waited->raw().remove();
        return {};
    }

    /// The allocator keeps what the threads gave back, more with every bin.
    static void releaseMemory() {
#if defined(__GLIBC__)
        malloc_trim(0);
#endif
    }

    // Writing

    /// A page that only leads to finer ones: the surface moved out of it when the level was made.
    static StoredPage passagePage(uint32_t log2Cells) {
        PageHeader header;
        header.log2Cells = log2Cells;
        header.root = emptyNode(0);
        return compressPage(std::as_bytes(std::span(&header, 1)), {});
    }

    /// Every page gets a parent, and every parent knows its children. A passage's entry has no leaves.
    void linkLevels() {
        const auto byMorton = [](const PageEntry& a, const PageEntry& b) { return a.morton < b.morton; };
        for (uint32_t level = frame_.levels - 1; level > 0; --level) {
            std::vector<PageEntry>& parents = spools_[level - 1].entries();
            std::vector<PageEntry> missing;
            for (const PageEntry& page : spools_[level].entries()) {
                PageEntry passage;
                passage.morton = page.morton >> 3;
                passage.level = static_cast<uint8_t>(level - 1);
                if (!missing.empty() && missing.back().morton == passage.morton) continue;
                if (!std::binary_search(parents.begin(), parents.end(), passage, byMorton)) missing.push_back(passage);
            }
            parents.insert(parents.end(), missing.begin(), missing.end());
            std::sort(parents.begin(), parents.end(), byMorton);
        }
        uint64_t first = spools_[0].entries().size();
        for (uint32_t level = 0; level + 1 < frame_.levels; ++level) {
            size_t child = 0;
            const std::vector<PageEntry>& children = spools_[level + 1].entries();
            for (PageEntry& page : spools_[level].entries()) {
                page.firstChild = static_cast<uint32_t>(first + child);
                for (; child < children.size() && children[child].morton >> 3 == page.morton; ++child)
                    page.childMask |= static_cast<uint8_t>(1u << (children[child].morton & 7));
                if (page.childMask == 0) page.firstChild = 0;
            }
            first += children.size();
        }
    }

    Result<void> write() {
        linkLevels();
        uint64_t first = 0;
        header_.levels = frame_.levels;
        for (uint32_t level = 0; level < frame_.levels; ++level) {
            LevelRow& row = header_.level[level];
            row.firstEntry = first;
            row.pages = spools_[level].entries().size();
            for (const PageEntry& page : spools_[level].entries()) row.certifiedError = std::max(row.certifiedError, double(page.certifiedError));
            first += row.pages;
        }
        auto writer = VcpWriter::create(options_.output, first);
        if (!writer) return writer.error();
        uint64_t done = 0;
        for (const PageSpool& spool : spools_)
            for (const PageEntry& entry : spool.entries()) {
                auto page = entry.leaves > 0 ? spool.read(entry) : Result<StoredPage>(passagePage(frame_.log2Cells));
                if (!page) return page.error();
                VCP_TRY((*writer)->append(entry, *page));
                if (!progress("writing", 1 - kWritingShare + kWritingShare * double(++done) / double(first + 1))) return cancelled();
            }
        for (const PageEntry& entry : spools_.back().entries()) {
            report_.leaves += entry.leaves;
            report_.hardLeaves += entry.hardLeaves;
        }
        report_.subvolumes = first;
        report_.certifiedErrorMax = header_.level[frame_.levels - 1].certifiedError;
        header_.cell = frame_.cell;
        header_.errorTarget = report_.errorTarget;
        header_.certifiedErrorMax = report_.certifiedErrorMax;
        header_.log2Cells = frame_.log2Cells;
        header_.triangles = report_.triangles;
        header_.degenerateTriangles = report_.degenerateTriangles;
        header_.vertices = report_.vertices;
        header_.leaves = report_.leaves;
        header_.hardLeaves = report_.hardLeaves;
        auto bytes = (*writer)->commit(header_);
        if (!bytes) return bytes.error();
        report_.fileBytes = *bytes;
        progress("done", 1);
        return {};
    }

    void finishReport() {
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        report_.peakRssBytes = static_cast<uint64_t>(usage.ru_maxrss) * 1024;
        report_.tempBytes = space_.peakDiskBytes();
        report_.seconds = secondsSince(start_);
    }

    const BuildOptions& options_;
    const MemoryPlan plan_;
    std::chrono::steady_clock::time_point start_, lastCheckpoint_;
    TempSpace space_;
    Journal journal_;
    json done_ = json::object();  ///< what an interrupted build recorded
    bool isResumed_ = false;
    std::optional<tbb::global_control> more_;
    tbb::task_arena arena_;

    SoupMeasures measures_;
    GridFrame frame_;
    FileHeader header_;
    BuildReport report_;
    PagePartition finest_;
    bool partitionRecorded_ = false;
    std::unique_ptr<Soup> soup_;
    std::optional<MaterialColours> colours_;
    int pass_ = 0;
    size_t firstBin_ = 0;  ///< of the pass that is resumed
    std::unique_ptr<RecordBins<LatticeTriangle>> current_, next_;
    std::unique_ptr<RecordBins<WaitingTriangle>> waiting_;
    std::deque<PageSpool> spools_;

    std::mutex progressMutex_;
    double lastProgress_ = -1, fraction_ = 0;
    std::atomic<bool> cancelled_ = false;
};

}  // namespace

std::filesystem::path tempFolderOf(const BuildOptions& options) {
    std::filesystem::path name = options.output.filename();
    name += ".build";
    return (options.temp.empty() ? options.output.parent_path() : options.temp) / name;
}

Result<BuildReport> buildOctree(const BuildOptions& options) {
    if (options.inputs.empty()) return Error{.code = ErrorCode::Usage, .message = "no input mesh given"};
    const unsigned threads = options.threads > 0 ? options.threads : static_cast<unsigned>(std::max(1, tbb::this_task_arena::max_concurrency()));
    auto plan = planMemory(options.memoryBytes > 0 ? options.memoryBytes : defaultMemoryBytes(), threads);
    if (!plan) return plan.error();
    BuildOptions expanded = options;
    auto inputs = expandInputs(options.inputs);
    if (!inputs) return inputs.error();
    expanded.inputs = std::move(*inputs);
    return Builder(expanded, *plan, threads).run();
}

}  // namespace vcp
