#include "mesostructure/base_tubes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include <glm/geometric.hpp>

#include "mesostructure/base_sheet.h"

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3, std::numbers::pi;

/// Where a tube goes through, and how wide it is there.
struct Knot {
    dvec3 centre;
    dvec2 radii;  ///< across, which is `beside` x the curve, and athwart that; both 0: the tube is closed
};

struct Tube {
    std::vector<Knot> knots;
    dvec3 beside;  ///< no direction of the curve
    int around = 0, along = 0;
};

/// Returns the curve at a parameter from 0 to 1 (Catmull and Rom 1974).
Knot knotAt(std::span<const Knot> knots, double v) {
    const double at = v * double(knots.size() - 1);
    const size_t i = std::min(size_t(at), knots.size() - 2);
    const double t = at - double(i);
    const auto between = [&](auto Knot::*of) {
        const auto p1 = knots[i].*of, p2 = knots[i + 1].*of, p0 = i > 0 ? knots[i - 1].*of : p1,
                   p3 = i + 2 < knots.size() ? knots[i + 2].*of : p2;
        return 0.5 * (2.0 * p1 +
                      t * (p2 - p0 + t * (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3 + t * (3.0 * p1 - p0 - 3.0 * p2 + p3))));
    };
    return {between(&Knot::centre), glm::max(between(&Knot::radii), dvec2(0))};
}

double roundOf(const Knot& knot) { return 2 * pi * std::sqrt(0.5 * glm::dot(knot.radii, knot.radii)); }

/// Returns how far it is round a tube, on the mean along its knots.
double meanRound(const Tube& tube) {
    double sum = 0;
    for (int i = 0; i <= 64; ++i) sum += roundOf(knotAt(tube.knots, i / 64.0)) / 65;
    return sum;
}

/// `across`: tile edges round the tube.
void addTube(BaseSurface& to, const Tube& tube, double across) {
    std::vector<double> lengths{0};  // up to each row
    for (int j = 0; j < tube.along; ++j)
        lengths.push_back(lengths.back() + glm::distance(knotAt(tube.knots, double(j) / tube.along).centre,
                                                         knotAt(tube.knots, double(j + 1) / tube.along).centre));
    const double edges = across / meanRound(tube);
    addSheet(
        to, tube.around, tube.along,
        [&](double u, double v) {
            constexpr double kStep = 1e-4;
            const Knot knot = knotAt(tube.knots, v);
            const dvec3 along = glm::normalize(knotAt(tube.knots, std::min(v + kStep, 1.0)).centre -
                                               knotAt(tube.knots, std::max(v - kStep, 0.0)).centre),
                        x = glm::normalize(glm::cross(tube.beside, along)), y = glm::cross(along, x);
            return knot.centre + knot.radii.x * std::cos(2 * pi * u) * x + knot.radii.y * std::sin(2 * pi * u) * y;
        },
        [&](double u, double v) { return dvec2(across * u, edges * lengths[size_t(std::lround(v * tube.along))]); });
}

std::vector<Tube> vase() {
    // The foot is closed, the mouth is open.
    return {{{{{0, 0, -1.2}, {0, 0}},
              {{0, 0, -1.17}, {0.4, 0.4}},
              {{0, 0, -1.08}, {0.47, 0.47}},
              {{0, 0, -0.7}, {0.68, 0.68}},
              {{0, 0, -0.2}, {0.8, 0.8}},
              {{0, 0, 0.3}, {0.66, 0.66}},
              {{0, 0, 0.65}, {0.38, 0.38}},
              {{0, 0, 0.9}, {0.28, 0.28}},
              {{0, 0, 1.1}, {0.36, 0.36}},
              {{0, 0, 1.2}, {0.48, 0.48}}},
             {0, 1, 0},
             60,
             72}};
}

Tube mirrored(Tube tube) {
    for (Knot& knot : tube.knots) knot.centre.y = -knot.centre.y;
    return tube;
}

std::vector<Tube> bird() {
    const Tube body{{{{-1.4, 0, 0.1}, {0, 0}},
                     {{-1.35, 0, 0.1}, {0.15, 0.025}},
                     {{-1, 0, 0.06}, {0.17, 0.05}},
                     {{-0.7, 0, 0.03}, {0.15, 0.11}},
                     {{-0.35, 0, 0}, {0.27, 0.27}},
                     {{0.05, 0, 0}, {0.36, 0.36}},
                     {{0.4, 0, 0.1}, {0.3, 0.32}},
                     {{0.6, 0, 0.25}, {0.2, 0.21}},
                     {{0.8, 0, 0.4}, {0.19, 0.19}},
                     {{0.96, 0, 0.43}, {0.12, 0.12}},
                     {{1.06, 0, 0.41}, {0.05, 0.05}},
                     {{1.2, 0, 0.37}, {0.02, 0.02}},
                     {{1.23, 0, 0.36}, {0, 0}}},
                    {0, 0, 1},
                    64,
                    60};
    const Tube wing{{{{0.05, 0.12, 0.1}, {0, 0}},
                     {{0.05, 0.18, 0.11}, {0.07, 0.28}},
                     {{0.02, 0.5, 0.2}, {0.06, 0.32}},
                     {{-0.05, 0.85, 0.3}, {0.05, 0.28}},
                     {{-0.18, 1.2, 0.33}, {0.035, 0.2}},
                     {{-0.29, 1.42, 0.33}, {0.025, 0.11}},
                     {{-0.33, 1.5, 0.33}, {0, 0}}},
                    {1, 0, 0},
                    32,
                    30};
    return {body, wing, mirrored(wing)};
}

std::vector<Tube> dinosaur() {
    const Tube body{{{{-2.2, 0, 0.35}, {0, 0}},
                     {{-2.1, 0, 0.35}, {0.04, 0.04}},
                     {{-1.6, 0, 0.42}, {0.1, 0.11}},
                     {{-1, 0, 0.62}, {0.2, 0.23}},
                     {{-0.4, 0, 0.8}, {0.36, 0.42}},
                     {{0.15, 0, 0.85}, {0.42, 0.5}},
                     {{0.6, 0, 0.97}, {0.3, 0.36}},
                     {{0.95, 0, 1.27}, {0.19, 0.21}},
                     {{1.2, 0, 1.6}, {0.15, 0.16}},
                     {{1.45, 0, 1.83}, {0.16, 0.15}},
                     {{1.75, 0, 1.87}, {0.13, 0.11}},
                     {{1.95, 0, 1.84}, {0.08, 0.07}},
                     {{2.02, 0, 1.83}, {0, 0}}},
                    {0, 0, 1},
                    24,
                    28};
    const auto leg = [](double x, double wide) {
        return Tube{{{{x, 0.24, 0.7}, {0, 0}},
                     {{x, 0.25, 0.62}, {wide * 0.13, wide * 0.16}},
                     {{x + 0.02, 0.27, 0.4}, {wide * 0.11, wide * 0.12}},
                     {{x, 0.28, 0.15}, {wide * 0.09, wide * 0.1}},
                     {{x + 0.03, 0.28, 0.04}, {wide * 0.1, wide * 0.14}},
                     {{x + 0.03, 0.28, 0}, {0, 0}}},
                    {1, 0, 0},
                    10,
                    10};
    };
    const Tube fore = leg(0.4, 1), hind = leg(-0.3, 1.25);
    return {body, fore, mirrored(fore), hind, mirrored(hind)};
}

/// Returns a branch that leaves at a place, in a direction round z, and bends upwards.
Tube branch(dvec3 from, double turn, double reach, double wide, int around, int along) {
    const dvec3 out(std::cos(turn), std::sin(turn), 0), up(0, 0, 1);
    const auto at = [&](double far, double high, double width) {
        return Knot{from + reach * (far * out + high * up), dvec2(wide * width)};
    };
    return {{at(0, 0, 0), at(0.06, 0.02, 1), at(0.35, 0.2, 0.85), at(0.65, 0.5, 0.65), at(0.9, 0.85, 0.4),
             at(1.02, 1.1, 0.2), at(1.05, 1.17, 0)},
            {-out.y, out.x, 0},
            around,
            along};
}

std::vector<Tube> tree() {
    std::vector<Tube> all{{{{{0, 0, -1.2}, {0.5, 0.5}},
                            {{0, 0, -1}, {0.36, 0.36}},
                            {{0.03, 0, -0.5}, {0.27, 0.26}},
                            {{-0.03, 0.02, 0}, {0.23, 0.23}},
                            {{0.02, -0.02, 0.5}, {0.19, 0.19}},
                            {{0, 0, 1}, {0.13, 0.13}},
                            {{0.04, 0, 1.45}, {0.06, 0.06}},
                            {{0.05, 0, 1.6}, {0, 0}}},
                           {0, 1, 0},
                           48,
                           60}};
    constexpr int kBranches = 6;
    for (int i = 0; i < kBranches; ++i) {
        const double turn = 2.4 * i, reach = 0.95 - 0.07 * i;
        const dvec3 from(0, 0, -0.25 + 0.2 * i);
        all.push_back(branch(from, turn, reach, 0.11 - 0.006 * i, 32, 24));
        const dvec3 fork = from + reach * dvec3(0.6 * std::cos(turn), 0.6 * std::sin(turn), 0.45);
        all.push_back(branch(fork, turn + (i % 2 == 0 ? 1.1 : -1.1), 0.45 * reach, 0.05, 24, 16));
    }
    return all;
}

}  // namespace

std::optional<BaseSurface> makeTubes(std::string_view name, double tiles) {
    std::vector<Tube> tubes;
    if (name == "vase") tubes = vase();
    if (name == "bird") tubes = bird();
    if (name == "dinosaur") tubes = dinosaur();
    if (name == "tree") tubes = tree();
    if (tubes.empty()) return std::nullopt;
    double most = 0;
    for (const Tube& tube : tubes) most = std::max(most, meanRound(tube));
    BaseSurface made;
    for (const Tube& tube : tubes) addTube(made, tube, tiles * std::max(1.0, std::round(2 * meanRound(tube) / most)));
    return made;
}

}  // namespace vcp::meso
