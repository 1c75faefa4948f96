// What README.md names exists: links, files, folders, subcommands of ./run, presets.
#include <cstdlib>
#include <filesystem>
#include <regex>
#include <set>
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

}  // namespace
}  // namespace vcp::house
