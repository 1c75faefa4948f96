#include "tests/house/include_rules.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>

#include "tests/house/rooms.h"

namespace vcp::house {
namespace {

using Names = std::set<std::string, std::less<>>;

const Names kOurs{"octree", "builder", "mesostructure", "streaming", "render", "viewer", "datasets_scripts", "tests"};

/// Headers of others, and the folders or rooms that may include them.
struct Outside {
    std::regex header;
    Names places;
    std::string what;
};

const std::vector<Outside>& outsideRules() {
    static const std::vector<Outside> rules{
        {std::regex("vulkan/.*|vk_.*|volk.*"), {"render", "viewer"}, "Vulkan belongs to render/ and viewer/"},
        {std::regex("GLFW/.*|.*imgui.*"),
         {"viewer/window", "viewer/examples"},
         "GLFW and ImGui belong to viewer/window/"},
        {std::regex("OpenMesh/.*"), {"mesostructure/base"}, "OpenMesh belongs to mesostructure/base/"},
        {std::regex("Eigen/.*"), {"mesostructure/gdm"}, "Eigen belongs to mesostructure/gdm/"},
        {std::regex("CLI/.*"), {"viewer/command"}, "CLI11 belongs to viewer/command/"},
        {std::regex("thread|mutex|shared_mutex|condition_variable|future|stop_token|semaphore|latch|barrier|execution|"
                    "pthread\\.h|tbb/.*|oneapi/.*"),
         {"builder", "streaming", "render/host", "viewer"},
         "threads belong to builder/, streaming/, render/host/ and viewer/"},
        {std::regex("hwy/.*"), {"render/host"}, "Highway belongs to render/host/"},
    };
    return rules;
}

std::string brokenBy(const Room& room, const std::string& header) {
    const size_t slash = header.find('/');
    if (slash != std::string::npos && kOurs.contains(header.substr(0, slash))) {
        const Room* other = roomOf(header.substr(0, header.rfind('/')));
        if (other && mayInclude(room, *other)) return "";
        return room.path + "/ may not include " + header;
    }
    for (const Outside& rule : outsideRules()) {
        if (!std::regex_match(header, rule.header)) continue;
        const bool isThere = std::ranges::any_of(
            rule.places, [&](const std::string& place) { return (room.path + "/").starts_with(place + "/"); });
        if (!isThere) return header + ": " + rule.what;
    }
    return "";
}

/// Whether a line of code names a stream of the process.
bool prints(std::string_view code) {
    const auto isPartOfName = [&](size_t at) {
        return at < code.size() && (std::isalnum(static_cast<unsigned char>(code[at])) || code[at] == '_');
    };
    for (const std::string_view stream : {"stdout", "stderr", "std::cout", "std::cerr"})
        for (size_t at = code.find(stream); at != std::string_view::npos; at = code.find(stream, at + 1))
            if (!(at > 0 && isPartOfName(at - 1)) && !isPartOfName(at + stream.size())) return true;
    return false;
}

}  // namespace

std::vector<std::string> includeViolations(std::string_view room, std::string_view text) {
    static const std::regex kInclude("^\\s*#\\s*include\\s*[<\"]([^>\"]+)[>\"].*");
    static const Names kMayPrint{"viewer/command", "viewer/examples", "datasets_scripts"};
    const Room* here = roomOf(room);
    if (!here) return {std::string(room) + "/ is no room"};
    std::vector<std::string> found;
    std::istringstream lines{std::string(text)};
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        std::smatch match;
        std::string why;
        if (line.find('#') != std::string::npos && std::regex_match(line, match, kInclude))
            why = brokenBy(*here, match[1]);
        else if (!kMayPrint.contains(here->path) && prints(std::string_view(line).substr(0, line.find("//"))))
            why = "only viewer/command/ prints";
        if (!why.empty()) found.push_back("line " + std::to_string(number) + ": " + why);
    }
    return found;
}

std::vector<std::string> cmakeViolations(std::string_view text) {
    static const std::regex kGlob("^[^#]*file\\s*\\(\\s*GLOB.*", std::regex::icase);
    std::vector<std::string> found;
    std::istringstream lines{std::string(text)};
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number)
        if (std::regex_match(line, kGlob))
            found.push_back("line " + std::to_string(number) + ": sources are listed, not globbed");
    return found;
}

std::vector<RoomTarget> roomTargets(std::string_view cmakeText) {
    static const std::regex kCall("(?:^|\\n)vcp_room\\(([^)]*)\\)");
    const std::string text(cmakeText);
    std::vector<RoomTarget> targets;
    for (auto call = std::sregex_iterator(text.begin(), text.end(), kCall); call != std::sregex_iterator(); ++call) {
        std::istringstream words((*call)[1]);
        std::string word, part;
        RoomTarget target;
        words >> word;
        target.name = "vcp_" + word;
        while (words >> word) {
            if (word == "OF" || word == "SOURCES" || word == "LINKS")
                part = word;
            else if (part == "OF")
                target.library = word;
            else if (part == "LINKS")
                target.links.push_back(word);
        }
        targets.push_back(std::move(target));
    }
    return targets;
}

std::vector<std::string> linkViolations(std::string_view room, const RoomTarget& target,
                                        const std::map<std::string, std::vector<std::string>>& roomsOf) {
    const Room* here = roomOf(room);
    std::vector<std::string> found;
    for (const std::string& link : target.links) {
        if (!link.starts_with("vcp_")) continue;
        const auto known = roomsOf.find(link);
        if (known == roomsOf.end()) {
            found.push_back(target.name + " links " + link + ", which is no room's");
            continue;
        }
        for (const std::string& other : known->second)
            if (!here || !mayInclude(*here, *roomOf(other)))
                found.push_back(target.name + " links " + link + ", but " + std::string(room) + "/ may not include " +
                                other + "/");
    }
    return found;
}

std::vector<std::filesystem::path> sourceFiles(const std::filesystem::path& folder) {
    static const Names kSuffixes{".h", ".hpp", ".cpp", ".c", ".glsl", ".comp", ".vert", ".frag", ".inl"};
    std::vector<std::filesystem::path> files;
    if (!std::filesystem::is_directory(folder)) return files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (entry.is_regular_file() && kSuffixes.contains(entry.path().extension().string()))
            files.push_back(entry.path());
    std::ranges::sort(files);
    return files;
}

std::string readText(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace vcp::house
