#include "builder/deal.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_pipeline.h>
#include <oneapi/tbb/task_arena.h>

namespace vcp {

namespace {

uint64_t trianglesOf(std::span<const SoupShare> soups) {
    uint64_t triangles = 0;
    for (const SoupShare& each : soups) triangles += each.triangles();
    return triangles;
}

/// Gives the blocks of one bin, or of all, one after the other.
class BlockWalk {
public:
    static Result<BlockWalk> over(const RawBins& bins, std::optional<size_t> bin) {
        BlockWalk walk(bins, !bin);
        if (bin) {
            VCP_TRY_ASSIGN(walk.listed_, bins.blocks(*bin));
        }
        return walk;
    }
    /// Returns the next one; none at the end. Errors: RawBins'.
    Result<std::optional<RawBins::Block>> next() {
        if (!isOfAll_) return at_ < listed_.size() ? std::optional(listed_[at_++]) : std::nullopt;
        if (at_ == bins_.bytes()) return std::optional<RawBins::Block>();
        VCP_TRY_ASSIGN(const auto block, bins_.blockAt(at_));
        at_ = block.end;
        return std::optional(block);
    }

private:
    BlockWalk(const RawBins& bins, bool isOfAll) : bins_(bins), isOfAll_(isOfAll) {}

    const RawBins& bins_;
    bool isOfAll_;
    std::vector<RawBins::Block> listed_;
    uint64_t at_ = 0;  ///< byte, or number of the listed one
};

/// Calls visit(piece, its place in an image) for every triangle of the soups on the lattice, then visit.finish(), with
/// a visit of its own for each block of theirs.
template <class MakeVisit>
Result<void> forLatticeTriangles(std::span<const SoupShare> soups, const LatticeSnapper& snapper, bool painted,
                                 const std::function<bool(double)>& progress, MakeVisit&& makeVisit) {
    const uint64_t total = trianglesOf(soups);
    std::atomic<uint64_t> done = 0;
    std::atomic<bool> failed = false, cancelled = false;
    std::mutex mutex;
    Result<void> result;
    const auto end = [&](const Result<void>& here) {
        const std::scoped_lock lock(mutex);
        if (!here && !failed.exchange(true)) result = here;
    };
    const auto visitBlock = [&](const auto& bins, uint32_t before, const RawBins::Block& block) -> Result<void> {
        VCP_TRY_ASSIGN(auto records, bins.read(block));
        auto visit = makeVisit();
        Result<void> here;
        for (auto& t : records) {
            if (t.material > 0) t.material += before;
            snapper.add(
                t,
                [&](const LatticeTriangle& piece, const std::optional<TexturedTriangle>& place) {
                    if (here) here = visit(piece, place);
                },
                painted);
        }
        if (here) here = visit.finish();
        if (!progress(double(done += block.records) / double(total))) cancelled = true;
        return here;
    };
    const auto all = [&](const auto& bins, const SoupShare& share) {
        auto walk = BlockWalk::over(bins.raw(), share.bin);
        if (!walk) return end(walk.error());
        const auto next = [&](tbb::flow_control& control) -> RawBins::Block {
            if (!cancelled && !failed) {
                const auto block = walk->next();
                if (block && *block) return **block;
                if (!block) end(block.error());
            }
            control.stop();
            return {};
        };
        const auto most = size_t(tbb::this_task_arena::max_concurrency()) * 2;
        tbb::parallel_pipeline(most, tbb::make_filter<void, RawBins::Block>(tbb::filter_mode::serial_in_order, next) &
                                         tbb::make_filter<RawBins::Block, void>(
                                             tbb::filter_mode::parallel, [&](const RawBins::Block& block) {
                                                 if (!cancelled && !failed)
                                                     end(visitBlock(bins, share.materialsBefore, block));
                                             }));
    };
    for (const SoupShare& each : soups) {
        all(each.soup.floats, each);
        all(each.soup.doubles, each);
    }
    if (result && cancelled) return Error::cancelled();
    return result;
}

/// A page, by its level and its Morton code, and how many triangles it needs.
using Page = std::pair<uint32_t, uint64_t>;
using PageCounts = std::map<Page, uint64_t>;

/// A box on the base level's lattice.
struct LatticeBox {
    glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};

    [[nodiscard]] bool touches(const LatticeTriangle& t) const {
        const auto& [a, b, c] = t.corner;
        return glm::all(glm::lessThanEqual(low, glm::dvec3(glm::max(a, glm::max(b, c))))) &&
               glm::all(glm::greaterThanEqual(high, glm::dvec3(glm::min(a, glm::min(b, c)))));
    }
};

/// Returns the box around some pages, widened as far as they need triangles.
LatticeBox boxOf(const PageCounts& pages, PageGrid base, double marginCells) {
    LatticeBox box;
    for (const auto& [page, count] : pages) {
        const double edge = std::ldexp(base.edgeCells() * kLatticePerCell, int(base.level) - int(page.first));
        const glm::dvec3 corner = glm::dvec3(mortonDecode(page.second)) * edge;
        box.low = glm::min(box.low, corner - marginCells * kLatticePerCell);
        box.high = glm::max(box.high, corner + edge + marginCells * kLatticePerCell);
    }
    return box;
}

/// Counts a triangle for every page that will need it, or for the parts of some pages: near enough for a count. As long
/// as it is not known which pages are parted, triangles are whole and lie on the base level's lattice.
struct CountVisit {
    const FinestPages& pages;
    double marginCells;
    uint32_t lattice;          ///< the level whose lattice triangles lie on
    const PageCounts& parted;  ///< the pages whose parts are counted; none: all pages are
    LatticeBox box;            ///< around them
    PageCounts& counts;
    std::atomic<uint64_t>& counted;  ///< pages that all threads count
    uint64_t mostPages;

    Result<void> operator()(const LatticeTriangle& t, const std::optional<TexturedTriangle>&) {
        if (!parted.empty() && !box.touches(t)) return {};
        pages.forPagesNear(t.corner, marginCells, lattice, [&](uint32_t level, uint64_t code) {
            if (!parted.empty() && (level == pages.base() || !parted.contains({level - 1, code >> 3}))) return;
            const auto [count, isNew] = counts.try_emplace({level, code}, 0);
            count->second += piecesIn(t, level);
            if (isNew) ++counted;
        });
        if (counted > mostPages)
            return Error{.code = ErrorCode::Limit, .message = fmt::format("more than {} pages", mostPages)};
        return {};
    }
    static Result<void> finish() { return {}; }

private:
    /// Returns into how many pieces a page will have a whole triangle cut, at least.
    [[nodiscard]] uint64_t piecesIn(const LatticeTriangle& t, uint32_t level) const {
        if (level <= lattice) return 1;
        const auto& [a, b, c] = t.corner;
        const double most = std::ldexp(double(kPartedEdgeCells) * kLatticePerCell, int(lattice) - int(level));
        return longestEdge(a, b, c) > most ? kLeastPieces : 1;
    }

    // A needle has two long edges.
    static constexpr uint64_t kLeastPieces = 3;
};

/// Counts triangles, snapped to some lattice, by pages. `parted`: as CountVisit's.
Result<PageCounts> countTriangles(const PageChoosing& choosing, const LatticeSnapper& snapper, uint32_t lattice,
                                  const FinestPages& pages, const PageCounts& parted,
                                  const std::function<bool(double)>& progress) {
    const LatticeBox box = boxOf(parted, pages.gridOf(pages.base()), choosing.marginCells);
    tbb::enumerable_thread_specific<PageCounts> parts;
    std::atomic<uint64_t> counted = 0;
    VCP_TRY(forLatticeTriangles(choosing.soups, snapper, false, progress, [&] {
        return CountVisit{pages, choosing.marginCells, lattice, parted,
                          box,   parts.local(),        counted, choosing.mostPages};
    }));
    PageCounts sums;
    for (const PageCounts& part : parts)
        for (const auto& [page, count] : part) sums[page] += count;
    return sums;
}

/// Counts the whole triangles.
Result<PageCounts> countWhole(const PageChoosing& choosing, const FinestPages& pages, const PageCounts& parted,
                              const std::function<bool(double)>& progress) {
    return countTriangles(choosing, LatticeSnapper(choosing.frame, nullptr, false), pages.base(), pages, parted,
                          progress);
}

/// Counts the pieces that the pages will hold.
Result<PageCounts> countPieces(const PageChoosing& choosing, const FinestPages& pages,
                               const std::function<bool(double)>& progress) {
    const GridFrame frame = choosing.frame.withLevelsBelow(pages.deepest() - pages.base());
    return countTriangles(choosing, LatticeSnapper(frame, nullptr, false, pages), pages.deepest(), pages, {}, progress);
}

/// Which pages are parted, found by parting those that hold too much, again and again.
class Parting {
public:
    Parting(PageGrid base, uint32_t mostLevelsBelow) : base_(base), deepest_(base.level + mostLevelsBelow) {}

    [[nodiscard]] FinestPages pages() const {
        std::vector<std::vector<uint64_t>> codes(deepest_ - base_.level);
        for (const auto& [level, code] : parted_) codes[level - base_.level].push_back(code);
        return FinestPages(base_, std::move(codes));
    }
    [[nodiscard]] const PageCounts& counts() const { return counts_; }
    /// The pages that were parted last, with their counts; their parts are to be counted next.
    [[nodiscard]] const PageCounts& partedLast() const { return partedLast_; }

    /// Takes the counts of the parts of the pages that were parted last, or at first of all pages. Puts those together
    /// again that were parted in vain, and parts the parts that hold too much. Returns whether it parted any.
    bool improve(const PageCounts& parts) {
        PageCounts together;
        for (const auto& [part, count] : parts)
            if (part.first > base_.level) together[above(part)] += count;
        for (const auto& [page, count] : partedLast_)
            if (double(together[page]) > kMostGrowth * double(count)) {
                parted_.erase(page);
                counts_[page] = count;
            }
        PageCounts crowded;
        for (const auto& [part, count] : parts) {
            if (!partedLast_.empty() && !parted_.contains(above(part))) continue;
            const bool isCrowded = count > kMostPageTriangles && part.first < deepest_;
            (isCrowded ? crowded : counts_)[part] = count;
        }
        for (const auto& [page, count] : crowded) parted_.insert(page);
        partedLast_ = std::move(crowded);
        return !partedLast_.empty();
    }

private:
    static Page above(const Page& part) { return {part.first - 1, part.second >> 3}; }

    PageGrid base_;
    uint32_t deepest_;
    std::set<Page> parted_;
    PageCounts counts_;  ///< of the pages that are not parted
    PageCounts partedLast_;
};

/// Deals triangles with images to the bins of the pages that need them.
class TextureBatch {
public:
    TextureBatch(const Dealing& dealing, const PagePartition& partition) {
        if (dealing.textures == nullptr) return;
        near_.emplace(dealing.pages, partition, dealing.marginCells);
        batch_.emplace(*dealing.textures);
    }
    Result<void> add(const std::optional<TexturedTriangle>& place) {
        if (!place) return {};
        for (const size_t bin : near_->of(place->corner)) VCP_TRY(batch_->add(bin, *place));
        return {};
    }
    Result<void> flush() { return batch_ ? batch_->flush() : Result<void>(); }

private:
    std::optional<BinsNear> near_;
    std::optional<BinBatch<TexturedTriangle>> batch_;
};

/// Counts triangles that have hardly any shape left on the lattice.
class TinyCount {
public:
    explicit TinyCount(std::atomic<uint64_t>& all) : all_(all) {}
    void add(const LatticeTriangle& t) {
        const auto& [a, b, c] = t.corner;
        const glm::i32vec3 size = glm::max(a, glm::max(b, c)) - glm::min(a, glm::min(b, c));
        here_ += std::max(size.x, std::max(size.y, size.z)) < 2 ? 1 : 0;
    }
    void finish() { all_ += std::exchange(here_, 0); }

private:
    std::atomic<uint64_t>& all_;
    uint64_t here_ = 0;
};

struct DealVisit {
    const PageGrid& grid;
    const PagePartition& partition;
    BinBatch<LatticeTriangle> batch;
    TextureBatch textures;
    TinyCount tiny;

    Result<void> operator()(const LatticeTriangle& t, const std::optional<TexturedTriangle>& place) {
        tiny.add(t);
        VCP_TRY(textures.add(place));
        size_t bin[3];
        for (int i = 0; i < 3; ++i) bin[i] = partition.binOf(grid.pageOf(t.corner[i]));
        for (int i = 0; i < 3; ++i)
            if (std::find(bin, bin + i, bin[i]) == bin + i) VCP_TRY(batch.add(bin[i], t));
        return {};
    }
    Result<void> finish() {
        tiny.finish();
        VCP_TRY(textures.flush());
        return batch.flush();
    }
};

/// Deals where there is one bin: nothing is sorted.
struct OneBinVisit {
    RecordBins<LatticeTriangle>& bins;
    TextureBatch textures;
    TinyCount tiny;
    std::vector<LatticeTriangle> held = {};

    Result<void> operator()(const LatticeTriangle& t, const std::optional<TexturedTriangle>& place) {
        constexpr size_t kMostHeld = 4096;
        tiny.add(t);
        VCP_TRY(textures.add(place));
        held.push_back(t);
        return held.size() < kMostHeld ? Result<void>() : append();
    }
    Result<void> finish() {
        tiny.finish();
        VCP_TRY(textures.flush());
        return append();
    }
    Result<void> append() {
        VCP_TRY(bins.append(0, held));
        held.clear();
        return {};
    }
};

/// Returns by how many levels the base level is too fine for pages that hold triangles of their own (deal.h). `pages`:
/// those of the base level.
uint32_t levelsTooMany(const PageCounts& pages, uint64_t triangles) {
    std::vector<uint64_t> codes, pagesAbove;
    for (const auto& [page, count] : pages) codes.push_back(page.second);
    while (codes.size() > 1) {
        pagesAbove.push_back(codes.size());
        for (uint64_t& code : codes) code >>= 3;
        codes.erase(std::unique(codes.begin(), codes.end()), codes.end());
    }
    uint64_t all = std::accumulate(pagesAbove.begin(), pagesAbove.end(), uint64_t{1});
    uint32_t less = 0;
    for (; less < pagesAbove.size() && all > kFreePages + triangles / kLeastPageTriangles; ++less)
        all -= pagesAbove[less];
    return less;
}

}  // namespace

Result<FinestPageChoice> choosePages(const PageChoosing& choosing) {
    Parting parting({choosing.frame.log2Cells, choosing.frame.levels - 1}, choosing.mostLevelsBelow);
    const uint64_t triangles = trianglesOf(choosing.soups);
    const uint64_t uncounted =
        choosing.mostLevelsBelow > 0 ? std::min(choosing.uncounted, kMostPageTriangles) : choosing.uncounted;
    FinestPageChoice choice{parting.pages(), {}};
    if (triangles <= uncounted && !choosing.mayBeCoarser) return choice;
    PageCounts counts;
    // Each count takes half of what is left of the progress.
    double left = 1;
    const auto progress = [&](double part) { return choosing.progress(1 - left + left / 2 * part); };
    for (bool goesOn = true; goesOn; left /= 2) {
        VCP_TRY_ASSIGN(counts, countWhole(choosing, choice.pages, parting.partedLast(), progress));
        if (parting.partedLast().empty() && choosing.mayBeCoarser) choice.levelsLess = levelsTooMany(counts, triangles);
        if (choice.levelsLess > 0) return choice;
        goesOn = parting.improve(counts);
        choice.pages = parting.pages();
    }
    if (choice.pages.isUniform()) {
        counts = parting.counts();
    } else {
        VCP_TRY_ASSIGN(counts, countPieces(choosing, choice.pages, progress));
    }
    for (const auto& [page, count] : counts)
        choice.counts.emplace_back(choice.pages.firstCode(page.first, page.second), count);
    std::sort(choice.counts.begin(), choice.counts.end());
    return choice;
}

Result<void> dealTriangles(const Dealing& dealing, const PagePartition& partition, RecordBins<LatticeTriangle>& bins) {
    const auto deal = [&](auto&& makeVisit) {
        return forLatticeTriangles(dealing.soups, dealing.snapper, true, dealing.progress, makeVisit);
    };
    if (partition.bins() == 1)
        VCP_TRY(deal([&] { return OneBinVisit{bins, TextureBatch(dealing, partition), TinyCount(dealing.tiny)}; }));
    else
        VCP_TRY(deal([&] {
            return DealVisit{dealing.grid, partition, BinBatch(bins), TextureBatch(dealing, partition),
                             TinyCount(dealing.tiny)};
        }));
    if (dealing.textures != nullptr) VCP_TRY(dealing.textures->raw().flush());
    return bins.raw().flush();
}

// Of scans of one density hardly a triangle is so small.
std::optional<std::string> tinyWarning(uint64_t tiny, uint64_t triangles, const GridFrame& frame) {
    if (tiny < 100 || tiny < triangles / 100) return std::nullopt;
    return fmt::format(
        "{} of {} triangles are smaller than this file can tell, {:.4g}: they lose their shape; build "
        "meshes of very different sizes into files of their own, which a scene shows together, or "
        "choose a smaller cell edge",
        tiny, triangles, 2 * frame.cell / kLatticePerCell);
}

}  // namespace vcp
