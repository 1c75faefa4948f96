#include "tests/house/include_rules.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace vcp::house {
namespace {

using Names = std::set<std::string, std::less<>>;

// Folder -> the other folders of ours that it may include.
const std::map<std::string, Names, std::less<>> kMayInclude{
    {"octree", {}},
    {"builder", {"octree"}},
    {"mesostructure", {"octree"}},
    {"streaming", {"octree"}},
    {"render", {"octree", "mesostructure", "streaming"}},
    {"viewer", {"octree", "builder", "mesostructure", "streaming", "render"}},
    {"datasets_scripts", {"octree", "builder"}},
};
const Names kOurs{"octree", "builder", "mesostructure", "streaming", "render", "viewer", "datasets_scripts", "tests"};
const Names kVulkan{"render", "viewer"}, kWindow{"viewer"}, kThreads{"builder", "streaming", "viewer"};

struct Outside {
    std::regex header;
    const Names& folders;
    std::string what;
};

const std::vector<Outside>& outsideRules() {
    static const std::vector<Outside> rules{
        {std::regex("vulkan/.*|vk_.*|volk.*"), kVulkan, "Vulkan belongs to render/ and viewer/"},
        {std::regex("GLFW/.*|.*imgui.*"), kWindow, "GLFW and ImGui belong to viewer/"},
        {std::regex("thread|mutex|shared_mutex|condition_variable|future|stop_token|semaphore|latch|barrier|execution|"
                    "pthread\\.h|tbb/.*|oneapi/.*"),
         kThreads, "threads belong to builder/, streaming/ and viewer/"},
    };
    return rules;
}

std::string brokenBy(std::string_view folder, const std::string& header) {
    const std::string top = header.substr(0, header.find('/'));
    if (header.find('/') != std::string::npos && kOurs.contains(top)) {
        if (top == folder || kMayInclude.find(folder)->second.contains(top)) return "";
        return std::string(folder) + "/ may not include " + header;
    }
    for (const Outside& rule : outsideRules())
        if (std::regex_match(header, rule.header) && !rule.folders.contains(folder)) return header + ": " + rule.what;
    return "";
}

}  // namespace

std::vector<std::string> includeViolations(std::string_view folder, std::string_view text) {
    static const std::regex kInclude("^\\s*#\\s*include\\s*[<\"]([^>\"]+)[>\"].*");
    std::vector<std::string> found;
    std::istringstream lines{std::string(text)};
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        std::smatch match;
        if (!std::regex_match(line, match, kInclude)) continue;
        const std::string why = brokenBy(folder, match[1]);
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

std::vector<std::string> folders() {
    std::vector<std::string> names;
    for (const auto& [name, others] : kMayInclude) names.push_back(name);
    return names;
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
