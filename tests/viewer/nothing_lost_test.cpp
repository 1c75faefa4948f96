// No command writes over what it reads, nor over what it did not make: each command, each of its inputs, named as
// people and accidents name files.
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "render/picture.h"
#include "tests/support/vcp_program.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

class NothingLost : public testing::Test {
protected:
    NothingLost() {
        writeBall(folder_ / "ball.ply", 20, 40);
        writeBall(folder_ / "second.ply", 12, 24);
        write("wall.mtl", "newmtl wall\nKd 1 1 1\nmap_Kd wall.png\n");
        write("wall.obj",
              "mtllib wall.mtl\nusemtl wall\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 "
              "2/2 3/3\nf 1/1 3/3 4/4\n");
        EXPECT_TRUE(writePng({2, 2, std::vector<uint8_t>(16, 200)}, folder_ / "wall.png").ok());
    }

    void write(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ / name, std::ios::binary) << text;
    }
    [[nodiscard]] Ran run(const std::vector<std::string>& arguments) const {
        return VcpProgram(folder_).run(arguments);
    }

    /// `file` under the names that lead to it. Made anew at each call.
    [[nodiscard]] std::vector<std::string> namesOf(const std::string& file, const std::string& extension) const {
        const fs::path link = folder_ / ("link" + extension), hard = folder_ / ("hard" + extension),
                       detour = folder_ / "detour";
        fs::remove(link);
        fs::remove(hard);
        fs::remove(detour);
        fs::create_symlink(folder_ / file, link);
        fs::create_hard_link(folder_ / file, hard);
        fs::create_directory_symlink(folder_.path(), detour);
        return {folder_ / file, fs::relative(folder_ / file), folder_.path() / "." / file, link, hard, detour / file};
    }

    static bool saysWhy(const std::string& line) {
        for (const char* why : {"never written over", "which is read", "must end in"})
            if (line.find(why) != std::string::npos) return true;
        return false;
    }

    /// Runs `arguments` with `-o NAME` for each name of `file`, which must be refused in one line and stay as it is.
    void expectKept(const std::vector<std::string>& arguments, const std::string& file) const {
        const std::string before = contentOf(folder_ / file);
        for (const std::string& name : namesOf(file, fs::path(file).extension())) {
            for (const bool overwrite : {false, true}) {
                std::vector<std::string> words = arguments;
                words.insert(words.end(), {"-o", name});
                if (overwrite) words.emplace_back("--overwrite");
                const Ran ran = run(words);
                EXPECT_NE(ran.status, 0) << arguments[0] << " -o " << name;
                EXPECT_EQ(ran.errLines(), 1u) << ran.err;
                EXPECT_TRUE(saysWhy(ran.err)) << ran.err;
                EXPECT_EQ(contentOf(folder_ / file), before) << arguments[0] << " -o " << name;
                EXPECT_FALSE(fs::exists(name + ".partial"));
            }
        }
    }

    TestFolder folder_{"vcp_nothing_lost_test"};
};

TEST_F(NothingLost, BuildKeepsItsInputs) {
    const std::string ball = folder_ / "ball.ply", second = folder_ / "second.ply", wall = folder_ / "wall.obj";
    expectKept({"build", ball}, "ball.ply");
    expectKept({"build", ball, second}, "second.ply");
    expectKept({"build", ball, "--method", "paper"}, "ball.ply");
    for (const char* file : {"wall.obj", "wall.mtl", "wall.png"}) expectKept({"build", wall}, file);
}

// The extension is what a person would notice; what counts is the file.
TEST_F(NothingLost, BuildComparesFilesAndNotNames) {
    for (const char* file : {"ball.ply", "wall.mtl", "wall.png"}) {
        const std::string input = std::string(file) == "ball.ply" ? folder_ / "ball.ply" : folder_ / "wall.obj";
        const fs::path out = folder_ / "out.vcp";
        fs::remove(out);
        fs::create_hard_link(folder_ / file, out);
        const std::string before = contentOf(out);
        for (const char* overwrite : {"--threads=2", "--overwrite"}) {
            const Ran ran = run({"build", input, "-o", out, overwrite});
            EXPECT_EQ(ran.status, 1) << file << ran.err;
            EXPECT_EQ(ran.errLines(), 1u) << ran.err;
            EXPECT_EQ(contentOf(folder_ / file), before) << file;
        }
    }
}

TEST_F(NothingLost, AnOutputOfAnotherKindIsKept) {
    write("notes.vcp", "my notes\n");
    const std::string ball = folder_ / "ball.ply", notes = folder_ / "notes.vcp";
    const Ran refused = run({"build", ball, "-o", notes});
    EXPECT_EQ(refused.status, 1);
    EXPECT_NE(refused.err.find("is not a dataset"), std::string::npos) << refused.err;
    EXPECT_EQ(contentOf(notes), "my notes\n");
    EXPECT_EQ(run({"build", ball, "-o", notes, "--overwrite"}).status, 0);
    EXPECT_EQ(run({"build", ball, "-o", notes}).status, 0) << "a dataset is replaced by a dataset";
    EXPECT_EQ(run({"verify", notes}).status, 0);
}

TEST_F(NothingLost, InputsAmongTheTemporaryFilesAreKept) {
    fs::create_directory(folder_ / "out.vcp.build");
    fs::copy_file(folder_ / "ball.ply", folder_ / "out.vcp.build/level3.spill");
    const Ran ran = run({"build", folder_ / "out.vcp.build/level3.spill", "-o", folder_ / "out.vcp"});
    EXPECT_NE(ran.status, 0);
    EXPECT_EQ(contentOf(folder_ / "out.vcp.build/level3.spill"), contentOf(folder_ / "ball.ply"));
}

TEST_F(NothingLost, ExtensionsSayWhatIsWritten) {
    const std::string ball = folder_ / "ball.ply";
    for (const auto& [command, name] : std::vector<std::pair<std::string, std::string>>{{"build", "x.ply"},
                                                                                        {"build", "x.v2"},
                                                                                        {"build", "-"},
                                                                                        {"render", "x.jpg"},
                                                                                        {"render", "x.pngg"},
                                                                                        {"render", "x.vcp"},
                                                                                        {"meso build", "x.png"}}) {
        const std::string out = name == "-" ? name : std::string(folder_ / name);
        const Ran ran =
            VcpProgram(folder_).runWords(command + " " + (command.starts_with("meso") ? "ball" : ball) + " -o " + out);
        EXPECT_EQ(ran.status, 2) << command << " " << name << ran.err;
        EXPECT_EQ(ran.errLines(), 1u) << ran.err;
        EXPECT_FALSE(fs::exists(out)) << command << " " << name;
    }
}

TEST_F(NothingLost, RenderKeepsItsInputs) {
    const std::string ball = folder_ / "ball.ply", dataset = folder_ / "ball.vcp", wall = folder_ / "wall.obj";
    ASSERT_EQ(run({"build", ball, "-o", dataset}).status, 0);
    expectKept({"render", dataset, "--size", "16x16"}, "ball.vcp");
    expectKept({"render", ball, "--size", "16x16"}, "ball.ply");
    // A PNG may replace a PNG; not one that the mesh is painted with, whether the octree is in the cache or not.
    for (int i = 0; i < 2; ++i) expectKept({"render", wall, "--size", "16x16"}, "wall.png");
    write(
        "scene.json",
        R"({"datasets": [{"file": "ball.vcp"}], "mesostructure": [{"asset": "ball", "surface": "quad", "texture": "wall.png"}]})");
    expectKept({"render", folder_ / "scene.json", "--size", "16x16"}, "wall.png");
    EXPECT_EQ(run({"render", folder_ / "scene.json", "--size", "16x16", "-o", folder_ / "scene.png"}).status, 0);
    // Other outputs than -o.
    for (const char* option : {"--depth", "--normals"}) {
        const std::string before = contentOf(folder_ / "wall.png");
        const Ran ran = run({"render", folder_ / "scene.json", "--size", "16x16", "-o", folder_ / "new.png", option,
                             folder_ / "wall.png"});
        EXPECT_EQ(ran.status, 1) << ran.err;
        EXPECT_EQ(contentOf(folder_ / "wall.png"), before);
        EXPECT_FALSE(fs::exists(folder_ / "new.png"));
        EXPECT_EQ(
            run({"render", dataset, "--size", "16x16", "-o", folder_ / "new.png", option, folder_ / "new.png"}).status,
            2);
    }
    // Pictures of a sequence have names of their own.
    fs::copy_file(folder_ / "wall.png", folder_ / "turn-0002.png");
    write("turn.json", R"({"mesostructure": [{"asset": "ball", "surface": "quad", "texture": "turn-0002.png"}]})");
    const std::string before = contentOf(folder_ / "turn-0002.png");
    EXPECT_EQ(run({"render", folder_ / "turn.json", "--size", "16x16", "--turntable", "3", "-o", folder_ / "turn.png"})
                  .status,
              1);
    EXPECT_EQ(contentOf(folder_ / "turn-0002.png"), before);
    EXPECT_FALSE(fs::exists(folder_ / "turn-0001.png"));
}

TEST_F(NothingLost, MesoKeepsItsInputs) {
    expectKept({"meso", "build", folder_ / "wall.png", "--grid", "8"}, "wall.png");
    write("ball.json", R"({"mesostructure": [{"asset": "ball", "texture": "wall.png"}]})");
    expectKept({"render", folder_ / "ball.json", "--size", "16x16"}, "wall.png");
    const fs::path out = folder_ / "wall.meso";
    fs::create_hard_link(folder_ / "wall.png", out);
    EXPECT_EQ(run({"meso", "build", folder_ / "wall.png", "--grid", "8", "-o", out, "--overwrite"}).status, 1);
    EXPECT_TRUE(readPng(folder_ / "wall.png").ok());
}

TEST_F(NothingLost, ReportsKeepWhatTheyAreOf) {
    const fs::path out = folder_ / "out";
    fs::create_directory(out);
    ASSERT_EQ(run({"build", folder_ / "ball.ply", "-o", folder_ / "ball.vcp"}).status, 0);
    fs::create_hard_link(folder_ / "ball.vcp", out / "stress.json");
    EXPECT_NE(run({"stress", folder_ / "ball.vcp", "--frames", "2", "--out", out, "--overwrite"}).status, 0);
    EXPECT_EQ(run({"verify", folder_ / "ball.vcp"}).status, 0);
    // A benchmark's datasets do not replace those beside its report.
    fs::copy_file(folder_ / "ball.ply", out / "ball.vcp");
    EXPECT_EQ(
        run({"bench", "build", folder_ / "ball.ply", "--out", out, "--repetitions", "1", "--samples", "1000"}).status,
        0);
    EXPECT_EQ(contentOf(out / "ball.vcp"), contentOf(folder_ / "ball.ply"));
}

TEST_F(NothingLost, SpecialFilesStayWhatTheyAre) {
    ASSERT_EQ(::mkfifo((folder_ / "pipe.png").c_str(), 0600), 0);
    fs::create_symlink("/dev/null", folder_ / "null.png");
    fs::create_symlink("/dev/null", folder_ / "null.vcp");
    for (const char* name : {"pipe.png", "null.png"})
        EXPECT_EQ(run({"render", folder_ / "ball.ply", "--size", "16x16", "-o", folder_ / name}).status, 1) << name;
    EXPECT_EQ(run({"build", folder_ / "ball.ply", "-o", folder_ / "null.vcp"}).status, 1);
    EXPECT_TRUE(fs::is_fifo(folder_ / "pipe.png"));
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(NothingLost, PicturesGoToStandardOutput) {
    const Ran ran = run({"render", folder_ / "ball.ply", "--size", "16x16", "-o", "-"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    write("out.png", ran.out);
    const auto picture = readPng(folder_ / "out.png");
    ASSERT_TRUE(picture.ok()) << picture.error().line();
    EXPECT_EQ(picture->width, 16u);
    EXPECT_FALSE(fs::exists("-"));
    EXPECT_EQ(run({"render", folder_ / "ball.ply", "--size", "16x16", "-o", "-", "--json"}).status, 2);
    EXPECT_EQ(run({"render", folder_ / "ball.ply", "--size", "16x16", "-o", "-", "--turntable", "2"}).status, 2);
}

// What lies under the names that an output passes through is somebody's.
TEST_F(NothingLost, NamesBesideTheOutputAreKept) {
    write("treasure", "gold");
    fs::create_symlink(folder_ / "treasure", folder_ / "out.vcp.partial");
    fs::create_symlink(folder_ / "treasure", folder_ / "out.png.partial");
    write("out.meso.partial", "mine");
    EXPECT_EQ(run({"build", folder_ / "ball.ply", "-o", folder_ / "out.vcp"}).status, 0);
    EXPECT_EQ(run({"render", folder_ / "out.vcp", "--size", "16x16", "-o", folder_ / "out.png"}).status, 0);
    EXPECT_EQ(run({"meso", "build", "ball", "--grid", "8", "-o", folder_ / "out.meso"}).status, 0);
    EXPECT_EQ(contentOf(folder_ / "treasure"), "gold");
    EXPECT_EQ(contentOf(folder_ / "out.meso.partial"), "mine");
    EXPECT_TRUE(fs::is_symlink(folder_ / "out.vcp.partial"));
}

}  // namespace
}  // namespace vcp
