// What README.md names exists: links, files, folders, subcommands of ./run, presets. All documents: lines fit, links
// lead somewhere.
#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/house/include_rules.h"

namespace vcp::house {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = VCP_SOURCE_DIR;

/// First group of every match.
std::vector<std::string> allMatches(const std::string& text, const char* pattern) {
    const std::regex regex(pattern);
    std::vector<std::string> found;
    for (auto it = std::sregex_iterator(text.begin(), text.end(), regex); it != std::sregex_iterator(); ++it)
        found.push_back((*it)[1]);
    return found;
}

TEST(Readme, LinksAndNamedFilesExist) {
    const std::string text = readText(kRoot / "README.md");
    std::vector<std::string> names = allMatches(text, "\\]\\(([^)#:]+)\\)");
    // Backticked paths: `octree/`, `builder/stream/mesh_stream.h`, `CHANGELOG.md`; not commands, options or outputs.
    for (const std::string& name : allMatches(text, "`([A-Za-z0-9_./]+(?:/|\\.(?:h|cpp|md|txt|json))|LICENSE)`"))
        names.push_back(name);
    EXPECT_GT(names.size(), 8u);
    for (const std::string& name : names) EXPECT_TRUE(fs::exists(kRoot / name)) << "README.md names " << name;
}

TEST(Readme, RunKnowsTheCommands) {
    const std::string text = readText(kRoot / "README.md"), run = readText(kRoot / "run");
    const std::vector<std::string> commands = allMatches(text, "\\./run ([a-z]+)");
    EXPECT_GE(commands.size(), 3u);
    for (const std::string& command : commands)
        EXPECT_TRUE(std::regex_search(run, std::regex("\n +" + command + "\\)"))) << "./run " << command;
}

TEST(Readme, PresetsExist) {
    const std::string text = readText(kRoot / "README.md"), presets = readText(kRoot / "CMakePresets.json");
    for (const std::string& preset : allMatches(text, "--preset ([a-z]+)"))
        EXPECT_NE(presets.find("\"name\": \"" + preset + "\""), std::string::npos) << preset;
}

TEST(Readme, FirstScreenIsInOrder) {
    const std::string text = readText(kRoot / "README.md");
    size_t last = 0;
    for (const char* part : {"`vcp` turns", "docs/images/demo.png", "./run demo", "./run test", "vcp build", "vcp view",
                             "vcp render", "`octree/`"}) {
        const size_t at = text.find(part);
        ASSERT_NE(at, std::string::npos) << part;
        EXPECT_GE(at, last) << part;
        last = at;
    }
}

std::vector<fs::path> documents() {
    std::vector<fs::path> found = {kRoot / "README.md", kRoot / "CHANGELOG.md"};
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / "docs"))
        if (entry.path().extension() == ".md") found.push_back(entry.path());
    return found;
}

TEST(Documents, LinesAreShort) {
    for (const fs::path& document : documents()) {
        std::istringstream text(readText(document));
        std::string line;
        for (int number = 1; std::getline(text, line); ++number) {
            // Tables and links cannot be broken. Bytes that continue a character of UTF-8 are none of their own.
            if (line.starts_with('|') || line.find("](") != std::string::npos) continue;
            const auto isCharacter = [](char c) { return (c & 0xc0) != 0x80; };
            EXPECT_LE(std::ranges::count_if(line, isCharacter), 120) << document << ':' << number;
        }
    }
}

TEST(Documents, LinksExist) {
    for (const fs::path& document : documents())
        for (const std::string& link : allMatches(readText(document), "\\]\\(([^): ]+)\\)")) {
            const size_t hash = link.find('#');
            const fs::path file = hash == 0 ? document : document.parent_path() / link.substr(0, hash);
            ASSERT_TRUE(fs::exists(file)) << document << ": " << link;
            if (hash == std::string::npos) continue;
            const std::string anchor = "id=\"" + link.substr(hash + 1) + "\"";
            EXPECT_NE(readText(file).find(anchor), std::string::npos) << document << ": " << link;
        }
}

}  // namespace
}  // namespace vcp::house
