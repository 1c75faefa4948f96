// The keys and what they do, and what keys and mouse do in the window, as text: F1, `vcp help view` and docs/window.md
// show this table, and a test compares docs/window.md with it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "viewer/viewer.h"

namespace vcp {

enum class KeyGroup { Mouse, View, Look, Measure, Save, Window };
const char* nameOf(KeyGroup group);

struct KeyHelp {
    KeyGroup group;
    const char* keys;
    const char* does;
};

std::span<const KeyHelp> keyMap();

/// Returns what a key does to the view. `key`: the character on it in capitals. Keys of the window itself (measuring,
/// panels) have no action.
std::optional<ViewerAction> actionOf(uint32_t key);
/// Handles the keys that fly, W A S D E Q, which may be held together: `held` is the direction (Viewer::fly). Returns
/// false where the key is none of them.
bool holdFlyKey(glm::dvec3& held, uint32_t key, bool isPressed);

/// Returns the table as two columns of plain text.
std::string keyMapText();

}  // namespace vcp
