// What keys and the mouse do in the window, for people: F1, `vcp help view` and docs/window.md show this table, and a
// test holds the last of them to it.
#pragma once

#include <span>
#include <string>

namespace vcp {

struct KeyHelp {
    const char* keys;
    const char* does;
};

std::span<const KeyHelp> keyMap();

/// Two columns of plain text.
std::string keyMapText();

}  // namespace vcp
