#include "builder/level_pages.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <map>
#include <mutex>

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include "builder/page/bin_triangles.h"
#include "builder/page/exact_tree.h"
#include "builder/page/page_encoder.h"

namespace vcp {

namespace {

struct BuiltPage {
    PageEntry entry;
    StoredPage stored;
};

/// Builds a page's bytes; what they were made of is freed before they are coded.
EncodedPage buildGeometry(const LevelSettings& settings, const LatticeMesh& mesh, uint64_t code,
                          std::span<const uint32_t> triangles) {
    if (settings.exact) {
        PageTree tree = buildExactTree(mesh, triangles, mortonDecode(code), settings.grid.log2Cells);
        return encodePage(tree, mesh);
    }
    PageGeometry geometry(mesh, triangles, mortonDecode(code), settings.grid.log2Cells);
    const double tolerance = settings.finest ? settings.tolerance - geometry.stray() : settings.tolerance;
    PageTree tree = buildPageTree(geometry, tolerance);
    return encodePage(tree, mesh);
}

Result<BuiltPage> buildPage(const LevelSettings& settings, const LatticeMesh& mesh, uint64_t code,
                            std::span<const uint32_t> triangles) {
    const EncodedPage encoded = buildGeometry(settings, mesh, code, triangles);
    // A page that cannot be read back must not spoil the whole file.
    if (const auto view = parsePage(encoded.geometry); encoded.leaves > 0 && !view)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format(
                         "a subvolume of {} triangles and {} leaves is more than a page holds; use a smaller cell edge",
                         triangles.size(), encoded.leaves)};
    BuiltPage page;
    page.entry.morton = code;
    page.entry.level = uint8_t(settings.grid.level);
    page.entry.leaves = encoded.leaves;
    page.entry.hardLeaves = encoded.hardLeaves;
    page.entry.certifiedError =
        std::nextafter(float(encoded.certifiedError * settings.cell), std::numeric_limits<float>::infinity());
    if (encoded.leaves > 0) page.stored = compressPage(encoded.geometry, encoded.colour);
    return page;
}

uint64_t bytesOf(const LatticeMesh& mesh) {
    return mesh.positions.size() * (sizeof(glm::i32vec3) + 2 * sizeof(uint32_t)) +
           mesh.triangles.size() * (sizeof mesh.triangles[0] + sizeof(float));
}

/// Returns the memory to build a page of these triangles.
uint64_t workOf(const LevelSettings& settings, const LatticeMesh& mesh, std::span<const uint32_t> triangles) {
    if (settings.exact) return exactPageWorkBytes(triangles.size());
    double touched = 0;
    for (const uint32_t k : triangles) {
        glm::dvec3 p[3];
        for (int i = 0; i < 3; ++i) p[i] = glm::dvec3(mesh.positions[mesh.triangles[k][i]]) / double(kLatticePerCell);
        // The cells that a flat shape touches: its area over three axes, its rim, and those of its corners.
        const double perimeter = glm::distance(p[0], p[1]) + glm::distance(p[1], p[2]) + glm::distance(p[2], p[0]);
        touched += 0.875 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0])) + 1.5 * perimeter + 4;
    }
    return pageWorkBytes(triangles.size(), uint64_t(touched));
}

/// Lets pages be built while there is memory for them.
class Admission {
public:
    explicit Admission(uint64_t bytes) : free_(bytes) {}
    void enter(uint64_t bytes) {
        std::unique_lock lock(mutex_);
        freed_.wait(lock, [&] { return bytes <= free_; });
        free_ -= bytes;
    }
    void leave(uint64_t bytes) {
        {
            const std::scoped_lock lock(mutex_);
            free_ += bytes;
        }
        freed_.notify_all();
    }

private:
    std::mutex mutex_;
    std::condition_variable freed_;
    uint64_t free_;
};

/// Appends pages in order, whatever the order they come in.
class InOrder {
public:
    explicit InOrder(PageSpool& spool) : spool_(spool) {}
    Result<void> put(size_t number, BuiltPage page) {
        const std::scoped_lock lock(mutex_);
        ready_.emplace(number, std::move(page));
        for (auto at = ready_.begin(); at != ready_.end() && at->first == next_; at = ready_.erase(at), ++next_)
            if (at->second.entry.leaves > 0) VCP_TRY(spool_.append(at->second.entry, at->second.stored));
        return {};
    }

private:
    PageSpool& spool_;
    std::mutex mutex_;
    std::map<size_t, BuiltPage> ready_;
    size_t next_ = 0;
};

}  // namespace

Result<void> buildPages(const LevelSettings& settings, const LatticeMesh& mesh, uint64_t first, uint64_t end,
                        PageSpool& spool, const std::function<bool(double)>& progress) {
    const TriangleBins bins =
        binTriangles(mesh, settings.grid, settings.exact ? kExactMarginCells : kBinMarginCells, first, end);
    std::vector<uint64_t> work(bins.pages.size());
    tbb::parallel_for(size_t{0}, work.size(), [&](size_t i) { work[i] = workOf(settings, mesh, bins.of(i)); });
    const uint64_t held = bytesOf(mesh) + bins.triangles.size() * sizeof(uint32_t);
    const auto left = [&](uint64_t bytes) { return bytes - std::min(held, bytes); };
    InOrder inOrder(spool);
    // Pages that need more than all have together are built first, each alone, while nothing else takes memory.
    std::vector<bool> isBuilt(work.size(), false);
    for (size_t i = 0; i < work.size(); ++i) {
        if (work[i] <= left(settings.pageBytes)) continue;
        if (const uint64_t most = left(settings.pageBytes + settings.roomBytes); work[i] > most)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("a subvolume holds {} triangles and needs {} MiB more memory; use a "
                                                "smaller cell edge or a larger memory cap",
                                                bins.of(i).size(), ((work[i] - most) * 3 / 2 >> 20) + 1)};
        VCP_TRY(settings.makeRoom());
        VCP_TRY_ASSIGN(auto page, buildPage(settings, mesh, bins.pages[i], bins.of(i)));
        VCP_TRY(inOrder.put(i, std::move(page)));
        isBuilt[i] = true;
    }
    Admission admission(left(settings.pageBytes));
    std::atomic<size_t> next = 0, done = 0;
    std::atomic<bool> stopped = false;
    std::mutex mutex;
    Result<void> result;
    const auto buildOne = [&](size_t i) -> Result<void> {
        Result<void> put;
        if (!isBuilt[i]) {
            admission.enter(work[i]);
            auto page = buildPage(settings, mesh, bins.pages[i], bins.of(i));
            put = page ? inOrder.put(i, std::move(*page)) : Result<void>(page.error());
            admission.leave(work[i]);
        }
        if (put && !progress(double(++done) / double(bins.pages.size()))) return Error::cancelled();
        return put;
    };
    // Pages differ in weight, so they are taken one by one, in order: few must wait for an earlier one.
    tbb::parallel_for(
        0, tbb::this_task_arena::max_concurrency(),
        [&](int) {
            for (size_t i; !stopped && (i = next++) < bins.pages.size();) {
                auto built = buildOne(i);
                if (built) continue;
                const std::scoped_lock lock(mutex);
                if (!stopped.exchange(true)) result = built;
            }
        },
        tbb::simple_partitioner());
    return result;
}

}  // namespace vcp
