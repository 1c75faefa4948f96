// What `vcp view` remembers: recent files, bookmarks, looks. A small JSON file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "octree/result.h"
#include "viewer/orbit_camera.h"

namespace vcp {

struct UserSettings {
    static constexpr size_t kMostRecent = 12;
    static constexpr size_t kMostBookmarks = 9;
    static constexpr size_t kMostBookmarkedFiles = 50;

    std::vector<std::string> recent;  ///< absolute paths and addresses without passwords, the last one first
    std::map<std::string, std::map<int, OrbitCamera>> bookmarks;  ///< of a path or address; numbers 1 to 9
    glm::ivec2 windowSize{1280, 800};
    bool panel = false;
    UpAxis up = UpAxis::Y;
    bool shadows = false, occlusion = false;
    double errorPixels = 0.5;
    uint64_t budgetBytes = 512ull << 20;
    glm::vec3 backgroundTop{0.10f, 0.12f, 0.15f};  ///< linear
    glm::vec3 backgroundBottom{0.25f, 0.27f, 0.30f};

    /// Puts an input to the front of `recent`; a path becomes absolute.
    void remember(const std::string& input);
};

/// What a file is remembered as: an address without user and password, a path made absolute.
std::string rememberedName(const std::string& input);

/// $XDG_CONFIG_HOME/vcp/view.json, else $HOME/.config/vcp/view.json. Errors: Io when neither is set.
Result<std::filesystem::path> userSettingsPath();

/// Defaults for what is missing, of a wrong type or out of range; may be hostile. Errors: Io (exists and cannot be
/// read), InvalidInput (not JSON). A file that is not there gives the defaults.
Result<UserSettings> readUserSettings(const std::filesystem::path& path);

/// Makes the folder where needed; the file is replaced whole. Errors: Io.
Result<void> writeUserSettings(const UserSettings& settings, const std::filesystem::path& path);

}  // namespace vcp
