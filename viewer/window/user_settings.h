// What `vcp view` remembers: recent files, bookmarks, looks. They are in a small JSON file, which several windows
// share: each saves what was changed in it by hand, into the file as it is by then, and leaves the rest, even what this
// version does not know.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "octree/io/result.h"
#include "viewer/annotation/annotations.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {

enum class ThemeChoice { System, Light, Dark };

struct UserSettings {
    static constexpr size_t kMostRecent = 12;
    static constexpr size_t kMostBookmarks = 9;
    static constexpr size_t kMostBookmarkedFiles = 50;  ///< of annotated files as well

    std::vector<std::string> recent;  ///< absolute paths and addresses without passwords, the last one first
    std::map<std::string, std::map<int, OrbitCamera>> bookmarks;  ///< for each path or address; numbers 1 to 9
    std::map<std::string, std::vector<Annotation>> annotations;   ///< for each path or address, as changed by hand
    glm::ivec2 windowSize{1280, 800};
    bool panel = false;
    ThemeChoice theme = ThemeChoice::System;
    UpAxis up = UpAxis::Y;
    bool shadows = false, occlusion = false;
    double errorPixels = 0.5;
    uint64_t budgetBytes = 512ull << 20;
    bool hasBackground = false;                    ///< the background was chosen by hand; else the theme has one
    glm::vec3 backgroundTop{0.10f, 0.12f, 0.15f};  ///< linear
    glm::vec3 backgroundBottom{0.25f, 0.27f, 0.30f};

    /// Puts a remembered name to the front of `recent`.
    void remember(const std::string& name);
};

/// What was done by hand in one window. Changes by options, scene files and bookmarks are not among it.
struct SettingsChanges {
    std::vector<std::string> opened;                              ///< remembered names, in order
    std::map<std::string, std::map<int, OrbitCamera>> bookmarks;  ///< bookmarks that were kept: UserSettings::bookmarks
    std::map<std::string, std::vector<Annotation>> annotations;   ///< of files where they were changed, all of them
    std::optional<glm::ivec2> windowSize;
    std::optional<bool> panel, shadows, occlusion;
    std::optional<ThemeChoice> theme;
    std::optional<UpAxis> up;
    std::optional<double> errorPixels;
    std::optional<uint64_t> budgetBytes;
    std::optional<glm::vec3> backgroundTop, backgroundBottom;

    [[nodiscard]] bool empty() const;
};

/// Returns what a file is remembered as: an address without user and password, a path made absolute.
std::string rememberedName(const std::string& input);

/// Returns $XDG_CONFIG_HOME/vcp/view.json, else $HOME/.config/vcp/view.json. Errors: Io when neither is set.
Result<std::filesystem::path> userSettingsPath();

/// Reads settings, with defaults for what is missing, of a wrong type or out of range; the file may be hostile. Errors:
/// Io (exists and cannot be read, is no regular file), InvalidInput (not JSON, larger than 1 MiB). Without a file all
/// are defaults.
Result<UserSettings> readUserSettings(const std::filesystem::path& path);

/// Writes the changes into the file; makes it and its folder where needed; any number of processes may do so at once.
/// The file is replaced whole; where it is a symbolic link, its target is. A damaged file is kept beside it, as
/// view.json.damaged or with the next free number behind. Without changes nothing is done. Returns a warning, empty
/// where there is none. Errors: Io.
Result<std::string> saveChanges(const SettingsChanges& changes, const std::filesystem::path& path);

}  // namespace vcp
