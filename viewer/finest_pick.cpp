#include "viewer/finest_pick.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp {

namespace {

constexpr uint64_t kMostBytes = 256ull << 20;

/// The stretch of a ray within a box, if any.
struct Stretch {
    double enter, leave;
};

Stretch within(const Ray& ray, glm::dvec3 low, glm::dvec3 high) {
    Stretch s{ray.tMin, ray.tMax};
    for (int axis = 0; axis < 3; ++axis) {
        const double d = ray.direction[axis];
        if (d == 0 && (ray.origin[axis] < low[axis] || ray.origin[axis] > high[axis])) return {1, 0};
        if (d == 0) continue;
        const double a = (low[axis] - ray.origin[axis]) / d, b = (high[axis] - ray.origin[axis]) / d;
        s.enter = std::max(s.enter, std::min(a, b));
        s.leave = std::min(s.leave, std::max(a, b));
    }
    return s;
}

struct PageOnRay {
    uint64_t page;
    double enter;
};

/// Reads the part of the directory that a page's children need.
Result<void> learnChildren(const ByteReader& reader, const Dataset& dataset, const PageEntry& page) {
    for (const uint64_t child : childrenOf(page)) {
        if (dataset.pages.knows(child)) continue;
        std::vector<std::byte> block(kBlockBytes);
        VCP_TRY(reader.read(blockOffset(child / kEntriesPerBlock), block));
        VCP_TRY(admitBlock(dataset, reader.name(), child / kEntriesPerBlock, block));
    }
    return {};
}

/// Returns the finest pages whose boxes, a little widened, the ray touches, nearest first.
Result<std::vector<PageOnRay>> finestPagesOn(const ByteReader& reader, const Dataset& dataset, const Ray& ray) {
    std::vector<PageOnRay> found;
    std::vector<uint64_t> open{0};
    while (!open.empty()) {
        const uint64_t page = open.back();
        open.pop_back();
        const PageEntry& entry = dataset.pages[page];
        const glm::dvec3 low = dataset.originOf(entry), slack(dataset.cellOf(entry.level));
        const Stretch s = within(ray, low - slack, low + dataset.edgeOf(entry) + slack);
        if (s.enter > s.leave) continue;
        if (entry.childMask == 0) found.push_back({page, s.enter});
        VCP_TRY(learnChildren(reader, dataset, entry));
        for (const uint64_t child : childrenOf(entry)) open.push_back(child);
    }
    std::sort(found.begin(), found.end(), [](const PageOnRay& a, const PageOnRay& b) { return a.enter < b.enter; });
    return found;
}

/// Shortens a ray to the part that a plane keeps.
void clip(Ray& ray, const SectionPlane& plane) {
    const double start = glm::dot(plane.normal, ray.origin) - plane.offset,
                 slope = glm::dot(plane.normal, ray.direction);
    if (slope > 0)
        ray.tMin = std::max(ray.tMin, -start / slope);
    else if (slope < 0)
        ray.tMax = std::min(ray.tMax, -start / slope);
    else if (start < 0)
        ray.tMax = -1;
}

}  // namespace

Result<std::optional<RayHit>> FinestPick::cast(Ray ray, std::span<const SectionPlane> sections) {
    for (const SectionPlane& plane : sections) clip(ray, plane);
    if (bytesKept() > kMostBytes) forget();
    std::optional<RayHit> nearest;
    if (ray.tMin > ray.tMax) return nearest;
    VCP_TRY_ASSIGN(const auto pages, finestPagesOn(*reader_, pages_.dataset(), ray));
    for (const PageOnRay& next : pages) {
        if (nearest && nearest->t < next.enter) break;
        VCP_TRY(pages_.load(next.page));
        VCP_TRY_ASSIGN(const auto caster, ReferenceCaster::create(pages_, std::span(&next.page, 1)));
        const auto hit = caster.cast(ray);
        if (hit && (!nearest || hit->t < nearest->t)) nearest = hit;
    }
    return nearest;
}

Result<std::optional<SceneHit>> ScenePick::cast(const Ray& ray, std::span<const SectionPlane> sections,
                                                std::span<const uint32_t> hidden,
                                                const std::optional<SurfacePoint>& onSurface) {
    std::optional<SceneHit> nearest;
    if (onSurface) {
        nearest.emplace();
        nearest->t = onSurface->depth;
        nearest->position = onSurface->position;
        nearest->normal = onSurface->normal;
        nearest->certifiedError = onSurface->error.value_or(std::numeric_limits<double>::infinity());
        nearest->onSurface = true;
    }
    for (Part& part : parts_) {
        const auto number = size_t(&part - parts_.data());
        if (std::find(hidden.begin(), hidden.end(), number) != hidden.end()) continue;
        // All picks together keep no more than one alone may, beside the pages that are cast into now.
        uint64_t kept = 0;
        for (const Part& each : parts_) kept += each.pick.bytesKept();
        if (kept > kMostBytes)
            for (Part& each : parts_) each.pick.forget();
        const Similarity& placement = part.placement;
        Ray local{placement.fromWorld(ray.origin), placement.turnedFromWorld(ray.direction)};
        local.tMin = ray.tMin / placement.scale;
        local.tMax = (nearest ? std::min(nearest->t, ray.tMax) : ray.tMax) / placement.scale;
        std::vector<SectionPlane> planes;
        for (const SectionPlane& plane : sections) planes.push_back(planeIn(placement, plane));
        VCP_TRY_ASSIGN(const auto hit, part.pick.cast(local, planes));
        if (!hit || (nearest && nearest->t <= hit->t * placement.scale)) continue;
        nearest = SceneHit{*hit, number};
        nearest->t *= placement.scale;
        nearest->certifiedError *= placement.scale;
        nearest->position = placement.toWorld(nearest->position);
        nearest->normal = placement.rotation * nearest->normal;
    }
    return nearest;
}

}  // namespace vcp
