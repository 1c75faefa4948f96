#include "builder/deal.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <unordered_map>

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include "builder/level/level_step.h"

namespace vcp {

namespace {

uint64_t trianglesOf(const Soup& soup) { return soup.floats.raw().total() + soup.doubles.raw().total(); }

/// Calls visit(piece) for every triangle of the soup on the lattice, then visit.finish(), with a visit of its own
/// for each block of the soup.
template <class MakeVisit>
Result<void> forLatticeTriangles(const Dealing& dealing, bool painted, MakeVisit&& makeVisit) {
    const uint64_t total = trianglesOf(dealing.soup);
    std::atomic<uint64_t> done = 0;
    std::atomic<bool> failed = false, cancelled = false;
    std::mutex mutex;
    Result<void> result;
    const auto all = [&](const auto& bins) {
        const auto blocks = bins.raw().blocks(0);
        tbb::parallel_for(size_t{0}, blocks.size(), [&](size_t i) {
            if (cancelled || failed) return;
            auto visit = makeVisit();
            auto records = bins.read(blocks[i]);
            Result<void> here = records ? Result<void>() : Result<void>(records.error());
            if (records)
                for (const auto& t : *records)
                    dealing.snapper.add(
                        t,
                        [&](const LatticeTriangle& piece) {
                            if (here) here = visit(piece);
                        },
                        painted);
            if (here) here = visit.finish();
            if (!dealing.progress(double(done += blocks[i].records) / double(total))) cancelled = true;
            if (here) return;
            const std::scoped_lock lock(mutex);
            if (!failed.exchange(true)) result = here;
        });
    };
    all(dealing.soup.floats);
    all(dealing.soup.doubles);
    if (result && cancelled) return Error::cancelled();
    return result;
}

using PageCounts = std::unordered_map<uint64_t, uint64_t>;

/// Counts a triangle for every page that will need it.
struct CountVisit {
    const PageGrid& grid;
    PageCounts& counts;

    Result<void> operator()(const LatticeTriangle& t) {
        grid.forPagesNear(t.corner, kStepMarginCells, [&](uint64_t page) { ++counts[page]; });
        return {};
    }
    static Result<void> finish() { return {}; }
};

struct DealVisit {
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

}  // namespace

Result<PagePartition> choosePartition(const Dealing& dealing, uint64_t limit) {
    if (trianglesOf(dealing.soup) <= limit) return PagePartition();
    tbb::enumerable_thread_specific<PageCounts> parts;
    VCP_TRY(forLatticeTriangles(dealing, false, [&] { return CountVisit{dealing.grid, parts.local()}; }));
    std::map<uint64_t, uint64_t> counts;
    for (PageCounts& part : parts) {
        for (const auto& [page, count] : part) counts[page] += count;
        PageCounts().swap(part);
    }
    return PagePartition({counts.begin(), counts.end()}, limit);
}

Result<void> dealTriangles(const Dealing& dealing, const PagePartition& partition, RecordBins<LatticeTriangle>& bins) {
    VCP_TRY(forLatticeTriangles(dealing, true, [&] { return DealVisit{dealing.grid, partition, BinBatch(bins)}; }));
    return bins.raw().flush();
}

}  // namespace vcp
