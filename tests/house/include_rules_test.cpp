// The include directions of the folders, and that the check itself can fail.
#include "tests/house/include_rules.h"

#include <gtest/gtest.h>

namespace vcp::house {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = VCP_SOURCE_DIR;

TEST(IncludeRules, EveryFolderKeepsTheArrows) {
    size_t checked = 0;
    for (const std::string& folder : folders())
        for (const fs::path& file : sourceFiles(kRoot / folder)) {
            ++checked;
            for (const std::string& violation : includeViolations(folder, readText(file)))
                ADD_FAILURE() << fs::relative(file, kRoot).string() << ": " << violation;
        }
    EXPECT_GT(checked, 5u);
}

TEST(IncludeRules, EverySourceFolderIsKnown) {
    const std::vector<std::string> known = folders();
    for (const auto& entry : fs::directory_iterator(kRoot)) {
        const std::string name = entry.path().filename().string();
        if (!entry.is_directory() || name[0] == '.' || name == "build" || name == "tests") continue;
        if (sourceFiles(entry.path()).empty()) continue;
        EXPECT_NE(std::find(known.begin(), known.end(), name), known.end()) << name << "/ has sources but no rule";
    }
}

TEST(IncludeRules, CMakeListsItsSources) {
    std::vector<fs::path> files{kRoot / "CMakeLists.txt"};
    for (const char* folder :
         {"cmake", "octree", "builder", "mesostructure", "streaming", "render", "viewer", "datasets_scripts", "tests"})
        if (fs::is_directory(kRoot / folder))
            for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder))
                if (entry.path().filename() == "CMakeLists.txt" || entry.path().extension() == ".cmake")
                    files.push_back(entry.path());
    EXPECT_GT(files.size(), 4u);
    for (const fs::path& file : files)
        for (const std::string& violation : cmakeViolations(readText(file)))
            ADD_FAILURE() << fs::relative(file, kRoot).string() << ": " << violation;
}

struct Sample {
    const char* folder;
    const char* text;
    size_t violations;
};

TEST(IncludeRules, SamplesAreJudged) {
    const Sample samples[] = {
        {"octree", "#include \"octree/page.h\"\n#include <vector>\n", 0},
        {"octree", "#include \"builder/mesh_stream.h\"\n", 1},
        {"octree", "  #  include <builder/mesh_stream.h>\n", 1},
        {"octree", "#include <thread>\n", 1},
        {"octree", "#include <atomic>\n", 0},
        {"builder", "#include \"octree/page.h\"\n#include <mutex>\n#include <tbb/parallel_for.h>\n", 0},
        {"builder", "#include \"streaming/policy.h\"\n", 1},
        {"builder", "#include <vulkan/vulkan.h>\n", 1},
        {"mesostructure", "#include \"octree/result.h\"\n#include \"render/device.h\"\n", 1},
        {"streaming", "#include <condition_variable>\n#include \"builder/build.h\"\n", 1},
        {"render", "#include <vulkan/vulkan.h>\n#include \"streaming/page_source.h\"\n", 0},
        {"render", "#include \"builder/build.h\"\n#include <GLFW/glfw3.h>\n#include <future>\n", 3},
        {"render", "#include \"viewer/window.h\"\n#include <imgui.h>\n#include <backends/imgui_impl_vulkan.h>\n", 3},
        {"viewer", "#include <GLFW/glfw3.h>\n#include \"render/renderer.h\"\n#include <thread>\n", 0},
        {"viewer", "#include \"tests/house/include_rules.h\"\n", 1},
        {"datasets_scripts", "#include \"builder/mesh_stream.h\"\n#include \"viewer/scene.h\"\n", 1},
        {"octree", "// #include \"viewer/window.h\"\n", 0},
    };
    for (const Sample& sample : samples)
        EXPECT_EQ(includeViolations(sample.folder, sample.text).size(), sample.violations) << sample.folder << ":\n"
                                                                                           << sample.text;
    EXPECT_EQ(cmakeViolations("set(a b)\nfile(GLOB sources *.cpp)\n").size(), 1u);
    EXPECT_EQ(cmakeViolations("file (glob_recurse s *.cpp)\n# file(GLOB s)\n").size(), 1u);
}

}  // namespace
}  // namespace vcp::house
