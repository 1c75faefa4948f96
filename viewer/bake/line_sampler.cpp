#include "viewer/bake/line_sampler.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/measure/hit_colour.h"
#include "octree/reference_caster.h"
#include "viewer/asset/share_out.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {

namespace {

constexpr size_t kRun = 16384, kFewest = 64;
constexpr double kSameSheet = 1e-3;  // finest cells

class Sampler {
public:
    Sampler(std::shared_ptr<const ByteReader> reader, const Dataset& dataset, const LineSamplerOptions& options)
        : reader_(std::move(reader)), dataset_(dataset), options_(options), pages_(reader_, dataset) {
        same_ = kSameSheet * dataset.cellOf(dataset.header.levels - 1);
    }

    Result<void> run(std::span<const SampleLine> lines, std::span<LineHit> hits) {
        for (size_t first = 0; first < lines.size(); first += kRun) {
            const size_t count = std::min(kRun, lines.size() - first);
            VCP_TRY(sampleRun(lines.subspan(first, count), hits.subspan(first, count)));
            if (options_.progress && !options_.progress(double(first + count) / double(lines.size())))
                return Error::cancelled();
        }
        return {};
    }

private:
    Result<void> sampleRun(std::span<const SampleLine> lines, std::span<LineHit> hits) {
        const std::vector<uint64_t> cut = pagesIn(boxOf(lines));
        uint64_t bytes = 0, missing = 0;
        for (const uint64_t page : cut) {
            const uint64_t size = dataset_.pages[page].pageBytes + uint64_t{dataset_.pages[page].colourBytes};
            bytes += size;
            if (!pages_.view(page)) missing += size;
        }
        if (bytes > options_.memoryBytes) {
            if (lines.size() <= kFewest)
                return Error{
                    .code = ErrorCode::Limit,
                    .message = fmt::format("{} bytes of pages lie along {} lines, and the memory cap leaves {} "
                                           "for them; raise it",
                                           bytes, lines.size(), options_.memoryBytes),
                    .file = reader_->name()};
            const size_t half = lines.size() / 2;
            VCP_TRY(sampleRun(lines.first(half), hits.first(half)));
            return sampleRun(lines.subspan(half), hits.subspan(half));
        }
        if (pages_.bytes() + missing > options_.memoryBytes) pages_ = PageCache(reader_, dataset_);
        VCP_TRY(pages_.load(cut));
        VCP_TRY_ASSIGN(const auto caster, ReferenceCaster::create(pages_, cut));
        const bool isDone = shareOut(lines.size(),
                                     [&](size_t first, size_t last) {
                                         for (size_t i = first; i < last; ++i) hits[i] = hitOf(caster, lines[i]);
                                     },
                                     {});
        return isDone ? Result<void>() : Error::cancelled();
    }

    [[nodiscard]] Box boxOf(std::span<const SampleLine> lines) const {
        Box box = Box::nothing();
        for (const SampleLine& line : lines)
            for (const double t : {options_.low, options_.high}) {
                const glm::dvec3 p = line.start + t * line.direction;
                box = box.joined({p, p});
            }
        return box;
    }

    /// Returns the finest pages that touch a box.
    [[nodiscard]] std::vector<uint64_t> pagesIn(const Box& box) const {
        std::vector<uint64_t> found, open{0};
        while (!open.empty()) {
            const uint64_t page = open.back();
            open.pop_back();
            const PageEntry& entry = dataset_.pages[page];
            const glm::dvec3 slack(dataset_.cellOf(entry.level)), low = dataset_.originOf(entry) - slack,
                                                                  high = low + dataset_.edgeOf(entry) + 2.0 * slack;
            if (glm::any(glm::lessThan(box.high, low)) || glm::any(glm::greaterThan(box.low, high))) continue;
            if (entry.childMask == 0) found.push_back(page);
            for (const uint64_t child : childrenOf(entry)) open.push_back(child);
        }
        return found;
    }

    /// Casts from the outer end inwards, so that normals face outwards.
    [[nodiscard]] LineHit hitOf(const ReferenceCaster& caster, const SampleLine& line) const {
        LineHit found;
        const double length = glm::length(line.direction);
        if (!(length > 0)) return found;
        const Ray ray{.origin = line.start + options_.high * line.direction,
                      .direction = -line.direction / length,
                      .tMin = 0,
                      .tMax = (options_.high - options_.low) * length};
        const std::vector<RayHit> all = caster.castAll(ray);
        const RayHit* nearest = nullptr;
        double best = std::numeric_limits<double>::infinity(), second = best, before = -best;
        for (const RayHit& hit : all) {
            if (hit.t - before < same_) continue;  // the same sheet, in the next leaf
            before = hit.t;
            const double at = options_.high - hit.t / length, away = std::abs(at);
            // Sheets come from the outer end on: a later one must be nearer by more than rounding.
            if (away < best - same_ / length) {
                if (nearest) second = best, found.other = float(found.at);
                best = away, nearest = &hit, found.at = at;
            } else if (away < second) {
                second = away, found.other = float(at);
            }
        }
        if (!nearest) return found;
        found.normal = glm::vec3(nearest->normal);
        if (options_.withColour)
            if (const auto light = lightOfHit(pages_, *nearest)) found.light = glm::vec3(*light);
        return found;
    }

    std::shared_ptr<const ByteReader> reader_;
    const Dataset& dataset_;
    const LineSamplerOptions& options_;
    PageCache pages_;
    double same_ = 0;
};

}  // namespace

Result<void> sampleLines(std::shared_ptr<const ByteReader> reader, const Dataset& dataset,
                         std::span<const SampleLine> lines, std::span<LineHit> hits,
                         const LineSamplerOptions& options) {
    return Sampler(std::move(reader), dataset, options).run(lines, hits);
}

}  // namespace vcp
