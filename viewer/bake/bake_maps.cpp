#include "viewer/bake/bake_maps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "mesostructure/base/texel_values.h"
#include "octree/surface/morton.h"
#include "viewer/bake/line_sampler.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {

namespace {

using namespace meso;
using glm::dvec2, glm::dvec3, glm::vec3;

/// Texels this near to a chart have values of their own; bilinear values at its border need them.
constexpr double kGuard = 2;
constexpr float kNone = LineHit::kNone;

class MapBaker {
public:
    MapBaker(const BaseSurface& base, const TexelMap& map, const BaseFrames& frames,
             const std::vector<dvec3>& directions, const BakeMapsOptions& options)
        : base_(base), map_(map), frames_(frames), directions_(directions), options_(options) {}

    Result<BakedMaps> run(const std::shared_ptr<const ByteReader>& reader, const Dataset& dataset) {
        VCP_TRY_ASSIGN(owners_, ownersOf(map_, kGuard));
        charts_ = chartsOf(base_, map_);
        made_.size = map_.size;
        order();
        VCP_TRY(sample(reader, dataset));
        VCP_TRY(makeHeights());
        makeStates();
        makeNormals();
        makeLight();
        return std::move(made_);
    }

private:
    [[nodiscard]] dvec2 placeOf(size_t texel) const {
        return {double(texel % size_t(map_.size)), double(texel / size_t(map_.size))};
    }
    [[nodiscard]] dvec3 weightsOf(size_t texel) const { return weightsAt(map_.places[owners_[texel]], placeOf(texel)); }
    [[nodiscard]] bool isInside(size_t texel) const {
        if (owners_[texel] == kNoTriangle) return false;
        const dvec3 w = weightsOf(texel);
        return std::min({w.x, w.y, w.z}) >= -kOnEdge;
    }
    [[nodiscard]] SampleLine lineOf(size_t texel) const {
        const auto& t = base_.triangles[owners_[texel]];
        const dvec3 w = weightsOf(texel);
        SampleLine line{.start = dvec3(0), .direction = dvec3(0)};
        for (int k = 0; k < 3; ++k)
            line.start += w[k] * base_.positions[t[k]], line.direction += w[k] * directions_[t[k]];
        return line;
    }

    /// Chooses the texels that are sampled, in an order that keeps together what lies together. The texels about the
    /// charts of an atlas are not: they get what is next to them.
    void order() {
        const Box bounds = Box::of(base_.positions);
        const dvec3 size = bounds.high - bounds.low;
        const double scale = 1023.0 / std::max({size.x, size.y, size.z, std::numeric_limits<double>::min()});
        std::vector<uint64_t> keys;
        for (size_t texel = 0; texel < owners_.size(); ++texel) {
            if (owners_[texel] == kNoTriangle || (map_.isAtlas() && !isInside(texel))) continue;
            const glm::uvec3 at(glm::clamp((lineOf(texel).start - bounds.low) * scale, 0.0, 1023.0));
            keys.push_back(uint64_t{mortonEncode(at)} << 32 | texel);
        }
        std::sort(keys.begin(), keys.end());
        sampled_.reserve(keys.size());
        for (const uint64_t key : keys) sampled_.push_back(uint32_t(key));
    }

    Result<void> sample(const std::shared_ptr<const ByteReader>& reader, const Dataset& dataset) {
        const uint64_t own = kBakeBytesPerTexel * map_.texels();
        constexpr uint64_t kLeast = 16 << 20;
        if (own + kLeast > options_.memoryBytes)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("maps of {0} x {0} texels need {1} MiB of memory; raise the memory cap "
                                                "or make smaller maps",
                                                map_.size, (own + kLeast) >> 20)};
        std::vector<SampleLine> lines;
        lines.reserve(sampled_.size());
        for (const uint32_t texel : sampled_) lines.push_back(lineOf(texel));
        hits_.resize(sampled_.size());
        return sampleLines(reader, dataset, lines, hits_,
                           {.low = -options_.reach,
                            .high = options_.reach,
                            .withColour = options_.withColour && dataset.hasColour(),
                            .memoryBytes = options_.memoryBytes - own,
                            .progress = options_.progress});
    }

    /// Spreads what was sampled over the map: filled, and the same on both sides of the edges of an atlas.
    template <class Value, class Of>
    std::vector<Value> spread(const Of& of) {
        std::vector<Value> values(map_.texels(), Value(kNone));
        for (size_t i = 0; i < sampled_.size(); ++i) values[sampled_[i]] = of(hits_[i]);
        const TexelCharts charts{map_, owners_, charts_};
        fillMissing(charts, std::span(values));
        // A chart without a value of its own gets those of its neighbours along its edges.
        conformEdges(base_, map_, std::span(values));
        fillMissing(charts, std::span(values));
        for (Value& value : values)
            if (isMissing(value)) value = Value(0);
        conformEdges(base_, map_, std::span(values));
        return values;
    }

    BakedHeights inSteps(const std::vector<float>& values) const {
        float low = std::numeric_limits<float>::infinity(), high = -low;
        for (size_t texel = 0; texel < values.size(); ++texel)
            if (isInside(texel)) low = std::min(low, values[texel]), high = std::max(high, values[texel]);
        BakedHeights made;
        made.offset = double(low);
        // A flat surface is a map of zeros.
        made.range = std::max(double(high) - double(low), 1e-6 * options_.reach);
        made.values.reserve(values.size());
        for (const float value : values) {
            const double part = std::clamp((double(value) - made.offset) / made.range, 0.0, 1.0);
            made.values.push_back(uint16_t(std::lround(part * 65535)));
        }
        return made;
    }

    Result<void> makeHeights() {
        const auto isHit = [](const LineHit& hit) { return !std::isnan(hit.at); };
        if (std::none_of(hits_.begin(), hits_.end(), isHit))
            return Error{.code = ErrorCode::InvalidInput,
                         .message = fmt::format("not one line from the base meets the scan within {:.4g} of it; is the "
                                                "base the scan's own, in its place and unit?",
                                                options_.reach)};
        std::vector<float> values = spread<float>([](const LineHit& hit) { return float(hit.at); });
        made_.heights = inSteps(values);
        for (size_t texel = 0; texel < values.size(); ++texel)
            if (owners_[texel] != kNoTriangle) values[texel] *= float(glm::length(lineOf(texel).direction));
        made_.displacement = inSteps(values);
        return {};
    }

    TexelState stateOf(size_t texel, const LineHit& hit) const {
        if (std::isnan(hit.at)) return TexelState::NoHit;
        if (std::abs(double(hit.other)) <= 2 * std::abs(hit.at)) return TexelState::Sheets;
        const double steep = std::cos(kSteepDegrees * std::numbers::pi / 180);
        const dvec3 direction = lineOf(texel).direction;
        return glm::dot(dvec3(hit.normal), direction) < steep * glm::length(direction) ? TexelState::Steep
                                                                                       : TexelState::Height;
    }

    /// Each texel stands for its share of its triangle's area.
    void makeStates() {
        made_.states.assign(map_.texels(), TexelState::Outside);
        std::vector<uint32_t> counts(base_.triangles.size(), 0);
        for (const uint32_t texel : sampled_)
            if (isInside(texel)) ++counts[owners_[texel]];
        made_.isField.assign(base_.triangles.size(), true);
        std::array<double, 5> areas{};
        for (size_t i = 0; i < sampled_.size(); ++i) {
            const size_t texel = sampled_[i];
            if (!isInside(texel)) continue;
            const TexelState state = stateOf(texel, hits_[i]);
            made_.states[texel] = state;
            if (state != TexelState::Height) made_.isField[owners_[texel]] = false;
            areas[size_t(state)] += areaOf(base_, owners_[texel]) / double(counts[owners_[texel]]);
        }
        const double all = areas[1] + areas[2] + areas[3] + areas[4];
        const auto part = [&](TexelState state) { return all > 0 ? areas[size_t(state)] / all : 0; };
        made_.shares = {part(TexelState::Height), part(TexelState::NoHit), part(TexelState::Sheets),
                        part(TexelState::Steep)};
    }

    void makeNormals() {
        const std::vector<vec3> normals = spread<vec3>([](const LineHit& hit) { return hit.normal; });
        made_.normals.assign(map_.texels(), vec3(0, 0, 1));
        for (size_t texel = 0; texel < normals.size(); ++texel) {
            if (owners_[texel] == kNoTriangle || normals[texel] == vec3(0)) continue;
            const glm::dmat3 frame = frames_.at(owners_[texel], weightsOf(texel));
            const dvec3 n = glm::inverse(frame) * dvec3(normals[texel]);
            if (const double length = glm::length(n); length > 0) made_.normals[texel] = vec3(n / length);
        }
    }

    void makeLight() {
        if (std::all_of(hits_.begin(), hits_.end(), [](const LineHit& hit) { return isMissing(hit.light); })) return;
        made_.light = spread<vec3>([](const LineHit& hit) { return hit.light; });
        // Coarser levels of a texture mix what lies beside a chart into it: let it be what is there on the whole.
        dvec3 sum(0);
        size_t count = 0;
        for (size_t texel = 0; texel < owners_.size(); ++texel)
            if (owners_[texel] != kNoTriangle) sum += dvec3(made_.light[texel]), ++count;
        for (size_t texel = 0; texel < owners_.size(); ++texel)
            if (owners_[texel] == kNoTriangle) made_.light[texel] = vec3(sum / double(count));
    }

    const BaseSurface& base_;
    const TexelMap& map_;
    const BaseFrames& frames_;
    const std::vector<dvec3>& directions_;
    const BakeMapsOptions& options_;
    std::vector<uint32_t> owners_, charts_, sampled_;
    std::vector<LineHit> hits_;
    BakedMaps made_;
};

}  // namespace

Result<BakedMaps> bakeMaps(const std::shared_ptr<const ByteReader>& reader, const Dataset& dataset,
                           const BaseSurface& base, const TexelMap& map, const BaseFrames& frames,
                           const std::vector<dvec3>& directions, const BakeMapsOptions& options) {
    for (size_t i = 0; i < base.triangles.size(); ++i)
        for (const uint32_t corner : base.triangles[i])
            if (directions[corner] == dvec3(0)) {
                const dvec3 p = base.positions[corner];
                return Error{.code = ErrorCode::InvalidInput,
                             .message = fmt::format("at ({:.9g}, {:.9g}, {:.9g}) the normals of the base's triangles "
                                                    "cancel: there is no direction to look in",
                                                    p.x, p.y, p.z),
                             .element = fmt::format("triangle {}", i)};
            }
    return MapBaker(base, map, frames, directions, options).run(reader, dataset);
}

}  // namespace vcp
