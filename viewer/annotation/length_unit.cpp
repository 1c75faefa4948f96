#include "viewer/annotation/length_unit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace vcp {

namespace {

constexpr std::array<LengthUnit, 7> kUnits = {
    {{"um", 1e-3, 13}, {"mm", 1, 4}, {"cm", 10, 5}, {"m", 1e3, 6}, {"km", 1e6, 7}, {"in", 25.4, 1}, {"ft", 304.8, 2}}};
constexpr std::string_view kWritten[] = {"km", "m", "mm", "um"};  // from the largest on
// The micro sign, and the Greek letter that looks like it.
constexpr std::string_view kMicrometre = "\u00b5m", kMicrometreInGreek = "\u03bcm";
constexpr double kFew = 0.01, kMany = 10000;

/// Returns a unit's name as it is written in pictures and lines of text.
std::string_view symbolOf(std::string_view name) { return name == "um" ? kMicrometre : name; }

}  // namespace

std::optional<LengthUnit> unitNamed(std::string_view name) {
    if (name == kMicrometre || name == kMicrometreInGreek) name = "um";
    const auto found = std::ranges::find(kUnits, name, &LengthUnit::name);
    return found == kUnits.end() ? std::nullopt : std::optional(*found);
}

WrittenUnit writtenUnit(double length, const std::optional<LengthUnit>& unit) {
    if (!unit) return {};
    const double size = std::abs(length);
    const bool isMetric = unit->name != "in" && unit->name != "ft";
    if (!isMetric || size == 0 || (size >= kFew && size < kMany)) return {1, symbolOf(unit->name)};
    WrittenUnit written;
    for (const std::string_view name : kWritten) {
        written = {unit->millimetres / unitNamed(name)->millimetres, symbolOf(name)};
        // What is a whole one but for rounding is one.
        if (size * written.factor >= 1 - 1e-9) break;
    }
    return written;
}

std::string lengthText(double length, const std::optional<LengthUnit>& unit) {
    const WrittenUnit written = writtenUnit(length, unit);
    return fmt::format("{:.4g}{}{}", length * written.factor, written.name.empty() ? "" : " ", written.name);
}

}  // namespace vcp
