#include "viewer/bench/stress/stress_path.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>

#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

constexpr double kVerticalFov = 0.6;
constexpr double kDiveCells = 32;
constexpr int kTeleportFrames = 10;
constexpr double kDefaultStallRate = 0.02;

/// Random numbers from 0 to below 1, the same everywhere.
class Random {
public:
    explicit Random(uint64_t seed) : engine_(seed) {}
    double unit() { return double(engine_() >> 11) * 0x1p-53; }
    double between(double low, double high) { return low + (high - low) * unit(); }
    glm::dvec3 direction() {
        const double z = between(-1, 1), angle = 2 * std::numbers::pi * unit(), r = std::sqrt(1 - z * z);
        return {r * std::cos(angle), z, r * std::sin(angle)};
    }

private:
    std::mt19937_64 engine_;
};

glm::dvec3 upFor(glm::dvec3 forward) {
    return std::abs(glm::normalize(forward).y) < 0.99 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
}

class Path {
public:
    explicit Path(const StressPathOptions& options)
        : o_(options), random_(options.seed), centre_(options.bounds.centre()) {
        fit_ = looking({0, -0.35, -1});
        reach_ = glm::length(fit_.eye - centre_);
    }

    Camera orbit(double t) const {
        const double angle = 2 * std::numbers::pi * t;
        return looking({std::sin(angle), -0.35, -std::cos(angle)});
    }
    Camera dive(double t) const {
        Camera camera = fit_;
        const glm::dvec3 back = glm::normalize(fit_.eye - o_.target);
        const double from = glm::length(fit_.eye - o_.target), to = std::min(kDiveCells * o_.cell, from);
        camera.eye = o_.target + back * (from * std::pow(to / from, t));
        return turned(camera, -back);
    }
    Camera fly(double t) const {
        Camera camera = fit_;
        const glm::dvec3 forward = glm::normalize(centre_ - fit_.eye);
        camera.eye = fit_.eye + forward * (2 * reach_ * t);
        return turned(camera, forward + glm::dvec3(0.3 * std::sin(4 * std::numbers::pi * t), 0, 0));
    }
    Camera teleport(int frame) {
        if (frame % kTeleportFrames == 0) {
            Camera camera = fit_;
            camera.eye = centre_ + random_.direction() * (reach_ * random_.between(0.05, 1));
            // It looks mostly towards the middle, now and then anywhere.
            const glm::dvec3 aim = random_.unit() < 0.8 ? centre_ - camera.eye + random_.direction() * (0.2 * reach_)
                                                        : random_.direction();
            last_ = turned(camera, aim);
        }
        return last_;
    }
    Camera jitter() {
        Camera camera = fit_;
        camera.eye = centre_ + (fit_.eye - centre_) * 0.5 + random_.direction() * (0.03 * reach_);
        return turned(camera, centre_ - camera.eye);
    }

private:
    [[nodiscard]] Camera looking(glm::dvec3 forward) const {
        return fitCamera(o_.bounds.low, o_.bounds.high, forward, upFor(forward), kVerticalFov,
                         double(o_.size.x) / o_.size.y);
    }
    static Camera turned(Camera camera, glm::dvec3 forward) {
        camera.forward = forward;
        camera.up = upFor(forward);
        return camera;
    }

    const StressPathOptions& o_;
    Random random_;
    glm::dvec3 centre_;
    Camera fit_, last_;
    double reach_ = 1;
};

std::optional<double> parseTime(std::string_view text) {
    const double unit = text.ends_with("ms") ? 1e-3 : 1;
    if (!text.ends_with('s')) return std::nullopt;
    text.remove_suffix(unit < 1 ? 2 : 1);
    double value = 0;
    const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failed != std::errc() || end != text.data() + text.size() || !(value >= 0) || value > 3600) return std::nullopt;
    return value * unit;
}

std::optional<double> parseRate(std::string_view text) {
    double value = 0;
    const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failed != std::errc() || end != text.data() + text.size() || !(value >= 0) || value > 1) return std::nullopt;
    return value;
}

}  // namespace

const std::vector<std::string>& stressPathNames() {
    static const std::vector<std::string> names = {"orbit", "dive", "fly", "teleport", "jitter"};
    return names;
}

std::optional<std::vector<Camera>> stressPath(const StressPathOptions& options) {
    const auto& names = stressPathNames();
    if (std::find(names.begin(), names.end(), options.name) == names.end()) return std::nullopt;
    Path path(options);
    std::vector<Camera> cameras;
    for (int frame = 0; frame < options.frames; ++frame) {
        const double t = options.frames > 1 ? double(frame) / (options.frames - 1) : 0;
        cameras.push_back(options.name == "orbit"      ? path.orbit(t)
                          : options.name == "dive"     ? path.dive(t)
                          : options.name == "fly"      ? path.fly(t)
                          : options.name == "teleport" ? path.teleport(frame)
                                                       : path.jitter());
    }
    return cameras;
}

std::optional<Faults> parseFaults(std::string_view text) {
    Faults faults;
    std::optional<double> stallRate;
    while (!text.empty()) {
        const std::string_view item = text.substr(0, text.find(','));
        text.remove_prefix(std::min(item.size() + 1, text.size()));
        const size_t equals = item.find('=');
        if (equals == std::string_view::npos) return std::nullopt;
        const std::string_view name = item.substr(0, equals), value = item.substr(equals + 1);
        const bool isTime = name == "stall" || name == "latency" || name == "spread";
        std::optional<double> number = isTime ? parseTime(value) : parseRate(value);
        if (name == "bandwidth") {
            const auto bytes = parseBytes(value);
            number = bytes ? std::optional(double(*bytes)) : std::nullopt;
        }
        if (!number) return std::nullopt;
        if (name == "error")
            faults.errorRate = *number;
        else if (name == "corrupt")
            faults.corruptRate = *number;
        else if (name == "stalls")
            stallRate = number;
        else if (name == "stall")
            faults.stallSeconds = *number;
        else if (name == "latency")
            faults.latencySeconds = *number;
        else if (name == "spread")
            faults.spreadSeconds = *number;
        else if (name == "bandwidth")
            faults.bytesPerSecond = *number;
        else
            return std::nullopt;
    }
    if (faults.stallSeconds > 0) faults.stallRate = stallRate.value_or(kDefaultStallRate);
    return faults;
}

}  // namespace vcp
