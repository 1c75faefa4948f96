// The executable as people and scripts meet it: exit status, stdout, stderr, files.
#include <cctype>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <sys/stat.h>

#include <gtest/gtest.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include "render/picture.h"
#include "render/view/renderer.h"
#include "tests/support/encoder_in_path.h"
#include "tests/support/peak_memory.h"
#include "tests/support/range_server.h"
#include "tests/support/vcp_program.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class CommandLine : public testing::Test {
protected:
    static void SetUpTestSuite() {
        folder_ = std::make_unique<TestFolder>("vcp_command_line_test");
        writeBall(ball(), 60, 120);
    }
    static void TearDownTestSuite() { folder_.reset(); }

    static fs::path ball() { return *folder_ / "ball.ply"; }

    /// The ball's dataset, built once, with several pages.
    static fs::path dataset() {
        const fs::path file = *folder_ / "ball.vcp";
        if (!fs::exists(file)) {
            const Ran ran = run({"build", ball().string(), "-o", file.string(), "--cell", "0.05"});
            EXPECT_EQ(ran.status, 0) << ran.err;
        }
        return file;
    }

    static VcpProgram program() { return VcpProgram(*folder_); }
    static Ran run(const std::vector<std::string>& arguments) { return program().run(arguments); }

    /// One line on stderr that names `named`; nothing on stdout; the status.
    static void expectFailure(const Ran& ran, int status, const std::string& named) {
        EXPECT_EQ(ran.status, status) << ran.err;
        EXPECT_EQ(ran.out, "");
        EXPECT_EQ(ran.errLines(), 1u) << ran.err;
        EXPECT_EQ(ran.err.substr(0, 5), "vcp: ") << ran.err;
        EXPECT_NE(ran.err.find(named), std::string::npos) << ran.err << " does not name " << named;
    }

    static void write(const fs::path& file, const std::string& content) {
        std::ofstream(file, std::ios::binary) << content;
    }

    static bool hasDevice() { return listDevices().ok(); }

    static std::unique_ptr<TestFolder> folder_;
};
std::unique_ptr<TestFolder> CommandLine::folder_;

constexpr const char* kCommands[] = {"build",  "info",    "verify", "render", "view",    "export", "compare",
                                     "stress", "devices", "bench",  "meso",   "publish", "serve"};

TEST_F(CommandLine, HelpOfEveryCommandBothWays) {
    const Ran all = run({"--help"});
    EXPECT_EQ(all.status, 0);
    EXPECT_EQ(run({"help"}).out, all.out);
    for (const std::string command : kCommands) {
        EXPECT_NE(all.out.find("\n  " + command + " "), std::string::npos) << command;
        const Ran asked = run({command, "--help"}), told = run({"help", command});
        EXPECT_EQ(asked.status, 0) << command;
        EXPECT_EQ(told.status, 0) << command;
        EXPECT_EQ(asked.out, told.out);
        EXPECT_EQ(asked.err, "");
        EXPECT_NE(asked.out.find("vcp " + command), std::string::npos) << asked.out;
    }
}

TEST_F(CommandLine, Version) {
    const Ran ran = run({"--version"});
    EXPECT_EQ(ran.status, 0);
    EXPECT_EQ(ran.out.substr(0, 4), "vcp ");
    EXPECT_TRUE(std::isdigit(ran.out.at(4)));
}

TEST_F(CommandLine, WrongUsageEndsWith2) {
    const std::string mesh = ball().string();
    const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
        {{}, "command is needed"},
        {{"fly"}, "fly"},
        {{"help", "fly"}, "fly"},
        {{"help", "biuld"}, "did you mean build?"},
        {{"rendr", mesh}, "did you mean render?"},
        {{"render", mesh, "-o", "x.png", "--sectoin", "x<0"}, "did you mean --section?"},
        {{"bench", "ray"}, "did you mean rays?"},
        {{"build"}, "vcp help build"},
        {{"build", mesh}, "--output"},
        {{"build", mesh, "-o", "x.vcp", "--cell", "wide"}, "wide"},
        {{"build", mesh, "-o", "x.vcp", "--cell", "1%"}, "1%"},
        {{"build", mesh, "-o", "x.vcp", "--error", "-1"}, "--error"},
        {{"build", mesh, "-o", "x.vcp", "--threads", "0"}, "--threads"},
        {{"build", mesh, "-o", "x.vcp", "--colour", "mauve"}, "mauve"},
        {{"build", mesh, "-o", "x.vcp", "--colour-quality", "85x"}, "85x"},
        {{"build", mesh, "-o", "x.vcp", "--colour-quality", "0"}, "lossless or 1 to 100"},
        {{"build", mesh, "-o", "x.vcp", "--colour-quality", "101"}, "lossless or 1 to 100"},
        {{"build", mesh, "-o", "x.vcp", "--vertex-normals", "smooth"}, "mesh or computed"},
        {{"build", mesh, "-o", "x.vcp", "--progress", "loud"}, "loud"},
        {{"build", mesh, "-o", "x.vcp", "--unknown"}, "--unknown"},
        {{"info"}, "FILE"},
        {{"verify"}, "FILE"},
        {{"render", mesh}, "--output"},
        {{"render", mesh, "-o", "x.png", "--size", "big"}, "big"},
        {{"render", mesh, "-o", "x.png", "--size", "0x5"}, "0x5"},
        {{"render", mesh, "-o", "x.png", "--budget", "1K"}, "1K"},
        {{"render", mesh, "-o", "x.png", "--depth", "x.jpg"}, "x.jpg"},
        {{"render", mesh, "-o", "x.png", "--light", "moon"}, "moon"},
        {{"render", mesh, "-o", "x.png", "--error-pixels", "0"}, "--error-pixels"},
        {{"view", mesh, "--size", "big"}, "big"},
    };
    for (const auto& [arguments, named] : cases) expectFailure(run(arguments), 2, named);
}

// Every command, every kind of file that is no good: one line that names it.
TEST_F(CommandLine, BadInputsEndWith1AndNameTheFile) {
    const fs::path empty = *folder_ / "empty.ply", garbage = *folder_ / "garbage.ply",
                   missing = *folder_ / "missing.ply";
    const fs::path emptyDataset = *folder_ / "empty.vcp", garbageDataset = *folder_ / "garbage.vcp";
    const fs::path missingDataset = *folder_ / "missing.vcp", out = *folder_ / "bad_out";
    write(empty, "");
    write(emptyDataset, "");
    std::string noise;
    for (unsigned i = 0; i < 9000; ++i) noise += char(i * 2654435761u >> 13);
    write(garbage, noise);
    write(garbageDataset, noise);
    const std::string truncated = contentOf(ball()).substr(0, 2000);
    write(*folder_ / "truncated.ply", truncated);

    for (const fs::path& mesh : {empty, garbage, missing, *folder_ / "truncated.ply", folder_->path()}) {
        expectFailure(run({"build", mesh.string(), "-o", out.string()}), 1, mesh.string());
        expectFailure(run({"render", mesh.string(), "-o", out.string()}), 1, mesh.string());
        // Whether it is a mesh shows when it is built, in the window.
        if (mesh == missing) expectFailure(run({"view", mesh.string()}), 1, mesh.string());
        expectFailure(run({"verify", dataset().string(), "--against", mesh.string()}), 1, mesh.string());
        EXPECT_FALSE(fs::exists(out));
        EXPECT_FALSE(fs::exists(out.string() + ".partial"));
    }
    for (const fs::path& file : {emptyDataset, garbageDataset, missingDataset, folder_->path()}) {
        expectFailure(run({"info", file.string()}), 1, file.string());
        expectFailure(run({"info", file.string(), "--json"}), 1, file.string());
        expectFailure(run({"verify", file.string()}), 1, file.string());
    }
    for (const fs::path& file : {emptyDataset, garbageDataset, missingDataset}) {
        expectFailure(run({"render", file.string(), "-o", out.string()}), 1, file.string());
        expectFailure(run({"view", file.string()}), 1, file.string());
        EXPECT_FALSE(fs::exists(out));
    }
    if (fs::exists(*folder_ / "cache" / "vcp")) {
        EXPECT_TRUE(fs::is_empty(*folder_ / "cache" / "vcp")) << "a failed build left something in the cache";
    }
}

/// Nothing of a name or of what a file says drives the terminal; each line is one.
TEST_F(CommandLine, NothingThatANameHoldsDrivesTheTerminal) {
    const auto expectHarmless = [](const Ran& ran) {
        for (const std::string* said : {&ran.out, &ran.err})
            for (const char c : *said)
                ASSERT_TRUE(c == '\n' || (static_cast<unsigned char>(c) >= 0x20 && c != '\x7f')) << ran.out << ran.err;
        EXPECT_EQ((ran.out + ran.err).find("\u202e"), std::string::npos) << ran.out << ran.err;
    };
    const fs::path hostile = *folder_ / "a\x1b]0;owned\x07\x7f\u202e.vcp", missing = *folder_ / "b\x1b[2J.vcp";
    fs::copy_file(dataset(), hostile, fs::copy_options::overwrite_existing);
    for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
             {"info", hostile.string()}, {"verify", hostile.string(), "--progress", "plain"}}) {
        const Ran ran = run(arguments);
        EXPECT_EQ(ran.status, 0) << ran.err;
        EXPECT_NE(ran.out.find("a\\x1b]0;owned\\x07\\x7f\\xe2\\x80\\xae.vcp"), std::string::npos) << ran.out;
        expectHarmless(ran);
    }
    const Ran json = run({"info", hostile.string(), "--json"});
    expectHarmless(json);
    EXPECT_EQ(Json::parse(json.out)["file"], hostile.string());
    const Ran refused = run({"info", missing.string()});
    expectFailure(refused, 1, "b\\x1b[2J.vcp");
    expectHarmless(refused);
    const Ran usage = run({"inf\x1b[2Jo"});
    EXPECT_EQ(usage.status, 2);
    expectHarmless(usage);

    const fs::path mesh = *folder_ / "hostile.obj", built = *folder_ / "hostile.vcp";
    write(mesh,
          "mtllib \x1b[31m\xc2\x9b"
          "31m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl \x1b[1m\nf 1 2 3\n");
    const Ran ran = run({"build", mesh.string(), "-o", built.string()});
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_NE(ran.out.find("\\x1b[31m"), std::string::npos) << ran.out << ran.err;
    expectHarmless(ran);

    const fs::path scene = *folder_ / "hostile.json";
    write(scene, "{\n\"datasets\": [{\"file\": \"a.vcp\"}],\n\"\\u001b[31m\": 1}");
    const Ran key = run({"render", scene.string(), "-o", (*folder_ / "none.png").string()});
    expectFailure(key, 1, scene.string() + ": line 3: \"\\x1b[31m\" is no key here");
    expectHarmless(key);
}

/// What a scene, a camera or a path says wrongly is not the command line's fault.
TEST_F(CommandLine, WhatFilesSayEndsWith1) {
    const fs::path scene = *folder_ / "wrong_scene.json", camera = *folder_ / "wrong_camera.json",
                   path = *folder_ / "wrong_path.json", png = *folder_ / "wrong.png";
    const fs::path points = *folder_ / "points.xyz";
    write(points, "0 0 0\n");
    write(scene, "{\"datasets\": [\n{\"file\": \"points.xyz\"}]}");
    expectFailure(run({"render", scene.string(), "-o", png.string()}), 1, points.string() + ": unknown mesh format");
    const std::pair<const char*, const char*> scenes[] = {
        {"{\"mesostructure\": [\n{\"asset\": \"brick\"}]}", ": line 2: \"asset\" must be"},
        {"{\"mesostructure\": [\n{\"asset\": \"beads\",\n\"tiles\": 1e6}]}", ": line "},
        {"{\"datasets\": [{\"file\": \"a.vcp\"}],\n\"sections\": [{\"normal\": [1e-320, 0, 0], \"offset\": 0}]}",
         ": line 2: \"normal\""},
    };
    for (const auto& [text, words] : scenes) {
        write(scene, text);
        const Ran ran = run({"render", scene.string(), "-o", png.string(), "--size", "16x16"});
        expectFailure(ran, 1, scene.string() + words);
        EXPECT_EQ(ran.err.find("vcp help"), std::string::npos) << ran.err;
    }
    write(camera, "{\"position\": [0, 0, 5],\n\"target\": [0, 0, 0],\n\"fov_degrees\": 178.5}");
    expectFailure(run({"render", dataset().string(), "-o", png.string(), "--camera", camera.string()}), 1,
                  camera.string() + ": line 3: \"fov_degrees\"");
    write(path, "[{\"position\": [0, 0, 5], \"target\": [0, 0, 0]},\n{\"position\": [0, 0, 5]}]");
    expectFailure(run({"render", dataset().string(), "-o", png.string(), "--path", path.string(), "--frames", "2"}), 1,
                  path.string() + ": line 2: camera 1: \"target\"");
    EXPECT_FALSE(fs::exists(png));
}

/// No command waits for a pipe that stands where a file should; a mesh may come through one.
TEST_F(CommandLine, PipesAreNoFiles) {
    const fs::path pipe = *folder_ / "pipe", scene = *folder_ / "pipe.json", png = *folder_ / "pipe.png";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    ASSERT_EQ(::mkfifo(scene.c_str(), 0600), 0);
    const std::string whole = dataset().string();
    expectFailure(run({"info", pipe.string()}), 1, pipe.string() + ": is a pipe, not a file");
    expectFailure(run({"verify", pipe.string()}), 1, pipe.string() + ": is a pipe, not a file");
    expectFailure(run({"render", scene.string(), "-o", png.string()}), 1, scene.string() + ": is a pipe, not a file");
    expectFailure(run({"render", whole, "-o", png.string(), "--camera", pipe.string()}), 1,
                  pipe.string() + ": is a pipe, not a file");
    expectFailure(run({"render", whole, "-o", png.string(), "--path", pipe.string(), "--frames", "2"}), 1,
                  pipe.string() + ": is a pipe, not a file");
    expectFailure(run({"meso", "info", pipe.string()}), 1, pipe.string());
    expectFailure(run({"render", pipe.string(), "-o", png.string()}), 1, pipe.string() + ": is not a regular file");
    EXPECT_FALSE(fs::exists(png));
}

TEST_F(CommandLine, MeshIsNoDatasetForInfoAndVerify) {
    expectFailure(run({"info", ball().string()}), 1, ball().string());
    expectFailure(run({"verify", ball().string()}), 1, ball().string());
}

TEST_F(CommandLine, InfoOfSeveralFiles) {
    const std::string one = dataset().string(), other = (*folder_ / "other.vcp").string(),
                      broken = (*folder_ / "no_dataset.vcp").string();
    fs::copy_file(one, other, fs::copy_options::overwrite_existing);
    write(broken, "no dataset");
    const Ran both = run({"info", one, other});
    EXPECT_EQ(both.status, 0) << both.err;
    EXPECT_LT(both.out.find(one + ": "), both.out.find("\n\n" + other + ": "));
    const Ran ran = run({"info", one, broken, other, "--json"});
    EXPECT_EQ(ran.status, 1);
    EXPECT_NE(ran.err.find("1 of 3 files could not be read"), std::string::npos) << ran.err;
    const Json files = Json::parse(ran.out)["files"];
    ASSERT_EQ(files.size(), 3u);
    EXPECT_EQ(files[0]["triangles"], files[2]["triangles"]);
    EXPECT_NE(files[1]["error"].get<std::string>().find("no_dataset.vcp"), std::string::npos);
}

TEST_F(CommandLine, BuildReportsWhatProgramsRelyOn) {
    const fs::path file = *folder_ / "reported.vcp";
    const Ran ran = run({"build", ball().string(), "-o", file.string(), "--json", "--progress", "json"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json json = Json::parse(ran.out);
    for (const char* field :
         {"triangles", "degenerate_triangles", "seconds", "peak_rss_bytes", "temp_bytes", "file_bytes", "levels",
          "subvolumes", "leaves", "hard_leaves", "cell", "certified_error_max"})
        EXPECT_TRUE(json.contains(field) && json[field].is_number()) << field;
    EXPECT_EQ(json["triangles"], 14160);
    EXPECT_EQ(json["file_bytes"], fs::file_size(file));
    EXPECT_GT(json["peak_rss_bytes"], 1 << 20);
    std::istringstream progress(ran.err);
    for (std::string line; std::getline(progress, line);) EXPECT_TRUE(Json::parse(line).contains("fraction")) << line;

    const Json info = Json::parse(run({"info", file.string(), "--json"}).out);
    for (const char* field : {"triangles", "degenerate_triangles", "levels", "subvolumes", "leaves", "hard_leaves",
                              "cell", "certified_error_max", "file_bytes"})
        EXPECT_EQ(info[field], json[field]) << field;
    EXPECT_EQ(info["level"].size(), json["levels"].get<size_t>());
    EXPECT_EQ(info["level"].back()["certified_error_max"], json["certified_error_max"]);
    EXPECT_GT(info["colour_stored_bytes"], 1000);
    EXPECT_GT(info["geometry_stored_bytes"], 1000);
    EXPECT_LT(info["geometry_stored_bytes"].get<uint64_t>() + info["colour_stored_bytes"].get<uint64_t>(),
              json["file_bytes"].get<uint64_t>());
    EXPECT_EQ(info["level"].back()["slab_leaves"], 0) << "the finest level is the mesh";

    const Json verified = Json::parse(run({"verify", file.string(), "--json"}).out);
    EXPECT_EQ(verified["ok"], true);
    EXPECT_EQ(verified["pages"], json["subvolumes"]);
    EXPECT_EQ(verified["bytes"], json["file_bytes"]);
}

TEST_F(CommandLine, SameBytesWhateverTheThreads) {
    const fs::path one = *folder_ / "one.vcp", three = *folder_ / "three.vcp";
    ASSERT_EQ(run({"build", ball().string(), "-o", one.string(), "--threads", "1"}).status, 0);
    ASSERT_EQ(run({"build", ball().string(), "-o", three.string(), "--threads", "3"}).status, 0);
    EXPECT_EQ(contentOf(one), contentOf(three));
}

TEST_F(CommandLine, VerifyMeasuresAgainstTheMesh) {
    const Ran ran = run({"verify", dataset().string(), "--against", ball().string(), "--json", "--samples", "20000"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json json = Json::parse(ran.out);
    EXPECT_EQ(json["ok"], true);
    for (const char* way : {"mesh_to_surface", "surface_to_mesh"}) {
        for (const char* quantile : {"p50", "p95", "p99", "max"}) EXPECT_TRUE(json[way][quantile].is_number());
        EXPECT_LE(json[way]["max"].get<double>(), json["certified_error_max"].get<double>() * (1 + 1e-6));
    }
    EXPECT_GE(json["samples"].get<uint64_t>(), 20000u);
    const Json& degrees = json["normal_degrees"];
    EXPECT_LE(degrees["p50"], degrees["p95"]);
    EXPECT_LE(degrees["p95"], degrees["p99"]);
    EXPECT_LE(degrees["p99"], degrees["max"]);
    EXPECT_LT(degrees["p99"], 30);
    const Ran table = run({"verify", dataset().string(), "--against", ball().string(), "--samples", "2000"});
    EXPECT_NE(table.out.find("normals, degrees"), std::string::npos) << table.out;
    EXPECT_NE(table.out.find("colour"), std::string::npos) << table.out;
    EXPECT_LE(json["colour_delta_e"]["p50"], json["colour_delta_e"]["max"]);
    EXPECT_LT(json["colour_delta_e"]["p95"], 1) << "vertices keep their colours";
}

TEST_F(CommandLine, VerifyRefusesAnotherMesh) {
    const fs::path other = *folder_ / "other.ply";
    writeBall(other, 7, 9);
    const Ran ran = run({"verify", dataset().string(), "--against", other.string(), "--json", "--samples", "2000"});
    EXPECT_EQ(ran.status, 1);
    EXPECT_EQ(Json::parse(ran.out)["ok"], false);
    EXPECT_NE(ran.err.find("more than the certified"), std::string::npos) << ran.err;
}

TEST_F(CommandLine, VerifyFindsAChangedByteAnywhere) {
    const std::string whole = contentOf(dataset());
    const fs::path file = *folder_ / "changed.vcp";
    for (size_t i = 0; i < 24; ++i) {
        std::string changed = whole;
        changed[i * (whole.size() - 1) / 23] ^= 0x10;
        write(file, changed);
        const Ran ran = run({"verify", file.string()});
        expectFailure(ran, 1, file.string());
        EXPECT_EQ(Json::parse(run({"verify", file.string(), "--json"}).out)["ok"], false);
    }
}

TEST_F(CommandLine, RenderReportsWhatProgramsRelyOn) {
    if (!hasDevice()) GTEST_SKIP() << "no Vulkan device";
    const fs::path png = *folder_ / "ball.png", depth = *folder_ / "ball.pfm", normals = *folder_ / "normals.png";
    const Ran ran = run({"render", dataset().string(), "-o", png.string(), "--size", "160x120", "--depth",
                         depth.string(), "--normals", normals.string(), "--json"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json json = Json::parse(ran.out);
    for (const char* field : {"frames", "ms_per_frame", "rays_per_second", "hit_pixels", "resident_bytes", "bytes_read",
                              "error_pixels", "pipelines"})
        EXPECT_TRUE(json.contains(field) && json[field].is_number()) << field;
    EXPECT_EQ(json["settled"], true);
    EXPECT_EQ(json["detail"], "settled");
    EXPECT_TRUE(json["device"].is_string());
    EXPECT_GT(json["hit_pixels"], 160 * 120 / 5);
    EXPECT_LE(json["error_pixels"].get<double>(), 0.5);
    const auto picture = readPng(png);
    ASSERT_TRUE(picture) << picture.error().line();
    EXPECT_EQ(picture->width, 160u);
    EXPECT_EQ(fs::file_size(depth), 160u * 120 * 4 + std::string("Pf\n160 120\n-1.0\n").size());
    EXPECT_GT(fs::file_size(normals), 100u);
}

TEST_F(CommandLine, RenderDrawsSixteenSamples) {
    if (!hasDevice()) GTEST_SKIP() << "no Vulkan device";
    const auto render = [&](const std::string& name, std::vector<std::string> more) {
        std::vector<std::string> arguments{"render", dataset().string(), "-o",    (*folder_ / name).string(), "--size",
                                           "96x64",  "--transparent",    "--json"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Ran ran = run(arguments);
        EXPECT_EQ(ran.status, 0) << ran.err;
        return Json::parse(ran.out);
    };
    // The alphas of the picture, counted.
    const auto alphas = [&](const char* name) {
        const Picture picture = readPng(*folder_ / name).value();
        std::map<int, int> count;
        for (size_t i = 3; i < picture.rgba.size(); i += 4) ++count[picture.rgba[i]];
        return count;
    };
    EXPECT_EQ(render("one.png", {"--samples", "1"})["samples"], 1);
    EXPECT_EQ(alphas("one.png").size(), 2u);
    const Json usual = render("usual.png", {});
    EXPECT_EQ(usual["samples"], 16);
    EXPECT_GT(usual["ms_samples"], usual["ms_per_frame"]);
    EXPECT_GT(alphas("usual.png").size(), 10u);
    render("sixteen.png", {"--samples", "16"});
    EXPECT_EQ(readPng(*folder_ / "sixteen.png").value(), readPng(*folder_ / "usual.png").value());
    EXPECT_EQ(render("turn.png", {"--turntable", "2", "--samples", "4"})["samples"], 4);
    EXPECT_EQ(alphas("turn-0002.png").size(), 5u) << "quarters";
    EXPECT_EQ(render("level.png", {"--shading", "level"})["samples"], 1) << "numbers have no mean";
    for (const char* wrong : {"0", "65", "x"})
        expectFailure(run({"render", dataset().string(), "-o", "x.png", "--samples", wrong}), 2, "--samples");
}

TEST_F(CommandLine, RenderOfAMeshBuildsItOnce) {
    if (!hasDevice()) GTEST_SKIP() << "no Vulkan device";
    const fs::path first = *folder_ / "first.png", second = *folder_ / "second.png", built = *folder_ / "built.png";
    ASSERT_EQ(run({"render", ball().string(), "-o", first.string(), "--size", "64x64"}).status, 0);
    const auto datasets = [&] {
        return std::distance(fs::directory_iterator(*folder_ / "cache" / "vcp"), fs::directory_iterator());
    };
    const auto count = datasets();
    EXPECT_GE(count, 1);
    ASSERT_EQ(run({"render", ball().string(), "-o", second.string(), "--size", "64x64"}).status, 0);
    const fs::path file = *folder_ / "as_render_builds_it.vcp";
    ASSERT_EQ(run({"build", ball().string(), "-o", file.string()}).status, 0);
    ASSERT_EQ(run({"render", file.string(), "-o", built.string(), "--size", "64x64"}).status, 0);
    EXPECT_EQ(datasets(), count);
    EXPECT_EQ(contentOf(first), contentOf(second));
    EXPECT_EQ(contentOf(first), contentOf(built));
}

TEST_F(CommandLine, CamerasByNameAndByFile) {
    if (!hasDevice()) GTEST_SKIP() << "no Vulkan device";
    const fs::path camera = *folder_ / "camera.json", png = *folder_ / "camera.png";
    const Ran named =
        run({"render", dataset().string(), "-o", png.string(), "--size", "64x64", "--camera", "iso", "--json"});
    ASSERT_EQ(named.status, 0) << named.err;
    const std::string picture = contentOf(png);
    write(camera, Json::parse(named.out)["camera"].dump());
    ASSERT_EQ(
        run({"render", dataset().string(), "-o", png.string(), "--size", "64x64", "--camera", camera.string()}).status,
        0);
    const auto again = readPng(png);
    ASSERT_TRUE(again);

    write(camera, "{\"position\": [0, 0, 5]}");
    const fs::path none = *folder_ / "none.png";
    const Ran wrong = run({"render", dataset().string(), "-o", none.string(), "--camera", camera.string()});
    expectFailure(wrong, 1, camera.string());
    expectFailure(run({"render", dataset().string(), "-o", none.string(), "--camera", "sideways"}), 1, "sideways");
    EXPECT_FALSE(fs::exists(none));
}

TEST_F(CommandLine, RenderRefusesBrokenPagesWithoutAPicture) {
    if (!hasDevice()) GTEST_SKIP() << "no Vulkan device";
    const Json info = Json::parse(run({"info", dataset().string(), "--json"}).out);
    std::string bytes = contentOf(dataset());
    for (size_t at = bytes.size() / 3; at + 200 < bytes.size(); at += 97) bytes[at] = char(bytes[at] ^ 0x55);
    const fs::path file = *folder_ / "broken_pages.vcp", png = *folder_ / "broken_pages.png";
    write(file, bytes);
    expectFailure(run({"render", file.string(), "-o", png.string(), "--size", "64x64"}), 1, file.string());
    EXPECT_FALSE(fs::exists(png));
}

TEST_F(CommandLine, ThePapersMethodFromMeshToPicture) {
    const fs::path file = *folder_ / "paper.vcp", again = *folder_ / "paper_again.vcp", png = *folder_ / "paper.png";
    const Ran built = run({"build", ball().string(), "-o", file.string(), "--method", "paper", "--cell", "0.05",
                           "--paper-k", "4", "--threads", "1", "--json"});
    ASSERT_EQ(built.status, 0) << built.err;
    const Json report = Json::parse(built.out);
    EXPECT_TRUE(report["certified_error_max"].is_null());
    EXPECT_EQ(report["file_bytes"], fs::file_size(file));
    ASSERT_EQ(run({"build", ball().string(), "-o", again.string(), "--method", "paper", "--cell", "0.05", "--paper-k",
                   "4", "--threads", "3"})
                  .status,
              0);
    EXPECT_EQ(contentOf(file), contentOf(again));

    const Json info = Json::parse(run({"info", file.string(), "--json"}).out);
    EXPECT_EQ(info["method"], "paper");
    EXPECT_EQ(info["cell"], 0.05);
    EXPECT_TRUE(info["certified_error_max"].is_null());
    EXPECT_NE(run({"info", file.string()}).out.find("4 rounds of region growing"), std::string::npos);
    EXPECT_EQ(Json::parse(run({"info", dataset().string(), "--json"}).out)["method"], "certified");
    EXPECT_EQ(run({"verify", file.string()}).status, 0);
    expectFailure(run({"verify", file.string(), "--against", ball().string()}), 1, "--method paper");
    expectFailure(run({"build", ball().string(), "-o", file.string(), "--paper-k", "4"}), 2, "--method paper");
    expectFailure(run({"build", ball().string(), "-o", file.string(), "--method", "paper", "--error", "0.1"}), 2,
                  "--error");
    if (!hasDevice()) return;
    const Ran drawn =
        run({"render", file.string(), "-o", png.string(), "--size", "64x64", "--paper-epsilon", "0.1", "--json"});
    ASSERT_EQ(drawn.status, 0) << drawn.err;
    EXPECT_GT(Json::parse(drawn.out)["hit_pixels"], 64 * 64 / 5);
    EXPECT_TRUE(Json::parse(drawn.out)["error_pixels"].is_null());
    expectFailure(run({"render", file.string(), "-o", png.string(), "--shadows"}), 2, "--shadows");
    expectFailure(run({"render", dataset().string(), "-o", png.string(), "--paper-epsilon", "0.1"}), 2, "--paper-");
}

TEST_F(CommandLine, Devices) {
    if (!hasDevice()) GTEST_SKIP() << "no Vulkan device";
    const Ran ran = run({"devices", "--json"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json json = Json::parse(ran.out);
    int chosen = 0;
    for (const Json& device : json["devices"]) {
        for (const char* field : {"name", "type", "driver"}) EXPECT_TRUE(device[field].is_string()) << field;
        for (const char* field : {"software", "chosen"}) EXPECT_TRUE(device[field].is_boolean()) << field;
        EXPECT_EQ(device["type"] == "cpu", device["software"].get<bool>());
        chosen += device["chosen"].get<bool>();
    }
    EXPECT_EQ(chosen, 1);
    const std::string text = run({"devices"}).out;
    EXPECT_EQ(text.find("software") != std::string::npos, ran.out.find("\"software\": true") != std::string::npos);
    expectFailure(run({"devices", "--device", "no such device"}), 1, "no such device");
    expectFailure(run({"render", dataset().string(), "-o", "x.png", "--device", "no such device"}), 1,
                  "no such device");
}

/// While it lives, programs that are started find no Vulkan driver.
class WithoutDrivers {
public:
    WithoutDrivers() {
        for (const char* name : {"VK_ICD_FILENAMES", "VK_DRIVER_FILES"}) {
            const char* value = getenv(name);
            before_.emplace_back(name, value ? std::optional<std::string>(value) : std::nullopt);
            setenv(name, "/nonexistent/driver.json", 1);
        }
    }
    ~WithoutDrivers() {
        for (const auto& [name, value] : before_)
            value ? setenv(name.c_str(), value->c_str(), 1) : unsetenv(name.c_str());
    }

private:
    std::vector<std::pair<std::string, std::optional<std::string>>> before_;
};

TEST_F(CommandLine, TheHostDrawsWithoutAnyDriver) {
    const auto render = [&](const std::string& name, std::vector<std::string> more) {
        std::vector<std::string> arguments{"render", dataset().string(), "-o",    (*folder_ / name).string(),
                                           "--size", "160x120",          "--json"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    };
    const auto picture = [&](const char* name) { return readPng(*folder_ / name).value(); };
    if (hasDevice()) {
        ASSERT_EQ(render("device.png", {"--shadows"}).status, 0);
        EXPECT_FALSE(Json::parse(run({"devices", "--json"}).out)["devices"].back()["chosen"].get<bool>());
    }
    const WithoutDrivers none;
    ASSERT_FALSE(hasDevice());
    const Json devices = Json::parse(run({"devices", "--json"}).out);
    ASSERT_EQ(devices["devices"].size(), 1u);
    EXPECT_EQ(devices["devices"][0]["name"], "host");
    EXPECT_TRUE(devices["devices"][0]["chosen"].get<bool>());
    EXPECT_TRUE(devices["problem"].is_string());
    EXPECT_TRUE(run({"devices"}).out.starts_with("* -  host: cpu"));

    const Ran drawn =
        render("host.png", {"--device", "host", "--shadows", "--depth", (*folder_ / "host.pfm").string()});
    ASSERT_EQ(drawn.status, 0) << drawn.err;
    const Json report = Json::parse(drawn.out);
    EXPECT_EQ(report["device"], "host");
    EXPECT_EQ(report["pipelines"], 0);
    EXPECT_TRUE(report["settled"].get<bool>());
    EXPECT_GT(report["hit_pixels"], 160 * 120 / 5);
    EXPECT_EQ(fs::file_size(*folder_ / "host.pfm"), std::string("Pf\n160 120\n-1.0\n").size() + 4 * 160 * 120);
    // Where there is no driver, the host is the best there is.
    ASSERT_EQ(render("best.png", {"--shadows"}).status, 0);
    EXPECT_EQ(picture("best.png"), picture("host.png"));
    // Tiles begin where those of the whole picture do, so that their rays are rounded alike.
    ASSERT_EQ(render("tiles.png", {"--shadows", "--tile", "64"}).status, 0);
    EXPECT_EQ(picture("tiles.png"), picture("host.png"));
    ASSERT_EQ(render("turn.png", {"--turntable", "2"}).status, 0);
    EXPECT_NE(picture("turn-0001.png"), Picture{});
    EXPECT_TRUE(fs::exists(*folder_ / "turn-0002.png"));
    expectFailure(render("x.png", {"--device", "llvmpipe"}), 1, "host draws pictures without Vulkan");
    if (!fs::exists(*folder_ / "device.png")) return;
    const Picture host = picture("host.png"), device = picture("device.png");
    uint64_t apart = 0;
    for (size_t i = 0; i < device.rgba.size(); ++i) apart += std::abs(host.rgba[i] - device.rgba[i]) > 2 ? 1 : 0;
    EXPECT_LE(apart, 8u);
}

TEST_F(CommandLine, TheHostSaysWhatItDoesNotDraw) {
    const std::string out = (*folder_ / "refused.png").string();
    const auto refused = [&](const std::vector<std::string>& more) {
        std::vector<std::string> arguments{"render", dataset().string(), "-o", out, "--device", "host"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    };
    expectFailure(refused({"--validation"}), 1, "validation layers");
    expectFailure(run({"view", dataset().string(), "--device", "host"}), 2, "the host draws no window");
    const fs::path soft = *folder_ / "soft.vcp";
    ASSERT_EQ(run({"build", ball().string(), "-o", soft.string(), "--cell", "0.02", "--error", "0.001"}).status, 0);
    expectFailure(run({"render", soft.string(), "-o", out, "--device", "host"}), 1, soft.string());
    EXPECT_FALSE(fs::exists(out));
}

TEST_F(CommandLine, SaysWhetherDistancesOrColoursLimitAPicture) {
    const fs::path scan = *folder_ / "painted.ply", made = *folder_ / "painted.vcp";
    const std::string makeScan = (fs::path(VCP_EXECUTABLE).parent_path() / "make_scan").string();
    ASSERT_EQ(std::system((makeScan + " --triangles 30000 --colour -o " + scan.string() + " >/dev/null").c_str()), 0);
    ASSERT_EQ(run({"build", scan.string(), "-o", made.string()}).status, 0);
    const Json coarse = Json::parse(run({"info", made.string(), "--json"}).out)["level"][0];
    EXPECT_GT(coarse["colour_error_p95"], 6);
    EXPECT_GE(coarse["colour_error_max"], coarse["colour_error_p95"]);
    const auto draw = [&](const char* camera, const char* colourError, const char* shading) {
        const Ran ran =
            run({"render", made.string(), "-o", (*folder_ / "painted.png").string(), "--size", "160x120", "--device",
                 "host", "--camera", camera, "--colour-error", colourError, "--shading", shading, "--json"});
        EXPECT_EQ(ran.status, 0) << ran.err;
        return Json::parse(ran.out);
    };
    const Json any = draw("30,35,0.1", "100", "lit"), near = draw("30,35,0.1", "6", "lit");
    EXPECT_GT(near["bytes_read"], 4 * double(any["bytes_read"]));
    EXPECT_EQ(any["colour_pixels"], 0);
    EXPECT_EQ(any["limited_by"], "geometry");
    EXPECT_LE(draw("30,35,0.1", "6", "clay")["bytes_read"], any["bytes_read"]) << "no colour is shown";
    // Slabs that are smaller than half a pixel may be off.
    const Json far = draw("30,35,0.04", "6", "lit");
    EXPECT_EQ(far["bytes_read"], any["bytes_read"]);
    EXPECT_GT(far["colour_pixels"], far["error_pixels"]);
    EXPECT_LE(far["colour_pixels"], 0.5);
    EXPECT_EQ(far["limited_by"], "colour");
}

TEST_F(CommandLine, ADryRunIsNearWhatTheBuildThenTakes) {
    if (!test::kMemoryIsMeasured) GTEST_SKIP() << "sanitizers take memory of their own";
    const fs::path scan = *folder_ / "estimated.ply", made = *folder_ / "estimated.vcp";
    const std::string makeScan = (fs::path(VCP_EXECUTABLE).parent_path() / "make_scan").string();
    ASSERT_EQ(std::system((makeScan + " --triangles 300k -o " + scan.string() + " >/dev/null").c_str()), 0);
    // With checkpoints whenever one may be made, and with none.
    for (const char* seconds : {"0", "100000"}) {
        const auto build = [&](std::vector<std::string> more) {
            std::vector<std::string> arguments{"build",     scan.string(), "-o",           made.string(), "--json",
                                               "--threads", "2",           "--checkpoint", seconds};
            arguments.insert(arguments.end(), more.begin(), more.end());
            const Ran ran = run(arguments);
            EXPECT_EQ(ran.status, 0) << ran.err;
            return Json::parse(ran.out);
        };
        const Json told = build({"--dry-run"}), took = build({});
        const auto near = [&](const char* expected, const char* real, double less, double more) {
            const double wanted = told[expected], is = took[real];
            EXPECT_LE(less * is, wanted) << expected;
            EXPECT_LE(wanted, more * is) << expected;
        };
        near("memory_bytes", "peak_rss_bytes", 0.7, 2);  // which differs by a third from run to run
        near("temp_bytes", "temp_bytes", 0.6, 1.6);
        near("file_bytes", "file_bytes", 0.8, 1.25);
        EXPECT_GT(told["seconds"], 0);
        EXPECT_GE(told["memory_cap_bytes"], told["memory_bytes"]);
    }
}

TEST_F(CommandLine, APictureInWhichNothingIsSeenIsSaidSo) {
    const std::vector<std::string> words{
        "render", dataset().string(), "-o", (*folder_ / "empty.png").string(), "--size", "64x48", "--device", "host"};
    const Ran seen = run(words);
    EXPECT_EQ(seen.err.find("nothing is seen"), std::string::npos) << seen.err;
    for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--tile", "32"}}) {
        std::vector<std::string> cut = words;
        cut.insert(cut.end(), {"--section", "x>1000000"});
        cut.insert(cut.end(), more.begin(), more.end());
        const Ran empty = run(cut);
        EXPECT_EQ(empty.status, 0) << empty.err;
        EXPECT_NE(empty.err.find("nothing is seen"), std::string::npos) << empty.err;
    }
}

TEST_F(CommandLine, AnInputThatFailsDoesNotKeepTheOthersFromBeingDrawn) {
    const fs::path broken = *folder_ / "broken.vcp", drawn = *folder_ / "drawn";
    std::ofstream(broken) << "no dataset";
    const Ran ran = run({"render", broken.string(), dataset().string(), "-o", drawn.string() + "/", "--size", "64x48",
                         "--device", "host", "--json"});
    EXPECT_EQ(ran.status, 1);
    EXPECT_NE(ran.err.find("1 of 2 inputs could not be drawn: " + broken.string()), std::string::npos) << ran.err;
    EXPECT_TRUE(fs::exists(drawn / (dataset().stem().string() + ".png")));
    EXPECT_FALSE(fs::exists(drawn / "broken.png"));
    const Json pictures = Json::parse(ran.out)["pictures"];
    ASSERT_EQ(pictures.size(), 2u);
    EXPECT_NE(pictures[0]["error"].get<std::string>().find("broken.vcp"), std::string::npos);
    EXPECT_EQ(pictures[1]["width"], 64);
    // An input alone fails with its own error.
    expectFailure(run({"render", broken.string(), "-o", drawn.string() + "/", "--device", "host"}), 1, "broken.vcp");
}

TEST_F(CommandLine, MeasurementsAreDrawn) {
    const fs::path measured = *folder_ / "measurement.json";
    const auto write = [&](const char* text) { std::ofstream(measured) << text; };
    write(R"({"unit": "mm", "lines": [{"points": [{"position": [0, 0, 0]}, {"position": [0.5, 0.2, 0]}]}]})");
    const auto render = [&](const char* name, std::vector<std::string> more) {
        std::vector<std::string> arguments{"render", dataset().string(), "-o",       (*folder_ / name).string(),
                                           "--size", "320x240",          "--device", "host"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    };
    ASSERT_EQ(render("plain.png", {}).status, 0);
    ASSERT_EQ(render("measured.png", {"--measurement", measured.string()}).status, 0);
    EXPECT_NE(readPng(*folder_ / "measured.png").value(), readPng(*folder_ / "plain.png").value());
    expectFailure(render("x.png", {"--measurement", (*folder_ / "none.json").string()}), 1, "none.json");
    write("{}");
    expectFailure(render("x.png", {"--measurement", measured.string()}), 1, "\"lines\" is missing");
    EXPECT_FALSE(fs::exists(*folder_ / "x.png"));
}

TEST_F(CommandLine, LegendsAndScaleBarsAreWrittenIntoPictures) {
    const auto render = [&](const char* name, std::vector<std::string> more) {
        std::vector<std::string> arguments{"render", dataset().string(), "-o",       (*folder_ / name).string(),
                                           "--size", "320x240",          "--device", "host"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    };
    const auto picture = [&](const char* name) { return readPng(*folder_ / name).value(); };
    ASSERT_EQ(render("without.png", {"--shading", "level"}).status, 0);
    ASSERT_EQ(render("whole.png", {"--shading", "level", "--legend", "--scale-bar", "--unit", "mm"}).status, 0);
    ASSERT_EQ(
        render("tiles.png", {"--shading", "level", "--legend", "--scale-bar", "--unit", "mm", "--tile", "50"}).status,
        0);
    ASSERT_EQ(
        render("around.png", {"--shading", "level", "--legend", "--scale-bar", "--unit", "mm", "--turntable", "2"})
            .status,
        0);
    ASSERT_EQ(render("inches.png", {"--shading", "level", "--scale-bar", "--unit", "in"}).status, 0);
    EXPECT_NE(picture("whole.png"), picture("without.png"));
    EXPECT_EQ(picture("tiles.png"), picture("whole.png"));
    EXPECT_EQ(picture("around-0001.png"), picture("whole.png"));
    EXPECT_NE(picture("inches.png"), picture("whole.png"));
    expectFailure(render("x.png", {"--legend", "--shading", "clay"}), 2, "--legend goes with --shading steps");
    expectFailure(render("x.png", {"--unit", "ell"}), 2, "um, mm, cm");
}

TEST_F(CommandLine, APictureOfEachInput) {
    const fs::path work = *folder_ / "each";
    fs::create_directories(work);
    fs::copy_file(dataset(), work / "one.vcp", fs::copy_options::overwrite_existing);
    fs::copy_file(dataset(), work / "two.vcp", fs::copy_options::overwrite_existing);
    const auto render = [&](const std::string& output, std::vector<std::string> more, const char* second = "two.vcp") {
        std::vector<std::string> arguments{"render",
                                           (work / "one.vcp").string(),
                                           (work / second).string(),
                                           "-o",
                                           output,
                                           "--size",
                                           "40x30",
                                           "--samples",
                                           "1",
                                           "--device",
                                           "host"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    };
    const std::string pictures = (work / "new/pictures/").string();
    const Ran first = render(pictures, {"--json"});
    ASSERT_EQ(first.status, 0) << first.err;
    EXPECT_EQ(first.err.find("replaced"), std::string::npos) << first.err;
    const Json told = Json::parse(first.out);
    ASSERT_EQ(told["pictures"].size(), 2u);
    EXPECT_EQ(told["pictures"][1]["output"], pictures + "two.png");
    EXPECT_EQ(readPng(pictures + "one.png").value(), readPng(pictures + "two.png").value());
    const Ran again = render(pictures, {});
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_NE(again.err.find("2 of 2 pictures are there already and are replaced"), std::string::npos) << again.err;

    ASSERT_EQ(render((work / "{}-deep.png").string(), {"--depth", (work / "{}.pfm").string()}).status, 0);
    EXPECT_TRUE(fs::exists(work / "two-deep.png") && fs::exists(work / "two.pfm"));
    expectFailure(render((work / "{}.png").string(), {"--depth", (work / "depth.pfm").string()}), 2, "with {}");
    expectFailure(render(pictures, {}, "../each/one.vcp"), 2, "would both be drawn into");
    expectFailure(render((work / "{}.jpg").string(), {}), 2, ".png");

    // A picture's name that stands for an input: the input stays.
    const std::string before = contentOf(work / "one.vcp");
    fs::create_symlink("one.vcp", work / "link.png");
    fs::rename(work / "two.vcp", work / "link.vcp");
    EXPECT_EQ(render((work / "{}.png").string(), {"--overwrite"}, "link.vcp").status, 1);
    EXPECT_EQ(contentOf(work / "one.vcp"), before);
}

// What only benchmarks and the paper's method need is not in the way of what everybody needs, and is there on demand.
TEST_F(CommandLine, HelpIsShortAndAllOfItIsThere) {
    for (const char* command : {"build", "render"}) {
        const std::string brief = run({command, "--help"}).out, all = run({command, "--help-all"}).out;
        EXPECT_EQ(brief.find("--paper-"), std::string::npos) << brief;
        EXPECT_NE(brief.find("More with --help-all"), std::string::npos) << brief;
        EXPECT_NE(all.find("--paper-scheme"), std::string::npos) << all;
        EXPECT_EQ(all.find("More with --help-all"), std::string::npos);
        for (const std::string& text : {brief, all})
            for (size_t from = 0, end; from < text.size(); from = end + 1) {
                end = std::min(text.find('\n', from), text.size());
                EXPECT_LE(end - from, 110u) << text.substr(from, end - from);
            }
    }
    EXPECT_NE(run({"view", "--help"}).out.find("How it looks:"), std::string::npos);
}

TEST_F(CommandLine, PicturesInTilesAndSequences) {
    if (!hasDevice()) GTEST_SKIP() << "no Vulkan device";
    const auto render = [&](const std::string& name, std::vector<std::string> more) {
        std::vector<std::string> arguments{"render", dataset().string(), "-o", (*folder_ / name).string(), "--size",
                                           "96x64"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    };
    const auto picture = [&](const char* name) { return readPng(*folder_ / name).value(); };
    // Without a camera of its own a turntable stands where it sees all of the scan from every side.
    const fs::path camera = *folder_ / "camera.json";
    write(camera, R"({"position":[0,0,4],"target":[0,0,0]})");
    ASSERT_EQ(render("tiled.png", {"--tile", "32", "--camera", camera.string()}).status, 0);
    const Ran turned = render("turn.png", {"--tile", "32", "--turntable", "3", "--json", "--camera", camera.string()});
    ASSERT_EQ(turned.status, 0) << turned.err;
    EXPECT_EQ(Json::parse(turned.out)["pictures"], 3);
    EXPECT_EQ(Json::parse(turned.out)["tiles"], 18);
    EXPECT_EQ(picture("turn-0001.png"), picture("tiled.png")) << "it begins where the camera is";
    EXPECT_NE(picture("turn-0002.png"), picture("turn-0001.png"));
    EXPECT_TRUE(fs::exists(*folder_ / "turn-0003.png"));
    EXPECT_FALSE(fs::exists(*folder_ / "turn-0004.png") || fs::exists(*folder_ / "turn.png"));

    const fs::path path = *folder_ / "path.json";
    write(path, R"([{"position":[0,0,4],"target":[0,0,0]},{"position":[3,0,4],"target":[0,0,0]}])");
    ASSERT_EQ(render("path.png", {"--path", path.string(), "--frames", "2", "--transparent"}).status, 0);
    EXPECT_EQ(picture("path-0001.png").rgba[3], 0);
    EXPECT_NE(picture("path-0002.png"), picture("path-0001.png"));
    expectFailure(render("x.png", {"--path", (*folder_ / "none.json").string()}), 1, "none.json");
    write(path, "[{]");
    expectFailure(render("x.png", {"--path", path.string()}), 1, path.string());
    expectFailure(render("x.png", {"--path", path.string(), "--turntable", "3"}), 2, "--turntable");

    ASSERT_EQ(render("deep.png", {"--turntable", "2", "--depth", (*folder_ / "deep.pfm").string(), "--normals",
                                  (*folder_ / "normal.png").string()})
                  .status,
              0);
    for (const char* name : {"deep-0001.pfm", "deep-0002.pfm", "normal-0001.png", "normal-0002.png"})
        EXPECT_TRUE(fs::exists(*folder_ / name)) << name;
    EXPECT_NE(contentOf(*folder_ / "deep-0001.pfm"), contentOf(*folder_ / "deep-0002.pfm"));
    EXPECT_FALSE(fs::exists(*folder_ / "deep.pfm") || fs::exists(*folder_ / "deep-0003.pfm"));
}

TEST_F(CommandLine, ATurntableIsAVideoOfItsPictures) {
    if (!hasDevice()) GTEST_SKIP() << "no Vulkan device";
    const test::EncoderInPath encoder(folder_->path());
    const auto render = [&](const std::string& name, std::vector<std::string> more) {
        std::vector<std::string> arguments{"render", dataset().string(), "-o", (*folder_ / name).string(), "--size",
                                           "96x64"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    };
    ASSERT_EQ(render("filmed.png", {"--turntable", "3", "--tile", "32"}).status, 0);
    std::string wanted = "1234ftyp";
    for (const char* name : {"filmed-0001.png", "filmed-0002.png", "filmed-0003.png"}) {
        const Picture picture = readPng(*folder_ / name).value();
        wanted.append(picture.rgba.begin(), picture.rgba.end());
    }
    const Ran filmed = render("filmed.mp4", {"--turntable", "3", "--tile", "32"});
    ASSERT_EQ(filmed.status, 0) << filmed.err;
    EXPECT_NE(filmed.out.find("filmed.mp4: 96x64, 3 pictures"), std::string::npos) << filmed.out;
    EXPECT_EQ(contentOf(*folder_ / "filmed.mp4"), wanted);
    expectFailure(render("one.mp4", {}), 2, "--turntable");
    expectFailure(render("clear.webm", {"--turntable", "3", "--transparent"}), 2, "--transparent");
    const test::EncoderInPath failing(folder_->path(), "echo 'no room' >&2\nexit 1\n");
    expectFailure(render("failed.mp4", {"--turntable", "3"}), 1, "failed.mp4: ffmpeg failed: no room");
    EXPECT_FALSE(fs::exists(*folder_ / "failed.mp4") || fs::exists(*folder_ / "failed.mp4.partial"));
}

TEST_F(CommandLine, ViewWithoutADisplayPointsToRender) {
    expectFailure(run({"view", dataset().string()}), 1, "vcp render");
    expectFailure(run({"view", dataset().string(), ball().string()}), 1, "vcp render");
    const fs::path scene = *folder_ / "wrong_scene.json";
    write(scene, "{\n\"datasets\": [{\"file\": \"none.vcp\", \"scale\": 0}]}");
    expectFailure(run({"view", scene.string()}), 1, scene.string() + ": line 2: \"scale\"");
    expectFailure(run({"view", scene.string(), scene.string()}), 2, "opened alone");
}

TEST_F(CommandLine, ScenesOfSeveralDatasets) {
    if (!hasDevice()) GTEST_SKIP() << "no Vulkan device";
    const auto render = [&](const std::string& png, std::vector<std::string> arguments) {
        std::vector<std::string> all{"render", "-o", (*folder_ / png).string(), "--size", "96x64", "--json"};
        all.insert(all.end(), arguments.begin(), arguments.end());
        const Ran ran = run(all);
        EXPECT_EQ(ran.status, 0) << ran.err;
        return Json::parse(ran.out, nullptr, false);
    };
    render("one.png", {dataset().string()});
    render("twice.png", {dataset().string(), dataset().string()});
    EXPECT_EQ(readPng(*folder_ / "one.png").value(), readPng(*folder_ / "twice.png").value())
        << "two in one place look like one";
    const fs::path scene = *folder_ / "scene.json", beside = *folder_ / "beside.off";
    // A mesh beside a dataset is one of its own.
    write(beside, "OFF\n4 4 6\n2 0 0\n3 0 0\n2 1 0\n2 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
    write(scene, Json{{"datasets", {{{"file", dataset().string()}}, {{"file", beside.string()}}}}}.dump());
    render("both.png", {dataset().string(), beside.string()});
    render("both_in_scene.png", {scene.string()});
    EXPECT_EQ(readPng(*folder_ / "both.png").value(), readPng(*folder_ / "both_in_scene.png").value());
    EXPECT_NE(readPng(*folder_ / "both.png").value(), readPng(*folder_ / "one.png").value());
    // A small one before the large one, a mesh, and one beside; the camera is the scene's.
    write(scene, Json{{"datasets",
                       {{{"file", dataset().filename().string()}},
                        {{"file", ball().string()}, {"scale", 0.25}, {"translate", {0, 0, 1.5}}},
                        {{"file", dataset().string()},
                         {"translate", {-3, 0, 0}},
                         {"rotate", {{"axis", {0, 0, 1}}, {"degrees", 90}}}}}},
                      {"camera", {{"position", {-1, 0, 8}}, {"target", {-1, 0, 0}}}}}
                     .dump());
    const Json whole = render("scene.png", {scene.string(), "--depth", (*folder_ / "scene.pfm").string()});
    EXPECT_EQ(whole["settled"], true);
    EXPECT_EQ(whole["camera"]["position"], (Json{-1.0, 0.0, 8.0}));
    render("tiles.png", {scene.string(), "--tile", "40"});
    const Picture picture = readPng(*folder_ / "scene.png").value(), tiles = readPng(*folder_ / "tiles.png").value();
    size_t other = 0;
    for (size_t i = 0; i < picture.rgba.size(); ++i) other += std::abs(picture.rgba[i] - tiles.rgba[i]) > 3 ? 1 : 0;
    EXPECT_LT(other, picture.rgba.size() / 200);
    expectFailure(run({"render", scene.string(), dataset().string(), "-o", "x.png"}), 2, "opened alone");
}

TEST_F(CommandLine, UnwritableOutputs) {
    const fs::path nowhere = *folder_ / "no" / "such" / "folder";
    expectFailure(run({"build", ball().string(), "-o", (nowhere / "x.vcp").string()}), 1, (nowhere / "x.vcp").string());
    const std::string under = (ball() / "x.vcp").string();
    expectFailure(run({"build", ball().string(), "-o", under}), 1, under);
    if (!hasDevice()) return;
    expectFailure(run({"render", dataset().string(), "-o", (nowhere / "x.png").string(), "--size", "64x64"}), 1,
                  (nowhere / "x.png").string());
}

TEST_F(CommandLine, FullDiskLeavesNothingHalfWritten) {
    dataset();
    const fs::path file = *folder_ / "full.vcp", png = *folder_ / "full.png";
    expectFailure(program().wait(program().start({"build", ball().string(), "-o", file.string()}, "stdout", true)), 1,
                  "full.vcp");
    EXPECT_FALSE(fs::exists(file));
    EXPECT_FALSE(fs::exists(file.string() + ".partial"));
    if (!hasDevice()) return;
    const fs::path depth = *folder_ / "full.pfm";
    expectFailure(program().wait(program().start({"render", dataset().string(), "-o", png.string(), "--depth",
                                                  depth.string(), "--size", "300x200"},
                                                 "stdout", true)),
                  1, "full.");
    EXPECT_FALSE(fs::exists(png));
    EXPECT_FALSE(fs::exists(depth));
    EXPECT_FALSE(fs::exists(depth.string() + ".partial"));
}

TEST_F(CommandLine, FullStandardOutputIsAFailure) {
    if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
    const Ran ran = program().wait(program().start({"info", dataset().string()}, "/dev/full"));
    EXPECT_EQ(ran.status, 1);
    EXPECT_NE(ran.err.find("standard output"), std::string::npos) << ran.err;
}

/// Whether a process handles a signal, or has ended.
bool catches(pid_t process, int signal) {
    std::ifstream status("/proc/" + std::to_string(process) + "/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("State:\tZ"))
            return true;
        else if (line.starts_with("SigCgt:"))
            return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1) != 0;
    return true;
}

TEST_F(CommandLine, InterruptedBuildLeavesNothing) {
    const fs::path big = *folder_ / "big.ply", file = *folder_ / "big.vcp";
    writeBall(big, 500, 1000);
    const pid_t child = program().start({"build", big.string(), "-o", file.string(), "--threads", "1"});
    while (!catches(child, SIGINT)) usleep(1000);
    kill(child, SIGINT);
    const Ran ran = program().wait(child);
    EXPECT_EQ(ran.status, 1) << "a build of a million triangles takes longer than to see that it is to end";
    EXPECT_FALSE(fs::exists(file));
    EXPECT_FALSE(fs::exists(file.string() + ".partial"));
    EXPECT_EQ(ran.errLines(), 1u) << ran.err;
    EXPECT_NE(ran.err.find("cancel"), std::string::npos) << ran.err;
}

TEST_F(CommandLine, DegenerateTrianglesAreCountedNotFatal) {
    const fs::path mesh = *folder_ / "degenerate.ply", file = *folder_ / "degenerate.vcp";
    write(mesh,
          "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
          "element face 3\nproperty list uchar int vertex_indices\nend_header\n"
          "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n3 0 1 1\n3 0 1 3\n");
    const Ran ran = run({"build", mesh.string(), "-o", file.string(), "--json"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(Json::parse(ran.out)["triangles"], 3);
    EXPECT_EQ(Json::parse(ran.out)["degenerate_triangles"], 1);
}

TEST_F(CommandLine, ADatasetBehindAServerIsThatOfTheFile) {
    if (!hasDevice()) GTEST_SKIP() << "no Vulkan device";
    const fs::path file = dataset();
    const test::RangeServer server(folder_->path());
    ASSERT_TRUE(server.runs());
    const std::string url = server.url("ball.vcp"), cache = (*folder_ / "blocks").string();
    const Json local = Json::parse(run({"info", file.string(), "--json"}).out),
               remote = Json::parse(run({"info", url, "--json"}).out);
    EXPECT_EQ(local["triangles"], remote["triangles"]);
    EXPECT_EQ(local["level"], remote["level"]);
    EXPECT_EQ(run({"verify", url, "--progress", "none"}).status, 0);
    const std::string here = (*folder_ / "here.png").string(), there = (*folder_ / "there.png").string();
    ASSERT_EQ(run({"render", file.string(), "-o", here, "--size", "160x120"}).status, 0);
    for (int i = 0; i < 2; ++i) {
        const Ran ran = run({"render", url, "-o", there, "--size", "160x120", "--cache", cache});
        ASSERT_EQ(ran.status, 0) << ran.err;
        EXPECT_EQ(contentOf(there), contentOf(here));
        fs::remove(there);
    }
    EXPECT_FALSE(fs::is_empty(cache));
    expectFailure(run({"info", server.url("none.vcp")}), 1, "no such file on the server");
    expectFailure(run({"render", server.url("ball.vcp?fault=whole"), "-o", there}), 1,
                  "does not answer range requests");
}

TEST_F(CommandLine, StressReportsAndItsInvariantsHold) {
    if (!hasDevice()) GTEST_SKIP() << "no Vulkan device";
    const std::string out = (*folder_ / "stress").string();
    const Ran ran = run({"stress",
                         dataset().string(),
                         "--path",
                         "teleport",
                         "--frames",
                         "20",
                         "--size",
                         "96x64",
                         "--budget",
                         "1M",
                         "--error-pixels",
                         "0.05",
                         "--faults",
                         "error=0.1,corrupt=0.01,stall=30ms,spread=2ms",
                         "--seed",
                         "3",
                         "--out",
                         out,
                         "--json",
                         "--progress",
                         "none"});
    ASSERT_EQ(ran.status, 0) << ran.err << ran.out.substr(0, 2000);
    const Json json = Json::parse(ran.out);
    EXPECT_EQ(json["violations"], Json::array());
    for (const char* field : {"first_picture_seconds", "settled_seconds", "bytes_read", "bytes_needed", "budget_bytes",
                              "resident_bytes_max"})
        EXPECT_GT(json[field].get<double>(), 0) << field;
    for (const char* field : {"frame_ms", "frame_ms_no_loads"})
        for (const char* q : {"p50", "p95", "p99", "max"}) EXPECT_GT(json[field][q].get<double>(), 0) << field << q;
    EXPECT_LE(json["resident_bytes_max"].get<uint64_t>(), json["budget_bytes"].get<uint64_t>());
    EXPECT_EQ(json["samples"].size(), 20u);
    for (const char* name :
         {"stress.json", "stress.md", "stress_bytes.svg", "stress_pages.svg", "stress_frames.svg", "stress_error.svg"})
        EXPECT_GT(fs::file_size(fs::path(out) / name), 100u) << name;
    const Ran orders =
        run({"stress", dataset().string(), "--path", "orbit", "--frames", "2", "--size", "96x64", "--error-pixels",
             "0.02", "--order", "feedback,error,nearest,breadth,random", "--out", out, "--json", "--progress", "none"});
    ASSERT_EQ(orders.status, 0) << orders.err << orders.out.substr(0, 2000);
    const Json curves = Json::parse(orders.out)["orders"];
    ASSERT_EQ(curves.size(), 5u);
    for (const Json& curve : curves) {
        EXPECT_GT(curve["samples"].size(), 2u);
        EXPECT_EQ(curve["samples"].back()["error"], 0);
        EXPECT_GT(curve["samples"][0]["error"].get<double>(), 0);
    }
    EXPECT_GT(fs::file_size(fs::path(out) / "stress_orders.svg"), 100u);
    const Ran together = run({"stress", dataset().string(), "--path", "orbit", "--frames", "4", "--size", "64x48",
                              "--error-pixels", "0.02", "--views", "3", "--json", "--progress", "none"});
    ASSERT_EQ(together.status, 0) << together.out << together.err;
    const Json views = Json::parse(together.out)["several_views"];
    EXPECT_EQ(views["views"], 3);
    EXPECT_EQ(views["identical"], 3);
    EXPECT_EQ(views["relaxed"], 0);
    EXPECT_EQ(views["loads"], views["pages_resident"]) << "each page once, for all";
    expectFailure(run({"stress", dataset().string(), "--order", "newest"}), 2, "newest");
    expectFailure(run({"stress", dataset().string(), "--path", "no/such/file"}), 1, "no/such/file");
    expectFailure(run({"stress", dataset().string(), "--faults", "error=2"}), 2, "error=2");
}

TEST_F(CommandLine, OptionsThatMayStandAloneTakeNoFileForTheirValue) {
    const std::string png = *folder_ / "optional.png";
    const auto draw = [&](std::vector<std::string> words) {
        fs::remove(png);
        words.insert(words.begin(), "render");
        // Into the ball, where there is something to occlude.
        for (const char* word :
             {"--section=z<50%", "--size", "32x32", "--samples", "1", "--device", "host", "-o", png.c_str()})
            words.emplace_back(word);
        const Ran ran = run(words);
        EXPECT_EQ(ran.status, 0) << ran.err;
        return contentOf(png);
    };
    const std::string file = dataset();
    const std::string usual = draw({file, "--occlusion"}), plain = draw({file});
    EXPECT_NE(usual, plain);
    EXPECT_EQ(draw({"--occlusion", file}), usual);
    EXPECT_EQ(draw({"--occlusion=3", file}), usual);
    EXPECT_EQ(draw({"--occlusion", "3", file}), usual);
    EXPECT_EQ(draw({file, "--occlusion", "--shadows"}), draw({"--shadows", "--occlusion", "3", file}));
    EXPECT_EQ(draw({"--occlusion", "0", file}), plain);
    const std::string cut = draw({file, "--section", "x<50%", "--section", "y<50%"});
    EXPECT_NE(cut, plain);
    EXPECT_EQ(draw({"--section", "x<50%", "--section", "y<50%", file}), cut);
    EXPECT_EQ(draw({"--section", "x<50%", "--section", "y<50%", "--caps", file}),
              draw({file, "--section", "x<50%", "--section", "y<50%", "--caps=closed"}));
    expectFailure(run({"render", "--occlusion", "9999", file, "-o", png}), 2, "--occlusion");
    std::vector<std::string> seven{"render", file, "-o", png};
    for (int i = 0; i < 7; ++i) seven.insert(seven.end(), {"--section", "x<50%"});
    expectFailure(run(seven), 2, "at most 6 times");
    expectFailure(run({"bench", "meso", "--device", "no-such-asset"}), 2, "no-such-asset");
    expectFailure(run({"bench", "meso", "--remesh", "no-such-asset"}), 2, "no-such-asset");
    expectFailure(run({"bench", "meso", "--remesh=none", "beads"}), 2, "--remesh");
}

}  // namespace
}  // namespace vcp
