#include "datasets_scripts/statue.h"

#include <algorithm>
#include <array>
#include <memory>
#include <string_view>

#include "datasets_scripts/marble.h"
#include "datasets_scripts/procedural_noise.h"
#include "datasets_scripts/sweep.h"

namespace vcp::scan {
namespace {

using glm::dvec3;

constexpr dvec3 kGold(0.83, 0.63, 0.20), kLapis(0.10, 0.20, 0.52), kStone(0.60, 0.57, 0.53);

/// |sin|: round crests and sharp valleys, as cloth under its own weight.
double fold(double turns) { return std::abs(sinTurns(0.5 * turns)); }

double bumpAt(const dvec3& p, const dvec3& centre, double radius) { return bump(glm::length(p - centre) / radius); }

class Statue {
public:
    Statue(uint64_t seed, double edge)
        : seed_(seed),
          marble_{Noise(seed), std::max(3 * edge, 1e-4)},
          phase_(signedUnit(hash(seed ^ 0xf01d))),
          sway_(1 + 0.25 * signedUnit(hash(seed ^ 0x5a7))),
          spread_(1 + 0.06 * signedUnit(hash(seed ^ 0x3196))),
          robe_{Spline({{0, -0.02, 0},
                        {0.005, 0.10, 0},
                        {0.015, 0.30, 0.01},
                        {0.035, 0.55, 0.02},
                        {0.06 * sway_, 0.80, 0.01},
                        {0.055 * sway_, 0.98, 0},
                        {0.02, 1.14, -0.005},
                        {-0.01, 1.28, 0},
                        {-0.012, 1.40, -0.01},
                        {0, 1.475, -0.01},
                        {0.004, 1.55, 0.005},
                        {0.008, 1.66, 0.015}}),
                Spline({{0.44, 0.40, 0},
                        {0.38, 0.34, 0},
                        {0.30, 0.27, 0},
                        {0.235, 0.215, 0},
                        {0.225, 0.19, 0},
                        {0.20, 0.165, 0},
                        {0.135, 0.11, 0},
                        {0.175, 0.135, 0},
                        {0.215, 0.115, 0},
                        {0.075, 0.070, 0},
                        {0.050, 0.055, 0},
                        {0.054, 0.058, 0}}),
                dvec3(0, 0, -1), 0.012, 0.10} {}

    [[nodiscard]] SurfacePoint robe(double u, double v) const {
        const SweepPoint s = robe_.at(u, v);
        const dvec3 p = s.position;
        const double y = p.y;
        const double skin = smoothStep(1.43, 1.47, y - 0.25 * std::max(0.0, p.z - 0.03));

        // Hanging folds, wandering and joining because noise bends their angle.
        const double bend = 0.055 * marble_.noise(p * 2.4) + 0.018 * marble_.noise(p * 6.5 + 5.0);
        const double angle = u + bend + 0.10 * (y - 0.6) + 0.1 * phase_;
        const double wide = fold(20 * angle), narrow = fold(34 * (angle + bend) + 0.3);
        const double deep = 0.012 + 0.050 * (1 - smoothStep(0.0, 0.95, y));
        const double valley = (1 - wide) * 0.65 + (1 - narrow) * 0.35;
        // The forward leg stretches the cloth.
        const double leg =
            1 - (1 - bumpAt(p, {0.10, 0.66, 0.20}, 0.32)) * (1 - 0.8 * bumpAt(p, {0.12, 0.36, 0.24}, 0.32));
        const double pleats = deep * (1 - 0.75 * leg) * (1 - skin);
        double height = -pleats * valley * (0.55 + 0.9 * valley) + 0.065 * leg;

        // Oblique folds drawn up towards the left hip.
        const double pull = bumpAt(p, {-0.14, 0.82, 0.12}, 0.36);
        height += 0.014 * pull * fold(16 * (y - 0.55 * p.x) + 2 * bend * 9);

        // The overfold ends in a ledge below the hips; the belt cuts in above them.
        const double hem = 0.845 + 0.035 * sinTurns(3 * u + phase_) + 0.012 * wide;
        const double over = smoothStep(hem, hem + 0.012, y) * (1 - smoothStep(1.04, 1.10, y));
        height += 0.026 * over;
        const double belt = bump((y - 1.115 - 0.012 * sinTurns(u + 0.1)) / 0.022);
        height += belt * (0.016 + 0.004 * sinTurns(46 * u + 40 * y));
        const double blouse = smoothStep(1.13, 1.17, y) * (1 - smoothStep(1.18, 1.30, y));
        height += 0.018 * blouse;

        height += 0.040 * (bumpAt(p, {0.072, 1.285, 0.125}, 0.105) + bumpAt(p, {-0.088, 1.285, 0.125}, 0.105));
        // Neckline: a V of cloth over the skin.
        height -= 0.010 * skin;

        const double end = s.end;
        const double rough = marble_.roughness(p) * (0.55 + 0.45 * end);
        SurfacePoint point;
        point.position = p + s.outward * ((height + rough) * end);
        const double cavity = (1 - skin) * (std::max(0.0, valley - 0.45) * 1.5 * (1 - belt)) +
                              0.35 * bump((y - hem + 0.008) / 0.014) * (1 - skin);
        point.colour = marble_.colour(point.position, cavity);
        if (belt > 0.12) point.colour = kGold * (0.8 + 0.2 * sinTurns(46 * u + 40 * y));
        return point;
    }

    [[nodiscard]] SurfacePoint head(double u, double v) const {
        const double polar = 0.5 * v;  // 0 at the chin's pole, half a turn later at the crown
        const double ring = sinTurns(polar);
        const dvec3 d(ring * cosTurns(u), -cosTurns(polar), -ring * sinTurns(u));
        const double face = smoothStep(0.25, 0.45, d.z) * (1 - smoothStep(0.48, 0.62, d.y));
        const auto feature = [&](double x, double y, double rx, double ry) {
            const dvec3 q((std::abs(d.x) - x) / rx, (d.y - y) / ry, 0);
            return d.z > 0 ? bump(std::min(1.0, glm::length(q))) : 0.0;
        };
        double height = 0.016 * feature(0, -0.12, 0.13, 0.30) + 0.006 * feature(0, -0.20, 0.20, 0.12) -
                        0.012 * feature(0.32, 0.13, 0.22, 0.13) + 0.006 * feature(0.32, 0.11, 0.13, 0.07) +
                        0.005 * feature(0.30, 0.28, 0.30, 0.08) + 0.007 * feature(0, -0.47, 0.20, 0.06) +
                        0.006 * feature(0, -0.57, 0.16, 0.06) + 0.012 * feature(0, -0.80, 0.30, 0.22);
        // The hair is combed in strands from the parting to the bun.
        const double comb = fold(26 * (d.y + 0.35 * d.z * d.z + 0.10 * marble_.noise(d * 3.0)));
        height = face * height + (1 - face) * (0.010 + 0.007 * comb) * smoothStep(-0.75, -0.35, d.y - 0.4 * d.z);
        const double jaw = 1 - 0.22 * smoothStep(0.1, -0.9, d.y);
        const dvec3 radii(0.082 * jaw, 0.118, 0.100 * (0.86 + 0.14 * jaw));
        const dvec3 local = 1.13 * (d * radii + d * height);
        // The head is turned to the raised arm and slightly down.
        const double c = cosTurns(0.055), s = sinTurns(0.055);
        SurfacePoint point;
        point.position =
            dvec3(0.01, 1.712, 0.025) + dvec3(c * local.x + s * local.z, local.y, -s * local.x + c * local.z);
        point.position += d * (0.35 * marble_.roughness(point.position) * std::min(1.0, 4 * ring));
        const double cavity = (1 - face) * (1 - comb) * 0.7 + face * 0.5 * feature(0.32, 0.13, 0.20, 0.10);
        point.colour = marble_.colour(point.position, cavity);
        // A gold fillet in the hair.
        if (std::abs(d.y - 0.50 - 0.30 * d.z * 0.4) < 0.045) point.colour = kGold * (0.82 + 0.18 * comb);
        return point;
    }

    [[nodiscard]] SurfacePoint bun(double u, double v) const {
        const double ring = sinTurns(0.5 * v);
        const dvec3 d(ring * cosTurns(u), -cosTurns(0.5 * v), -ring * sinTurns(u));
        const double comb = fold(18 * d.y + 4 * u);
        SurfacePoint point;
        point.position = dvec3(-0.035, 1.742, -0.125) + d * (0.052 + 0.007 * comb * ring);
        point.colour = marble_.colour(point.position, (1 - comb) * 0.6);
        return point;
    }

    /// A limb of marble along a sweep; `carving` scales the weathering.
    [[nodiscard]] SurfacePoint limb(const Sweep& sweep, double u, double v, double carving) const {
        const SweepPoint s = sweep.at(u, v);
        SurfacePoint point;
        point.position = s.position + s.outward * (carving * marble_.roughness(s.position) * s.end);
        point.colour = marble_.colour(point.position, 0.08);
        return point;
    }

    [[nodiscard]] SurfacePoint feather(const Sweep& sweep, double u, double v, bool covert) const {
        const SweepPoint s = sweep.at(u, v);
        const double across = cosTurns(u), face = sinTurns(u);
        // A round shaft, and barbs that slant away from it.
        const double shaft = 0.0045 * bump(across / 0.16) * (1 - 0.6 * s.along);
        const double barbs = fold(70 * (s.along - 0.22 * std::abs(across)) + 3 * marble_.noise(s.position * 8.0));
        const double relief = (0.0022 * barbs * (1 - bump(across / 0.2)) + shaft) * std::abs(face);
        SurfacePoint point;
        point.position = s.position + s.outward * ((relief + 0.3 * marble_.roughness(s.position)) * s.end);
        point.colour = marble_.colour(point.position, 0.45 * (1 - s.along) * (1 - s.along) + 0.18 * (1 - barbs));
        if (!covert) point.colour *= 1 - 0.12 * smoothStep(0.75, 1.0, s.along);
        return point;
    }

    [[nodiscard]] SurfacePoint wreath(double u, double v) const {
        // Three strands twisted along a ring.
        const double twist = u + 14 * v;
        const double radius = 0.0135 + 0.0045 * fold(3 * 2 * 0.5 * twist + 0.0);
        const dvec3 out(cosTurns(v), sinTurns(v), 0);
        const dvec3 tilt = glm::normalize(dvec3(-0.25, 0.10, 1));
        const dvec3 x = glm::normalize(glm::cross(dvec3(0, 1, 0), tilt)), y = glm::cross(tilt, x);
        const dvec3 radial = x * out.x + y * out.y;
        SurfacePoint point;
        point.position =
            dvec3(0.475, 2.055, 0.16) + radial * (0.135 + radius * cosTurns(u)) - tilt * (radius * sinTurns(u));
        point.colour = kGold * (0.62 + 0.38 * fold(3 * twist));
        return point;
    }

    [[nodiscard]] SurfacePoint staff(const Sweep& sweep, double u, double v) const {
        const SweepPoint s = sweep.at(u, v);
        return {s.position, kGold * (0.70 + 0.1 * cosTurns(u))};
    }

    [[nodiscard]] SurfacePoint shawl(double u, double v) const {
        static const Spline top({{-0.30, 1.03, 0.25},
                                 {-0.31, 1.05, 0.16},
                                 {-0.33, 1.06, 0.02},
                                 {-0.27, 1.07, -0.16},
                                 {-0.05, 1.10, -0.27},
                                 {0.16, 1.06, -0.24},
                                 {0.29, 0.99, -0.08},
                                 {0.30, 0.94, 0.06},
                                 {0.26, 0.92, 0.16}});
        const dvec3 start = top.at(u);
        dvec3 out(start.x, 0, start.z);
        out = glm::normalize(out);
        const double drop =
            v * (0.62 + 0.10 * sinTurns(1.5 * u + phase_) + 0.20 * bump(u / 0.35) - 0.12 * smoothStep(0.75, 1.0, u));
        const dvec3 rough = dvec3(u * 3, v, phase_);
        const double wave = 0.5 * sinTurns(9 * u + 0.5 * marble_.noise(rough * 2.0) + 0.08 * sinTurns(9 * u));
        const double small = marble_.noise(dvec3(u * 26, v * 3, 4.5));
        // The cloth is blown backwards and outwards towards its lower border.
        const double flare = 0.03 + 0.17 * v * v + v * (0.085 * wave + 0.012 * small) + 0.010 * wave;
        SurfacePoint point;
        point.position = start + out * flare + dvec3(-0.05 * v * v, -drop, -0.08 * v * v);
        point.position += out * marble_.roughness(point.position) * 0.6;
        point.colour = marble_.colour(point.position, std::max(0.0, -wave) * 0.9);
        // A lapis border with a gold thread, as inlay.
        if (v > 0.90) point.colour = v > 0.925 && v < 0.94 ? kGold : kLapis * (1.0 + 0.35 * wave);
        return point;
    }

    [[nodiscard]] SurfacePoint rock(double u, double v) const {
        const double ring = sinTurns(0.5 * v);
        const dvec3 d(ring * cosTurns(u), -cosTurns(0.5 * v), -ring * sinTurns(u));
        const dvec3 base = dvec3(0.01, -0.015, 0.02) + d * dvec3(0.48, 0.105, 0.45);
        // Broken facets come first, the crests of folded noise, then fine weathering.
        const double facets = std::abs(marble_.noise(base * 7.0)) + 0.5 * std::abs(marble_.noise(base * 15.0 + 3.0));
        const double height = 0.06 * (0.45 - facets) + 2.2 * marble_.roughness(base);
        SurfacePoint point;
        point.position = base + d * (height * std::min(1.0, 3 * ring));
        const dvec3 marble = marble_.colour(point.position, 0.25 + 0.6 * (facets < 0.12));
        point.colour = 0.35 * marble + 0.65 * kStone * (0.82 + 0.30 * facets);
        return point;
    }

    [[nodiscard]] SurfacePoint plinth(double u, double v) const {
        // Half width and height along the moulding, from the centre below to the centre above.
        static constexpr std::array<std::array<double, 2>, 14> kProfile{{{0, -0.62},
                                                                         {0.56, -0.62},
                                                                         {0.565, -0.615},
                                                                         {0.565, -0.55},
                                                                         {0.53, -0.53},
                                                                         {0.51, -0.50},
                                                                         {0.47, -0.48},
                                                                         {0.465, -0.18},
                                                                         {0.50, -0.15},
                                                                         {0.515, -0.125},
                                                                         {0.545, -0.105},
                                                                         {0.545, -0.045},
                                                                         {0.535, -0.035},
                                                                         {0, -0.035}}};
        static const double length = [] {
            double sum = 0;
            for (size_t i = 1; i < kProfile.size(); ++i) sum += step(kProfile[i - 1], kProfile[i]);
            return sum;
        }();
        double left = v * length;
        size_t i = 1;
        for (; i + 1 < kProfile.size() && left > step(kProfile[i - 1], kProfile[i]); ++i)
            left -= step(kProfile[i - 1], kProfile[i]);
        const double t = std::min(1.0, left / step(kProfile[i - 1], kProfile[i]));
        const double half = kProfile[i - 1][0] + t * (kProfile[i][0] - kProfile[i - 1][0]);
        const double y = kProfile[i - 1][1] + t * (kProfile[i][1] - kProfile[i - 1][1]);

        // A square with rounded corners: the norm of order 16.
        const double c = cosTurns(u), s = sinTurns(u);
        const double c2 = c * c, s2 = s * s, c16 = c2 * c2 * c2 * c2 * (c2 * c2 * c2 * c2),
                     s16 = s2 * s2 * s2 * s2 * (s2 * s2 * s2 * s2);
        const double norm = std::sqrt(std::sqrt(std::sqrt(std::sqrt(c16 + s16))));
        const dvec3 p(half * c / norm, y, -half * s / norm);
        const dvec3 outward =
            std::abs(p.x) > std::abs(p.z) ? dvec3(p.x > 0 ? 1 : -1, 0, 0) : dvec3(0, 0, p.z > 0 ? 1 : -1);
        const bool side = y > -0.47 && y < -0.19 && half > 0.4;
        const double inlay = side ? meander(std::abs(p.x) > std::abs(p.z) ? p.z : p.x, y) : 0;

        const double chips = std::max(0.0, marble_.noise(p * 6.0 + 90.0) - 0.30) *
                             bump((half / norm - glm::length(dvec3(p.x, 0, p.z))) / 0.2);
        const double edgeWear = std::max(0.0, glm::length(dvec3(p.x, 0, p.z)) / std::max(half, 1e-9) - 1.24);
        const double height = 0.7 * marble_.roughness(p) - 0.006 * (inlay > 0) - 0.14 * chips * edgeWear;
        SurfacePoint point;
        const dvec3 flat = half < 0.53 && (i == 1 || i + 1 == kProfile.size()) ? dvec3(0, i == 1 ? -1 : 1, 0) : outward;
        // No displacement at the poles, where neighbours on the ring would pull apart.
        point.position = p + flat * (height * std::min(1.0, 10 * half));
        point.colour = marble_.colour(p + 3.0, 0.12 + 0.5 * bump((y + 0.48) / 0.03) + 0.4 * bump((y + 0.18) / 0.02));
        if (inlay > 1.5)
            point.colour = kGold;
        else if (inlay > 0)
            point.colour = kLapis * (0.9 + 0.25 * marble_.noise(p * 30.0));
        return point;
    }

    [[nodiscard]] SurfacePoint ribbon(double u, double v) const {
        static const Spline path({{0.475, 1.925, 0.16},
                                  {0.50, 1.84, 0.20},
                                  {0.56, 1.78, 0.19},
                                  {0.55, 1.70, 0.23},
                                  {0.61, 1.62, 0.22},
                                  {0.60, 1.54, 0.26},
                                  {0.66, 1.46, 0.25}});
        const dvec3 across = glm::normalize(dvec3(0.5 * cosTurns(2.2 * u), 0.25, sinTurns(2.2 * u)));
        SurfacePoint point;
        point.position = path.at(u) + across * (0.024 * (v - 0.5) * (1 - 0.4 * u));
        point.colour = kLapis * 1.3;
        return point;
    }

    /// A second pass of the scanner over part of the plinth or the robe, registered a millimetre off.
    [[nodiscard]] SurfacePoint secondPass(bool robePart, double u, double v) const {
        SurfacePoint point =
            robePart ? robe(0.10 + 0.30 * u, 0.20 + 0.25 * v) : plinth(0.30 + 0.14 * u, 0.42 + 0.14 * v);
        const uint64_t h = hash(seed_ ^ (robePart ? 0x2a55 : 0x2a56));
        point.position += 0.0012 * dvec3(signedUnit(h), signedUnit(h, 21), signedUnit(h, 42));
        point.colour *= 0.985;
        return point;
    }

    /// The feathers of both wings, longest layer first.
    void addWings(std::vector<Part>& parts, double weight) const;
    void addLimbs(std::vector<Part>& parts) const;

private:
    static double step(const std::array<double, 2>& a, const std::array<double, 2>& b) {
        const double dx = a[0] - b[0], dy = a[1] - b[1];
        return std::sqrt(dx * dx + dy * dy);
    }

    /// The band around the plinth: 0 marble, 1 lapis, 2 gold key pattern.
    static double meander(double x, double y) {
        static constexpr std::array<std::string_view, 7> kKey{"########", "........", "#######.", "#.....#.",
                                                              "#.###.#.", "#.#...#.", "#.#####."};
        constexpr double kPixel = 0.0168, kLow = -0.385;
        const double row = (y - kLow) / kPixel, column = x / kPixel + 400;
        if (std::abs(x) > 0.40 || row < -1 || row >= 9) return 0;
        if (row < 0 || row >= 8) return 1;
        const auto line = size_t(row);
        if (line == 7) return 2;
        return kKey[6 - line][size_t(column) % 8] == '#' ? 2 : 1;
    }

    uint64_t seed_;
    Marble marble_;
    double phase_, sway_, spread_;
    Sweep robe_;
};

/// The same part on the other side of the plane x = 0; u runs backwards so that faces still look outward.
std::function<SurfacePoint(double, double)> mirrored(std::function<SurfacePoint(double, double)> shape) {
    return [shape = std::move(shape)](double u, double v) {
        SurfacePoint point = shape(1 - u, v);
        point.position.x = -point.position.x;
        return point;
    };
}

void Statue::addWings(std::vector<Part>& parts, double weight) const {
    const Spline arm({{0.06, 1.30, -0.10},
                      {0.16, 1.50, -0.20},
                      {0.32 * spread_, 1.78, -0.30},
                      {0.55 * spread_, 1.98, -0.36},
                      {0.78 * spread_, 1.98, -0.40},
                      {0.95 * spread_, 1.84, -0.42}});
    const dvec3 plane = glm::normalize(dvec3(-0.30, 0.05, 1));
    constexpr int kLayers = 3;
    constexpr std::array<int, kLayers> kCount{12, 10, 9};
    constexpr std::array<double, kLayers> kLength{1.0, 0.58, 0.30}, kWidth{0.088, 0.082, 0.070};
    for (const bool left : {false, true}) {
        const std::string side = left ? "left" : "right";
        const auto add = [&](std::string name, double share, double aspect,
                             std::function<SurfacePoint(double, double)> shape) {
            parts.push_back({std::move(name), Topology::Capped, weight * share, aspect,
                             left ? mirrored(std::move(shape)) : std::move(shape)});
        };
        const Sweep bone{arm,
                         Spline({{0.060, 0.045, 0},
                                 {0.055, 0.040, 0},
                                 {0.045, 0.034, 0},
                                 {0.040, 0.030, 0},
                                 {0.034, 0.024, 0},
                                 {0.02, 0.014, 0}}),
                         plane, 0.03, 0.08};
        add(side + " wing", 0.06, 0.35, [*this, bone](double u, double v) { return limb(bone, u, v, 1); });
        for (int layer = 0; layer < kLayers; ++layer) {
            for (int i = 0; i < kCount[size_t(layer)]; ++i) {
                const double t = (i + 0.5) / kCount[size_t(layer)];
                const uint64_t h = hash(seed_ ^ uint64_t(1000 * layer + i));
                const dvec3 root =
                    arm.at(0.12 + 0.88 * t) + plane * (0.016 * layer - 0.004 + 0.006 * (i % 2)) - dvec3(0, 0.01, 0);
                // The feathers turn from hanging down at the body to reaching out at the tip.
                const double lean = 0.02 + 0.165 * t * t + 0.004 * signedUnit(h);
                dvec3 along(sinTurns(lean), -cosTurns(lean), 0);
                along = glm::normalize(along - plane * glm::dot(along, plane));
                const double length = kLength[size_t(layer)] * (0.50 + 0.42 * t) * (1 + 0.05 * signedUnit(h, 21));
                const dvec3 outward = glm::cross(plane, along);
                const dvec3 sag = outward * (0.10 * length * (0.3 + t)) - plane * (0.05 * length);
                const auto at = [&](double d) { return root + along * (length * d) + sag * (d * d); };
                const double width = kWidth[size_t(layer)] * (1 + 0.10 * signedUnit(h, 42)), thick = 0.0065;
                const Sweep blade{Spline({at(0), at(0.2), at(0.4), at(0.6), at(0.8), at(1)}),
                                  Spline({{0.45 * width, thick, 0},
                                          {0.85 * width, thick, 0},
                                          {width, thick, 0},
                                          {width, 0.9 * thick, 0},
                                          {0.90 * width, 0.8 * thick, 0},
                                          {0.62 * width, 0.6 * thick, 0}}),
                                  glm::normalize(plane - 0.16 * outward), 0.05, 0.10};
                const double share = 0.30 * (length * width) / 0.95;
                const bool covert = layer > 0;
                add(side + " feather " + std::to_string(layer + 1) + "." + std::to_string(i + 1), share, 0.45,
                    [*this, blade, covert](double u, double v) { return feather(blade, u, v, covert); });
            }
        }
    }
}

void Statue::addLimbs(std::vector<Part>& parts) const {
    const Sweep right{Spline({{0.13, 1.37, -0.01},
                              {0.215, 1.405, 0},
                              {0.31, 1.45, 0.03},
                              {0.40, 1.53, 0.08},
                              {0.435, 1.64, 0.12},
                              {0.455, 1.76, 0.145},
                              {0.47, 1.85, 0.155},
                              {0.475, 1.93, 0.165}}),
                      Spline({{0.072, 0.072, 0},
                              {0.070, 0.070, 0},
                              {0.054, 0.056, 0},
                              {0.047, 0.048, 0},
                              {0.046, 0.047, 0},
                              {0.034, 0.034, 0},
                              {0.030, 0.036, 0},
                              {0.020, 0.034, 0}}),
                      dvec3(0, 0, 1), 0.03, 0.08};
    const Sweep left{Spline({{-0.13, 1.37, -0.01},
                             {-0.215, 1.40, -0.01},
                             {-0.275, 1.32, -0.01},
                             {-0.32, 1.20, 0.01},
                             {-0.34, 1.09, 0.06},
                             {-0.345, 1.08, 0.16},
                             {-0.345, 1.10, 0.25},
                             {-0.345, 1.12, 0.32}}),
                     Spline({{0.072, 0.072, 0},
                             {0.070, 0.070, 0},
                             {0.055, 0.056, 0},
                             {0.047, 0.048, 0},
                             {0.046, 0.046, 0},
                             {0.038, 0.038, 0},
                             {0.032, 0.036, 0},
                             {0.026, 0.038, 0}}),
                     dvec3(0.9, 0.3, 0.3), 0.03, 0.08};
    parts.push_back({"right arm", Topology::Capped, 0.020, 0.45,
                     [*this, right](double u, double v) { return limb(right, u, v, 0.5); }});
    parts.push_back({"left arm", Topology::Capped, 0.020, 0.45,
                     [*this, left](double u, double v) { return limb(left, u, v, 0.5); }});
    // A rod 4 mm thick whose triangles are far longer than wide.
    const Sweep rod{
        Spline(
            {{-0.36, -0.05, 0.36}, {-0.355, 0.6, 0.34}, {-0.35, 1.2, 0.32}, {-0.345, 1.8, 0.30}, {-0.34, 2.35, 0.28}}),
        Spline({{0.0065, 0.0065, 0}, {0.0065, 0.0065, 0}, {0.006, 0.006, 0}, {0.0055, 0.0055, 0}, {0.004, 0.004, 0}}),
        dvec3(0, 0, -1), 0.004, 0.08};
    parts.push_back(
        {"staff", Topology::Capped, 0.006, 1.5, [*this, rod](double u, double v) { return staff(rod, u, v); }});
}

}  // namespace

std::vector<Part> statue(uint64_t seed, double edge) {
    const auto shape = std::make_shared<const Statue>(seed, edge);
    std::vector<Part> parts;
    const auto add = [&](std::string name, Topology topology, double weight, double aspect,
                         std::function<SurfacePoint(double, double)> surface, std::vector<Hole> holes = {}) {
        parts.push_back({std::move(name), topology, weight, aspect, std::move(surface), std::move(holes)});
    };
    add("robe", Topology::Capped, 0.30, 1.8, [shape](double u, double v) { return shape->robe(u, v); });
    add("plinth", Topology::Capped, 0.20, 2.2, [shape](double u, double v) { return shape->plinth(u, v); });
    add("rock", Topology::Capped, 0.06, 3.0, [shape](double u, double v) { return shape->rock(u, v); });
    add("head", Topology::Capped, 0.050, 1.6, [shape](double u, double v) { return shape->head(u, v); });
    add("bun", Topology::Capped, 0.010, 1.6, [shape](double u, double v) { return shape->bun(u, v); });
    add("wreath", Topology::Torus, 0.020, 0.12, [shape](double u, double v) { return shape->wreath(u, v); });
    shape->addLimbs(parts);
    shape->addWings(parts, 0.23);
    add("shawl", Topology::Sheet, 0.08, 1.6, [shape](double u, double v) { return shape->shawl(u, v); },
        {{0.43, 0.60, 0.035, 0.07}, {0.60, 0.35, 0.02, 0.05}, {0.52, 0.82, 0.015, 0.04}});
    add("second pass, robe", Topology::Sheet, 0.015, 1.0,
        [shape](double u, double v) { return shape->secondPass(true, u, v); },
        {{0.3, 0.4, 0.10, 0.12}, {0.7, 0.6, 0.14, 0.09}});
    add("second pass, plinth", Topology::Sheet, 0.010, 1.0,
        [shape](double u, double v) { return shape->secondPass(false, u, v); }, {{0.5, 0.5, 0.18, 0.10}});
    add("ribbon", Topology::Strip, 0.004, 1.0, [shape](double u, double v) { return shape->ribbon(u, v); });
    double sum = 0;
    for (const Part& part : parts) sum += part.weight;
    for (Part& part : parts) part.weight /= sum;
    return parts;
}

}  // namespace vcp::scan
