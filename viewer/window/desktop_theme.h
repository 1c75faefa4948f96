// Whether the desktop asks for dark windows or for light ones.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace vcp {

/// Returns an environment variable, empty where it is not set.
using Environment = std::function<std::string(const char*)>;

/// Returns what GTK_THEME says, else what `portal` says, else the settings files of GTK 4, GTK 3 and KDE in `config`;
/// nothing where none does. `portal` is asked only where it matters. Files are read up to 64 KiB and may hold anything.
std::optional<bool> desktopIsDark(const Environment& variable, const std::filesystem::path& config,
                                  const std::function<std::optional<bool>()>& portal);

/// A program and its arguments.
using ProgramCall = std::vector<std::string>;
/// The programs that ask the desktop's portal for the setting color-scheme of org.freedesktop.appearance, by D-Bus.
const std::vector<ProgramCall>& portalCalls();

/// Runs programs one after the other, until one prints an answer that ends in 1 (dark) or 2 (light). Returns nothing
/// where none does. What takes longer than `most`, all together, is killed. Any thread.
std::optional<bool> portalIsDark(const std::vector<ProgramCall>& calls, std::chrono::milliseconds most);

/// Returns what the desktop of this process asks for. Takes up to a second. Any thread.
std::optional<bool> askDesktop();

}  // namespace vcp
