#include "builder/mask/mask_cutter.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/mask/delaunay.h"
#include "builder/mask/mask_outline.h"
#include "builder/mask/outline_simplifier.h"
#include "builder/mask/triangulation.h"

namespace vcp {

namespace {

// A part has so many texels at least, in the mean, and so many of the squares that may go; but a triangle that has few
// of both makes the least parts.
constexpr double kTexelsOfPart = 128, kSparedOfPart = 2, kLeastParts = 256, kMostParts = 1 << 16;
// The outline is off by a quarter of a texel before it is simplified.
constexpr double kTolerance = 1.25;
// What surrounds less than this is a fault of the mask, in square texels.
constexpr double kLeastArea = 2;
// A loop that is small in the world keeps its shape: some 14 corners of a disc.
constexpr double kLeastPart = 1.0 / 64;
// Beyond this, a float no longer tells texels apart.
constexpr double kFarthestTexel = double(1 << 26);

double areaOf(const std::array<glm::dvec2, 3>& t) {
    const glm::dvec2 a = t[1] - t[0], b = t[2] - t[0];
    return std::abs(a.x * b.y - a.y * b.x) / 2;
}

/// Returns the binary logarithm of how many square texels may be left out since they are less than `detail`: whole, so
/// that triangles of one shape share what is cut.
int log2OfSpared(double squareTexels, double worldArea, double detail) {
    const double spared = detail * detail * squareTexels / worldArea;
    if (!(spared > 1)) return 0;
    constexpr double kRootOfTwo = 1.4142135623730951;
    constexpr int kMost = 60;
    return spared < std::ldexp(1.0, kMost) ? std::ilogb(spared * kRootOfTwo) : kMost;
}

/// Returns what is left of a triangle; nothing where all is. `spared`: square texels that nobody sees.
std::optional<MaskParts> cutTriangle(const AlphaMask& mask, const std::array<glm::dvec2, 3>& texels, double spared) {
    const double ofPart = std::max(kTexelsOfPart, kSparedOfPart * spared);
    const auto most = size_t(std::clamp(areaOf(texels) / ofPart, kLeastParts, kMostParts));
    for (uint32_t level = 0; level <= mask.coarsestLevel(); ++level) {
        const auto outline = findOutline(mask, texels, level);
        if (!outline || outline->isWhole(outline->loops)) return std::nullopt;
        level = outline->level;
        OutlineSimplifier simplifier(outline->loops, texels);
        simplifier.keepLoops(std::ldexp(kLeastArea, 2 * int(level)));
        simplifier.keepWithin(std::ldexp(kTolerance, int(level)));
        if (spared > 1) simplifier.keepAreas(spared, kLeastPart);
        if (simplifier.triangles() > most) continue;
        const std::vector<MaskLoop> loops = simplifier.loops();
        if (outline->isWhole(loops)) return std::nullopt;
        MaskParts parts = triangulate(loops);
        makeDelaunay(texels, parts);
        return parts;
    }
    return std::nullopt;
}

}  // namespace

const AlphaMask* MaskCutter::maskOf(std::span<const Material> materials, uint32_t number) {
    const auto [found, isNew] = byMaterial_.try_emplace(number);
    if (!isNew) {
        if (!found->second) return nullptr;
        loaded_.splice(loaded_.begin(), loaded_, *found->second);
        return &loaded_.front().mask;
    }
    if (!mayCut(materials[number])) return nullptr;
    auto mask = loadMask(materials[number], memoryBytes_);
    if (!mask) warnings_.push_back(mask.error().line() + "; material '" + materials[number].name + "' is not cut");
    if (!mask || mask->content() == AlphaMask::kKept) return nullptr;
    loaded_.push_front({number, *std::move(mask)});
    found->second = loaded_.begin();
    loadedBytes_ += loaded_.front().mask.bytes();
    while (loadedBytes_ > memoryBytes_ && loaded_.size() > 1) {
        loadedBytes_ -= loaded_.back().mask.bytes();
        byMaterial_.erase(loaded_.back().material);
        loaded_.pop_back();
    }
    return &loaded_.front().mask;
}

const MaskParts* MaskCutter::cut(const AlphaMask& mask, const Place& place, const std::array<glm::dvec2, 3>& texels) {
    const auto [found, isNew] = known_.try_emplace(place);
    if (isNew) {
        found->second = cutTriangle(mask, texels, std::ldexp(1.0, place.log2Spared));
        constexpr uint64_t kPlaceBytes = 128;
        knownBytes_ += kPlaceBytes;
        if (found->second)
            knownBytes_ += found->second->points.size() * sizeof(Weights) +
                           found->second->triangles.size() * sizeof found->second->triangles[0];
        if (knownBytes_ > memoryBytes_ / 4) {
            // What is asked for next is most likely what was asked for last, and all else is soon found again.
            auto last = known_.extract(found);
            known_.clear();
            knownBytes_ = 0;
            const auto kept = known_.insert(std::move(last)).position;
            return kept->second ? &*kept->second : nullptr;
        }
    }
    return found->second ? &*found->second : nullptr;
}

const MaskParts* MaskCutter::partsOf(std::span<const Material> materials, uint32_t number,
                                     const std::array<glm::vec2, 3>& uv, double area) {
    static const MaskParts kNothing;
    if (number >= materials.size() || !materials[number].mask.exists()) return nullptr;
    const MaskRule& rule = materials[number].mask;
    const MaskParts* parts = &kNothing;
    if (rule.cutoff <= 1) {
        const AlphaMask* const mask = maskOf(materials, number);
        if (!mask) return nullptr;
        std::array<glm::dvec2, 3> texels;
        glm::dvec2 low(HUGE_VAL), high(-HUGE_VAL);
        for (size_t i = 0; i < 3; ++i) {
            texels[i] = (glm::dvec2(uv[i]) * glm::dvec2(rule.uvScale) + glm::dvec2(rule.uvOffset)) * mask->size();
            low = glm::min(low, texels[i]);
            high = glm::max(high, texels[i]);
        }
        for (const glm::dvec2& t : texels)
            if (!(std::max(std::abs(t.x), std::abs(t.y)) < kFarthestTexel)) return nullptr;
        const auto content = mask->contentOf(low, high);
        if (content == AlphaMask::kKept) return nullptr;
        if (content == AlphaMask::kBoth)
            parts = cut(*mask,
                        {number,
                         log2OfSpared(areaOf(texels), area, detail_),
                         {uv[0].x, uv[0].y, uv[1].x, uv[1].y, uv[2].x, uv[2].y}},
                        texels);
    }
    cutTriangles_ += parts != nullptr;
    return parts;
}

}  // namespace vcp
