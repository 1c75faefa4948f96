#include "builder/build.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <sys/resource.h>

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include "builder/bin_triangles.h"
#include "builder/coarsen.h"
#include "builder/ingest.h"
#include "builder/page_builder.h"
#include "builder/page_encoder.h"
#include "octree/vcp_writer.h"

namespace vcp {

namespace {

// Soft leaves of coarser levels may err by this many of their cells; they are looked at where a cell is
// about a pixel.
constexpr double kCoarseErrorCells = 0.2;

// Reading is about this part of the whole; the rest is shared by the levels by their triangles.
constexpr double kReadingShare = 0.15;

struct BuiltPage {
    PageEntry entry;
    StoredPage stored;
};

class Builder {
public:
    explicit Builder(const BuildOptions& options) : options_(options), start_(std::chrono::steady_clock::now()) {}

    Result<BuildReport> run() {
        if (options_.inputs.empty()) return Error{.code = ErrorCode::Usage, .message = "no input mesh given"};
        // A wrong output is found before an hour's work, not after it.
        if (auto probe = VcpWriter::create(options_.output, 1); !probe) return probe.error();
        auto ingested = ingest(options_, [this](double fraction, uint64_t triangles) {
            report_.triangles = triangles;
            return progress("reading", kReadingShare * fraction);
        });
        if (!ingested) return ingested.error();
        frame_ = ingested->frame;
        VCP_TRY(chooseError(*ingested));
        describe(*ingested);
        VCP_TRY(buildLevels(std::move(ingested->mesh)));
        VCP_TRY(write());
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        report_.peakRssBytes = static_cast<uint64_t>(usage.ru_maxrss) * 1024;
        report_.seconds = seconds();
        return report_;
    }

private:
    [[nodiscard]] double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

    bool progress(const char* stage, double fraction) {
        if (!options_.progress) return true;
        const std::scoped_lock lock(progressMutex_);
        fraction_ = std::max(fraction_, std::min(fraction, 1.0));
        if (seconds() - lastProgress_ < 0.1 && fraction < 1) return !cancelled_;
        lastProgress_ = seconds();
        if (!options_.progress({.stage = stage, .fraction = fraction_, .triangles = report_.triangles, .seconds = lastProgress_})) cancelled_ = true;
        return !cancelled_;
    }

    Result<void> chooseError(const IngestedMesh& ingested) {
        double error = options_.error;
        if (options_.errorIsRelative) error *= glm::length(ingested.boundsMax - ingested.boundsMin);
        if (error <= 0) error = kDefaultErrorCells * frame_.cell;
        // Rounding to the lattice is part of the error; below a few steps nothing could be certified.
        const double least = 8 * kLatticeRounding * frame_.cell;
        if (error < least)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("an error of {:g} needs a finer cell than {:g}; use --cell {:g} or smaller", error, frame_.cell, error / (8 * kLatticeRounding))};
        report_.errorTarget = error;
        return {};
    }

    void describe(const IngestedMesh& ingested) {
        report_.triangles = ingested.triangles;
        report_.degenerateTriangles = ingested.degenerateTriangles;
        report_.vertices = ingested.vertices;
        report_.levels = frame_.levels;
        report_.cell = frame_.cell;
        for (int i = 0; i < 3; ++i) {
            header_.origin[i] = frame_.origin[i];
            header_.boundsMin[i] = ingested.boundsMin[i];
            header_.boundsMax[i] = ingested.boundsMax[i];
        }
        header_.flags = ingested.mesh.colours.empty() ? 0 : kFlagColour;
    }

    Result<void> buildLevels(LatticeMesh mesh) {
        levels_.resize(frame_.levels);
        double workDone = 0;
        for (uint32_t level = frame_.levels; level-- > 0;) {
            if (level + 1 < frame_.levels) mesh = coarsen(mesh);
            // Each coarser level has about half the triangles of the one before.
            const double share = level == 0 ? 1 - workDone : (1 - workDone) / 2;
            VCP_TRY(buildLevel(level, mesh, workDone, share));
            workDone += share;
        }
        return {};
    }

    Result<void> buildLevel(uint32_t level, LatticeMesh& mesh, double workBefore, double share) {
        const std::string stage = fmt::format("level {} of {}", frame_.levels - level, frame_.levels);
        computeNormals(mesh);
        const TriangleBins bins = binTriangles(mesh, frame_.log2Cells, level);
        const double cell = std::ldexp(frame_.cell, static_cast<int>(frame_.levels - 1 - level));
        const bool finest = level + 1 == frame_.levels;
        std::vector<BuiltPage>& pages = levels_[level];
        pages.resize(bins.pages.size());
        std::atomic<size_t> done = 0;
        const auto buildOne = [&](size_t i) {
            if (cancelled_) return;
            pages[i] = buildPage(mesh, bins, i, level, cell, finest);
            progress(stage.c_str(), kReadingShare + (1 - kReadingShare) * (workBefore + share * double(++done) / double(pages.size())));
        };
        // Pages differ in weight, so they are taken one by one; each lands in its own slot, so the order of
        // the work cannot show in the file.
        std::optional<tbb::global_control> more;  // without it TBB gives no more threads than processors, and says so
        if (options_.threads > tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism))
            more.emplace(tbb::global_control::max_allowed_parallelism, options_.threads);
        tbb::task_arena arena(options_.threads == 0 ? tbb::task_arena::automatic : static_cast<int>(options_.threads));
        arena.execute([&] { tbb::parallel_for(size_t{0}, pages.size(), buildOne, tbb::simple_partitioner()); });
        if (cancelled_) return Error{.code = ErrorCode::Cancelled, .message = "cancelled; nothing was written", .file = options_.output.string()};
        std::erase_if(pages, [](const BuiltPage& page) { return page.entry.leaves == 0; });
        return {};
    }

    BuiltPage buildPage(const LatticeMesh& mesh, const TriangleBins& bins, size_t i, uint32_t level, double cell, bool finest) const {
        PageGeometry geometry(mesh, bins.of(i), mortonDecode(bins.pages[i]), frame_.log2Cells);
        const double tolerance = finest ? report_.errorTarget / cell - geometry.stray() : kCoarseErrorCells;
        PageTree tree = buildPageTree(geometry, tolerance);
        const EncodedPage encoded = encodePage(tree, geometry, mesh);
        BuiltPage page;
        page.entry.morton = bins.pages[i];
        page.entry.level = static_cast<uint8_t>(level);
        page.entry.leaves = encoded.leaves;
        page.entry.hardLeaves = encoded.hardLeaves;
        page.entry.certifiedError = std::nextafter(static_cast<float>(encoded.certifiedError * cell), std::numeric_limits<float>::infinity());
        if (encoded.leaves > 0) page.stored = compressPage(encoded.geometry, encoded.colour);
        return page;
    }

    /// A page that only leads to finer ones: the surface moved out of it when the level was made.
    static BuiltPage passagePage(uint64_t morton, uint32_t level, uint32_t log2Cells) {
        PageHeader header;
        header.log2Cells = log2Cells;
        header.root = emptyNode(0);
        BuiltPage page;
        page.entry.morton = morton;
        page.entry.level = static_cast<uint8_t>(level);
        page.stored = compressPage(std::as_bytes(std::span(&header, 1)), {});
        return page;
    }

    /// Every page gets a parent, and every parent knows its children.
    void linkLevels() {
        const auto byMorton = [](const BuiltPage& a, const BuiltPage& b) { return a.entry.morton < b.entry.morton; };
        for (uint32_t level = frame_.levels - 1; level > 0; --level) {
            std::vector<BuiltPage>& parents = levels_[level - 1];
            std::vector<BuiltPage> missing;
            for (const BuiltPage& page : levels_[level]) {
                const uint64_t parent = page.entry.morton >> 3;
                if (!missing.empty() && missing.back().entry.morton == parent) continue;
                BuiltPage probe;
                probe.entry.morton = parent;
                if (!std::binary_search(parents.begin(), parents.end(), probe, byMorton)) missing.push_back(passagePage(parent, level - 1, frame_.log2Cells));
            }
            for (BuiltPage& page : missing) parents.push_back(std::move(page));
            std::sort(parents.begin(), parents.end(), byMorton);
        }
        uint64_t first = levels_[0].size();
        for (uint32_t level = 0; level + 1 < frame_.levels; ++level) {
            size_t child = 0;
            const std::vector<BuiltPage>& children = levels_[level + 1];
            for (BuiltPage& page : levels_[level]) {
                page.entry.firstChild = static_cast<uint32_t>(first + child);
                for (; child < children.size() && children[child].entry.morton >> 3 == page.entry.morton; ++child)
                    page.entry.childMask |= static_cast<uint8_t>(1u << (children[child].entry.morton & 7));
                if (page.entry.childMask == 0) page.entry.firstChild = 0;
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
            row.pages = levels_[level].size();
            for (const BuiltPage& page : levels_[level]) row.certifiedError = std::max(row.certifiedError, double(page.entry.certifiedError));
            first += row.pages;
        }
        auto writer = VcpWriter::create(options_.output, first);
        if (!writer) return writer.error();
        for (const auto& level : levels_)
            for (const BuiltPage& page : level) {
                VCP_TRY((*writer)->append(page.entry, page.stored));
                if (!progress("writing", fraction_)) return Error{.code = ErrorCode::Cancelled, .message = "cancelled; nothing was written", .file = options_.output.string()};
            }
        for (const BuiltPage& page : levels_.back()) {
            report_.leaves += page.entry.leaves;
            report_.hardLeaves += page.entry.hardLeaves;
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

    const BuildOptions& options_;
    std::chrono::steady_clock::time_point start_;
    GridFrame frame_;
    FileHeader header_;
    BuildReport report_;
    std::vector<std::vector<BuiltPage>> levels_;
    std::mutex progressMutex_;
    double lastProgress_ = -1, fraction_ = 0;
    std::atomic<bool> cancelled_ = false;
};

}  // namespace

Result<BuildReport> buildOctree(const BuildOptions& options) { return Builder(options).run(); }

}  // namespace vcp
