#include "viewer/scene/option_values.h"

#include <charconv>
#include <cmath>

#include <fast_float/fast_float.h>
#include <fmt/format.h>

namespace vcp {

namespace {

/// Parses a number at the start of `text` and removes it.
template <class Number>
bool takeNumber(std::string_view& text, Number& number) {
    const char* end = text.data() + text.size();
    const char* stop = nullptr;
    if constexpr (std::is_floating_point_v<Number>) {
        const auto parsed = fast_float::from_chars(text.data(), end, number);
        if (parsed.ec != std::errc()) return false;
        stop = parsed.ptr;
    } else {
        const auto parsed = std::from_chars(text.data(), end, number);
        if (parsed.ec != std::errc()) return false;
        stop = parsed.ptr;
    }
    text.remove_prefix(size_t(stop - text.data()));
    return true;
}

}  // namespace

std::vector<double> parseNumbers(std::string_view text) {
    std::vector<double> numbers;
    for (;;) {
        if (!takeNumber(text, numbers.emplace_back()) || !std::isfinite(numbers.back())) return {};
        if (text.empty()) return numbers;
        if (!text.starts_with(',')) return {};
        text.remove_prefix(1);
    }
}

std::optional<PlaneChoice> parsePlane(std::string_view text) {
    PlaneChoice plane;
    if (const auto list = parseNumbers(text); list.size() == 4) {
        plane.normal = {list[0], list[1], list[2]};
        plane.offset = list[3];
        return plane.normal == glm::dvec3(0) ? std::nullopt : std::optional(plane);
    }
    if (text.size() < 3 || text[0] < 'x' || text[0] > 'z' || (text[1] != '<' && text[1] != '>')) return std::nullopt;
    const double sign = text[1] == '>' ? 1 : -1;
    plane.normal[text[0] - 'x'] = sign;
    text.remove_prefix(2);
    if (!takeNumber(text, plane.offset) || !std::isfinite(plane.offset)) return std::nullopt;
    plane.isRelative = text == "%";
    if (!plane.isRelative && !text.empty()) return std::nullopt;
    plane.offset *= plane.isRelative ? sign / 100 : sign;
    return plane;
}

double offsetIn(const PlaneChoice& plane, const Box& bounds) {
    if (!plane.isRelative) return plane.offset;
    // An axis' offset counts from the box's lower side, whichever side is kept.
    const glm::dvec3 axis = glm::abs(plane.normal);
    return glm::dot(plane.normal, bounds.low) + plane.offset * glm::dot(axis, bounds.high - bounds.low);
}

std::optional<Box> parseBox(std::string_view text) {
    const auto list = parseNumbers(text);
    if (list.size() != 6) return std::nullopt;
    const Box box{{list[0], list[1], list[2]}, {list[3], list[4], list[5]}};
    return glm::all(glm::lessThan(box.low, box.high)) ? std::optional(box) : std::nullopt;
}

std::optional<glm::dvec3> parseDirection(std::string_view text) {
    const auto list = parseNumbers(text);
    if (list.size() != 3) return std::nullopt;
    const glm::dvec3 direction(list[0], list[1], list[2]);
    return direction == glm::dvec3(0) ? std::nullopt : std::optional(direction);
}

std::optional<Length> parseLength(std::string_view text) {
    Length length;
    if (!takeNumber(text, length.value)) return std::nullopt;
    length.isRelative = text == "%";
    if (!length.isRelative && !text.empty()) return std::nullopt;
    if (length.isRelative) length.value /= 100;
    if (!(length.value > 0) || !std::isfinite(length.value)) return std::nullopt;
    return length;
}

std::optional<uint64_t> parseBytes(std::string_view text) {
    double number = 0;
    if (!takeNumber(text, number) || !(number > 0) || !std::isfinite(number)) return std::nullopt;
    if (!text.empty()) {
        constexpr std::string_view kPrefixes = "KMGT";
        const size_t power = kPrefixes.find(text.front() & ~0x20);
        if (power != std::string_view::npos) {
            number = std::ldexp(number, int(10 * (power + 1)));
            text.remove_prefix(1);
            if (text == "iB") text = {};
        }
        if (text == "B") text = {};
    }
    if (!text.empty() || number > 0x1p60 || number < 1) return std::nullopt;
    return uint64_t(number);
}

std::optional<uint64_t> parseBudget(std::string_view text) {
    const auto bytes = parseBytes(text);
    return bytes && *bytes >= 1 << 20 ? bytes : std::nullopt;
}

std::optional<uint64_t> parseMemory(std::string_view text, uint64_t whole) {
    if (!text.ends_with('%')) return parseBytes(text);
    double percent = 0;
    if (!takeNumber(text, percent) || text != "%" || !(percent > 0) || percent > 100) return std::nullopt;
    return uint64_t(percent / 100 * double(whole));
}

std::optional<uint64_t> parseCount(std::string_view text) {
    double number = 0;
    if (!takeNumber(text, number)) return std::nullopt;
    if (!text.empty()) {
        constexpr std::string_view kPrefixes = "KMG";
        const size_t power = kPrefixes.find(text.front() & ~0x20);
        if (power == std::string_view::npos || text.size() > 1) return std::nullopt;
        // There is a single product, rounded once, so that 1.1M is whole.
        constexpr double kFactors[] = {1e3, 1e6, 1e9};
        number *= kFactors[power];
    }
    if (!(number >= 1) || number > 1e15 || number != std::floor(number)) return std::nullopt;
    return uint64_t(number);
}

std::optional<glm::ivec2> parseSize(std::string_view text) {
    glm::ivec2 size(0);
    if (!takeNumber(text, size.x) || text.empty() || (text.front() != 'x' && text.front() != 'X')) return std::nullopt;
    text.remove_prefix(1);
    if (!takeNumber(text, size.y) || !text.empty()) return std::nullopt;
    if (size.x < 1 || size.y < 1 || size.x > kLargestSize || size.y > kLargestSize) return std::nullopt;
    return size;
}

std::string formatCount(uint64_t count) {
    if (count < 1000) return std::to_string(count);
    return formatCount(count / 1000) + fmt::format(" {:03}", count % 1000);
}

std::string formatCount(uint64_t count, std::string_view one, std::string_view many) {
    const std::string_view plural = many.empty() ? one : many;
    return fmt::format("{} {}{}", formatCount(count), count == 1 ? one : plural,
                       count == 1 || !many.empty() ? "" : "s");
}

std::string formatBytes(uint64_t bytes) {
    constexpr const char* kUnits[] = {"B", "kB", "MB", "GB", "TB", "PB", "EB"};
    double value = double(bytes);
    size_t unit = 0;
    while (value >= 999.95 && unit + 1 < std::size(kUnits)) value /= 1000, ++unit;
    return unit == 0 ? fmt::format("{} B", bytes) : fmt::format("{:.1f} {}", value, kUnits[unit]);
}

std::string formatLength(double length) { return fmt::format("{:.4g}", length); }

std::string formatSeconds(double seconds) {
    if (seconds < 60) return fmt::format("{:.2f} s", seconds);
    const auto whole = int64_t(seconds);
    if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
    return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::optional<double> secondsLeft(double seconds, double fraction, double begun) {
    const double done = fraction - begun;
    if (!(seconds > 1 && done > 0.01 * (1 - begun))) return std::nullopt;
    return seconds * (1 - fraction) / done;
}

std::string formatTimeLeft(double seconds) {
    return seconds < 59 ? fmt::format("{:.0f} s", std::ceil(seconds)) : formatSeconds(std::ceil(seconds));
}

}  // namespace vcp
