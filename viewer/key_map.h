// What keys do, and what keys and the mouse do in the window, for people: F1, `vcp help view` and docs/window.md show
// this table, and a test holds the last of them to it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "viewer/viewer.h"

namespace vcp {

struct KeyHelp {
    const char* keys;
    const char* does;
};

std::span<const KeyHelp> keyMap();

/// What a key does to the view: the character on it in capitals. Keys of the window itself (measuring, panels) have
/// none.
std::optional<ViewerAction> actionOf(uint32_t key);
/// The keys that fly, W A S D E Q, held together: `held` is which way they go (Viewer::fly). False: the key is none of
/// them.
bool holdFlyKey(glm::dvec3& held, uint32_t key, bool isPressed);

/// Two columns of plain text.
std::string keyMapText();

}  // namespace vcp
