// Procedural solids: signed distances, or functions that change by at most 1 a unit of length, so that their size
// bounds the distance to where they vanish (Hart 1996).
#include "mesostructure/solids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/periodic_noise.h"

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3, std::numbers::pi;

double capsule(dvec3 p, dvec3 a, dvec3 b, double radius) {
    const dvec3 ab = b - a;
    const double s = std::clamp(glm::dot(p - a, ab) / glm::dot(ab, ab), 0.0, 1.0);
    return glm::length(p - a - s * ab) - radius;
}

double box(dvec3 p, dvec3 half) {
    const dvec3 q = glm::abs(p) - half;
    return glm::length(glm::max(q, dvec3(0))) + std::min(0.0, std::max({q.x, q.y, q.z}));
}

/// Returns the distance to a disc with its axis along z.
double disc(dvec3 p, double radius, double half) {
    const dvec2 q(std::hypot(p.x, p.y) - radius, std::abs(p.z) - half);
    return glm::length(glm::max(q, dvec2(0))) + std::min(0.0, std::max(q.x, q.y));
}

double torus(double across, double other, double along, double major, double minor) {
    return std::hypot(std::hypot(across, other) - major, along) - minor;
}

/// Returns the least of `element(offset from the element's place, i, j)` over a lattice of nx x ny places in the tile.
/// Elements may reach `leak` out of their cells; a bound stands for what lies two cells away.
template <class Element>
double lattice(dvec3 p, int nx, int ny, double leak, const Element& element) {
    const int i = int(std::floor(p.x * nx)), j = int(std::floor(p.y * ny));
    double least = 1.0 / std::max(nx, ny) - leak;
    for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di) {
            const dvec3 place((i + di + 0.5) / nx, (j + dj + 0.5) / ny, 0);
            least = std::min(least, element(p - place, wrapped(i + di, nx), wrapped(j + dj, ny)));
        }
    return least;
}

double floorBelow(dvec3 p, double height) { return p.z - height; }

double beads(dvec3 p) {
    return std::min(floorBelow(p, 0.03),
                    lattice(p, 4, 4, 0, [](dvec3 q, int, int) { return glm::length(q - dvec3(0, 0, 0.13)) - 0.1; }));
}

// A bead as high as its tile is wide: in few cells it is still many cells wide.
double bead(dvec3 p) {
    return std::min(floorBelow(p, 0.12),
                    lattice(p, 1, 1, 0, [](dvec3 q, int, int) { return glm::length(q - dvec3(0, 0, 0.52)) - 0.4; }));
}

double ball(dvec3 p) {
    return lattice(p, 1, 1, 0, [](dvec3 q, int, int) { return glm::length(q - dvec3(0, 0, 0.1)) - 0.06; });
}

double chain(dvec3 p) {
    return lattice(p, 8, 2, 0.05, [](dvec3 q, int i, int) {
        q.z -= 0.125;
        return i & 1 ? torus(q.x, q.z, q.y, 0.085, 0.02) : torus(q.x, q.y, q.z, 0.085, 0.02);
    });
}

double weave(dvec3 p) {
    constexpr double swing = 0.035, radius = 0.032, middle = 0.125;
    const double lipschitz = std::sqrt(1 + swing * 8 * pi * swing * 8 * pi);
    double least = 1.0 / 8;
    for (int k = -1; k <= 1; ++k) {
        const int j = int(std::floor(8 * p.y)) + k, i = int(std::floor(8 * p.x)) + k;
        const double alongX = middle + (j & 1 ? -swing : swing) * std::sin(8 * pi * p.x),
                     alongY = middle - (i & 1 ? -swing : swing) * std::sin(8 * pi * p.y);
        least = std::min(least, std::hypot(p.y - (j + 0.5) / 8, p.z - alongX) - radius);
        least = std::min(least, std::hypot(p.x - (i + 0.5) / 8, p.z - alongY) - radius);
    }
    return least / lipschitz;
}

double bars(dvec3 p) {
    const auto toBar = [](double s) { return s - (std::floor(4 * s) + 0.5) / 4; };
    const auto square = [](double a, double b) { return box({a, b, 0}, {0.03, 0.03, 1}); };
    return std::min(square(toBar(p.y), p.z - 0.17), square(toBar(p.x), p.z - 0.07));
}

double scales(dvec3 p) {
    const double c = std::cos(0.3), s = std::sin(0.3);
    // There are two lattices, the second shifted by half a place.
    double least = 1;
    for (const double shift : {0.0, 0.5}) {
        const dvec3 moved = p - dvec3(shift / 4, shift / 4, 0);
        least = std::min(least, lattice(moved, 4, 4, 0.04, [&](dvec3 q, int, int) {
                             q.z -= 0.1;
                             return disc({c * q.x + s * q.z, q.y, c * q.z - s * q.x}, 0.15, 0.0055);
                         }));
    }
    return std::min(least, floorBelow(p, 0.02));
}

/// Returns a polynomial smooth minimum: its gradient is a mean of the two.
double smoothMin(double a, double b, double k) {
    const double h = std::max(k - std::abs(a - b), 0.0) / k;
    return std::min(a, b) - h * h * k * 0.25;
}

double kitten(dvec3 p) {
    const dvec3 q(p.x - std::floor(p.x), p.y - std::floor(p.y), p.z);
    double f = capsule(q, {0.5, 0.3, 0.16}, {0.5, 0.5, 0.18}, 0.12);        // body
    f = smoothMin(f, glm::length(q - dvec3(0.5, 0.68, 0.24)) - 0.1, 0.05);  // head
    for (const double side : {-1.0, 1.0}) {
        f = smoothMin(f, capsule(q, {0.5 + side * 0.05, 0.74, 0.3}, {0.5 + side * 0.075, 0.79, 0.37}, 0.022),
                      0.02);  // ears
        f = smoothMin(f, capsule(q, {0.5 + side * 0.1, 0.52, 0.14}, {0.5 + side * 0.13, 0.66, 0.07}, 0.035),
                      0.04);  // forelegs
        f = smoothMin(f, capsule(q, {0.5 + side * 0.11, 0.26, 0.12}, {0.5 + side * 0.18, 0.38, 0.07}, 0.045),
                      0.04);  // hind legs
    }
    f = smoothMin(f, glm::length(q - dvec3(0.5, 0.77, 0.22)) - 0.035, 0.03);         // muzzle
    f = smoothMin(f, capsule(q, {0.5, 0.2, 0.1}, {0.72, 0.14, 0.08}, 0.025), 0.04);  // tail
    f = smoothMin(f, capsule(q, {0.72, 0.14, 0.08}, {0.82, 0.24, 0.09}, 0.022), 0.02);
    return std::min({f, floorBelow(p, 0.03), 0.13});
}

double flakes(dvec3 p, uint32_t seed) {
    const double f = lattice(p, 6, 6, 0.07, [&](dvec3 q, int i, int j) {
        const double tilt = 0.25 + 0.5 * hashUnit(i, j, seed), turn = 2 * pi * hashUnit(i, j, seed + 1);
        const double x = std::cos(turn) * q.x + std::sin(turn) * q.y, y = std::cos(turn) * q.y - std::sin(turn) * q.x,
                     z = q.z - 0.06 - 0.06 * hashUnit(i, j, seed + 2);
        return box({std::cos(tilt) * x + std::sin(tilt) * z, y, std::cos(tilt) * z - std::sin(tilt) * x},
                   {0.1, 0.06, 0.01});
    });
    return std::min(f, floorBelow(p, 0.03));
}

double gyroid(dvec3 p) {
    const double k = 4 * pi;
    const dvec3 s(std::sin(k * p.x), std::sin(k * p.y), std::sin(k * p.z)),
        c(std::cos(k * p.x), std::cos(k * p.y), std::cos(k * p.z));
    const double sheet = (std::abs(s.x * c.y + s.y * c.z + s.z * c.x) - 0.35) / (k * std::sqrt(6.0));
    return std::max(sheet, std::abs(p.z - 0.125) - 0.1);
}

double sponge(dvec3 p) {
    double f = std::abs(p.z - 0.125) - 0.115;
    for (const int holes : {4, 12}) {
        const auto away = [&](double v) { return std::abs(v * holes - std::floor(v * holes) - 0.5) / holes; };
        const double x = away(p.x), y = away(p.y), z = away(p.z + 0.5 / holes), half = 1.0 / (6.0 * holes);
        const double cross = std::min({std::max(x, y), std::max(y, z), std::max(z, x)}) - half;
        f = std::max(f, -cross);
    }
    return f;
}

double blades(dvec3 p, uint32_t seed) {
    const double f = lattice(p, 10, 10, 0.06, [&](dvec3 q, int i, int j) {
        const double lean = 0.05 * hashUnit(i, j, seed), turn = 2 * pi * hashUnit(i, j, seed + 1);
        return capsule(q, {0, 0, 0.02},
                       {lean * std::cos(turn), lean * std::sin(turn), 0.15 + 0.08 * hashUnit(i, j, seed + 2)}, 0.003);
    });
    return std::min(f, floorBelow(p, 0.02));
}

constexpr std::array<std::string_view, 12> kSolidNames{"bead",   "beads",  "ball",   "chain",  "weave",  "bars",
                                                       "scales", "kitten", "flakes", "gyroid", "sponge", "blades"};

std::function<double(dvec3)> fieldNamed(std::string_view name, uint32_t seed) {
    if (name == "bead") return bead;
    if (name == "beads") return beads;
    if (name == "ball") return ball;
    if (name == "chain") return chain;
    if (name == "weave") return weave;
    if (name == "bars") return bars;
    if (name == "scales") return scales;
    if (name == "kitten") return kitten;
    if (name == "flakes") return [seed](dvec3 p) { return flakes(p, seed); };
    if (name == "gyroid") return gyroid;
    if (name == "sponge") return sponge;
    if (name == "blades") return [seed](dvec3 p) { return blades(p, seed); };
    return {};
}

class SolidShape final : public Shape {
public:
    explicit SolidShape(Solid solid) : Shape(solid.extent), field_(std::move(solid.field)) {}

    double field(dvec3 p) const override { return field_(p); }
    double distance(dvec3 p, double cap) const override { return std::min(cap, std::abs(field_(p))); }

    bool mayTouch(dvec3 lower, dvec3 upper) const override { return mayTouch(lower, upper, 4); }

    TruthHit trace(dvec3 origin, dvec3 direction, double tMax) const override {
        // Sphere tracing: steps by the field never pass the surface. A ray that starts inside first goes on to the way
        // out.
        bool outside = field_(origin) > -kNear;
        double t = 0, step = 0;
        for (int steps = 0; t <= tMax; t += step, ++steps) {
            if (steps == kMaxSteps) return {false, false, t, {}};
            const dvec3 p = origin + t * direction;
            if (p.z < 0 ? direction.z <= 0 : p.z > extent().z && direction.z >= 0) return {};
            const double f = field_(p);
            if (outside && f < kNear) return {true, true, t, normalAt(p)};
            if (!outside && f > kNear) outside = true;
            step = std::max(std::abs(f), kNear);
        }
        return {};
    }

private:
    static constexpr double kNear = 1e-10;
    static constexpr int kMaxSteps = 20000;

    bool mayTouch(dvec3 lower, dvec3 upper, int depth) const {
        const dvec3 half = 0.5 * (upper - lower), centre = lower + half;
        if (std::abs(field_(centre)) > glm::length(half)) return false;
        if (depth == 0) return true;
        for (int octant = 0; octant < 8; ++octant) {
            const dvec3 from(octant & 1 ? centre.x : lower.x, octant & 2 ? centre.y : lower.y,
                             octant & 4 ? centre.z : lower.z);
            if (mayTouch(from, from + half, depth - 1)) return true;
        }
        return false;
    }
    dvec3 normalAt(dvec3 p) const {
        constexpr double e = 1e-6;
        const dvec3 g(field_(p + dvec3(e, 0, 0)) - field_(p - dvec3(e, 0, 0)),
                      field_(p + dvec3(0, e, 0)) - field_(p - dvec3(0, e, 0)),
                      field_(p + dvec3(0, 0, e)) - field_(p - dvec3(0, 0, e)));
        const double size = glm::length(g);
        return size > 0 ? g / size : dvec3(0, 0, 1);
    }

    std::function<double(dvec3)> field_;
};

}  // namespace

std::span<const std::string_view> solidNames() { return kSolidNames; }

Result<Solid> makeSolid(std::string_view name, uint32_t seed) {
    Solid solid{{1, 1, name == "bead" ? 1 : name == "kitten" ? 0.5 : 0.25}, fieldNamed(name, seed)};
    if (!solid.field) return Error{.code = ErrorCode::Usage, .message = fmt::format("there is no solid \"{}\"", name)};
    return solid;
}

Result<std::unique_ptr<Shape>> solidShape(const std::string& name, uint32_t seed) {
    VCP_TRY_ASSIGN(auto solid, makeSolid(name, seed));
    return std::unique_ptr<Shape>(std::make_unique<SolidShape>(std::move(solid)));
}

}  // namespace vcp::meso
