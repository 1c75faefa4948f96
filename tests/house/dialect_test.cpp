// One way to say a thing in all sources: how errors are handed on, how numbers change their type.
#include <regex>
#include <sstream>

#include <gtest/gtest.h>

#include "tests/house/include_rules.h"

namespace vcp::house {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = VCP_SOURCE_DIR;

/// What a source says in another dialect: one line each, "line 3: why".
std::vector<std::string> dialectViolations(const std::string& text) {
    static const std::string number =
        "(?:std::)?(?:u?int(?:8|16|32|64)_t|size_t|ptrdiff_t|byte|float|double|int|unsigned|long|char)";
    static const std::regex longCast("static_cast<" + number + ">");
    static const std::regex oldCast("\\(" + number + "\\)[\\w(]");
    static const std::regex declared("^\\s*(?:const )?auto (\\w+) = .*;$");
    static const std::regex handedOn("^\\s*if \\(!(\\w+)\\) return (\\w+)\\.error\\(\\);$");
    static const std::regex unnamed("\\bError\\{\\s*[^\\s.}]");
    static const std::regex cancelled("\\bError\\{\\.code = ErrorCode::Cancelled, \\.message = \"cancelled\"\\}");
    std::vector<std::string> found;
    std::istringstream lines(text);
    std::string line, before;
    for (int at = 1; std::getline(lines, line); before = line, ++at) {
        const std::string where = "line " + std::to_string(at) + ": ";
        const std::string code = line.substr(0, line.find("//"));
        if (std::regex_search(code, longCast)) found.push_back(where + "a number is converted as double(x)");
        if (std::regex_search(code, oldCast)) found.push_back(where + "a number is converted as double(x)");
        if (std::regex_search(code, unnamed))
            found.push_back(where + "an error's fields are named: Error{.code = ...}");
        if (std::regex_search(code, cancelled)) found.push_back(where + "Error::cancelled() is what was cancelled");
        std::smatch name, test;
        if (std::regex_match(before, name, declared) && std::regex_match(line, test, handedOn) && name[1] == test[1] &&
            test[1] == test[2])
            found.push_back(where + "VCP_TRY_ASSIGN hands the error on");
    }
    return found;
}

TEST(Dialect, EverySourceSpeaksIt) {
    size_t checked = 0;
    for (const char* top : {"octree", "builder", "streaming", "render", "mesostructure", "viewer", "datasets_scripts"})
        for (const fs::path& file : sourceFiles(kRoot / top)) {
            if (file.filename() == "result.h") continue;  // It defines the macros.
            ++checked;
            for (const std::string& violation : dialectViolations(readText(file)))
                ADD_FAILURE() << fs::relative(file, kRoot).string() << ": " << violation;
        }
    EXPECT_GT(checked, 300u);
}

TEST(Dialect, SamplesAreJudged) {
    const auto count = [](const char* text) { return dialectViolations(text).size(); };
    EXPECT_EQ(count("const double x = double(n);\n"), 0u);
    EXPECT_EQ(count("const double x = static_cast<double>(n);\n"), 1u);
    EXPECT_EQ(count("const double x = (double)n;\n"), 1u);
    EXPECT_EQ(count("std::function<void(uint64_t)> told;\n"), 0u);
    EXPECT_EQ(count("const auto shade = static_cast<ShadingMode>(n);\n"), 0u);
    EXPECT_EQ(count("auto file = openFile(path);\nif (!file) return file.error();\n"), 1u);
    EXPECT_EQ(count("auto file = openFile(path);\nif (!other) return other.error();\n"), 0u);
    EXPECT_EQ(count("return Error{ErrorCode::Io, \"is a folder\"};\n"), 1u);
    EXPECT_EQ(count("return Error{.code = ErrorCode::Io, .message = what};\nreturn Error{};\n"), 0u);
    EXPECT_EQ(count("return Error{.code = ErrorCode::Cancelled, .message = \"cancelled\"};\n"), 1u);
    EXPECT_EQ(count("VCP_TRY_ASSIGN(auto file, openFile(path));\n"), 0u);
}

}  // namespace
}  // namespace vcp::house
