#include "builder/mask/mask_cutter.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/mask/mask_outline.h"
#include "builder/mask/triangulation.h"

namespace vcp {

namespace {

constexpr double kLeastParts = 128, kMostParts = 4096;
// Beyond this, a float no longer tells texels apart.
constexpr double kFarthestTexel = double(1 << 26);

size_t mostPartsOf(const std::array<glm::dvec2, 3>& t) {
    const glm::dvec2 a = t[1] - t[0], b = t[2] - t[0];
    const double area = std::abs(a.x * b.y - a.y * b.x) / 2;
    return size_t(std::clamp(std::sqrt(area) / 2, kLeastParts, kMostParts));
}

/// Returns the parts; nothing where all is left.
std::optional<MaskParts> cutTriangle(const AlphaMask& mask, const std::array<glm::dvec2, 3>& texels) {
    auto outline = MaskOutline::find(mask, texels);
    if (!outline || outline->isWhole()) return std::nullopt;
    const size_t most = mostPartsOf(texels);
    const double longest = glm::distance(texels[0], texels[1]) + glm::distance(texels[0], texels[2]);
    // Lines that cross make more than is known before.
    for (double tolerance = outline->leastTolerance();; tolerance *= 2) {
        outline->simplify(tolerance);
        const bool isCoarsest = tolerance > longest;
        if (outline->triangles() > most && !isCoarsest) continue;
        if (outline->isWhole()) return std::nullopt;
        MaskParts parts = triangulate(outline->loops());
        if (parts.triangles.size() <= 2 * most || isCoarsest) return parts;
    }
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
    std::string warning;
    auto mask = loadMask(materials[number], memoryBytes_, warning);
    if (!mask) warning = mask.error().line() + "; material '" + materials[number].name + "' is not cut";
    if (!warning.empty()) warnings_.push_back(std::move(warning));
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
        found->second = cutTriangle(mask, texels);
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
                                     const std::array<glm::vec2, 3>& uv) {
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
            parts = cut(*mask, {number, {uv[0].x, uv[0].y, uv[1].x, uv[1].y, uv[2].x, uv[2].y}}, texels);
    }
    cutTriangles_ += parts != nullptr;
    return parts;
}

}  // namespace vcp
