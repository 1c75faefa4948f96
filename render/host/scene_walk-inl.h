// The boxes of a scene that are still to be visited, in the order in which rays come to them.
#if defined(VCP_RENDER_HOST_SCENE_WALK_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VCP_RENDER_HOST_SCENE_WALK_INL_H
#undef VCP_RENDER_HOST_SCENE_WALK_INL_H
#else
#define VCP_RENDER_HOST_SCENE_WALK_INL_H
#endif

#include <array>
#include <optional>

#include "render/host/host_scene.h"
#include "render/host/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

constexpr double kSubcell = 1.0 / (1u << kMaxSubcellDepth);  // finest cells

/// Returns the edge of a box in finest cells. `bits`: log2 of it in subcells.
HWY_INLINE double cellsOf(uint32_t bits) { return double(uint64_t{1} << bits) * kSubcell; }

/// A node of the scene's tree, or of a page's.
struct WalkEntry {
    glm::uvec3 corner;  // subcells
    uint32_t bits;      // log2 of its edge in subcells
    uint32_t page;      // or kNoPage
    uint32_t word;      // its node word, or the number of the scene's node
};
constexpr uint32_t kNoPage = ~0u;

/// Whether it has children; else it is a leaf.
HWY_INLINE bool isNode(const WalkEntry& at) { return at.page == kNoPage || nodeType(at.word) == kNodeInternal; }

/// Returns the middles of octants i to i + kLanes - 1 about `middle`. `half`: of an octant's edge.
HWY_INLINE Lane3 octantMiddles(int i, glm::vec3 middle, float half) {
    alignas(32) static constexpr float kSign[3][8] = {
        {-1, 1, -1, 1, -1, 1, -1, 1}, {-1, -1, 1, 1, -1, -1, 1, 1}, {-1, -1, -1, -1, 1, 1, 1, 1}};
    return {mulAdd(load(kSign[0] + i), Lane(half), Lane(middle.x)),
            mulAdd(load(kSign[1] + i), Lane(half), Lane(middle.y)),
            mulAdd(load(kSign[2] + i), Lane(half), Lane(middle.z))};
}

/// Returns the entry of a child of the scene's tree, or nothing where it is empty.
HWY_INLINE std::optional<WalkEntry> sceneEntry(const HostScene& scene, HostScene::Child child, glm::uvec3 corner,
                                               uint32_t bits) {
    if (child.kind == HostScene::Child::Kind::None) return {};
    const bool isPage = child.kind == HostScene::Child::Kind::Page;
    const uint32_t word = isPage ? scene.page(child.index).root : child.index;
    if (isPage && nodeType(word) == kNodeEmpty) return {};
    return WalkEntry{corner, bits, isPage ? child.index : kNoPage, word};
}

HWY_INLINE std::optional<WalkEntry> rootOf(const HostScene& scene) {
    return sceneEntry(scene, scene.root(), glm::uvec3(0), scene.rootBits());
}

/// Calls visit(octant) for the octants in `octants`, a bit each; that in `nearest` is the last one, and the one across
/// from it the first.
template <class Visit>
HWY_INLINE void forEachFarFirst(uint32_t octants, uint32_t nearest, const Visit& visit) {
    // Bit k is made that of octant k ^ nearest.
    if ((nearest & 1) != 0) octants = (octants & 0x55) << 1 | (octants >> 1 & 0x55);
    if ((nearest & 2) != 0) octants = (octants & 0x33) << 2 | (octants >> 2 & 0x33);
    if ((nearest & 4) != 0) octants = (octants & 0x0f) << 4 | (octants >> 4 & 0x0f);
    while (octants != 0) {
        const auto k = uint32_t(std::bit_width(octants)) - 1;
        octants ^= 1u << k;
        visit(k ^ nearest);
    }
}

HWY_INLINE glm::uvec3 childCorner(const WalkEntry& at, uint32_t octant) {
    return at.corner + (glm::uvec3(octant & 1, octant >> 1 & 1, octant >> 2) << (at.bits - 1));
}

HWY_INLINE uint32_t emptyChildren(const uint32_t* words) {
    uint32_t empty = 0;
    for (int i = 0; i < 8; i += kLanes) {
        // The bit below the type tells an empty node from a slab leaf.
        const LaneWords type = hn::ShiftRight<int(kNodeTypeShift) - 1>(hn::LoadU(Words(), words + i));
        empty |= bitsOf(hn::RebindMask(Floats(), hn::Eq(type, hn::Set(Words(), 2 * kNodeEmpty)))) << i;
    }
    return empty;
}

/// Calls visit(octant, child) for those children of a node that are in `octants`, a bit each, and hold anything, in the
/// order of forEachFarFirst.
template <class Visit>
HWY_INLINE void forEachChild(const HostScene& scene, const WalkEntry& at, uint32_t octants, uint32_t nearest,
                             const Visit& visit) {
    const uint32_t bits = at.bits - 1;
    if (at.page == kNoPage) {
        const HostScene::Node& node = scene.node(at.word);
        forEachFarFirst(octants, nearest, [&](uint32_t octant) HWY_ATTR {
            if (const auto child = sceneEntry(scene, node[octant], childCorner(at, octant), bits))
                visit(octant, *child);
        });
        return;
    }
    const uint32_t* words = &scene.page(at.page).view->nodes[8 * (at.word & kNodePayloadMask)];
    forEachFarFirst(octants & ~emptyChildren(words), nearest, [&](uint32_t octant) HWY_ATTR {
        visit(octant, WalkEntry{childCorner(at, octant), bits, at.page, words[octant]});
    });
}

/// A stack of boxes; begins with the scene's root.
class SceneWalk {
public:
    explicit SceneWalk(const HostScene& scene) : scene_(scene) { restart(); }

    void restart() {
        count_ = 0;
        if (const auto root = rootOf(scene_)) stack_[size_t(count_++)] = *root;
    }
    [[nodiscard]] bool isDone() const { return count_ == 0; }
    WalkEntry next() { return stack_[size_t(--count_)]; }
    /// Makes the box that came last the next one again.
    void putBack(const WalkEntry& at) { stack_[size_t(count_++)] = at; }

    /// Pushes those children of a node that are in `met`, a bit an octant, and hold anything: last, so that it comes
    /// next, the one in the octant `nearest`, and the one across from it first.
    HWY_INLINE void pushChildren(const WalkEntry& at, uint32_t met, uint32_t nearest) {
        forEachChild(scene_, at, met, nearest,
                     [&](uint32_t, const WalkEntry& child) HWY_ATTR { stack_[size_t(count_++)] = child; });
    }

private:
    /// A traversal leaves at most seven siblings behind at each of at most 31 depths.
    static constexpr int kStackEntries = 7 * 32 + 8;

    const HostScene& scene_;
    int count_ = 0;
    std::array<WalkEntry, kStackEntries> stack_;
};

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
