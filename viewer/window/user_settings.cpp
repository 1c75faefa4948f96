#include "viewer/window/user_settings.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <span>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include "octree/io/file_descriptor.h"
#include "octree/io/output_file.h"
#include "streaming/web_address.h"
#include "viewer/camera/text_file.h"
#include "viewer/scene/scene_file.h"

namespace vcp {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kLargestFile = 1 << 20;
constexpr int kMostDamaged = 100;
constexpr const char* kThemeNames[] = {"system", "light", "dark"};
// The tries take half a minute.
constexpr int kLockTries = 3000;
constexpr std::chrono::milliseconds kLockPause{10};

/// Reads fields of an object; a field that is wrong leaves the value as it is.
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
    /// Returns whether it is there.
    bool colour(const char* name, glm::vec3& value) const {
        const Json* field = find(name);
        if (!field || !field->is_array() || field->size() != 3) return false;
        for (const Json& part : *field)
            if (!part.is_number() || !(part.get<double>() >= 0 && part.get<double>() <= 1)) return false;
        for (int i = 0; i < 3; ++i) value[i] = (*field)[size_t(i)].get<float>();
        return true;
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
            if (read && number.size() == 1 && number[0] >= '1' && number[0] <= '9')
                settings.bookmarks[addressWithoutUser(file)][number[0] - '0'] = *read;
        }
    }
}

void readAnnotations(const Json& json, UserSettings& settings) {
    for (const auto& [file, points] : json.items()) {
        if (settings.annotations.size() >= UserSettings::kMostBookmarkedFiles) continue;
        const auto read = annotationsFromJson(points.dump(), file);
        if (read) settings.annotations[addressWithoutUser(file)] = *read;
    }
}

UserSettings settingsFrom(const Json& json) {
    UserSettings settings;
    const Fields fields(json);
    if (const Json* recent = fields.find("recent"); recent && recent->is_array())
        for (const Json& each : *recent)
            if (each.is_string() && settings.recent.size() < UserSettings::kMostRecent)
                settings.recent.push_back(addressWithoutUser(each.get<std::string>()));
    if (const Json* bookmarks = fields.find("bookmarks"); bookmarks && bookmarks->is_object())
        readBookmarks(*bookmarks, settings);
    if (const Json* annotations = fields.find("annotations"); annotations && annotations->is_object())
        readAnnotations(*annotations, settings);
    fields.number("width", settings.windowSize.x, 64, 16384);
    fields.number("height", settings.windowSize.y, 64, 16384);
    fields.flag("panel", settings.panel);
    for (int i = 0; i < int(std::size(kThemeNames)); ++i)
        if (const Json* theme = fields.find("theme"); theme && *theme == kThemeNames[i])
            settings.theme = static_cast<ThemeChoice>(i);
    if (const Json* up = fields.find("up"); up && *up == "z") settings.up = UpAxis::Z;
    fields.flag("shadows", settings.shadows);
    fields.flag("occlusion", settings.occlusion);
    fields.number("error_pixels", settings.errorPixels, 0.01, 1000);
    fields.number("budget_bytes", settings.budgetBytes, 1 << 20, std::ldexp(1.0, 60));
    const bool hasTop = fields.colour("background_top", settings.backgroundTop);
    settings.hasBackground = fields.colour("background_bottom", settings.backgroundBottom) || hasTop;
    return settings;
}

Json colourJson(glm::vec3 c) { return Json::array({c.x, c.y, c.z}); }

/// Adds names, the last one first; values that are no names stay behind them.
void addRecent(Json& json, const std::vector<std::string>& opened) {
    if (!json.is_array()) json = Json::array();
    for (const std::string& name : opened) {
        Json recent = Json::array({name});
        for (const Json& each : json) {
            const Json kept = each.is_string() ? Json(addressWithoutUser(each.get<std::string>())) : each;
            if (kept != Json(name) && recent.size() < UserSettings::kMostRecent) recent.push_back(kept);
        }
        json = std::move(recent);
    }
}

/// Adds bookmarks; where there are too many, the files whose bookmarks were kept longest ago lose theirs.
void addBookmarks(Json& json, const std::map<std::string, std::map<int, OrbitCamera>>& bookmarks) {
    if (!json.is_object()) json = Json::object();
    for (const auto& [file, views] : bookmarks) {
        Json of = json.contains(file) && json[file].is_object() ? json[file] : Json::object();
        for (const auto& [number, camera] : views) of[std::to_string(number)] = Json::parse(cameraToJson(camera));
        json.erase(file);
        json[file] = std::move(of);
        while (json.size() > UserSettings::kMostBookmarkedFiles) json.erase(json.begin());
    }
}

/// Puts the annotations of files in place of what was kept of them; the files that were annotated longest ago go where
/// there are too many.
void addAnnotations(Json& json, const std::map<std::string, std::vector<Annotation>>& annotations) {
    if (!json.is_object()) json = Json::object();
    for (const auto& [file, points] : annotations) {
        json.erase(file);
        json[file] = Json::parse(annotationsToJson(points));
        while (json.size() > UserSettings::kMostBookmarkedFiles) json.erase(json.begin());
    }
}

void applyChanges(const SettingsChanges& changes, Json& json) {
    if (!changes.opened.empty()) addRecent(json["recent"], changes.opened);
    if (!changes.bookmarks.empty()) addBookmarks(json["bookmarks"], changes.bookmarks);
    if (!changes.annotations.empty()) addAnnotations(json["annotations"], changes.annotations);
    const auto put = [&](const char* name, const auto& value) {
        if (value) json[name] = *value;
    };
    if (changes.windowSize) {
        json["width"] = changes.windowSize->x;
        json["height"] = changes.windowSize->y;
    }
    put("panel", changes.panel);
    if (changes.theme) json["theme"] = kThemeNames[size_t(*changes.theme)];
    if (changes.up) json["up"] = *changes.up == UpAxis::Z ? "z" : "y";
    put("shadows", changes.shadows);
    put("occlusion", changes.occlusion);
    put("error_pixels", changes.errorPixels);
    put("budget_bytes", changes.budgetBytes);
    if (changes.backgroundTop) json["background_top"] = colourJson(*changes.backgroundTop);
    if (changes.backgroundBottom) json["background_bottom"] = colourJson(*changes.backgroundBottom);
}

Error notSaved(const fs::path& path, const std::string& why) {
    return {ErrorCode::Io, "settings cannot be remembered: " + why, path.string()};
}

/// Makes an error that ends with what the system says.
Error notSaved(const fs::path& path, const char* what, int error) {
    return notSaved(path, fmt::format("{}: {}", what, std::generic_category().message(error)));
}

struct FileText {
    bool exists = false;
    std::string text;
    mode_t mode = 0600;  // the mode of a file that did not exist
};

/// Reads the file. Errors: Io (it exists and cannot be read), InvalidInput (too large).
Result<FileText> readFile(const fs::path& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0 && errno == ENOENT) return FileText{};
    auto text = readText(path, kLargestFile, "a file of settings, which has at most 1 MiB");
    if (text) return FileText{true, *std::move(text), status.st_mode & 0777};
    Error error = text.error();
    if (error.code == ErrorCode::Limit) error.code = ErrorCode::InvalidInput;
    return error;
}

/// Locks the folder of the settings, so that one process at a time reads and replaces them. A network file system locks
/// only files that are open for writing: there a file of our own beside them is locked.
class FolderLock {
public:
    static Result<FolderLock> of(const fs::path& settings) {
        const fs::path folder = settings.parent_path();
        FolderLock lock;
        lock.file_ = FileDescriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
        if (!lock.file_.isOpen()) return notSaved(settings, "its folder cannot be opened", errno);
        int refused = lock.hold();
        if (refused == 0) return lock;
        if (refused != EWOULDBLOCK) {
            lock.file_ = FileDescriptor(
                ::open(fs::path(settings.string() + ".lock").c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600));
            refused = lock.file_.isOpen() ? lock.hold() : errno;
        }
        if (refused == EWOULDBLOCK) return notSaved(settings, "another process holds them, and does not let go");
        // Where nothing can be locked, the settings are written without a lock.
        return lock;
    }

private:
    /// Returns 0, or why it is not locked. It does not wait for ever for a process that hangs.
    int hold() const {
        for (int tries = 0; ::flock(file_.number(), LOCK_EX | LOCK_NB) != 0; ++tries) {
            if (errno != EWOULDBLOCK && errno != EINTR) return errno;
            if (tries == kLockTries) return EWOULDBLOCK;
            std::this_thread::sleep_for(kLockPause);
        }
        return 0;
    }

    FileDescriptor file_;
};

/// Writes under a name that is not taken, then renames.
Result<void> replaceFile(const fs::path& path, const std::string& text, mode_t mode) {
    const auto failed = [&](const Error& error) { return notSaved(path, error.message); };
    auto file = OutputFile::create(path, OutputKind::JsonText, {.overwrite = true});
    if (!file) return failed(file.error());
    if (::fchmod(file->descriptor(), mode) != 0) return notSaved(path, "cannot be written", errno);
    if (const auto written = file->append(std::as_bytes(std::span(text))); !written) return failed(written.error());
    if (const auto committed = file->commit(); !committed) return failed(committed.error());
    return {};
}

/// Moves a file aside; returns the name that it has now.
Result<fs::path> putAside(const fs::path& path) {
    fs::path aside = path;
    aside += ".damaged";
    std::error_code failed;
    for (int number = 2; fs::symlink_status(aside, failed).type() != fs::file_type::not_found; ++number) {
        if (number > kMostDamaged) return notSaved(path, "it is damaged, as are many beside it");
        aside = path;
        aside += fmt::format(".damaged-{}", number);
    }
    if (::rename(path.c_str(), aside.c_str()) != 0)
        return notSaved(path, "it is damaged, and cannot be put aside", errno);
    return aside;
}

}  // namespace

std::string rememberedName(const std::string& input) {
    if (isHttpUrl(input)) return addressWithoutUser(input);
    std::error_code failed;
    const fs::path absolute = fs::absolute(input, failed);
    return failed ? input : absolute.lexically_normal().string();
}

void UserSettings::remember(const std::string& name) {
    std::erase(recent, name);
    recent.insert(recent.begin(), name);
    if (recent.size() > kMostRecent) recent.resize(kMostRecent);
}

bool SettingsChanges::empty() const {
    return opened.empty() && bookmarks.empty() && annotations.empty() && !windowSize && !panel && !theme && !shadows &&
           !occlusion && !up && !errorPixels && !budgetBytes && !backgroundTop && !backgroundBottom;
}

Result<fs::path> userSettingsPath() {
    const char* config = std::getenv("XDG_CONFIG_HOME");
    if (config && fs::path(config).is_absolute()) return fs::path(config) / "vcp" / "view.json";
    const char* home = std::getenv("HOME");
    if (home && *home) return fs::path(home) / ".config" / "vcp" / "view.json";
    return Error{.code = ErrorCode::Io, .message = "no folder for settings: set XDG_CONFIG_HOME or HOME"};
}

Result<UserSettings> readUserSettings(const fs::path& path) {
    VCP_TRY_ASSIGN(const auto file, readFile(path));
    if (!file.exists) return UserSettings{};
    const Json json = Json::parse(file.text, nullptr, false);
    if (!json.is_object())
        return Error{.code = ErrorCode::InvalidInput, .message = "is no JSON object", .file = path.string()};
    return settingsFrom(json);
}

Result<std::string> saveChanges(const SettingsChanges& changes, const fs::path& where) {
    if (changes.empty()) return std::string();
    std::error_code failed;
    const fs::path path = fs::absolute(where, failed);
    fs::create_directories(path.parent_path(), failed);
    if (failed) return notSaved(path, failed.message());
    const auto target = linkTarget(path);
    if (!target) return notSaved(path, target.error().message);
    VCP_TRY_ASSIGN(const auto lock, FolderLock::of(*target));
    const auto before = readFile(*target);
    if (!before && before.error().code != ErrorCode::InvalidInput) return notSaved(path, before.error().message);
    Json json = !before ? Json() : before->exists ? Json::parse(before->text, nullptr, false) : Json::object();
    std::string warning;
    if (!json.is_object()) {
        VCP_TRY_ASSIGN(const auto aside, putAside(*target));
        warning = fmt::format("{}: was no file of settings; it is kept as {}, and a new one is begun", path.string(),
                              aside.string());
        json = Json::object();
    }
    applyChanges(changes, json);
    VCP_TRY(replaceFile(*target, json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n',
                        before ? before->mode : 0600));
    return warning;
}

}  // namespace vcp
