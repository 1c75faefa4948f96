#include "builder/stream/data_uri.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace vcp {
namespace {

constexpr std::array<int8_t, 256> base64Values() {
    std::array<int8_t, 256> values{};
    values.fill(-1);
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < kDigits.size(); ++i) values[uint8_t(kDigits[i])] = int8_t(i);
    values['-'] = 62;  // the URL's variant
    values['_'] = 63;
    return values;
}

int hexDigit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

}  // namespace

std::optional<std::string> decodeDataUri(std::string_view uri) {
    static constexpr auto kValues = base64Values();
    const size_t comma = uri.find(',');
    if (!isDataUri(uri) || comma == std::string_view::npos || !uri.substr(0, comma).ends_with(";base64"))
        return std::nullopt;
    std::string_view digits = uri.substr(comma + 1);
    while (digits.ends_with('=')) digits.remove_suffix(1);
    if (digits.size() % 4 == 1) return std::nullopt;
    std::string data;
    data.reserve(digits.size() / 4 * 3 + 3);
    uint32_t bits = 0;
    int held = 0;
    for (const char digit : digits) {
        const int8_t value = kValues[uint8_t(digit)];
        if (value < 0) return std::nullopt;
        bits = bits << 6 | uint32_t(value);
        held += 6;
        if (held < 8) continue;
        held -= 8;
        data += char(bits >> held & 0xFF);
    }
    return data;
}

std::optional<std::filesystem::path> nameBelow(const std::filesystem::path& folder, std::string name,
                                               bool allowOutside) {
    std::ranges::replace(name, '\\', '/');
    const bool drive = name.size() > 1 && name[1] == ':';
    if (name.empty() || name.find('\0') != std::string::npos || drive) return std::nullopt;
    const std::filesystem::path path(name);
    const bool isOutside = path.is_absolute() || std::ranges::find(path, "..") != path.end();
    if (isOutside && !allowOutside) return std::nullopt;
    return folder / path;
}

std::optional<std::filesystem::path> fileBelow(const std::filesystem::path& folder, std::string_view uri,
                                               bool allowOutside) {
    const size_t colon = uri.find(':');
    if (colon != std::string_view::npos && colon < uri.find('/')) return std::nullopt;  // a scheme
    std::string name;
    for (size_t i = 0; i < uri.size(); ++i) {
        const int high = uri[i] == '%' && i + 2 < uri.size() ? hexDigit(uri[i + 1]) : -1;
        const int low = high >= 0 ? hexDigit(uri[i + 2]) : -1;
        if (low >= 0) {
            name += char(high * 16 + low);
            i += 2;
        } else {
            name += uri[i];
        }
    }
    return nameBelow(folder, std::move(name), allowOutside);
}

}  // namespace vcp
