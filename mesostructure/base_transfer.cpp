#include "mesostructure/base_transfer.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/gtc/packing.hpp>
#include <glm/mat3x3.hpp>

#include "mesostructure/harmonics.h"
#include "mesostructure/shell.h"

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3;
using Row = std::array<double, 16>;

constexpr double kBaseLift = 1e-6;      // by which rays start above a base, parts of the scene's diagonal
constexpr double kSteadiness = 1e-5;    // that is added to the least squares' diagonal, whose largest is near 0.1
constexpr double kBounceIsOver = 1e-4;  // of what a white surface gives back, at most, by one more bounce
// How much of the whole is done when all rays are cast, and when all bounces are followed.
constexpr double kAfterRays = 0.6, kAfterBounces = 0.75;

/// Weighs the rays over a hemisphere so that sums of what they bring are coefficients (the inverse of the harmonics'
/// products over the rays, by Cholesky's decomposition).
std::vector<f64::Harmonics> fitOf(std::span<const f64::Harmonics> rays) {
    const double count = double(rays.size());
    double l[16][16] = {};
    for (int i = 0; i < 16; ++i)
        for (int j = 0; j <= i; ++j) {
            double sum = i == j ? kSteadiness : 0;
            for (const f64::Harmonics& ray : rays) sum += ray.c[i] * ray.c[j] / count;
            for (int k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
            l[i][j] = i == j ? std::sqrt(sum) : sum / l[j][j];
        }
    std::vector<f64::Harmonics> fit;
    for (f64::Harmonics ray : rays) {
        for (int i = 0; i < 16; ++i) {
            for (int k = 0; k < i; ++k) ray.c[i] -= l[i][k] * ray.c[k];
            ray.c[i] /= l[i][i];
        }
        for (int i = 15; i >= 0; --i) {
            for (int k = i + 1; k < 16; ++k) ray.c[i] -= l[k][i] * ray.c[k];
            ray.c[i] /= l[i][i];
        }
        for (double& c : ray.c) c /= count;
        fit.push_back(ray);
    }
    return fit;
}

/// A ray over a vertex that meets a base.
struct Blocked {
    uint32_t triangle;
    uint16_t ray;
    bool isDark;                      // it meets the triangle's back
    std::array<uint16_t, 2> weights;  // of the triangle's second and third corner, 0 to 65535
};

class BaseTracer {
public:
    BaseTracer(const BaseScene& scene, const BaseTransferOptions& options) : scene_(scene), options_(options) {
        for (uint32_t i = 0; i < options.rays; ++i) {
            directions_.push_back(directionByCosine({0, 0, 1}, evenPoint(i)));
            harmonics_.push_back(f64::harmonicsOf(directions_.back()));
        }
        fit_ = fitOf(harmonics_);
        dvec3 low(0), high(0);
        if (!scene.positions.empty()) low = high = scene.positions.front();
        for (const dvec3 p : scene.positions) low = glm::min(low, p), high = glm::max(high, p);
        lift_ = kBaseLift * glm::length(high - low);
        blocked_.resize(scene.positions.size());
        own_.resize(scene.positions.size());
    }

    void cast(size_t vertex) {
        const dvec3 n = scene_.normals[vertex];
        const glm::dmat3 frame = frameOf(n);
        f64::Harmonics open = f64::clampedCosine(n);
        if (n != dvec3(0))
            for (uint32_t i = 0; i < options_.rays; ++i) {
                const dvec3 d = frame * directions_[i], from = scene_.positions[vertex] + lift_ * n;
                const auto hit = options_.cast(from, d);
                if (!hit) continue;
                blocked_[vertex].push_back(blockedBy(*hit, i, d, from + hit->t * d));
                const f64::Harmonics lost = f64::harmonicsOf(d);
                for (int k = 0; k < 16; ++k) open.c[k] -= lost.c[k] / options_.rays;
            }
        std::copy(open.c, open.c + 16, own_[vertex].begin());
    }

    /// Follows light from base to base; then `lit` is what each vertex gets, over what falls on an open one. Returns
    /// false where it was cancelled. `share`: calls for all vertices.
    template <class Share>
    bool bounce(const Share& share) {
        lit_ = own_;
        for (uint32_t i = 0; i < options_.bounces; ++i) {
            std::vector<Row> next = own_;
            const bool isDone = share(
                [&](size_t v) {
                    for (const Blocked& blocked : blocked_[v]) {
                        const Row from = givenBack(blocked);
                        for (size_t k = 0; k < 16; ++k) next[v][k] += from[k] / options_.rays;
                    }
                },
                i);
            if (!isDone) return false;
            // Under light of radiance 1 from everywhere.
            double most = 0;
            for (size_t v = 0; v < next.size(); ++v)
                most = std::max(most, std::abs(next[v][0] - lit_[v][0]) / f64::kBand0);
            lit_ = std::move(next);
            if (most < kBounceIsOver) break;
        }
        return true;
    }

    /// Returns M less the identity. Precondition: bounce().
    [[nodiscard]] std::array<float, BaseTransfer::kValues> changeAt(size_t vertex) const {
        const glm::dmat3 frame = frameOf(scene_.normals[vertex]);
        std::array<Row, 16> local{};
        for (const Blocked& blocked : blocked_[vertex]) {
            Row change = givenBack(blocked);
            const f64::Harmonics lost = f64::harmonicsOf(frame * directions_[blocked.ray]);
            for (size_t k = 0; k < 16; ++k) change[k] -= lost.c[k];
            for (size_t i = 0; i < 16; ++i)
                for (size_t j = 0; j < 16; ++j) local[i][j] += fit_[blocked.ray].c[i] * change[j];
        }
        std::array<float, BaseTransfer::kValues> made{};
        for (size_t j = 0; j < 16; ++j) {
            f64::Harmonics column;
            for (size_t i = 0; i < 16; ++i) column.c[i] = local[i][j];
            column = turnedHarmonics(column, frame);
            for (size_t i = 0; i < 16; ++i) made[16 * j + i] = float(column.c[i]);
        }
        return made;
    }

    [[nodiscard]] bool isOpen(size_t vertex) const { return blocked_[vertex].empty(); }

private:
    static glm::dmat3 frameOf(dvec3 n) {
        return {turnedFromZ(n, {1, 0, 0}), turnedFromZ(n, {0, 1, 0}), turnedFromZ(n, {0, 0, 1})};
    }

    [[nodiscard]] Blocked blockedBy(BaseHit hit, uint32_t ray, dvec3 d, dvec3 at) const {
        const auto& t = scene_.triangles[hit.triangle];
        const dvec3 a = scene_.positions[t[0]], b = scene_.positions[t[1]] - a, c = scene_.positions[t[2]] - a;
        const dvec3 normal = glm::cross(b, c), p = at - a;
        const double area2 = glm::dot(normal, normal);
        double second = 0, third = 0;
        if (area2 > 0) {
            second = std::clamp(glm::dot(glm::cross(p, c), normal) / area2, 0.0, 1.0);
            third = std::clamp(glm::dot(glm::cross(b, p), normal) / area2, 0.0, 1 - second);
        }
        return {
            hit.triangle, uint16_t(ray), glm::dot(d, normal) >= 0, {uint16_t(65535 * second), uint16_t(65535 * third)}};
    }

    /// Returns what comes back from where a ray meets a base.
    [[nodiscard]] Row givenBack(const Blocked& blocked) const {
        Row row{};
        if (blocked.isDark) return row;
        const auto& t = scene_.triangles[blocked.triangle];
        const double second = blocked.weights[0] / 65535.0, third = blocked.weights[1] / 65535.0;
        const double weights[] = {1 - second - third, second, third};
        for (size_t corner = 0; corner < 3; ++corner)
            for (size_t k = 0; k < 16; ++k)
                row[k] += scene_.albedos[blocked.triangle] * weights[corner] * lit_[t[corner]][k];
        return row;
    }

    const BaseScene& scene_;
    const BaseTransferOptions& options_;
    double lift_ = 0;
    std::vector<dvec3> directions_;          // of the rays, z along the normal
    std::vector<f64::Harmonics> harmonics_;  // of them
    std::vector<f64::Harmonics> fit_;        // what each ray adds to the coefficients
    std::vector<std::vector<Blocked>> blocked_;
    std::vector<Row> own_, lit_;  // what a white flat surface gives back: straight from the surroundings; all of it
};

}  // namespace

std::vector<uint64_t> BaseTransfer::lightTexels(std::span<const glm::vec4, 16> light) const {
    std::vector<uint64_t> texels;
    texels.reserve(kTexels * vertices());
    for (const uint32_t number : numbers)
        for (int channel = 0; channel < 3; ++channel) {
            float over[16];
            for (size_t i = 0; i < 16; ++i) over[i] = light[i][channel];
            const float* column = number > 0 ? &changes[kValues * (number - 1)] : nullptr;
            for (size_t j = 0; column != nullptr && j < 16; ++j, column += 16)
                for (size_t i = 0; i < 16; ++i) over[i] += column[i] * light[j][channel];
            for (size_t i = 0; i < 16; i += 4)
                texels.push_back(glm::packHalf4x16({over[i], over[i + 1], over[i + 2], over[i + 3]}));
        }
    return texels;
}

TileReflection tileReflection(const TilePaths& paths, uint32_t count) {
    TileReflection found;
    PathRandom random(1);
    const dvec2 extent(paths.shape().extent());
    for (uint32_t i = 0; i < count; ++i) {
        const dvec2 place = evenPoint(i) * extent;
        const TileMeeting above = paths.see({0, 0, 1}, place);
        found.height += above.point.at.z / count;
        const double across = random.next();
        const dvec3 view = directionByCosine({0, 0, 1}, {across, random.next()});
        const TileMeeting met = paths.see(view, place);
        if (met.kind != TileMeeting::Kind::Surface) continue;
        const double u = random.next();
        const dvec3 on = directionByCosine(met.point.normal, {u, random.next()});
        found.albedo += paths.albedo() * paths.follow(met.point, on, random).weight / count;
    }
    return found;
}

uint32_t BaseScene::add(const BaseSurface& surface, double height, double albedo) {
    const auto first = uint32_t(positions.size());
    const std::vector<dvec3> directions = shellDirections(surface);
    for (size_t i = 0; i < surface.positions.size(); ++i) {
        const double length = glm::length(directions[i]);
        positions.push_back(surface.positions[i] + height * directions[i]);
        normals.push_back(length > 0 ? directions[i] / length : dvec3(0));
    }
    for (const auto& t : surface.triangles) {
        triangles.push_back({first + t[0], first + t[1], first + t[2]});
        albedos.push_back(float(albedo));
    }
    return first;
}

Result<std::vector<BaseTransfer>> traceBaseTransfer(const BaseScene& scene,
                                                    std::span<const std::pair<uint32_t, uint32_t>> ranges,
                                                    const BaseTransferOptions& options) {
    if (options.rays < 16 || options.rays > 4096)
        return Error{.code = ErrorCode::Usage, .message = "the transfer of a base takes 16 to 4096 rays a vertex"};
    const uint64_t most = sizeof(Blocked) * options.rays + sizeof(float) * BaseTransfer::kValues + 3 * sizeof(Row);
    if (scene.positions.size() * most > options.memoryBytes)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format("the transfer of bases of {} vertices may take {} bytes; at most {}: take "
                                   "coarser bases",
                                   scene.positions.size(), scene.positions.size() * most, options.memoryBytes)};
    BaseTracer tracer(scene, options);
    const auto share = [&](size_t count, const auto& each, BaseTransferOptions::Part part) {
        const auto fill = [&](size_t first, size_t last) {
            for (size_t i = first; i < last; ++i) each(i);
        };
        if (options.shareOut) return options.shareOut(count, fill, part);
        fill(0, count);
        return true;
    };
    const size_t vertices = scene.positions.size();
    if (!share(vertices, [&](size_t v) { tracer.cast(v); }, {0, kAfterRays})) return Error::cancelled();
    const auto bounce = [&](const auto& each, uint32_t number) {
        const double step = (kAfterBounces - kAfterRays) / options.bounces;
        return share(vertices, each, {kAfterRays + number * step, kAfterRays + (number + 1) * step});
    };
    if (!tracer.bounce(bounce)) return Error::cancelled();
    std::vector<BaseTransfer> made;
    std::vector<std::pair<uint32_t, float*>> changed;  // vertices, and where their change goes
    for (const auto& [first, count] : ranges) {
        BaseTransfer& transfer = made.emplace_back();
        uint32_t number = 0;
        for (uint32_t v = first; v < first + count; ++v) transfer.numbers.push_back(tracer.isOpen(v) ? 0 : ++number);
        transfer.changes.resize(BaseTransfer::kValues * number);
        for (uint32_t v = first; v < first + count; ++v)
            if (const uint32_t at = transfer.numbers[v - first]; at > 0)
                changed.emplace_back(v, &transfer.changes[BaseTransfer::kValues * (at - 1)]);
    }
    const auto change = [&](size_t i) { std::ranges::copy(tracer.changeAt(changed[i].first), changed[i].second); };
    if (!share(changed.size(), change, {kAfterBounces, 1})) return Error::cancelled();
    return made;
}

}  // namespace vcp::meso
