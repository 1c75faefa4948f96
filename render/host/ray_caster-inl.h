// Single rays through the scene, for those of which every hit counts: eight children of a node at a time.
#if defined(VCP_RENDER_HOST_RAY_CASTER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_RAY_CASTER_INL_H
#undef VCP_RENDER_HOST_RAY_CASTER_INL_H
#else
#define VCP_RENDER_HOST_RAY_CASTER_INL_H
#endif

#include "render/host/page_marks.h"
#include "render/host/single_ray-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

/// Casts one ray after the other, and of each finds one hit after the other.
class RayCaster {
public:
    static constexpr float kNothing = LeafCaster::kNothing;

    /// `marks`, where given, gets the pages that rays hit or begin in.
    RayCaster(const HostScene& scene, PageMarks* marks) : scene_(scene), marks_(marks), walk_(scene), leaves_(scene) {}

    /// Begins a ray. `direction`: unit. `reach`: hits from there on do not matter. All in finest cells, from the root's
    /// lowest corner.
    void begin(glm::dvec3 origin, glm::vec3 direction, float reach) {
        ray_ = SingleRay(origin, direction);
        reach_ = reach;
        walk_.restart();
    }

    /// Returns the distance of the first hit of a ray that begins at distance `from` on the one that was begun, or
    /// kNothing where that is not within reach. Precondition: `from` is no less than the distance found before.
    float next(float from) {
        ray_.from = from;
        if (marks_ != nullptr)
            if (const auto page = scene_.pageAt(ray_.origin + double(from) * glm::dvec3(ray_.direction)))
                marks_->mark(*page);
        while (!walk_.isDone()) {
            const WalkEntry at = walk_.next();
            if (isNode(at)) {
                visitNode(at);
                continue;
            }
            // Boxes do not overlap and come front to back: the first hit is the nearest.
            leaves_.choose(at);
            const float distance = leaves_.cast(ray_);
            if (distance == kNothing) continue;
            if (marks_ != nullptr) marks_->mark(at.page);
            hit_ = at;
            walk_.putBack(at);  // the ray may hit more of it
            return distance < reach_ ? distance : kNothing;
        }
        return kNothing;
    }

    /// The leaf of the last hit. Precondition: next() returned a distance.
    [[nodiscard]] const WalkEntry& hitLeaf() const { return hit_; }
    /// A vertex of the triangle of that hit. Precondition: besides, the leaf is hard.
    [[nodiscard]] uint32_t hitVertex() const { return leaves_.hitVertex(); }

private:
    void visitNode(const WalkEntry& at) {
        const double half = 0.5 * cellsOf(at.bits);
        const glm::vec3 middle(glm::dvec3(at.corner) * kSubcell + half - ray_.origin);
        const auto octantHalf = float(0.5 * half);
        uint32_t met = 0;
        for (int i = 0; i < 8; i += kLanes) met |= bitsOf(isMet(octantMiddles(i, middle, octantHalf), octantHalf)) << i;
        walk_.pushChildren(at, met, ray_.nearest);
    }

    /// Tells which boxes the ray meets within its reach. `c`: their middles relative to its origin.
    [[nodiscard]] Mask isMet(Lane3 c, float half) const {
        const Lane h = mulAdd(abs(c.x) + abs(c.y) + abs(c.z), Lane(kPlaceRounding), Lane(half));
        const Lane x0 = (c.x - h) * Lane(ray_.inverse.x), x1 = (c.x + h) * Lane(ray_.inverse.x);
        const Lane y0 = (c.y - h) * Lane(ray_.inverse.y), y1 = (c.y + h) * Lane(ray_.inverse.y);
        const Lane z0 = (c.z - h) * Lane(ray_.inverse.z), z1 = (c.z + h) * Lane(ray_.inverse.z);
        const Lane first = max(max(min(x0, x1), min(y0, y1)), max(min(z0, z1), Lane(ray_.from)));
        const Lane last = min(min(max(x0, x1), max(y0, y1)), min(max(z0, z1), Lane(reach_)));
        return first <= last;
    }

    const HostScene& scene_;
    PageMarks* const marks_;  // or null
    SceneWalk walk_;
    LeafCaster leaves_;
    SingleRay ray_;
    float reach_ = 0;
    WalkEntry hit_{};
};

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
