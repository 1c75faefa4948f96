#include "builder/paper/paper_subvolumes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <deque>
#include <limits>
#include <memory>
#include <new>
#include <tuple>
#include <unordered_map>
#include <unordered_set>

#include <fmt/format.h>

#include "builder/bin_passes.h"
#include "builder/ingest.h"
#include "builder/lattice/triangle_geometry.h"
#include "builder/mesh/open_mesh.h"
#include "builder/ordered_pages.h"
#include "builder/paper/paper_file.h"
#include "builder/progress_meter.h"
#include "builder/spill/page_spool.h"
#include "builder/work_arena.h"
#include "octree/io/output_claim.h"
#include "octree/surface/morton.h"

namespace vcp {

namespace {

// Parts of the whole time that are over where a stage ends.
constexpr double kRead = 0.1, kDealt = 0.2, kCoarseDone = 0.3, kFineDone = 0.9, kPacked = 0.98;

struct PlainTriangle {
    glm::dvec3 corner[3];

    bool operator<(const PlainTriangle& other) const { return key() < other.key(); }

private:
    [[nodiscard]] std::array<double, 9> key() const {
        std::array<double, 9> all;
        for (int i = 0; i < 9; ++i) all[i] = corner[i / 3][i % 3];
        return all;
    }
};
static_assert(sizeof(PlainTriangle) == 72);

/// One of the two grids. A cube is one root of it; cubes that triangles are near have a bin of them.
struct CubeGrid {
    CubeGrid(TempSpace& space, const RootGrid& roots, uint32_t number, uint64_t bufferBytes)
        : grid(roots), bins(space, fmt::format("level{}", number), 1, bufferBytes), octrees(space, number) {}

    size_t binOf(glm::ivec3 root) {
        const uint64_t code = mortonEncode(glm::u32vec3(root));
        const auto [at, isNew] = binOf_.emplace(code, codes.size());
        if (isNew) codes.push_back(code);
        return at->second;
    }
    [[nodiscard]] double edge() const { return double(1 << grid.rootLevel); }

    RootGrid grid;
    RecordBins<PlainTriangle> bins;
    std::vector<uint64_t> codes;  ///< cube of each bin, its Morton code among the grid's roots
    PageSpool octrees;            ///< of the bins (spooled())

private:
    std::unordered_map<uint64_t, size_t> binOf_;
};

/// An octree as it is spooled: PaperPageHeader, nodes, vectors. Until it is packed, its entry's error is its longest
/// vector.
BuiltPage spooled(const CornerOctree& tree, uint64_t code) {
    PaperPageHeader header;
    header.nodes = uint32_t(tree.nodes.size());
    header.slices = uint32_t(tree.vectors.size());
    header.emptyNodes = uint32_t(tree.emptyNodes);
    BuiltPage page{.entry = {.morton = code, .leaves = uint32_t(tree.leaves), .certifiedError = tree.largest},
                   .stored = {},
                   .surface = {}};
    std::vector<std::byte>& out = page.stored.geometry;
    const size_t nodes = sizeof header + tree.nodes.size() * 4;
    out.resize(nodes + tree.vectors.size() * sizeof tree.vectors[0]);
    std::memcpy(out.data(), &header, sizeof header);
    std::memcpy(out.data() + sizeof header, tree.nodes.data(), tree.nodes.size() * 4);
    if (!tree.vectors.empty()) std::memcpy(out.data() + nodes, tree.vectors.data(), out.size() - nodes);
    page.stored.geometryBytes = uint32_t(out.size());
    return page;
}

/// Returns the octree of a cube from the spool, without a frame.
Result<CornerOctree> unspooled(const PageSpool& spool, const PageEntry& entry) {
    VCP_TRY_ASSIGN(const auto stored, spool.read(entry));
    PaperPageHeader header;
    std::memcpy(&header, stored.geometry.data(), sizeof header);
    CornerOctree tree;
    tree.nodes.resize(header.nodes);
    tree.vectors.resize(header.slices);
    tree.leaves = entry.leaves;
    tree.emptyNodes = header.emptyNodes;
    const size_t nodes = sizeof header + tree.nodes.size() * 4;
    std::memcpy(tree.nodes.data(), stored.geometry.data() + sizeof header, tree.nodes.size() * 4);
    if (!tree.vectors.empty())
        std::memcpy(tree.vectors.data(), stored.geometry.data() + nodes, stored.geometry.size() - nodes);
    return tree;
}

class SubvolumesBuild {
public:
    SubvolumesBuild(const BuildOptions& options, const PaperOptions& paper, const MemoryPlan& memory)
        : options_(options),
          paper_(paper),
          memory_(memory),
          halo_(vectorHalo(paper)),
          level_(std::countr_zero(unsigned(paper.subvolumeCells))),
          meter_(options.progress),
          space_(tempFolderOf(options), memory.tempBytes),
          arena_(threadsOf(options)) {}

    Result<BuildReport> run() {
        auto built = [&]() -> Result<void> {
            try {
                return stages();
            } catch (const std::bad_alloc&) {
                return Error{.code = ErrorCode::Limit,
                             .message = "the system has no more memory to give; use a smaller memory cap"};
            }
        }();
        if (space_.folder().isTaken()) space_.folder().remove();
        if (!built) return built.error();
        report_.seconds = meter_.seconds();
        report_.peakRssBytes = peakRssBytes();
        report_.tempBytes = space_.peakDiskBytes();
        return report_;
    }

private:
    Result<void> stages() {
        VCP_TRY_ASSIGN(const auto claim, OutputClaim::take(options_.output));
        VCP_TRY(checkOutput(options_.output, OutputKind::Dataset, rules()));
        if (space_.folder().exists()) {
            VCP_TRY(space_.folder().take());
            space_.folder().clear();
        }
        VCP_TRY(arena_.execute([&] { return read(); }));
        VCP_TRY(chooseGrids());
        VCP_TRY(arena_.execute([&] { return deal(); }));
        VCP_TRY(buildOctrees(*coarse_, 1, kDealt, kCoarseDone));
        VCP_TRY(joinCoarse());
        VCP_TRY(buildOctrees(*fine_, 2, kCoarseDone, kFineDone));
        VCP_TRY(pack());
        return write();
    }

    [[nodiscard]] OutputRules rules() const { return {.overwrite = options_.overwrite, .inputs = options_.inputs}; }

    /// Tells the caller how far things are; false: it cancelled.
    bool report(const std::string& stage, double fraction) {
        return meter_.report(stage,
                             {.fraction = fraction, .triangles = measures_.triangles, .tempBytes = space_.diskBytes()});
    }
    Error cancelled() const { return Error::cancelled(options_.output.string()); }

    Result<void> read() {
        if (!report("reading", 0)) return cancelled();
        soup_ = std::make_unique<Soup>(space_, memory_.bufferBytes);
        const auto progress = [&](double fraction, uint64_t triangles) {
            measures_.triangles = triangles;
            return report("reading", kRead * fraction);
        };
        VCP_TRY_ASSIGN(const auto tally, readInputs(options_, space_, memory_.vertexBytes, *soup_, progress,
                                                    report_.warnings, report_.sideFiles));
        VCP_TRY_ASSIGN(measures_, measuresOf(tally, options_));
        return {};
    }

    Result<void> chooseGrids() {
        VCP_TRY_ASSIGN(const auto frame, chooseFrame(options_, measures_));
        const glm::dvec3 extent = (measures_.boundsMax - measures_.boundsMin) / frame.cell;
        if (!(std::max({extent.x, extent.y, extent.z}) < RootGrid::kMaxCells / 2))
            return Error{.code = ErrorCode::Limit,
                         .message = "the cells are too small for this mesh: more than 2^19 would lie across it"};
        const RootGrid grid = RootGrid::around(measures_.boundsMin, measures_.boundsMax, frame.cell, 4, level_);
        const int across = std::max({grid.roots.x, grid.roots.y, grid.roots.z});
        shift_ = kLeastCoarseShift;
        while (across << level_ >> shift_ > kMostCoarseCells) ++shift_;
        levels_ = 1 + std::max(shift_, int(std::bit_width(unsigned(across - 1))));
        RootGrid coarse = grid;
        coarse.cell = std::ldexp(grid.cell, shift_);
        coarse.roots = (grid.roots + (1 << shift_) - 1) / (1 << shift_);
        fine_.emplace(space_, grid, 1, memory_.bufferBytes / 2);
        coarse_.emplace(space_, coarse, 0, memory_.bufferBytes / 4);
        return {};
    }

    /// Gives each triangle to the cubes that it is within the halo of.
    Result<void> deal() {
        BinBatch<PlainTriangle> fine(fine_->bins), coarse(coarse_->bins);
        const uint64_t total = SoupShare{.soup = *soup_}.triangles();
        uint64_t done = 0;
        const auto all = [&](const auto& soup) -> Result<void> {
            VCP_TRY_ASSIGN(const auto blocks, soup.blocks(0));
            for (const RawBins::Block& block : blocks) {
                VCP_TRY_ASSIGN(const auto records, soup.read(block));
                for (const auto& t : records) {
                    const PlainTriangle plain{
                        {glm::dvec3(t.corner[0]), glm::dvec3(t.corner[1]), glm::dvec3(t.corner[2])}};
                    VCP_TRY(dealTo(*fine_, fine, plain));
                    VCP_TRY(dealTo(*coarse_, coarse, plain));
                }
                done += block.records;
                if (!report("sorting", kRead + (kDealt - kRead) * double(done) / double(total))) return cancelled();
            }
            return {};
        };
        VCP_TRY(all(soup_->floats));
        VCP_TRY(all(soup_->doubles));
        VCP_TRY(fine.flush());
        VCP_TRY(coarse.flush());
        VCP_TRY(fine_->bins.raw().flush());
        VCP_TRY(coarse_->bins.raw().flush());
        soup_->floats.raw().remove();
        soup_->doubles.raw().remove();
        return {};
    }
    Result<void> dealTo(CubeGrid& cubes, BinBatch<PlainTriangle>& batch, const PlainTriangle& triangle) const {
        const RootGrid& grid = cubes.grid;
        const BoxOverlap overlap({grid.gridFromWorld(triangle.corner[0]), grid.gridFromWorld(triangle.corner[1]),
                                  grid.gridFromWorld(triangle.corner[2])});
        const auto rootAt = [&](glm::dvec3 p) {
            return glm::clamp(glm::ivec3(glm::floor(p / cubes.edge())), glm::ivec3(0), grid.roots - 1);
        };
        const glm::ivec3 first = rootAt(overlap.lower() - double(halo_)),
                         last = rootAt(overlap.upper() + double(halo_));
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x) {
                    const glm::dvec3 centre = (glm::dvec3(x, y, z) + 0.5) * cubes.edge();
                    if (overlap.test(centre, cubes.edge() / 2 + double(halo_)))
                        VCP_TRY(batch.add(cubes.binOf({x, y, z}), triangle));
                }
        return {};
    }

    Result<void> buildOctrees(CubeGrid& cubes, int number, double begins, double ends) {
        // What a cube full of leaves takes with what is sampled around it, and what a triangle takes with its tree.
        constexpr uint64_t kPointBytes = 110, kTriangleBytes = 300;
        const uint64_t points = uint64_t(paper_.subvolumeCells + 16);
        std::vector<uint64_t> work;
        for (size_t i = 0; i < cubes.codes.size(); ++i)
            work.push_back(points * points * points * kPointBytes + cubes.bins.count(i) * kTriangleBytes);
        const std::string stage = fmt::format("level {} of 2", number);
        if (!report(stage, begins)) return cancelled();
        return buildEach(cubes.octrees, work, stage, begins, ends, [&](size_t i) -> Result<BuiltPage> {
            VCP_TRY_ASSIGN(const auto tree, octreeOf(cubes, i));
            return spooled(tree, cubes.codes[i]);
        });
    }
    Result<void> buildEach(PageSpool& pages, const std::vector<uint64_t>& work, const std::string& stage, double begins,
                           double ends, const std::function<Result<BuiltPage>(size_t)>& build) {
        const std::function<bool(double)> progress = [&](double part) {
            return report(stage, begins + (ends - begins) * part);
        };
        return arena_.execute([&] {
            return buildInOrder({.work = work,
                                 .pageBytes = memory_.pageBytes,
                                 .roomBytes = memory_.tempBytes,
                                 .makeRoom = [&] { return space_.spill(); },
                                 .build = build,
                                 .description = [&](size_t) { return std::string("a subvolume is too large"); },
                                 .pages = pages,
                                 .emptyToo = true,
                                 .surfaces = nullptr,
                                 .progress = progress});
        });
    }
    /// Among triangles at equal distance the first counts: they are sorted, whatever order they came in.
    Result<CornerOctree> octreeOf(const CubeGrid& cubes, size_t bin) const {
        std::vector<PlainTriangle> triangles;
        VCP_TRY_ASSIGN(const auto blocks, cubes.bins.blocks(bin));
        for (const RawBins::Block& block : blocks) {
            VCP_TRY_ASSIGN(const auto records, cubes.bins.read(block));
            triangles.insert(triangles.end(), records.begin(), records.end());
        }
        std::ranges::sort(triangles, std::less<>());
        IndexedMesh mesh;
        for (const PlainTriangle& t : triangles) {
            const auto first = uint32_t(mesh.positions.size());
            mesh.positions.insert(mesh.positions.end(), t.corner, t.corner + 3);
            mesh.triangles.push_back({first, first + 1, first + 2});
        }
        const MeshBvh bvh(mesh);
        const CornerRegion region{cubes.grid, glm::ivec3(mortonDecode(cubes.codes[bin])), glm::ivec3(1), halo_};
        return buildVectorOctree(bvh, paper_, {.cell = cubes.grid.cell, .threads = 1, .region = region});
    }

    [[nodiscard]] static float longestOf(const PageSpool& octrees) {
        float longest = 0;
        for (const PageEntry& entry : octrees.entries()) longest = std::max(longest, entry.certifiedError);
        return longest > 0 ? longest : 1;
    }
    void packVectors(CornerOctree& tree, float longest) const {
        tree.largest = longest;
        for (const auto& slice : tree.vectors) {
            auto& packed = tree.slices.emplace_back();
            for (size_t k = 0; k < 4; ++k) packed[k] = packPaperVector(slice[k], longest, paper_.packing);
        }
        tree.vectors = {};
    }
    /// The word of an empty node that is as far from the surface as the halo is wide.
    [[nodiscard]] int32_t farWord(float cutoff) const {
        return CornerOctree::kEmpty + int32_t(double(std::min(halo_ / cutoff, 1.0f)) * (CornerOctree::kEmpty - 1));
    }

    /// Makes one page of the octrees of the larger cells.
    Result<void> joinCoarse() {
        CornerOctree whole;
        whole.frame = coarse_->grid;
        whole.cutoff = glm::length(glm::vec3(whole.frame.cells()));
        const glm::ivec3 roots = whole.frame.roots;
        whole.nodes.assign(size_t(roots.x) * size_t(roots.y) * size_t(roots.z), farWord(whole.cutoff));
        whole.emptyNodes = whole.nodes.size();
        const float longest = longestOf(coarse_->octrees);
        coarse_->octrees.sortEntries();
        for (const PageEntry& entry : coarse_->octrees.entries()) {
            VCP_TRY_ASSIGN(auto tree, unspooled(coarse_->octrees, entry));
            const auto nodesBefore = int64_t(whole.nodes.size()) - 1, slicesBefore = int64_t(whole.slices.size());
            if (nodesBefore + int64_t(tree.nodes.size()) > CornerOctree::kEmpty / 2)
                return Error{.code = ErrorCode::Limit, .message = "the octree would have more than 2^30 nodes"};
            const auto moved = [&](int32_t word) {
                return CornerOctree::isLeaf(word)    ? int32_t(word - slicesBefore)
                       : CornerOctree::isInner(word) ? int32_t(word + nodesBefore)
                                                     : word;
            };
            const glm::ivec3 root(mortonDecode(entry.morton));
            whole.nodes[size_t((root.z * roots.y + root.y) * roots.x + root.x)] = moved(tree.nodes[0]);
            for (size_t i = 1; i < tree.nodes.size(); ++i) whole.nodes.push_back(moved(tree.nodes[i]));
            packVectors(tree, longest);
            whole.slices.insert(whole.slices.end(), tree.slices.begin(), tree.slices.end());
            whole.leaves += tree.leaves;
            whole.emptyNodes += tree.emptyNodes;
            --whole.emptyNodes;
        }
        whole.largest = longest;
        VCP_TRY_ASSIGN(const auto page, paperPage(whole, paper_.packing, uint32_t(shift_)));
        coarsePage_ = compressPage(page.geometryBytes(), {});
        coarseLeaves_ = uint32_t(whole.leaves);
        for (int z = 0; z < roots.z; ++z)
            for (int y = 0; y < roots.y; ++y)
                for (int x = 0; x < roots.x; ++x) {
                    const size_t root = size_t((z * roots.y + y) * roots.x + x);
                    markNear(whole, whole.nodes[root], glm::ivec3(x, y, z) << level_, level_);
                }
        coarse_->bins.raw().remove();
        coarse_->octrees.remove();
        return {};
    }
    /// Notes the subvolumes in which the larger cells have leaves: there they are never looked at.
    void markNear(const CornerOctree& whole, int32_t word, glm::ivec3 low, int level) {
        if (CornerOctree::isInner(word)) {
            for (int k = 0; k < 8; ++k)
                markNear(whole, whole.nodes[size_t(word) + size_t(k)],
                         low + (1 << (level - 1)) * glm::ivec3(k & 1, k >> 1 & 1, k >> 2), level - 1);
        } else if (CornerOctree::isLeaf(word)) {
            const glm::ivec3 first = low << shift_ >> level_,
                             last = glm::min((((low + (1 << level)) << shift_) - 1) >> level_, fine_->grid.roots - 1);
            for (int z = first.z; z <= last.z; ++z)
                for (int y = first.y; y <= last.y; ++y)
                    for (int x = first.x; x <= last.x; ++x) near_.insert(mortonEncode(glm::u32vec3(x, y, z)));
        }
    }

    /// Packs the octrees of the subvolumes with the longest vector of all.
    Result<void> pack() {
        fine_->bins.raw().remove();
        fine_->octrees.sortEntries();
        const std::vector<PageEntry>& octrees = fine_->octrees.entries();
        longest_ = longestOf(fine_->octrees);
        pages_.emplace(space_, 2);
        std::vector<uint64_t> work;
        for (const PageEntry& entry : octrees) work.push_back(uint64_t{3} * entry.pageBytes);
        return buildEach(*pages_, work, "writing", kFineDone, kPacked, [&](size_t i) -> Result<BuiltPage> {
            VCP_TRY_ASSIGN(auto tree, unspooled(fine_->octrees, octrees[i]));
            packVectors(tree, longest_);
            return builtPage(tree, octrees[i].morton);
        });
    }
    Result<BuiltPage> builtPage(CornerOctree& tree, uint64_t code) const {
        tree.frame.rootLevel = level_;
        tree.frame.roots = glm::ivec3(1);
        tree.cutoff = glm::length(glm::vec3(fine_->grid.cells()));
        VCP_TRY_ASSIGN(const auto page, paperPage(tree, paper_.packing));
        return BuiltPage{.entry = {.morton = code, .leaves = uint32_t(tree.leaves)},
                         .stored = compressPage(page.geometryBytes(), {}),
                         .surface = {}};
    }

    /// Returns the entries of all levels, coarse first, linked. Those of the finest level that are spooled have offsets
    /// there; those that are not have none of a page's bytes.
    [[nodiscard]] std::vector<std::vector<PageEntry>> entriesOfLevels() const {
        const auto count = size_t(levels_);
        std::vector<std::vector<PageEntry>> levels(count);
        levels.back() = pages_->entries();
        std::unordered_set<uint64_t> empty = near_;
        for (const PageEntry& entry : pages_->entries()) empty.erase(entry.morton);
        for (const uint64_t code : empty) levels.back().push_back({.morton = code});
        std::ranges::sort(levels.back(), {}, &PageEntry::morton);
        for (size_t level = levels.size(); level-- > 0;) {
            for (PageEntry& entry : levels[level]) {
                entry.level = uint8_t(level);
                if (level > 0 && (levels[level - 1].empty() || levels[level - 1].back().morton != entry.morton >> 3))
                    levels[level - 1].push_back({.morton = entry.morton >> 3});
                if (level > 0) levels[level - 1].back().childMask |= uint8_t(1u << (entry.morton & 7));
            }
        }
        uint32_t next = 1;
        for (size_t level = 0; level + 1 < levels.size(); ++level)
            for (PageEntry& entry : levels[level]) {
                entry.firstChild = next;
                next += uint32_t(std::popcount(entry.childMask));
            }
        levels.front().front().leaves = coarseLeaves_;
        return levels;
    }

    [[nodiscard]] FileHeader headerOf(const std::vector<std::vector<PageEntry>>& levels) const {
        FileHeader header;
        header.method = Method::Paper;
        header.cell = fine_->grid.cell;
        header.log2Cells = uint32_t(level_);
        header.levels = uint32_t(levels.size());
        for (int axis = 0; axis < 3; ++axis) {
            header.origin[axis] = fine_->grid.low[axis];
            header.boundsMin[axis] = measures_.boundsMin[axis];
            header.boundsMax[axis] = measures_.boundsMax[axis];
        }
        header.triangles = measures_.triangles;
        header.degenerateTriangles = measures_.degenerateTriangles;
        header.vertices = measures_.vertices;
        header.paper = parametersOf(paper_);
        for (size_t level = 0; level < levels.size(); ++level) {
            header.level[level].firstEntry = header.pages;
            header.level[level].pages = levels[level].size();
            header.pages += levels[level].size();
        }
        for (const PageEntry& entry : levels.back()) header.leaves += entry.leaves;
        return header;
    }

    Result<void> write() {
        CornerOctree nothing;
        nothing.largest = longest_;
        nothing.emptyNodes = 1;
        nothing.nodes = {farWord(glm::length(glm::vec3(fine_->grid.cells())))};
        VCP_TRY_ASSIGN(const auto empty, builtPage(nothing, 0));
        const std::vector<std::vector<PageEntry>> levels = entriesOfLevels();
        const FileHeader header = headerOf(levels);
        VCP_TRY_ASSIGN(auto writer, VcpWriter::create(options_.output, header.pages, rules()));
        uint64_t done = 0;
        for (const std::vector<PageEntry>& level : levels)
            for (const PageEntry& entry : level) {
                if (entry.level == 0) {
                    VCP_TRY(writer->append(entry, coarsePage_));
                } else if (entry.pageBytes == 0) {
                    VCP_TRY(writer->append(entry, empty.stored));
                } else {
                    VCP_TRY_ASSIGN(const auto page, pages_->read(entry));
                    VCP_TRY(writer->append(entry, page));
                }
                if (!report("writing", kPacked + (1 - kPacked) * double(++done) / double(header.pages + 1)))
                    return cancelled();
            }
        VCP_TRY_ASSIGN(report_.fileBytes, writer->commit(header));
        describe(header, report_);
        report_.certifiedErrorMax = std::numeric_limits<double>::quiet_NaN();
        report_.cutTriangles = measures_.cutTriangles;
        report("done", 1);
        return {};
    }

    const BuildOptions& options_;
    const PaperOptions& paper_;
    const MemoryPlan memory_;
    const float halo_;
    const int level_;  // a subvolume has 2^level_ cells an edge
    ProgressMeter meter_;
    TempSpace space_;
    WorkArena arena_;
    std::unique_ptr<Soup> soup_;
    SoupMeasures measures_;
    int shift_ = 0, levels_ = 0;  // the larger cells are 2^shift_ of the finest ones an edge
    std::optional<CubeGrid> fine_, coarse_;
    std::optional<PageSpool> pages_;
    float longest_ = 1;
    StoredPage coarsePage_;
    uint32_t coarseLeaves_ = 0;
    std::unordered_set<uint64_t> near_;
    BuildReport report_;
};

}  // namespace

Result<BuildReport> buildPaperSubvolumes(const BuildOptions& options, const PaperOptions& paper) {
    const auto cells = unsigned(paper.subvolumeCells);
    if (cells < kLeastSubvolumeCells || cells > kMostSubvolumeCells || !std::has_single_bit(cells))
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("subvolumes have {} to {} cells an edge, a power of two",
                                            kLeastSubvolumeCells, kMostSubvolumeCells)};
    VCP_TRY_ASSIGN(const auto memory, memoryOf(options));
    BuildOptions expanded = options;
    VCP_TRY_ASSIGN(expanded.inputs, expandInputs(options.inputs));
    auto built = SubvolumesBuild(expanded, paper, memory).run();
    if (built || !built.error().file.empty()) return built;
    Error error = built.error();
    error.file = options.inputs.front().string();
    return error;
}

}  // namespace vcp
