// Rays of light through the scene together: all those of a tile whose directions have the same signs, a ray a lane.
//
// They come to the octants of a node in the same order. A node is visited once, with a list of the packets of rays that
// meet it; each box is compared with the rays of a packet at once. A leaf is decoded once and met by its rays one by
// one (single_ray-inl.h), so a ray hits the same whatever others are cast with it.
#if defined(VCP_RENDER_HOST_RAY_STREAM_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_RAY_STREAM_INL_H
#undef VCP_RENDER_HOST_RAY_STREAM_INL_H
#else
#define VCP_RENDER_HOST_RAY_STREAM_INL_H
#endif

#include <span>
#include <vector>

#include "render/host/light_rays.h"
#include "render/host/page_marks.h"
#include "render/host/single_ray-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

/// As many rays as there are lanes; lanes without a ray are never alive.
struct RayPacket {
    alignas(32) float inverse[3][8], start[3][8];  // 1 / direction, and with it the origin from the stream's
    alignas(32) float reach[8];
    uint32_t alive;  // a bit each of the rays without a hit
};

class RayStream {
public:
    /// `marks`, where given, gets the pages that rays hit or begin in.
    RayStream(const HostScene& scene, PageMarks* marks) : scene_(scene), marks_(marks), leaves_(scene) {}

    /// Casts those of `all` that are numbered in `some`. Their directions have the same signs. `distances`: one a ray
    /// of `all`.
    void cast(std::span<const LightRay> all, std::span<const uint32_t> some, float* distances) {
        begin(all, some);
        while (!stack_.empty() && open_ != 0) {
            const Visit at = stack_.back();
            stack_.pop_back();
            if (isNode(at.box))
                visitNode(at);
            else
                visitLeaf(at);
        }
        for (size_t i = 0; i < some.size(); ++i) distances[some[i]] = found_[i];
    }

private:
    /// Rays of a packet, a bit each.
    struct PacketPart {
        uint32_t packet, rays;
    };
    /// A box to visit, and the elements of `parts_` that meet it.
    struct Visit {
        WalkEntry box;
        size_t first, end;
    };

    void begin(std::span<const LightRay> all, std::span<const uint32_t> some) {
        const size_t packets = (some.size() + kLanes - 1) / kLanes;
        rays_.resize(packets * kLanes);
        packets_.resize(packets);
        found_.assign(packets * kLanes, LeafCaster::kNothing);
        origin_ = all[some[0]].origin;
        spread_ = 0;
        for (size_t i = 0; i < rays_.size(); ++i) {
            const LightRay& ray = all[some[std::min(i, some.size() - 1)]];
            rays_[i] = SingleRay(ray.origin, ray.direction);
            RayPacket& packet = packets_[i / kLanes];
            const size_t lane = i % kLanes;
            const glm::vec3 from(ray.origin - origin_), inverse = rays_[i].inverse;
            for (int axis = 0; axis < 3; ++axis) {
                packet.inverse[axis][lane] = inverse[axis];
                packet.start[axis][lane] = from[axis] * inverse[axis];
            }
            packet.reach[lane] = ray.reach;
            spread_ = std::max(spread_, std::abs(from.x) + std::abs(from.y) + std::abs(from.z));
            if (marks_ != nullptr)
                if (const auto page = scene_.pageAt(ray.origin)) marks_->mark(*page);
        }
        open_ = some.size();
        parts_.resize(std::max(parts_.size(), packets));
        for (size_t i = 0; i < packets; ++i) {
            const size_t rays = std::min<size_t>(kLanes, some.size() - i * kLanes);
            packets_[i].alive = (1u << rays) - 1;
            parts_[i] = {uint32_t(i), packets_[i].alive};
        }
        stack_.clear();
        if (const auto root = rootOf(scene_)) stack_.push_back({*root, 0, packets});
    }

    /// The planes by which rays enter the lower and the upper octants of a node along an axis, and leave them.
    struct Planes {
        float enter[2], leave[2];
    };
    [[nodiscard]] Planes planesAlong(int axis, float middle, float half, float rounding) const {
        const float low = middle - half - rounding, below = middle + rounding;
        const float above = middle - rounding, high = middle + half + rounding;
        if ((rays_[0].nearest >> axis & 1) == 0) return {{low, above}, {below, high}};
        return {{below, high}, {low, above}};
    }

    void visitNode(const Visit& at) {
        WalkEntry children[8];
        uint32_t octants[8];
        size_t count = 0;
        forEachChild(scene_, at.box, 0xff, rays_[0].nearest, [&](uint32_t octant, const WalkEntry& child) HWY_ATTR {
            octants[count] = octant;
            children[count++] = child;
        });
        // The parts that meet a child follow each other, with room for all of them.
        const size_t room = at.end - at.first;
        if (parts_.size() < at.end + count * room) parts_.resize(2 * (at.end + count * room));
        PacketPart* const parts = parts_.data();
        size_t firsts[8], ends[8];
        for (size_t i = 0; i < count; ++i) firsts[i] = ends[i] = at.end + i * room;

        const double half = 0.5 * cellsOf(at.box.bits);
        const glm::vec3 m(glm::dvec3(at.box.corner) * kSubcell + half - origin_);
        const auto h = float(half);
        const float rounding = kPlaceRounding * (std::abs(m.x) + std::abs(m.y) + std::abs(m.z) + 3 * h + spread_);
        const Planes planes[3] = {planesAlong(0, m.x, h, rounding), planesAlong(1, m.y, h, rounding),
                                  planesAlong(2, m.z, h, rounding)};
        for (size_t k = at.first; k < at.end; ++k) {
            const PacketPart part = parts[k];
            const RayPacket& packet = packets_[part.packet];
            const uint32_t rays = part.rays & packet.alive;
            if (rays == 0) continue;
            const Crossings x = crossingsOf(packet, 0, planes[0]), y = crossingsOf(packet, 1, planes[1]),
                            z = crossingsOf(packet, 2, planes[2]);
            const Lane begin(0.0f), reach = load(packet.reach);
            Lane enter[4], leave[4];
            for (int i = 0; i < 4; ++i) {
                enter[i] = max(max(y.enter[i & 1], z.enter[i >> 1]), begin);
                leave[i] = min(min(y.leave[i & 1], z.leave[i >> 1]), reach);
            }
            for (size_t i = 0; i < count; ++i) {
                const uint32_t o = octants[i];
                const Mask met = max(x.enter[o & 1], enter[o >> 1]) <= min(x.leave[o & 1], leave[o >> 1]);
                const uint32_t here = bitsOf(met) & rays;
                parts[ends[i]] = {part.packet, here};
                ends[i] += here != 0 ? 1 : 0;
            }
        }
        for (size_t i = 0; i < count; ++i)
            if (ends[i] > firsts[i]) stack_.push_back({children[i], firsts[i], ends[i]});
    }

    /// Where rays cross such planes.
    struct Crossings {
        Lane enter[2], leave[2];
    };
    HWY_INLINE static Crossings crossingsOf(const RayPacket& packet, int axis, const Planes& planes) {
        const Lane inverse = load(packet.inverse[axis]), start = load(packet.start[axis]);
        const auto at = [&](float plane) HWY_ATTR { return mulSub(Lane(plane), inverse, start); };
        return {{at(planes.enter[0]), at(planes.enter[1])}, {at(planes.leave[0]), at(planes.leave[1])}};
    }

    /// Boxes do not overlap and come front to back: the first hit of a ray is its nearest.
    void visitLeaf(const Visit& at) {
        leaves_.choose(at.box);
        for (size_t k = at.first; k < at.end; ++k) {
            const PacketPart part = parts_[k];
            RayPacket& packet = packets_[part.packet];
            for (uint32_t rest = part.rays & packet.alive; rest != 0; rest &= rest - 1) {
                const auto lane = size_t(std::countr_zero(rest)), ray = part.packet * size_t(kLanes) + lane;
                const float distance = leaves_.cast(rays_[ray]);
                if (distance == LeafCaster::kNothing) continue;
                if (marks_ != nullptr) marks_->mark(at.box.page);
                if (distance < packet.reach[lane]) found_[ray] = distance;
                packet.alive &= ~(1u << lane);
                --open_;
            }
        }
    }

    const HostScene& scene_;
    PageMarks* const marks_;  // or null
    LeafCaster leaves_;
    std::vector<SingleRay> rays_;  // kLanes a packet; the last ones repeat the last ray
    std::vector<float> found_;     // of each of them
    std::vector<RayPacket> packets_;
    std::vector<PacketPart> parts_;
    std::vector<Visit> stack_;  // far boxes first; their parts are in the same order
    size_t open_ = 0;           // rays without a hit
    glm::dvec3 origin_{0};      // of the first ray
    float spread_ = 0;          // how far the others' are from there
};

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
