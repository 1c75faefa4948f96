// Parallel rays of light of a tile: to these, the sun is a camera with parallel rays whose pixels lie anywhere. They go
// through the scene as a tile of a picture does, in groups of those that begin side by side.
#if defined(VCP_RENDER_HOST_SUN_TILE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_SUN_TILE_INL_H
#undef VCP_RENDER_HOST_SUN_TILE_INL_H
#else
#define VCP_RENDER_HOST_SUN_TILE_INL_H
#endif

#include <algorithm>
#include <span>
#include <vector>

#include "render/host/light_rays.h"
#include "render/host/page_marks.h"
#include "render/host/tile_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

constexpr size_t kSunTileRays = size_t(kGroups) * kLanes;

/// Where parallel rays begin: across and along their direction, finest cells from a point. Their groups, kLanes rays
/// each, lie in rectangles.
struct SunRays {
    TileRays tile;
    TileSides sides;
    int groups = 0;
    alignas(32) float across[kSunTileRays], up[kSunTileRays], begin[kSunTileRays], end[kSunTileRays];
    alignas(32) float middleX[kGroups], middleY[kGroups], halfX[kGroups], halfY[kGroups], first[kGroups];
    alignas(32) bool isRay[kSunTileRays];
};

/// Places rays of one direction, at most kSunTileRays of them: those of `all` that are numbered in `some`.
inline HWY_NOINLINE void placeSunRays(std::span<const LightRay> all, std::span<const uint32_t> some, SunRays& sun) {
    const glm::dvec3 along = glm::normalize(glm::dvec3(all[some[0]].direction));
    const glm::dvec3 aside =
        glm::normalize(glm::cross(along, std::abs(along.z) < 0.7 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0)));
    const glm::dvec3 up = glm::cross(along, aside);
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
    const auto placeOf = [&](uint32_t ray) {
        const glm::dvec3 from = all[ray].origin - all[some[0]].origin;
        return glm::dvec3(glm::dot(from, aside), glm::dot(from, up), glm::dot(from, along));
    };
    for (const uint32_t ray : some) {
        low = glm::min(low, placeOf(ray));
        high = glm::max(high, placeOf(ray));
    }
    const glm::dvec3 middle(0.5 * (low.x + high.x), 0.5 * (low.y + high.y), low.z);
    const glm::vec2 reach(0.5 * (high - low));
    sun.tile = {.origin = all[some[0]].origin + middle.x * aside + middle.y * up + middle.z * along,
                .originPerX = aside,
                .originPerY = up,
                .direction = along,
                .directionPerX = glm::dvec3(0),
                .directionPerY = glm::dvec3(0),
                .isParallel = true,
                .sections = {},
                .reach = reach,
                .halfGroup = glm::vec2(0),
                .hasSpans = true};
    sun.groups = int((some.size() + kLanes - 1) / kLanes);
    for (int g = 0; g < kGroups; ++g) {
        glm::vec2 least(std::numeric_limits<float>::infinity()), most = -least;
        sun.first[g] = std::numeric_limits<float>::infinity();
        for (int lane = 0; lane < kLanes; ++lane) {
            const auto i = size_t(g) * kLanes + size_t(lane);
            sun.isRay[i] = i < some.size();
            const uint32_t ray = some[std::min(i, some.size() - 1)];
            const glm::vec3 place(placeOf(ray) - middle);
            sun.across[i] = place.x, sun.up[i] = place.y, sun.begin[i] = place.z;
            sun.end[i] = place.z + all[ray].reach;
            least = glm::min(least, glm::vec2(place));
            most = glm::max(most, glm::vec2(place));
            sun.first[g] = std::min(sun.first[g], place.z);
        }
        const glm::vec2 center = 0.5f * (least + most), half = 0.5f * (most - least);
        sun.middleX[g] = center.x, sun.middleY[g] = center.y;
        sun.halfX[g] = half.x, sun.halfY[g] = half.y;
        sun.tile.halfGroup = glm::max(sun.tile.halfGroup, half);
    }
    // Rounding of the rays' places is bridged where boxes are compared.
    const auto setPlane = [](TilePlanes& planes, int index, glm::dvec3 n, double at) {
        planes.x[index] = float(n.x), planes.y[index] = float(n.y), planes.z[index] = float(n.z);
        planes.w[index] = float(-at);
        planes.sum[index] = float(std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
    };
    const double wider = 1e-5 * double(1 + reach.x + reach.y);
    setPlane(sun.sides.first, 0, aside, -reach.x - wider);
    setPlane(sun.sides.last, kGroupColumns - 1, aside, reach.x + wider);
    setPlane(sun.sides.first, kGroupColumns, up, -reach.y - wider);
    setPlane(sun.sides.last, kGroupColumns + kGroupRows - 1, up, reach.y + wider);
}

class SunTile : public TileWalk<SunTile> {
public:
    SunTile(const HostScene& scene, const SunRays& sun, PageMarks* marks)
        : TileWalk(scene, sun.tile, sun.sides), sun_(sun), marks_(marks) {
        open_ = uint32_t((uint64_t{1} << sun.groups) - 1);
    }

    /// Finds how far each ray comes, as castLightRays has it. `distances`: kSunTileRays of them.
    void run(float* distances) {
        walk();
        std::fill_n(distances, kSunTileRays, std::numeric_limits<float>::infinity());
        if (!haveRays_) return;
        for (int g = 0; g < sun_.groups; ++g) {
            const Mask missed = groups_[g].t >= Lane(hwy::HighestValue<float>());
            const Lane distance = max(groups_[g].t - groups_[g].begin, Lane(0.0f));
            alignas(32) float lanes[8];
            store(select(missed, Lane(std::numeric_limits<float>::infinity()), distance), lanes);
            std::copy_n(lanes, kLanes, distances + g * kLanes);
        }
    }

private:
    friend TileWalk<SunTile>;

    [[nodiscard]] uint32_t groupsMet(glm::vec3 middle, float half) const {
        const auto placeOf = [&](glm::dvec3 axis) { return glm::dot(glm::vec3(axis), middle); };
        const auto widthOf = [&](glm::dvec3 axis) {
            return half * float(std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
        };
        const TileRays& tile = sun_.tile;
        const float rounding = kPlaceRounding * (std::abs(middle.x) + std::abs(middle.y) + std::abs(middle.z) +
                                                 tile.reach.x + tile.reach.y);
        const float x = placeOf(tile.originPerX), y = placeOf(tile.originPerY);
        const float wideX = widthOf(tile.originPerX) + rounding, wideY = widthOf(tile.originPerY) + rounding;
        const float last = placeOf(tile.direction) + widthOf(tile.direction) + rounding;
        uint32_t met = 0;
        for (int g = 0; g < kGroups; g += kLanes) {
            const Mask besideX = abs(load(sun_.middleX + g) - Lane(x)) <= load(sun_.halfX + g) + Lane(wideX);
            const Mask besideY = abs(load(sun_.middleY + g) - Lane(y)) <= load(sun_.halfY + g) + Lane(wideY);
            met |= bitsOf(besideX & besideY & (load(sun_.first + g) <= Lane(last))) << g;
        }
        return met;
    }

    void makeGroups() {
        for (int g = 0; g < sun_.groups; ++g) {
            const auto first = size_t(g) * kLanes;
            RayGroup& group = groups_[g];
            uint32_t rays = 0;
            for (int lane = 0; lane < kLanes; ++lane) rays |= uint32_t(sun_.isRay[first + size_t(lane)]) << lane;
            group.alive = maskOf(rays);
            group.column = load(sun_.across + first);
            group.row = load(sun_.up + first);
            group.begin = load(sun_.begin + first);
            group.end = load(sun_.end + first);
            group.middleColumn = sun_.middleX[g];
            group.middleRow = sun_.middleY[g];
            group.direction = spread(sun_.tile.direction);
            setInverse(group);
            setNoHit(group);
        }
    }

    /// Only a hit's distance counts.
    [[nodiscard]] static uint32_t nextLeaf() { return 0; }
    void keepLeaf(const WalkEntry& at) {
        if (marks_ != nullptr) marks_->mark(at.page);
    }
    void keepTriangle(const WalkEntry& at, const Triangles&, int, const RayGroup&, Mask, const GroupInHardLeaf&) {
        keepLeaf(at);
    }
    /// The work of rays of light is not counted.
    static void countNode(glm::vec3, float) {}
    static void count(uint32_t, uint32_t, uint32_t) {}
    static void countUntil(int, Mask) {}

    const SunRays& sun_;
    PageMarks* const marks_;  // or null
};

/// Groups of rays that are so many times as wide as most others, or so many times that far away, are no part of a tile.
constexpr float kWidestGroup = 2, kFarthestGroup = 4;
/// Where most groups are wider, in finest cells, a leaf meets few rays of a tile, and streams are faster.
constexpr float kMostGroupCells = 2;

/// Whether rays run side by side, so many that a tile pays.
inline HWY_NOINLINE bool areParallel(std::span<const LightRay> all, std::span<const uint32_t> some) {
    return some.size() >= 2 * kLanes && std::all_of(some.begin(), some.end(), [&](uint32_t ray) {
               return all[ray].direction == all[some[0]].direction;
           });
}

/// A group of rays across their direction: its middle and the square of its width, finest cells.
struct Strip {
    glm::vec3 middle;
    float square;
};

/// Takes those groups of parallel rays out of `some` that are about as wide as most, and not far from most.
inline HWY_NOINLINE std::vector<uint32_t> takeCompact(std::span<const LightRay> all, std::vector<uint32_t>& some) {
    const auto across = [&](uint32_t ray) {
        const glm::vec3 along = all[ray].direction, from(all[ray].origin - all[some[0]].origin);
        return from - glm::dot(from, along) * along;
    };
    std::vector<Strip> strips;
    for (size_t first = 0; first < some.size(); first += kLanes) {
        const glm::vec3 begin = across(some[first]);
        Strip strip{begin, 0};
        for (size_t i = first + 1; i < std::min(first + kLanes, some.size()); ++i) {
            const glm::vec3 from = across(some[i]) - begin;
            strip.square = std::max(strip.square, glm::dot(from, from));
        }
        strips.push_back(strip);
    }
    std::vector<float> sorted;
    for (const Strip& strip : strips) sorted.push_back(strip.square);
    std::sort(sorted.begin(), sorted.end());
    const float usual = sorted[sorted.size() / 4];
    std::vector<uint32_t> compact;
    if (usual > kMostGroupCells * kMostGroupCells) return compact;
    const float median = sorted[sorted.size() / 2];
    const Strip& center =
        *std::find_if(strips.begin(), strips.end(), [&](const Strip& strip) { return strip.square == median; });
    std::vector<uint32_t> others;
    for (size_t i = 0; i < some.size(); ++i) {
        const Strip& strip = strips[i / kLanes];
        const glm::vec3 away = strip.middle - center.middle;
        const bool isCompact = strip.square <= kWidestGroup * kWidestGroup * usual &&
                               glm::dot(away, away) <= kFarthestGroup * kFarthestGroup * usual;
        (isCompact ? compact : others).push_back(some[i]);
    }
    some = std::move(others);
    return compact;
}

/// Casts rays of one direction, and removes them from `some`: all but those that begin far from their neighbours.
inline HWY_NOINLINE void castParallel(const HostScene& scene, std::span<const LightRay> all,
                                      std::vector<uint32_t>& some, float* distances, PageMarks* marks) {
    const std::vector<uint32_t> compact = takeCompact(all, some);
    for (std::span<const uint32_t> rest = compact; !rest.empty();) {
        const auto part = rest.first(std::min(rest.size(), kSunTileRays));
        rest = rest.subspan(part.size());
        SunRays sun;
        placeSunRays(all, part, sun);
        float found[kSunTileRays];
        SunTile(scene, sun, marks).run(found);
        for (size_t i = 0; i < part.size(); ++i) {
            distances[part[i]] = found[i];
            if (marks == nullptr) continue;
            if (const auto page = scene.pageAt(all[part[i]].origin)) marks->mark(*page);
        }
    }
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
