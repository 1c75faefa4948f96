// What reaches a terminal: shown as it is, or spelled out.
#include "viewer/command/terminal/terminal_text.h"

#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace vcp {
namespace {

using namespace std::string_literals;

TEST(TerminalText, WhatIsShownStays) {
    for (const std::string text :
         {"", "a plain line; 100 % of it", "Größe, 測量, Δ, 🗿, e\u0301", "C:\\scans\\x1b.ply"}) {
        EXPECT_EQ(terminalText(text), text);
        EXPECT_EQ(terminalLines(text), text);
        EXPECT_EQ(terminalJson(text), text);
    }
}

TEST(TerminalText, ControlsAreSpelledOut) {
    EXPECT_EQ(terminalText("\x1b]0;owned\x07"), "\\x1b]0;owned\\x07");
    EXPECT_EQ(terminalText("a\rb\nc\td\x7f\0e"s), "a\\x0db\\x0ac\\x09d\\x7f\\x00e");
    EXPECT_EQ(terminalText("\u009b31m"), "\\xc2\\x9b31m") << "C1: CSI in two bytes";
    EXPECT_EQ(terminalText("\x9b"
                           "31m"),
              "\\x9b31m")
        << "C1: CSI in one byte is not UTF-8";
    EXPECT_EQ(terminalText("gpj.\u202eply"), "gpj.\\xe2\\x80\\xaeply");
    EXPECT_EQ(terminalText("\u2066a\u2028b\u200f"), "\\xe2\\x81\\xa6a\\xe2\\x80\\xa8b\\xe2\\x80\\x8f");
    EXPECT_EQ(terminalLines("a\nb\r\n"), "a\nb\\x0d\n");
}

TEST(TerminalText, WhatIsNoUtf8IsSpelledOut) {
    EXPECT_EQ(terminalText("\xff\xfe"), "\\xff\\xfe");
    EXPECT_EQ(terminalText("a\xc3"), "a\\xc3") << "cut off";
    EXPECT_EQ(terminalText("\xc0\x9b"), "\\xc0\\x9b") << "too long a form";
    EXPECT_EQ(terminalText("\xe0\x82\x9b"), "\\xe0\\x82\\x9b") << "too long a form";
    EXPECT_EQ(terminalText("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "half of a pair";
    EXPECT_EQ(terminalText("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond Unicode";
    EXPECT_EQ(terminalText("\xe2\x82(\x80"), "\\xe2\\x82(\\x80");
}

TEST(TerminalText, JsonKeepsItsMeaning) {
    const nlohmann::json json = {{"name", "\u009b\x7f\u202e\x1b é"}};
    for (const int indent : {-1, 2}) {
        const std::string shown = terminalJson(json.dump(indent));
        EXPECT_EQ(nlohmann::json::parse(shown), json);
        EXPECT_EQ(shown.find('\x7f'), std::string::npos);
        EXPECT_NE(shown.find("\\u009b"), std::string::npos);
        EXPECT_NE(shown.find("\\u202e"), std::string::npos);
        EXPECT_NE(shown.find("é"), std::string::npos);
    }
}

/// Any bytes become UTF-8 without a control character, which stays the same when it is escaped again.
TEST(TerminalText, AnyBytes) {
    for (uint32_t seed = 0; seed < 2000; ++seed) {
        std::mt19937 random(seed);
        std::string bytes(random() % 40, '\0');
        for (char& byte : bytes) byte = char(random());
        const std::string shown = terminalText(bytes);
        for (const char byte : shown) ASSERT_FALSE(uint8_t(byte) < 0x20 || byte == 0x7f) << seed;
        ASSERT_NO_THROW((void)nlohmann::json(shown).dump()) << seed;
        ASSERT_EQ(terminalText(shown), shown) << seed;
    }
}

}  // namespace
}  // namespace vcp
