#include "viewer/window/desktop_theme.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <csignal>
#include <cstdlib>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "octree/io/file_descriptor.h"
#include "viewer/camera/text_file.h"

extern char** environ;

namespace vcp {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr size_t kLargestFile = 64 << 10, kLongestAnswer = 256;
constexpr float kDarkestLight = 128;  // of a window's ground, 0 to 255: below it a theme is dark
constexpr std::chrono::milliseconds kLongestQuestion{1000};

std::string lowered(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

/// Returns the value of "key=value" in a section of an .ini file; empty where there is none. Keys in any case.
std::string valueOf(const std::string& ini, const std::string& section, const std::string& key) {
    bool isInside = false;
    for (size_t from = 0; from < ini.size();) {
        const size_t end = std::min(ini.find('\n', from), ini.size());
        std::string line = ini.substr(from, end - from);
        from = end + 1;
        std::erase_if(line, [](unsigned char c) { return std::isspace(c) != 0; });
        if (line.starts_with('[')) isInside = lowered(line) == "[" + section + "]";
        if (isInside && lowered(line).starts_with(key + "=")) return line.substr(key.size() + 1);
    }
    return {};
}

std::string textOf(const fs::path& file) {
    const auto text = readText(file, kLargestFile, "a file of settings");
    return text ? *text : std::string();
}

/// Returns whether a theme's name says that it is dark: "Adwaita:dark", "Yaru-dark", "BreezeDark".
bool namesDark(const std::string& theme) { return lowered(theme).find("dark") != std::string::npos; }

std::optional<bool> gtkIsDark(const fs::path& file) {
    const std::string ini = textOf(file);
    const std::string prefers = lowered(valueOf(ini, "settings", "gtk-application-prefer-dark-theme"));
    const std::string theme = valueOf(ini, "settings", "gtk-theme-name");
    if (prefers == "1" || prefers == "true" || namesDark(theme)) return true;
    if (!prefers.empty() || !theme.empty()) return false;
    return std::nullopt;
}

/// KDE notes the colours themselves: "BackgroundNormal=49,54,59".
std::optional<bool> kdeIsDark(const fs::path& file) {
    const std::string ini = textOf(file);
    const std::string ground = valueOf(ini, "colors:window", "backgroundnormal");
    float light = 0;
    const char* at = ground.c_str();
    for (int i = 0; i < 3; ++i) {
        char* end = nullptr;
        light += std::strtof(at, &end) / 3;
        if (end == at) {
            const std::string scheme = valueOf(ini, "general", "colorscheme");
            return scheme.empty() ? std::nullopt : std::optional(namesDark(scheme));
        }
        at = *end == ',' ? end + 1 : end;
    }
    return light < kDarkestLight;
}

/// A program that runs, killed at the end if it still does.
class Program {
public:
    explicit Program(const ProgramCall& call) {
        int ends[2];
        if (::pipe2(ends, O_CLOEXEC) != 0) return;
        said_ = FileDescriptor(ends[0]);
        const FileDescriptor output(ends[1]);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_adddup2(&actions, output.number(), STDOUT_FILENO);
        posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
        std::vector<char*> texts;
        for (const std::string& each : call) texts.push_back(const_cast<char*>(each.c_str()));
        texts.push_back(nullptr);
        if (::posix_spawnp(&process_, texts[0], &actions, nullptr, texts.data(), environ) != 0) process_ = 0;
        posix_spawn_file_actions_destroy(&actions);
    }
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;
    ~Program() {
        if (process_ <= 0) return;
        ::kill(process_, SIGKILL);
        ::waitpid(process_, nullptr, 0);
    }

    /// Returns what it printed by its end; nothing where it does not end in time.
    [[nodiscard]] std::string answer(Clock::time_point until) {
        std::string text;
        while (process_ > 0 && text.size() < kLongestAnswer) {
            const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
            pollfd waits{said_.number(), POLLIN, 0};
            if (left <= 0 || ::poll(&waits, 1, int(left)) <= 0) return {};
            std::array<char, kLongestAnswer> part{};
            const ssize_t size = ::read(said_.number(), part.data(), part.size());
            if (size <= 0) return size == 0 ? text : std::string();
            text.append(part.data(), size_t(size));
        }
        return {};
    }

private:
    FileDescriptor said_;
    pid_t process_ = 0;
};

/// Returns the value that an answer ends with: "v v u 1", or "(<<uint32 1>>,)".
std::string lastNumber(const std::string& text) {
    constexpr const char* kDigits = "0123456789";
    const size_t last = text.find_last_of(kDigits);
    if (last == std::string::npos) return {};
    const size_t before = text.find_last_not_of(kDigits, last);
    const size_t first = before == std::string::npos ? 0 : before + 1;
    return text.substr(first, last + 1 - first);
}

}  // namespace

std::optional<bool> desktopIsDark(const Environment& variable, const fs::path& config,
                                  const std::function<std::optional<bool>()>& portal) {
    if (const std::string theme = variable("GTK_THEME"); !theme.empty()) return namesDark(theme);
    if (const auto said = portal()) return said;
    const auto gtk = [&] {
        const auto four = gtkIsDark(config / "gtk-4.0" / "settings.ini");
        return four ? four : gtkIsDark(config / "gtk-3.0" / "settings.ini");
    };
    const bool isKde = lowered(variable("XDG_CURRENT_DESKTOP")).find("kde") != std::string::npos;
    const auto kde = [&] { return kdeIsDark(config / "kdeglobals"); };
    const auto first = isKde ? kde() : gtk();
    return first ? first : isKde ? gtk() : kde();
}

const std::vector<ProgramCall>& portalCalls() {
    static const std::vector<ProgramCall> kCalls{
        {"busctl", "--user", "--timeout=1", "call", "org.freedesktop.portal.Desktop", "/org/freedesktop/portal/desktop",
         "org.freedesktop.portal.Settings", "Read", "ss", "org.freedesktop.appearance", "color-scheme"},
        {"gdbus", "call", "-e", "-t", "1", "-d", "org.freedesktop.portal.Desktop", "-o",
         "/org/freedesktop/portal/desktop", "-m", "org.freedesktop.portal.Settings.Read", "org.freedesktop.appearance",
         "color-scheme"}};
    return kCalls;
}

std::optional<bool> portalIsDark(const std::vector<ProgramCall>& calls, std::chrono::milliseconds most) {
    const Clock::time_point until = Clock::now() + most;
    for (const ProgramCall& call : calls) {
        const std::string number = lastNumber(Program(call).answer(until));
        if (number == "1" || number == "2") return number == "1";
        if (number == "0") return std::nullopt;  // no preference
    }
    return std::nullopt;
}

std::optional<bool> askDesktop() {
    const auto variable = [](const char* name) {
        const char* value = std::getenv(name);
        return std::string(value ? value : "");
    };
    const auto portal = [&]() -> std::optional<bool> {
        std::error_code ignored;
        const std::string runtime = variable("XDG_RUNTIME_DIR");
        const bool hasBus = !variable("DBUS_SESSION_BUS_ADDRESS").empty() ||
                            (!runtime.empty() && fs::exists(fs::path(runtime) / "bus", ignored));
        return hasBus ? portalIsDark(portalCalls(), kLongestQuestion) : std::nullopt;
    };
    const std::string home = variable("HOME"), config = variable("XDG_CONFIG_HOME");
    return desktopIsDark(variable, config.empty() ? fs::path(home) / ".config" : fs::path(config), portal);
}

}  // namespace vcp
