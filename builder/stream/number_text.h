// Numbers and words in the ASCII mesh formats: parsed in place, without locale and without copies.
#pragma once

#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>

#include <fast_float/fast_float.h>

namespace vcp {

/// What texts in UTF-8 may begin with.
inline constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";

/// Bytes of a line in a text: longer ones are refused.
inline constexpr size_t kLineLimit = 64 * 1024;

inline bool isSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }  // tab, LF, VT, FF, CR
inline bool isBlank(char c) { return isSpace(c) && c != '\n'; }

inline const char* skipBlanks(const char* p, const char* end) {
    while (p != end && isBlank(*p)) ++p;
    return p;
}

inline const char* skipSpaces(const char* p, const char* end) {
    while (p != end && isSpace(*p)) ++p;
    return p;
}

inline const char* wordEnd(const char* p, const char* end) {
    while (p != end && !isSpace(*p)) ++p;
    return p;
}

/// Skips a leading plus sign, which is common in mesh files, though from_chars refuses it.
inline const char* skipPlus(const char* p, const char* end) {
    return end - p > 1 && p[0] == '+' && p[1] != '-' && p[1] != '+' ? p + 1 : p;
}

/// Parses to the nearest double ("nan" and "inf" included; too large values become infinite). Returns where the number
/// ends, or nullptr when there is none.
inline const char* parseReal(const char* p, const char* end, double& value) {
    const auto [stop, failure] = fast_float::from_chars(skipPlus(p, end), end, value);
    return failure == std::errc() ? stop : nullptr;
}

/// Returns where the integer ends, or nullptr when there is none or it does not fit.
inline const char* parseInteger(const char* p, const char* end, int64_t& value) {
    constexpr int kSafeDigits = 18;  // cannot overflow
    p = skipPlus(p, end);
    const char* const start = p;
    const bool negative = p != end && *p == '-';
    if (negative) ++p;
    const char* const digits = p;
    int64_t magnitude = 0;
    for (; p != end && *p >= '0' && *p <= '9'; ++p) {
        if (p - digits == kSafeDigits) {
            const auto [stop, failure] = std::from_chars(start, end, value);
            return failure == std::errc() ? stop : nullptr;
        }
        magnitude = magnitude * 10 + (*p - '0');
    }
    value = negative ? -magnitude : magnitude;
    return p == digits ? nullptr : p;
}

/// Returns the number of leading bytes of `text` up to and including its last white space.
inline size_t afterLastSpace(std::string_view text) { return text.find_last_of(" \t\r\n\v\f") + 1; }

/// Returns a word of the file as an error message may show it: short, and without control characters.
inline std::string shown(std::string_view word) {
    constexpr size_t kLongest = 32;
    std::string text = "'";
    for (const char c : word.substr(0, kLongest)) text += c >= ' ' && c <= '~' ? c : '?';
    return text + (word.size() > kLongest ? "...'" : "'");
}

inline std::string shownWord(const char* p, const char* end) {
    return shown(std::string_view(p, size_t(wordEnd(p, end) - p)));
}

}  // namespace vcp
