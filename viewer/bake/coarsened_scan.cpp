#include "viewer/bake/coarsened_scan.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <future>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <meshoptimizer.h>

#include "builder/measure/mesh_deviation.h"
#include "mesostructure/base/manifold_part.h"
#include "mesostructure/base/surface_edges.h"
#include "octree/io/caught.h"
#include "viewer/export/surface_stream.h"

namespace vcp {

namespace {

using meso::BaseSurface;

constexpr uint64_t kMostOfRun = 1'000'000, kFewestOfRun = 2'000;
constexpr uint64_t kRunBytes = 600;  // memory for each triangle of a run, from reading to what it is simplified to
constexpr uint64_t kSamples = 50'000, kFewestSamples = 64;  // that say how far the scan is away
constexpr double kReadPart = 0.95;                          // of the work; the rest is done when all is read

/// A run of the scan's triangles, as they are or simplified.
struct Run {
    BaseSurface surface;
    uint64_t scanTriangles = 0;  ///< that it stands for
};

struct SimplifiedRun {
    Run run;
    uint64_t vertices = 0;  ///< before
    uint64_t joined = 0;    ///< corners less than were given
    uint64_t leftOut = 0;
    double away = 0;  ///< most that samples are away from what they became, world units
};

void append(BaseSurface& to, const BaseSurface& from) {
    const auto first = uint32_t(to.positions.size());
    to.positions.insert(to.positions.end(), from.positions.begin(), from.positions.end());
    for (const auto& t : from.triangles) to.triangles.push_back({first + t[0], first + t[1], first + t[2]});
}

/// Gives corners at one place one number. Returns how many numbers went.
uint64_t join(BaseSurface& surface) {
    auto& all = surface.positions;
    if (all.empty()) return 0;
    std::vector<uint32_t> numbers(all.size());
    const size_t kept =
        meshopt_generateVertexRemap(numbers.data(), nullptr, all.size(), all.data(), all.size(), sizeof all[0]);
    // Numbers are given in the order in which places first come.
    for (size_t i = 0, next = 0; i < all.size(); ++i)
        if (numbers[i] == next) all[next++] = all[i];
    for (auto& triangle : surface.triangles)
        for (uint32_t& corner : triangle) corner = numbers[corner];
    const uint64_t gone = all.size() - kept;
    all.resize(kept);
    return gone;
}

uint64_t borderEdges(const BaseSurface& surface) {
    const auto opposite = meso::oppositeEdges(surface.triangles, surface.positions.size());
    return uint64_t(std::ranges::count(opposite, meso::kNoEdge));
}

/// Leaves out corners that no triangle has.
void keepUsedCorners(BaseSurface& surface) {
    constexpr uint32_t kUnused = UINT32_MAX;
    std::vector<uint32_t> renumbered(surface.positions.size(), kUnused);
    std::vector<glm::dvec3> kept;
    for (auto& t : surface.triangles)
        for (uint32_t& corner : t) {
            uint32_t& number = renumbered[corner];
            if (number == kUnused) number = uint32_t(kept.size()), kept.push_back(surface.positions[corner]);
            corner = number;
        }
    surface.positions = std::move(kept);
}

/// Leaves about so many triangles. Corners on borders stay.
void simplify(BaseSurface& surface, size_t triangles) {
    std::vector<glm::vec3> places;  // single precision is relative to the lowest corner
    const Box box = Box::of(surface.positions);
    for (const glm::dvec3& p : surface.positions) places.emplace_back(p - box.low);
    std::vector<std::array<uint32_t, 3>> left(surface.triangles.size());
    const size_t indices = meshopt_simplify(&left[0][0], &surface.triangles[0][0], 3 * left.size(), &places[0].x,
                                            places.size(), sizeof places[0], 3 * std::min(triangles, left.size()), 1,
                                            meshopt_SimplifyLockBorder, nullptr);
    left.resize(indices / 3);
    surface.triangles = std::move(left);
}

class Coarsening {
public:
    Coarsening(const ByteReader& reader, const SurfaceCut& cut, const CoarseningOptions& options)
        : reader_(reader), cut_(cut), options_(options), all_(cut.dataset().header.triangles) {
        threads_ = std::max(1u, std::thread::hardware_concurrency());
        const uint64_t most = options.memoryBytes / 2 / kRunBytes;
        mostOfRun_ = std::clamp(most / (threads_ + 1), kFewestOfRun, kMostOfRun);
        mostJoined_ = std::max(most, kFewestOfRun);
    }
    // Work that goes on would be waited for.
    ~Coarsening() { isStopped_ = true; }

    Result<CoarsenedScan> run() {
        const StreamOptions streaming{.colour = false,
                                      .progress = [this](double part) { return told(kReadPart * part); }};
        VCP_TRY(streamFacets(reader_, cut_, streaming, true,
                             [this](std::span<const Facet> facets) { return take(facets); }));
        VCP_TRY(closeRun());
        VCP_TRY(finish(0));
        while (held_ > options_.triangles + options_.triangles / 4 && runs_.size() > 1) {
            const uint64_t before = held_;
            VCP_TRY(joinNeighbours());
            if (double(held_) > 0.9 * double(before)) break;
        }
        BaseSurface whole;
        for (Run& run : runs_) append(whole, run.surface), run.surface = {};
        made_.vertices -= join(whole);
        if (runs_.size() > 1) partSheets(whole);
        for (const double most : away_) made_.away += most;
        made_.mesh = {std::move(whole.positions), std::move(whole.triangles), {}};
        return std::move(made_);
    }

private:
    bool told(double part) {
        part_ = part;
        return !options_.progress || options_.progress(part);
    }

    Result<void> take(std::span<const Facet> facets) {
        for (const Facet& facet : facets) {
            const auto first = uint32_t(open_.surface.positions.size());
            open_.surface.positions.insert(open_.surface.positions.end(), facet.begin(), facet.end());
            open_.surface.triangles.push_back({first, first + 1, first + 2});
            if (++open_.scanTriangles < mostOfRun_) continue;
            VCP_TRY(closeRun());
            if (held_ < std::max(2 * options_.triangles, 2 * heldBefore_)) continue;
            VCP_TRY(finish(0));
            VCP_TRY(joinNeighbours());
            heldBefore_ = held_;
        }
        return {};
    }

    Result<void> closeRun() {
        if (open_.scanTriangles == 0) return {};
        return start(std::exchange(open_, {}), 0);
    }

    /// Simplifies a run in a thread of its own. `round`: how many times it was simplified before.
    Result<void> start(Run run, size_t round) {
        VCP_TRY(finish(threads_ - 1));
        working_.push_back({round, std::async(std::launch::async, [this, round, run = std::move(run)]() mutable {
                                return caught(
                                    [&]() -> Result<SimplifiedRun> { return simplified(std::move(run), round); });
                            })});
        return {};
    }

    /// Waits until no more than so many runs are worked at, and keeps what they became, in their order.
    Result<void> finish(size_t most) {
        for (; working_.size() > most; working_.pop_front()) {
            auto& [round, work] = working_.front();
            while (work.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready)
                if (!told(part_)) return Error::cancelled();
            VCP_TRY_ASSIGN(SimplifiedRun done, work.get());
            made_.leftOut += done.leftOut;
            if (round == 0)
                made_.vertices += done.vertices;
            else
                made_.vertices -= done.joined;
            away_.resize(std::max(away_.size(), round + 1), 0);
            away_[round] = std::max(away_[round], done.away);
            held_ += done.run.surface.triangles.size();
            runs_.push_back(std::move(done.run));
            // Corners and triangles, and as much again while they are joined.
            constexpr uint64_t kHeldBytes = 100;
            if (held_ * kHeldBytes > options_.memoryBytes / 2)
                return Error{.code = ErrorCode::Limit,
                             .message = fmt::format("has too many parts, holes or borders to be made coarser within {} "
                                                    "MiB of memory; give a base of your own",
                                                    options_.memoryBytes >> 20),
                             .file = cut_.name()};
        }
        return {};
    }

    /// Joins runs that follow each other, as many as the memory holds, and simplifies them again, one after the other.
    Result<void> joinNeighbours() {
        std::vector<Run> before = std::exchange(runs_, {});
        ++round_, held_ = 0;
        for (size_t first = 0, last = 0; first < before.size(); first = last) {
            Run joined;
            for (; last < before.size(); ++last) {
                const size_t more = before[last].surface.triangles.size();
                if (last > first && joined.surface.triangles.size() + more > mostJoined_) break;
                append(joined.surface, before[last].surface);
                joined.scanTriangles += before[last].scanTriangles;
                before[last].surface = {};
            }
            VCP_TRY(finish(0));
            VCP_TRY(start(std::move(joined), round_));
        }
        return finish(0);
    }

    /// Any thread.
    [[nodiscard]] SimplifiedRun simplified(Run run, size_t round) const {
        SimplifiedRun made;
        made.joined = join(run.surface);
        made.vertices = run.surface.positions.size();
        // Where two runs are pinched at one place of their border, their sheets touch.
        if (round > 0) partSheets(run.surface);
        made.leftOut = keepManifoldPart(run.surface);
        made.run.scanTriangles = run.scanTriangles;
        if (run.surface.triangles.empty() || isStopped_) return made;
        // What is within borders keeps its share, however many there are.
        const double part = double(run.scanTriangles) / double(all_), share = part * double(options_.triangles);
        made.run.surface = run.surface;
        simplify(made.run.surface, size_t(share) + borderEdges(run.surface));
        leaveOutFolds(made.run.surface), partSheets(made.run.surface);
        made.leftOut += keepManifoldPart(made.run.surface);
        keepUsedCorners(made.run.surface);
        if (made.run.surface.triangles.empty() || isStopped_) return made;
        const IndexedMesh scan{std::move(run.surface.positions), std::move(run.surface.triangles), {}},
            coarse{made.run.surface.positions, made.run.surface.triangles, {}};
        const DeviationTarget target(coarse);
        const auto away = measureDeviation(
            scan, target, {.samples = std::max(uint64_t(part * double(kSamples)), kFewestSamples), .threads = 1});
        if (away) made.away = away->absoluteQuantile(1);  // else nothing has an area
        return made;
    }

    struct Working {
        size_t round;
        std::future<Result<SimplifiedRun>> work;
    };

    const ByteReader& reader_;
    const SurfaceCut& cut_;
    const CoarseningOptions& options_;
    uint64_t all_, mostOfRun_ = 0, mostJoined_ = 0;  // triangles
    unsigned threads_ = 1;
    Run open_;                  // what is read
    std::vector<Run> runs_;     // simplified, in the order of their pages
    uint64_t held_ = 0;         // triangles of these
    uint64_t heldBefore_ = 0;   // after neighbours were joined
    size_t round_ = 0;          // times that neighbours were joined
    std::vector<double> away_;  // the most of each round
    double part_ = 0;
    CoarsenedScan made_;
    std::atomic<bool> isStopped_ = false;
    std::deque<Working> working_;  // waited for first of all
};

}  // namespace

Result<CoarsenedScan> coarsenScan(const ByteReader& reader, const SurfaceCut& cut, const CoarseningOptions& options) {
    return Coarsening(reader, cut, options).run();
}

}  // namespace vcp
