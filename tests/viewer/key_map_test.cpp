// The documents say what the keys do.
#include "viewer/key_map.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/test_folder.h"

namespace vcp {
namespace {

TEST(KeyMap, TheDocumentHasEveryRow) {
    const std::string document = contentOf(std::string(VCP_SOURCE_DIR) + "/docs/window.md");
    ASSERT_GT(keyMap().size(), 20u);
    for (const KeyHelp& each : keyMap()) {
        const std::string row = std::string("| ") + each.keys + " | " + each.does + " |\n";
        EXPECT_NE(document.find(row), std::string::npos) << row;
    }
}

TEST(KeyMap, TextHasALineEach) {
    const std::string text = keyMapText();
    EXPECT_EQ(size_t(std::count(text.begin(), text.end(), '\n')), keyMap().size());
}

}  // namespace
}  // namespace vcp
