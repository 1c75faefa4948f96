// vcp meso bake from the outside.
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "render/picture.h"
#include "tests/support/vcp_program.h"
#include "viewer/bake/bake_files.h"

namespace vcp {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

class BakeCommand : public testing::Test {
protected:
    static void SetUpTestSuite() {
        folder_ = std::make_unique<TestFolder>("vcp_bake_command_test");
        // A ball whose red grows along x.
        std::ofstream out(*folder_ / "ball.obj");
        constexpr int kAround = 120, kUp = 60;
        for (int j = 0; j <= kUp; ++j)
            for (int i = 0; i < kAround; ++i) {
                const double up = M_PI * j / kUp, turn = 2 * M_PI * i / kAround, ring = j % kUp == 0 ? 0 : std::sin(up);
                const double x = ring * std::cos(turn);
                out << "v " << x << " " << ring * std::sin(turn) << " " << std::cos(up) << " " << 0.5 + 0.5 * x
                    << " 0.25 0.5\n";
            }
        for (int j = 0; j < kUp; ++j)
            for (int i = 0; i < kAround; ++i) {
                const int a = 1 + i + kAround * j, b = 1 + (i + 1) % kAround + kAround * j;
                if (j > 0) out << "f " << a << " " << a + kAround << " " << b << "\n";
                if (j + 1 < kUp) out << "f " << b << " " << a + kAround << " " << b + kAround << "\n";
            }
        out.close();
        const Ran built = VcpProgram(*folder_).runWords("build " + path("ball.obj") + " -o " + path("ball.vcp"));
        ASSERT_EQ(built.status, 0) << built.err;
    }
    static void TearDownTestSuite() { folder_.reset(); }

    static Ran run(const std::string& arguments) { return VcpProgram(*folder_).runWords(arguments); }
    static std::string path(const std::string& name) { return (*folder_ / name).string(); }
    /// All names in the folder, but for what the program is given and says.
    static std::set<std::string> names() {
        std::set<std::string> all;
        for (const auto& entry : fs::directory_iterator(folder_->path())) all.insert(entry.path().filename().string());
        for (const char* usual : {"stdout", "stderr", "cache"}) all.erase(usual);
        return all;
    }
    /// Expects one line and nothing new beside what is there.
    static void refused(const std::string& arguments, const std::string& because, int status = 1) {
        SCOPED_TRACE(arguments);
        const std::set<std::string> before = names();
        const Ran ran = run("meso bake " + path("ball.vcp") + " -o " + path("no") + " " + arguments);
        EXPECT_EQ(ran.status, status);
        EXPECT_EQ(ran.errLines(), 1u) << ran.err;
        EXPECT_NE(ran.err.find(because), std::string::npos) << ran.err;
        EXPECT_EQ(names(), before);
    }
    static std::string write(const std::string& name, const std::string& text) {
        std::ofstream(path(name)) << text;
        return path(name);
    }

    static inline std::unique_ptr<TestFolder> folder_;
};

TEST_F(BakeCommand, AScanBecomesASceneAndPictures) {
    const Ran ran = run("meso bake " + path("ball.vcp") + " -o " + path("asset") +
                        " --triangles 200 --texels 128 --measure --json --progress plain");
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json told = Json::parse(ran.out);
    EXPECT_EQ(told["triangles"], 200);
    EXPECT_EQ(told["map"], "atlas");
    EXPECT_EQ(told["height_field"], 1);
    EXPECT_LT(told["scan_to_base"]["max"], 0.005);
    EXPECT_NE(ran.err.find("sampling"), std::string::npos) << ran.err;
    uint64_t bytes = 0;
    for (const std::string_view name : kBakedFiles) {
        ASSERT_TRUE(fs::exists(*folder_ / "asset" / name)) << name;
        bytes += fs::file_size(*folder_ / "asset" / name);
    }
    EXPECT_EQ(told["bytes"], bytes);
    // The scene looks as the scan does.
    const std::string camera = write("camera.json", R"({"position": [0.5, -4, 1], "target": [0, 0, 0]})");
    for (const std::string& of : {path("asset/scene.json"), path("ball.vcp")}) {
        const Ran drawn = run("render " + of + " --camera " + camera + " --size 96x96 --samples 4 --progress none -o " +
                              path(of.ends_with("json") ? "a.png" : "b.png"));
        ASSERT_EQ(drawn.status, 0) << drawn.err;
    }
    const auto scene = readPng(path("a.png")), scan = readPng(path("b.png"));
    ASSERT_TRUE(scene && scan);
    ASSERT_EQ(scene->rgba.size(), scan->rgba.size());
    size_t unlike = 0;
    for (size_t i = 0; i < scan->rgba.size(); i += 4)
        unlike += std::abs(int(scene->rgba[i]) - int(scan->rgba[i])) > 16 ||
                  std::abs(int(scene->rgba[i + 2]) - int(scan->rgba[i + 2])) > 16;
    // But for a pixel here and there on the silhouette.
    EXPECT_LT(unlike, 96u * 96 / 50);
    // Other programs read the base: so do the readers of glTF.
    const Ran again = run("build " + path("asset/base.glb") + " -o " + path("base.vcp") + " --json");
    ASSERT_EQ(again.status, 0) << again.err;
    EXPECT_EQ(Json::parse(again.out)["triangles"], 200);
    fs::remove(path("base.vcp")), fs::remove(path("a.png")), fs::remove(camera), fs::remove(path("b.png"));
    // What is there stays, unless it is to be replaced and holds nothing else.
    const Ran over = run("meso bake " + path("ball.vcp") + " -o " + path("asset") + " --triangles 100 --texels 64");
    EXPECT_EQ(over.status, 2);
    EXPECT_EQ(over.errLines(), 1u) << over.err;
    const Ran input = run("meso bake " + path("ball.vcp") + " -o " + path("asset") +
                          " --overwrite --texels 64 --base " + path("asset/base.obj"));
    EXPECT_EQ(input.status, 2);
    EXPECT_NE(input.err.find("base.obj, which is read"), std::string::npos) << input.err;
    const Ran replaced =
        run("meso bake " + path("ball.vcp") + " -o " + path("asset/") + " --triangles 100 --texels 64 --overwrite");
    EXPECT_EQ(replaced.status, 0) << replaced.err;
    write("asset/mine.txt", "mine");
    const Ran mine =
        run("meso bake " + path("ball.vcp") + " -o " + path("asset") + " --triangles 100 --texels 64 --overwrite");
    EXPECT_EQ(mine.status, 2);
    EXPECT_NE(mine.err.find("mine.txt"), std::string::npos) << mine.err;
    fs::remove_all(path("asset"));
}

TEST_F(BakeCommand, ABaseOfOnesOwn) {
    // A box without coordinates, and a quad with them, inside of the ball.
    const std::string box =
        write("box.obj",
              "v -.6 -.6 -.6\nv .6 -.6 -.6\nv .6 .6 -.6\nv -.6 .6 -.6\nv -.6 -.6 .6\nv .6 -.6 .6\n"
              "v .6 .6 .6\nv -.6 .6 .6\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
    const Ran ran = run("meso bake " + path("ball.vcp") + " -o " + path("own") + " --base " + box +
                        " --texels 256 --reach 0.5 --measure --json");
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json told = Json::parse(ran.out);
    EXPECT_EQ(told["triangles"], 12);
    EXPECT_EQ(told["height_field"], 1);
    EXPECT_LT(told["scan_to_base"]["max"], 0.02);
    const std::string quad =
        write("quad.obj",
              "v -.4 -.4 .9\nv .4 -.4 .9\nv .4 .4 .9\nv -.4 .4 .9\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
              "f 1/1 2/2 3/3 4/4\n");
    const Ran given = run("meso bake " + path("ball.vcp") + " -o " + path("given") + " --base " + quad +
                          " --texels 64 --reach 0.5 --json");
    ASSERT_EQ(given.status, 0) << given.err;
    EXPECT_EQ(Json::parse(given.out)["map"], "given");
    EXPECT_EQ(Json::parse(given.out)["height_field"], 1);
    const Ran anew = run("meso bake " + path("ball.vcp") + " -o " + path("given") + " --base " + quad +
                         " --texels 64 --reach 0.5 --new-map --overwrite --json");
    ASSERT_EQ(anew.status, 0) << anew.err;
    EXPECT_EQ(Json::parse(anew.out)["map"], "atlas");
    for (const char* name : {"own", "given"}) fs::remove_all(path(name));
}

TEST_F(BakeCommand, WhatIsWrongIsOneLineAndNothingIsLeft) {
    const std::string quad = "v 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    refused("--base " + write("empty.obj", "v 0 0 0\n"), "empty.obj");
    refused("--base " + write("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "nan.obj");
    refused("--base " + write("over.obj", quad + "f 1/1 2/2 3/3\nf 1/1 3/3 4/2\n"),
            "over.obj: triangle 0: it and triangle 1 overlap");
    refused("--base " + write("line.obj", quad + "f 1/1 2/2 3/3\nf 1/1 3/3 4/3\n"),
            "line.obj: triangle 1: its texture coordinates have no area");
    refused("--base " + write("out.obj", quad + "vt 0 2\nf 1/1 2/2 3/3\nf 1/1 3/3 4/5\n"),
            "out.obj: triangle 1: the texture coordinates");
    refused("--base " + write("fin.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 2 1 4\nf 1 2 5\n"),
            "fin.obj: triangle 2: 3 triangles meet");
    refused("--base " + write("back.obj", "v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\nf 1 3 2\n"), "back.obj");
    refused("--base " + write("far.obj", "v 50 0 0\nv 51 0 0\nv 50 1 0\nf 1 2 3\n"), "not one line");
    refused("--texels 16", "does not fit 16 x 16 texels");
    refused("--texels 4", "--texels", 2);
    refused("--texels 5000", "--texels", 2);
    refused("--texels 4096 --memory 64M", "memory");
    refused("--base " + path("nothing.obj"), "nothing.obj");
    refused("--reach x", "--reach", 2);
    // Inputs that are no scan.
    for (const std::string& input : {path("ball.obj"), path("absent.vcp")}) {
        const std::set<std::string> before = names();
        const Ran ran = run("meso bake " + input + " -o " + path("no"));
        EXPECT_EQ(ran.status, 1) << input;
        EXPECT_EQ(ran.errLines(), 1u) << ran.err;
        EXPECT_EQ(names(), before);
    }
    // A full disk.
    const std::set<std::string> before = names();
    const VcpProgram program(*folder_);
    const Ran full = program.wait(program.start({"meso", "bake", path("ball.vcp"), "-o", path("no"), "--triangles",
                                                 "300", "--texels", "256", "--progress", "none"},
                                                "stdout", true));
    EXPECT_EQ(full.status, 1);
    EXPECT_EQ(full.errLines(), 1u) << full.err;
    EXPECT_EQ(names(), before);
}

}  // namespace
}  // namespace vcp
