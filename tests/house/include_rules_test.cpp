// The arrows of the rooms, and that the check itself can fail.
#include "tests/house/include_rules.h"

#include <algorithm>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include "tests/house/rooms.h"

namespace vcp::house {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = VCP_SOURCE_DIR;
/// Folders that are parted into rooms: each of theirs with sources stands in the table.
const std::set<std::string> kParted{"builder", "octree", "viewer"};

/// The top folders, each once.
std::set<std::string> topFolders() {
    std::set<std::string> tops;
    for (const Room& room : rooms()) tops.insert(room.path.substr(0, room.path.find('/')));
    return tops;
}

std::string folderOf(const fs::path& file) { return fs::relative(file.parent_path(), kRoot).generic_string(); }

TEST(IncludeRules, ArrowsRunUpwardInTheTable) {
    for (size_t i = 0; i < rooms().size(); ++i)
        for (const std::string& name : rooms()[i].mayInclude) {
            size_t found = 0;
            for (size_t j = 0; j < rooms().size(); ++j) {
                const std::string& other = rooms()[j].path;
                if (name.ends_with('/') ? !(other + "/").starts_with(name) : other != name) continue;
                ++found;
                EXPECT_LT(j, i) << rooms()[i].path << " -> " << other;
            }
            EXPECT_GT(found, 0u) << rooms()[i].path << " -> " << name << ", which is no room";
        }
}

TEST(IncludeRules, EveryRoomKeepsTheArrows) {
    size_t checked = 0;
    for (const std::string& top : topFolders())
        for (const fs::path& file : sourceFiles(kRoot / top)) {
            ++checked;
            for (const std::string& violation : includeViolations(folderOf(file), readText(file)))
                ADD_FAILURE() << fs::relative(file, kRoot).string() << ": " << violation;
        }
    EXPECT_GT(checked, 300u);
}

/// Returns the types that a file defines in a named namespace, each with its namespace.
std::vector<std::string> typesIn(const std::string& text) {
    static const std::regex opens(R"(^(?:inline )?namespace ?([\w:]*) ?\{)"), closes(R"(^\}  // namespace)");
    static const std::regex type(
        R"(^(?:template <.*> )?(?:struct|class|enum|enum class) (\w+)(?: final)?(?: :[^:].*)? *\{)");
    std::vector<std::string> types, spaces;
    std::istringstream lines(text);
    std::smatch found;
    for (std::string line; std::getline(lines, line);) {
        if (std::regex_search(line, found, opens))
            spaces.push_back(found[1]);
        else if (std::regex_search(line, closes) && !spaces.empty())
            spaces.pop_back();
        else if (std::regex_search(line, found, type) && std::ranges::find(spaces, "") == spaces.end()) {
            std::string name;
            for (const std::string& space : spaces) name += space + "::";
            types.push_back(name + found[1].str());
        }
    }
    return types;
}

TEST(Types, AreFoundWhereTheyAreDefined) {
    EXPECT_EQ(typesIn("namespace vcp {\nstruct A;\nstruct B final : C {\n    struct Inner {\n    };\n};\n"
                      "namespace {\nclass D {};\n}  // namespace\nenum class E : int { F };\n}  // namespace vcp\n"),
              (std::vector<std::string>{"vcp::B", "vcp::E"}));
}

/// Programs link all rooms: of two types with one name, functions of one would be taken for the other's.
TEST(Types, HaveNamesOfTheirOwn) {
    std::map<std::string, fs::path> known;
    for (const std::string& top : topFolders())
        for (const fs::path& file : sourceFiles(kRoot / top))
            for (const std::string& type : typesIn(readText(file))) {
                if (type.find("::") == std::string::npos) continue;  // of a shader
                const auto [other, isNew] = known.emplace(type, file);
                EXPECT_TRUE(isNew) << type << " is in " << fs::relative(other->second, kRoot) << " and "
                                   << fs::relative(file, kRoot);
            }
    EXPECT_GT(known.size(), 500u);
}

/// The renderer stands on all of its room: what lies below it does not know it.
TEST(IncludeRules, NothingBelowTheRendererIncludesIt) {
    size_t checked = 0;
    for (const fs::path& file : sourceFiles(kRoot / "render")) {
        if (file.parent_path() == kRoot / "render/view") continue;
        ++checked;
        EXPECT_EQ(readText(file).find("#include \"render/view/"), std::string::npos)
            << fs::relative(file, kRoot).string() << " includes the renderer";
    }
    EXPECT_GT(checked, 40u);
}

/// Messages name the thing, "the memory cap": the command line adds its option (viewer/command/option_names.h).
TEST(IncludeRules, OnlyTheCommandLineNamesItsOptions) {
    const std::regex option("\"[^\"]*--[a-z][^\"]*\""), ofOthers("\\{\"busctl\", ");
    size_t checked = 0;
    for (const Room& room : rooms()) {
        if (room.path.starts_with("viewer/command") || room.path == "viewer/examples" ||
            room.path == "datasets_scripts")
            continue;
        if (room.path.starts_with("viewer/bench")) continue;
        for (const auto& entry : fs::directory_iterator(kRoot / room.path)) {
            if (entry.path().extension() != ".cpp" && entry.path().extension() != ".h") continue;
            ++checked;
            std::istringstream lines(readText(entry.path()));
            for (std::string line; std::getline(lines, line);) {
                line.erase(std::min(line.find("//"), line.size()));
                EXPECT_FALSE(std::regex_search(line, option) && !std::regex_search(line, ofOthers))
                    << fs::relative(entry.path(), kRoot).string() << ": " << line;
            }
        }
    }
    EXPECT_GT(checked, 250u);
}

/// What the command line adds its options to is said somewhere.
TEST(IncludeRules, EachThingThatHasAnOptionIsSpokenOf) {
    std::string all;
    for (const Room& room : rooms())
        for (const auto& entry : fs::directory_iterator(kRoot / room.path))
            if (entry.path().extension() == ".cpp" || entry.path().extension() == ".h")
                if (room.path != "viewer/command" && room.path != "viewer/widget") all += readText(entry.path());
    size_t checked = 0;
    const std::regex row("\\{\"([^\"]+)\", \"[^\"]+\"\\},");
    for (const char* table : {"viewer/command/option_names.h", "viewer/widget/handles.cpp"}) {
        const std::string text = readText(kRoot / table);
        for (std::sregex_iterator at(text.begin(), text.end(), row), end; at != end; ++at, ++checked)
            EXPECT_NE(all.find((*at)[1].str()), std::string::npos) << table << ": " << (*at)[1];
    }
    EXPECT_GE(checked, 20u);
}

TEST(IncludeRules, EveryRoomLinksWhatItMayInclude) {
    std::map<std::string, std::vector<std::string>> roomsOf;
    std::vector<std::pair<std::string, RoomTarget>> targets;
    for (const Room& room : rooms()) {
        if (!kParted.contains(room.path.substr(0, room.path.find('/')))) {
            roomsOf["vcp_" + room.path] = {room.path};
            continue;
        }
        for (const RoomTarget& target : roomTargets(readText(kRoot / room.path / "CMakeLists.txt"))) {
            roomsOf[target.name].push_back(room.path);
            if (!target.library.empty()) roomsOf[target.library].push_back(room.path);
            targets.emplace_back(room.path, target);
        }
    }
    EXPECT_GT(targets.size(), 20u);
    for (const auto& [room, target] : targets)
        for (const std::string& violation : linkViolations(room, target, roomsOf)) ADD_FAILURE() << violation;
}

TEST(IncludeRules, EveryFolderIsInTheTable) {
    const std::set<std::string> tops = topFolders();
    for (const auto& entry : fs::directory_iterator(kRoot)) {
        const std::string name = entry.path().filename().string();
        if (!entry.is_directory() || name[0] == '.' || name == "build" || name == "tests") continue;
        if (sourceFiles(entry.path()).empty()) continue;
        EXPECT_TRUE(tops.contains(name)) << name << "/ has sources but no rule";
    }
    for (const std::string& top : kParted)
        for (const fs::path& file : sourceFiles(kRoot / top)) {
            const Room* room = roomOf(folderOf(file));
            EXPECT_TRUE(room && room->path == folderOf(file)) << folderOf(file) << "/ is no room";
        }
    for (const Room& room : rooms()) EXPECT_FALSE(sourceFiles(kRoot / room.path).empty()) << room.path << "/ is empty";
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
    const char* room;
    const char* text;
    size_t violations;
};

TEST(IncludeRules, SamplesAreJudged) {
    const Sample samples[] = {
        {"octree", "#include \"octree/page/page.h\"\n#include <vector>\n", 0},
        {"octree", "#include \"octree/shared/leaf_math.h\"\n", 0},
        {"octree", "#include \"builder/stream/mesh_stream.h\"\n", 1},
        {"octree", "  #  include <builder/stream/mesh_stream.h>\n", 1},
        {"octree", "#include <thread>\n", 1},
        {"render", "#include <tbb/parallel_for.h>\n", 1},
        {"render/host", "#include <tbb/parallel_for.h>\n#include <hwy/highway.h>\n", 0},
        {"octree", "#include <hwy/highway.h>\n", 1},
        {"octree", "#include <atomic>\n", 0},
        {"builder", "#include \"octree/page/page.h\"\n#include <mutex>\n#include <tbb/parallel_for.h>\n", 0},
        {"builder", "#include \"streaming/policy.h\"\n", 1},
        {"builder", "#include <vulkan/vulkan.h>\n", 1},
        {"builder", "#include \"builder/page/page_builder.h\"\n#include \"builder/build.h\"\n", 0},
        {"builder", "#include \"builder/paper/paper_file.h\"\n", 1},
        {"builder/page", "#include \"builder/lattice/soup.h\"\n#include \"builder/page/page_builder.h\"\n", 0},
        {"builder/page", "#include \"builder/build.h\"\n#include \"builder/level/coarsen.h\"\n", 2},
        {"builder/mesh/gltf", "#include \"builder/stream/mesh_stream.h\"\n#include \"builder/mesh/open_mesh.h\"\n", 1},
        {"mesostructure", "#include \"octree/io/result.h\"\n#include \"render/device.h\"\n", 1},
        {"streaming", "#include <condition_variable>\n#include \"builder/build.h\"\n", 1},
        {"render", "#include <vulkan/vulkan.h>\n#include \"streaming/page_source.h\"\n", 0},
        {"render/passes", "#include \"render/vulkan/device.h\"\n#include \"viewer/viewer.h\"\n", 1},
        {"render", "#include \"builder/build.h\"\n#include <GLFW/glfw3.h>\n#include <future>\n", 3},
        {"render", "#include \"viewer/window/window.h\"\n#include <imgui.h>\n#include <backends/imgui_impl_vulkan.h>\n",
         3},
        {"viewer", "#include \"render/view/renderer.h\"\n#include <thread>\n", 0},
        {"viewer", "#include <GLFW/glfw3.h>\n#include \"viewer/window/window.h\"\n", 2},
        {"viewer", "#include \"tests/house/include_rules.h\"\n", 1},
        {"viewer/scene", "#include \"builder/build.h\"\n#include \"builder/stream/byte_source.h\"\n", 0},
        {"viewer/scene", "#include <CLI/CLI.hpp>\n#include \"viewer/command/commands.h\"\n", 2},
        {"viewer/scene", "#include \"mesostructure/base/subdivision.h\"\n#include <OpenMesh/Core/IO/MeshIO.hh>\n", 1},
        {"mesostructure/base", "#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>\n", 0},
        {"mesostructure/gdm", "#include <Eigen/Dense>\n#include \"mesostructure/shape.h\"\n", 1},
        {"mesostructure", "#include <Eigen/Dense>\n#include \"mesostructure/gdm/factors.h\"\n", 1},
        {"viewer/scene", "    std::fprintf(stderr, \"done\");\n", 1},
        {"viewer/command", "#include <CLI/CLI.hpp>\n    std::fprintf(stderr, \"done\");  // stderr\n", 0},
        {"viewer/window", "#include <GLFW/glfw3.h>\n#include \"viewer/viewer.h\"\n// on stdout\n", 0},
        {"viewer/bench/peers",
         "#include \"builder/paper/paper_octree.h\"\n#include \"viewer/bench/rays/bench_tracer.h\"\n", 1},
        {"datasets_scripts", "#include \"builder/stream/mesh_stream.h\"\n#include \"viewer/scene.h\"\n", 1},
        {"octree", "// #include \"viewer/window/window.h\"\n", 0},
    };
    for (const Sample& sample : samples)
        EXPECT_EQ(includeViolations(sample.room, sample.text).size(), sample.violations) << sample.room << ":\n"
                                                                                         << sample.text;
    EXPECT_EQ(cmakeViolations("set(a b)\nfile(GLOB sources *.cpp)\n").size(), 1u);
    EXPECT_EQ(cmakeViolations("file (glob_recurse s *.cpp)\n# file(GLOB s)\n").size(), 1u);
}

TEST(IncludeRules, LinksAreJudged) {
    const auto targets = roomTargets(
        "# Pages.\nvcp_room(builder_page OF vcp_builder\n    SOURCES\n        a.cpp\n    LINKS\n"
        "        vcp_builder_lattice\n        vcp_builder_level\n        TBB::tbb\n        vcp_made_up)\n");
    ASSERT_EQ(targets.size(), 1u);
    EXPECT_EQ(targets[0].name, "vcp_builder_page");
    EXPECT_EQ(targets[0].library, "vcp_builder");
    EXPECT_EQ(targets[0].links.size(), 4u);
    const std::map<std::string, std::vector<std::string>> roomsOf{{"vcp_builder_lattice", {"builder/lattice"}},
                                                                  {"vcp_builder_level", {"builder/level"}}};
    // One is below, the other beside; the third is nobody's.
    EXPECT_EQ(linkViolations("builder/page", targets[0], roomsOf).size(), 2u);
}

}  // namespace
}  // namespace vcp::house
