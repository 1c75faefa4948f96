#include "viewer/export/surface_stream.h"

#include <algorithm>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include "builder/stream/colour_encoding.h"
#include "viewer/export/page_surface.h"

namespace vcp {

namespace {

constexpr uint32_t kNoRank = UINT32_MAX;

/// A vertex that pages other than its home name, too.
struct SharedVertex {
    LatticePoint at;
    uint32_t rank;  ///< its number among those of its home

    [[nodiscard]] auto key() const { return std::tuple(at.x, at.y, at.z); }
    bool operator<(const SharedVertex& other) const { return key() < other.key(); }
    bool operator==(const SharedVertex& other) const { return at == other.at; }
};
using SharedTable = std::vector<SharedVertex>;

/// How a page numbers its vertices.
struct PageNumbers {
    std::vector<uint32_t> rank = {};  ///< of each point; kNoRank where it belongs elsewhere, or no triangle has it
    uint32_t own = 0;                 ///< vertices that belong to the page
    SharedTable shared = {};          ///< sorted
};

PageNumbers numbersOf(const ExportedPage& surface) {
    PageNumbers numbers{.rank = std::vector<uint32_t>(surface.points.size(), kNoRank)};
    const auto isOwn = [&](uint32_t v) { return surface.homes[v] == surface.page; };
    for (const Index3& t : surface.whole)
        for (const uint32_t v : t)
            if (isOwn(v)) numbers.rank[v] = 0;
    for (uint32_t& rank : numbers.rank)
        if (rank != kNoRank) rank = numbers.own++;
    for (const Index3& t : surface.whole) {
        if (std::ranges::all_of(t, isOwn)) continue;
        for (const uint32_t v : t)
            if (isOwn(v)) numbers.shared.push_back({surface.points[v], numbers.rank[v]});
    }
    std::ranges::sort(numbers.shared, std::less<>());
    numbers.shared.erase(std::unique(numbers.shared.begin(), numbers.shared.end()), numbers.shared.end());
    numbers.shared.shrink_to_fit();
    return numbers;
}

/// The tables of the pages that were asked last. Any thread.
class SharedTables {
public:
    SharedTables(const ByteReader& reader, const SurfaceCut& cut, uint64_t mostBytes)
        : reader_(reader), cut_(cut), mostBytes_(mostBytes) {}

    void keep(uint64_t page, std::shared_ptr<const SharedTable> table) {
        const std::lock_guard lock(mutex_);
        if (places_.contains(page)) return;
        bytes_ += bytesOf(*table);
        latest_.emplace_front(page, std::move(table));
        places_[page] = latest_.begin();
        while (bytes_ > mostBytes_ && latest_.size() > 1) {
            bytes_ -= bytesOf(*latest_.back().second);
            places_.erase(latest_.back().first);
            latest_.pop_back();
        }
    }

    /// Returns a page's table, and reads the page for it where it is not kept. Errors: those of readPage.
    Result<std::shared_ptr<const SharedTable>> of(uint64_t page) {
        if (auto kept = find(page)) return kept;
        VCP_TRY_ASSIGN(const auto surface, readPageSurface(reader_, cut_, page, false));
        auto table = std::make_shared<const SharedTable>(std::move(numbersOf(surface).shared));
        keep(page, table);
        return table;
    }

private:
    static uint64_t bytesOf(const SharedTable& table) { return 128 + table.size() * sizeof(SharedVertex); }

    std::shared_ptr<const SharedTable> find(uint64_t page) {
        const std::lock_guard lock(mutex_);
        const auto place = places_.find(page);
        if (place == places_.end()) return nullptr;
        latest_.splice(latest_.begin(), latest_, place->second);
        return latest_.front().second;
    }

    using Latest = std::list<std::pair<uint64_t, std::shared_ptr<const SharedTable>>>;

    const ByteReader& reader_;
    const SurfaceCut& cut_;
    uint64_t mostBytes_, bytes_ = 0;
    std::mutex mutex_;
    Latest latest_;
    std::map<uint64_t, Latest::iterator> places_;
};

/// Makes something of each page, on all threads, and hands it on in their order.
class PageBatches {
public:
    PageBatches(const SurfaceCut& cut, const StreamOptions& options)
        : cut_(cut), options_(options), arena_(threadsOf(options)) {}

    /// make(index, page) -> Result<Piece>, any thread; take(index, Piece&&) -> Result<void>. The progress goes from
    /// `from` to `to`.
    template <class Make, class Take>
    Result<void> run(double from, double to, Make&& make, Take&& take) {
        const std::span<const uint64_t> pages = cut_.pages();
        using Made = decltype(make(size_t(0), uint64_t(0)));
        for (size_t first = 0; first < pages.size();) {
            const size_t end = endOfBatch(first);
            std::vector<std::optional<Made>> pieces(end - first);
            arena_.execute([&] {
                tbb::parallel_for(first, end, [&](size_t i) { pieces[i - first].emplace(make(i, pages[i])); });
            });
            for (size_t i = first; i < end; ++i) {
                VCP_TRY_ASSIGN(auto piece, std::move(*pieces[i - first]));
                VCP_TRY(take(i, std::move(piece)));
                pieces[i - first].reset();
            }
            first = end;
            if (options_.progress && !options_.progress(from + (to - from) * double(end) / double(pages.size())))
                return Error::cancelled();
        }
        return {};
    }

private:
    /// More threads than TBB allows would make it complain.
    static int threadsOf(const StreamOptions& options) {
        const size_t most = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
        return options.threads > 0 ? int(std::min<size_t>(options.threads, most)) : tbb::task_arena::automatic;
    }
    [[nodiscard]] size_t endOfBatch(size_t first) const {
        const std::span<const uint64_t> pages = cut_.pages();
        uint64_t bytes = 0;
        size_t end = first;
        do {
            bytes += cut_.dataset().pages[pages[end]].pageBytes;
            ++end;
        } while (end < pages.size() && bytes + cut_.dataset().pages[pages[end]].pageBytes <= kBatchBytes);
        return end;
    }

    const SurfaceCut& cut_;
    const StreamOptions& options_;
    tbb::task_arena arena_;
};

void widen(Box& box, glm::dvec3 p) { box = {glm::min(box.low, p), glm::max(box.high, p)}; }

uint32_t rgbaOf(glm::dvec4 channels) {
    return packRgba(
        {toByte(channels.x / 255), toByte(channels.y / 255), toByte(channels.z / 255), toByte(channels.w / 255)});
}

class MeshStreaming {
public:
    MeshStreaming(const ByteReader& reader, const SurfaceCut& cut, const StreamOptions& options, MeshSink& sink)
        : reader_(reader),
          cut_(cut),
          options_(options),
          sink_(sink),
          tables_(reader, cut, options.tableBytes),
          batches_(cut, options),
          first_(cut.pages().size()) {}

    Result<SurfaceTotals> run() {
        VCP_TRY(batches_.run(
            0, 0.5, [&](size_t, uint64_t page) { return verticesOf(page); },
            [&](size_t index, PageVertices&& piece) { return takeVertices(index, std::move(piece)); }));
        VCP_TRY(sink_.endVertices(totals_));
        VCP_TRY(batches_.run(
            0.5, 1, [&](size_t index, uint64_t page) { return trianglesOf(index, page); },
            [&](size_t, std::vector<std::array<uint64_t, 3>>&& triangles) { return sink_.addTriangles(triangles); }));
        return totals_;
    }

private:
    struct PageVertices {
        std::vector<SurfaceVertex> vertices = {};
        uint64_t triangles = 0;
        double error = 0;
        std::shared_ptr<const SharedTable> shared = {};
    };

    [[nodiscard]] Result<PageVertices> verticesOf(uint64_t page) const {
        VCP_TRY_ASSIGN(const auto surface, readPageSurface(reader_, cut_, page, options_.colour));
        PageNumbers numbers = numbersOf(surface);
        PageVertices piece{.error = surface.error};
        for (size_t v = 0; v < surface.points.size(); ++v)
            if (numbers.rank[v] != kNoRank)
                piece.vertices.push_back({.at = cut_.worldOf(surface.points[v]),
                                          .colour = surface.colours.empty() ? 0xffffffff : surface.colours[v]});
        for (const ColouredPoint& p : surface.loose.points)
            piece.vertices.push_back({.at = p.at, .colour = rgbaOf(p.colour)});
        piece.triangles =
            surface.loose.triangles.size() +
            uint64_t(std::ranges::count_if(surface.whole, [&](const Index3& t) { return surface.owns(t); }));
        piece.shared = std::make_shared<const SharedTable>(std::move(numbers.shared));
        return piece;
    }

    Result<void> takeVertices(size_t index, PageVertices&& piece) {
        first_[index] = totals_.vertices;
        totals_.vertices += piece.vertices.size();
        totals_.triangles += piece.triangles;
        totals_.certified = std::max(totals_.certified, piece.error);
        for (const SurfaceVertex& v : piece.vertices) widen(totals_.bounds, v.at);
        if (!piece.shared->empty()) tables_.keep(cut_.pages()[index], std::move(piece.shared));
        return sink_.addVertices(piece.vertices);
    }

    Result<std::vector<std::array<uint64_t, 3>>> trianglesOf(size_t index, uint64_t page) {
        VCP_TRY_ASSIGN(const auto surface, readPageSurface(reader_, cut_, page, false));
        const PageNumbers numbers = numbersOf(surface);
        std::vector<std::array<uint64_t, 3>> triangles;
        std::map<uint64_t, std::shared_ptr<const SharedTable>> homes;  // of this page's neighbours
        for (const Index3& t : surface.whole) {
            if (!surface.owns(t)) continue;
            auto& triangle = triangles.emplace_back();
            for (int i = 0; i < 3; ++i) {
                const uint64_t home = surface.homes[t[i]];
                if (home == page) {
                    triangle[i] = first_[index] + numbers.rank[t[i]];
                    continue;
                }
                auto& table = homes[home];
                if (!table) {
                    VCP_TRY_ASSIGN(table, tables_.of(home));
                }
                VCP_TRY_ASSIGN(triangle[i], numberIn(*table, home, page, surface.points[t[i]]));
            }
        }
        const uint64_t loose = first_[index] + numbers.own;
        for (const Index3& t : surface.loose.triangles) triangles.push_back({loose + t[0], loose + t[1], loose + t[2]});
        return triangles;
    }

    [[nodiscard]] Result<uint64_t> numberIn(const SharedTable& table, uint64_t home, uint64_t page,
                                            LatticePoint p) const {
        const SharedVertex wanted{p, 0};
        const auto found = std::lower_bound(table.begin(), table.end(), wanted);
        const auto at = std::ranges::lower_bound(cut_.pages(), home);
        if (found == table.end() || !(*found == wanted) || at == cut_.pages().end() || *at != home)
            return Error{.code = ErrorCode::InvalidInput,
                         .message = fmt::format("does not have a triangle that page {} shares with it; the file was "
                                                "not made by a build",
                                                page),
                         .file = cut_.name(),
                         .element = fmt::format("page {}", home)};
        return first_[size_t(at - cut_.pages().begin())] + found->rank;
    }

    const ByteReader& reader_;
    const SurfaceCut& cut_;
    const StreamOptions& options_;
    MeshSink& sink_;
    SharedTables tables_;
    PageBatches batches_;
    std::vector<uint64_t> first_;  ///< number of each page's first vertex, in the order of the cut
    SurfaceTotals totals_;
};

}  // namespace

Result<SurfaceTotals> streamMesh(const ByteReader& reader, const SurfaceCut& cut, const StreamOptions& options,
                                 MeshSink& sink) {
    return MeshStreaming(reader, cut, options, sink).run();
}

Result<SurfaceTotals> streamFacets(const ByteReader& reader, const SurfaceCut& cut, const StreamOptions& options,
                                   bool once, const TakeFacets& take) {
    struct PageFacets {
        std::vector<Facet> facets = {};
        double error = 0;
    };
    SurfaceTotals totals;
    const auto make = [&](size_t, uint64_t page) -> Result<PageFacets> {
        VCP_TRY_ASSIGN(const auto surface, readPageSurface(reader, cut, page, false));
        PageFacets piece{.error = surface.error};
        for (const Index3& t : surface.whole)
            if (!once || surface.owns(t))
                piece.facets.push_back({cut.worldOf(surface.points[t[0]]), cut.worldOf(surface.points[t[1]]),
                                        cut.worldOf(surface.points[t[2]])});
        const auto& points = surface.loose.points;
        for (const Index3& t : surface.loose.triangles)
            piece.facets.push_back({points[t[0]].at, points[t[1]].at, points[t[2]].at});
        return piece;
    };
    const auto hand = [&](size_t, PageFacets&& piece) -> Result<void> {
        totals.triangles += piece.facets.size();
        totals.certified = std::max(totals.certified, piece.error);
        for (const Facet& facet : piece.facets)
            for (const glm::dvec3& p : facet) widen(totals.bounds, p);
        return take(piece.facets);
    };
    VCP_TRY(PageBatches(cut, options).run(0, 1, make, hand));
    return totals;
}

}  // namespace vcp
