#include "viewer/user_settings.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "streaming/http_reader.h"
#include "viewer/text_file.h"

namespace vcp {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

constexpr std::uintmax_t kLargestFile = 1 << 20;

/// Reads fields of an object; what is wrong leaves the value as it is.
class Fields {
public:
    explicit Fields(const Json& json) : json_(json) {}

    void flag(const char* name, bool& value) const {
        if (const Json* field = find(name); field && field->is_boolean()) value = field->get<bool>();
    }
    template <class Number>
    void number(const char* name, Number& value, double least, double most) const {
        const Json* field = find(name);
        if (!field || !field->is_number()) return;
        const double read = field->get<double>();
        if (read >= least && read <= most) value = static_cast<Number>(read);
    }
    void colour(const char* name, glm::vec3& value) const {
        const Json* field = find(name);
        if (!field || !field->is_array() || field->size() != 3) return;
        for (const Json& part : *field)
            if (!part.is_number() || !(part.get<double>() >= 0 && part.get<double>() <= 1)) return;
        for (int i = 0; i < 3; ++i) value[i] = (*field)[static_cast<size_t>(i)].get<float>();
    }
    [[nodiscard]] const Json* find(const char* name) const {
        const auto at = json_.find(name);
        return at == json_.end() ? nullptr : &*at;
    }

private:
    const Json& json_;
};

void readBookmarks(const Json& json, UserSettings& settings) {
    for (const auto& [file, views] : json.items()) {
        if (!views.is_object() || settings.bookmarks.size() >= UserSettings::kMostBookmarkedFiles) continue;
        for (const auto& [number, camera] : views.items()) {
            const auto read = cameraFromJson(camera.dump(), file);
            if (read && number.size() == 1 && number[0] >= '1' && number[0] <= '9') settings.bookmarks[file][number[0] - '0'] = *read;
        }
    }
}

UserSettings settingsFrom(const Json& json) {
    UserSettings settings;
    const Fields fields(json);
    if (const Json* recent = fields.find("recent"); recent && recent->is_array())
        for (const Json& each : *recent)
            if (each.is_string() && settings.recent.size() < UserSettings::kMostRecent) settings.recent.push_back(each.get<std::string>());
    if (const Json* bookmarks = fields.find("bookmarks"); bookmarks && bookmarks->is_object()) readBookmarks(*bookmarks, settings);
    fields.number("width", settings.windowSize.x, 64, 16384);
    fields.number("height", settings.windowSize.y, 64, 16384);
    fields.flag("panel", settings.panel);
    if (const Json* up = fields.find("up"); up && *up == "z") settings.up = UpAxis::Z;
    fields.flag("shadows", settings.shadows);
    fields.flag("occlusion", settings.occlusion);
    fields.number("error_pixels", settings.errorPixels, 0.01, 1000);
    fields.number("budget_bytes", settings.budgetBytes, 1 << 20, std::ldexp(1.0, 60));
    fields.colour("background_top", settings.backgroundTop);
    fields.colour("background_bottom", settings.backgroundBottom);
    return settings;
}

Json toJson(const UserSettings& settings) {
    const auto colour = [](glm::vec3 c) { return Json::array({c.x, c.y, c.z}); };
    Json json;
    json["recent"] = settings.recent;
    json["bookmarks"] = Json::object();
    for (const auto& [file, views] : settings.bookmarks)
        for (const auto& [number, camera] : views) json["bookmarks"][file][std::to_string(number)] = Json::parse(cameraToJson(camera));
    json["width"] = settings.windowSize.x;
    json["height"] = settings.windowSize.y;
    json["panel"] = settings.panel;
    json["up"] = settings.up == UpAxis::Z ? "z" : "y";
    json["shadows"] = settings.shadows;
    json["occlusion"] = settings.occlusion;
    json["error_pixels"] = settings.errorPixels;
    json["budget_bytes"] = settings.budgetBytes;
    json["background_top"] = colour(settings.backgroundTop);
    json["background_bottom"] = colour(settings.backgroundBottom);
    return json;
}

Error notWritten(const fs::path& path, const std::string& why) {
    return {ErrorCode::Io, "settings cannot be remembered: " + why, path.string()};
}

}  // namespace

std::string rememberedName(const std::string& input) {
    if (isHttpUrl(input)) return input;
    std::error_code failed;
    const fs::path absolute = fs::absolute(input, failed);
    return failed ? input : absolute.lexically_normal().string();
}

void UserSettings::remember(const std::string& input) {
    const std::string name = rememberedName(input);
    std::erase(recent, name);
    recent.insert(recent.begin(), name);
    if (recent.size() > kMostRecent) recent.resize(kMostRecent);
}

Result<fs::path> userSettingsPath() {
    const char* config = std::getenv("XDG_CONFIG_HOME");
    if (config && fs::path(config).is_absolute()) return fs::path(config) / "vcp" / "view.json";
    const char* home = std::getenv("HOME");
    if (home && *home) return fs::path(home) / ".config" / "vcp" / "view.json";
    return Error{ErrorCode::Io, "no folder for settings: set XDG_CONFIG_HOME or HOME"};
}

Result<UserSettings> readUserSettings(const fs::path& path) {
    std::error_code failed;
    if (!fs::exists(path, failed)) return UserSettings{};
    const auto text = readText(path, kLargestFile, "a file of settings");
    if (!text) return text.error();
    const Json json = Json::parse(*text, nullptr, false);
    if (!json.is_object()) return Error{ErrorCode::InvalidInput, "is no JSON object; what was remembered is lost", path.string()};
    return settingsFrom(json);
}

Result<void> writeUserSettings(const UserSettings& settings, const fs::path& path) {
    std::error_code failed;
    fs::create_directories(path.parent_path(), failed);
    if (failed) return notWritten(path, failed.message());
    fs::path partial = path;
    partial += fmt::format(".{}.partial", getpid());
    {
        std::ofstream file(partial, std::ios::binary);
        file << toJson(settings).dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
        if (!file.flush()) return notWritten(path, "cannot be written");
    }
    fs::rename(partial, path, failed);
    if (failed) return notWritten(path, failed.message());
    return {};
}

}  // namespace vcp
