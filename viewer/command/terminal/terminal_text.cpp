#include "viewer/command/terminal/terminal_text.h"

#include <cstdint>

#include <fmt/format.h>

namespace vcp {

namespace {

struct Character {
    uint32_t code = 0;
    size_t bytes = 1;
    bool valid = false;
};

/// Returns the first character of a text that is not empty. A byte that is not UTF-8 counts as one character.
Character firstOf(std::string_view text) {
    const auto byte = [&](size_t i) { return uint8_t(text[i]); };
    const uint8_t lead = byte(0);
    if (lead < 0x80) return {lead, 1, true};
    const size_t bytes = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
    if (lead < 0xc2 || lead > 0xf4 || text.size() < bytes) return {};
    uint32_t code = lead & (0x7fu >> bytes);
    for (size_t i = 1; i < bytes; ++i) {
        if ((byte(i) & 0xc0) != 0x80) return {};
        code = code << 6 | (byte(i) & 0x3fu);
    }
    // Overlong forms, halves of surrogate pairs and codes beyond Unicode are no characters.
    constexpr uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
    if (code < kLeast[bytes] || (code >= 0xd800 && code < 0xe000) || code > 0x10ffff) return {};
    return {code, bytes, true};
}

bool isShown(const Character& c) {
    if (!c.valid || c.code < 0x20 || (c.code >= 0x7f && c.code < 0xa0)) return false;
    const bool turns = c.code == 0x61c || c.code == 0x200e || c.code == 0x200f ||
                       (c.code >= 0x202a && c.code <= 0x202e) || (c.code >= 0x2066 && c.code <= 0x2069);
    return !turns && c.code != 0x2028 && c.code != 0x2029;
}

template <class Spell>
std::string escaped(std::string_view text, bool keepLines, Spell&& spell) {
    std::string shown;
    shown.reserve(text.size());
    while (!text.empty()) {
        const Character c = firstOf(text);
        const std::string_view bytes = text.substr(0, c.bytes);
        if (isShown(c) || (keepLines && bytes == "\n"))
            shown += bytes;
        else
            shown += spell(c, bytes);
        text.remove_prefix(c.bytes);
    }
    return shown;
}

std::string byBytes(const Character&, std::string_view bytes) {
    std::string text;
    for (const char byte : bytes) text += fmt::format("\\x{:02x}", uint8_t(byte));
    return text;
}

}  // namespace

std::string terminalText(std::string_view text) { return escaped(text, false, byBytes); }
std::string terminalLines(std::string_view text) { return escaped(text, true, byBytes); }

std::string terminalJson(std::string_view json) {
    // None of these characters has more than 16 bits, and outside of strings there are only line breaks.
    return escaped(json, true, [](const Character& c, std::string_view) {
        return fmt::format("\\u{:04x}", c.valid ? c.code : 0xfffdu);
    });
}

}  // namespace vcp
