// docs/architecture.md links files that exist and names every room.
#include <filesystem>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "tests/house/include_rules.h"
#include "tests/house/rooms.h"

namespace vcp::house {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = VCP_SOURCE_DIR;

TEST(Architecture, LinksExist) {
    const std::string text = readText(kRoot / "docs/architecture.md");
    const std::regex link("\\]\\(([^)#:]+)\\)");
    size_t links = 0;
    for (auto it = std::sregex_iterator(text.begin(), text.end(), link); it != std::sregex_iterator(); ++it, ++links)
        EXPECT_TRUE(fs::exists(kRoot / "docs" / (*it)[1].str())) << (*it)[1];
    EXPECT_GT(links, 20u);
}

TEST(Architecture, NamesEveryRoom) {
    const std::string text = readText(kRoot / "docs/architecture.md");
    for (const Room& room : rooms()) {
        if (room.path == "viewer/examples" || room.path == "datasets_scripts") continue;
        const size_t slash = room.path.find('/');
        const std::string inside = slash == std::string::npos ? room.path : room.path.substr(slash + 1);
        EXPECT_TRUE(std::regex_search(text, std::regex("\\[" + inside + "(: [^\\]]*)?\\]"))) << room.path;
    }
}

}  // namespace
}  // namespace vcp::house
