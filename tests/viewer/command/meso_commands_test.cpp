// vcp meso and vcp bench meso from the outside.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <png.h>
#include <nlohmann/json.hpp>

#include "render/picture.h"
#include "tests/support/vcp_program.h"

namespace vcp {
namespace {

using Json = nlohmann::json;

class MesoCommands : public testing::Test {
protected:
    MesoCommands() : folder_("vcp_meso_test") {}

    [[nodiscard]] Ran run(const std::string& arguments) const { return VcpProgram(folder_).runWords(arguments); }
    [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }

    /// Writes a scene of these surfaces, and of further keys after a comma.
    [[nodiscard]] std::string scene(const std::string& surfaces, const std::string& rest = "") const {
        std::ofstream(path("scene.json")) << R"({"mesostructure": [)" << surfaces << "]" << rest << "}";
        return path("scene.json");
    }
    /// Draws a scene into a.png, with one JSON object.
    [[nodiscard]] Ran draw(const std::string& scene, const std::string& options) const {
        return run("render --samples 1 " + scene + " -o " + path("a.png") +
                   " --up z --progress none --validation --json " + options);
    }
    [[nodiscard]] std::vector<uint8_t> pixels() const {
        const auto picture = readPng(path("a.png"));
        EXPECT_TRUE(picture);
        return picture ? picture->rgba : std::vector<uint8_t>();
    }

    /// A ramp along x, 16 x 8 texels.
    void writeRamp(const std::string& name, bool isWide) const {
        png_image image{};
        image.version = PNG_IMAGE_VERSION, image.width = 16, image.height = 8;
        std::vector<uint8_t> bytes(16 * 8);
        for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = uint8_t(i % 16 * 17);
        image.format = PNG_FORMAT_GRAY;
        ASSERT_TRUE(png_image_write_to_file(&image, path(name).c_str(), 0, bytes.data(), 0, nullptr));
        if (!isWide) return;
        std::vector<uint16_t> values(16 * 8 * 3, 40000);
        image.format = PNG_FORMAT_LINEAR_RGB;
        ASSERT_TRUE(png_image_write_to_file(&image, path(name).c_str(), 0, values.data(), 0, nullptr));
    }

    TestFolder folder_;
};

TEST_F(MesoCommands, BuildsAndTellsWhatIsInIt) {
    writeRamp("ramp.png", false);
    writeRamp("flat.png", true);
    for (const std::string& source : std::vector<std::string>{"beads", "cobble", path("ramp.png"), path("flat.png")}) {
        const std::string out = path("a.meso");
        const Ran built = run("meso build " + source + " -o " + out + " --grid 16 --texels 64 --blocks 4,2 --json");
        ASSERT_EQ(built.status, 0) << built.err;
        const Ran info = run("meso info " + out + " --json");
        ASSERT_EQ(info.status, 0) << info.err;
        Json made = Json::parse(built.out);
        const Json told = Json::parse(info.out);
        EXPECT_GT(made["seconds"], 0);
        made.erase("seconds");
        EXPECT_EQ(made, told);
        EXPECT_GT(told["occupied_cells"], 0);
        EXPECT_GT(told["patches"], 0);
        EXPECT_EQ(run("meso info " + out).status, 0);
    }
    EXPECT_EQ(Json::parse(run("meso info " + path("a.meso") + " --json").out)["texels"], Json::array({16, 8}));
}

TEST_F(MesoCommands, LargeMapsAreHeightsAlone) {
    const std::string build = "meso build needle --texels 4104 -o " + path("large.meso");
    const Ran refused = run(build);
    EXPECT_EQ(refused.status, 1);
    EXPECT_NE(refused.err.find("4104 x 4104 texels: rays are marched over at most 4096"), std::string::npos)
        << refused.err;
    EXPECT_NE(refused.err.find("--only-heights"), std::string::npos) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(path("large.meso")));
    EXPECT_EQ(run("meso build beads --only-heights -o " + path("none.meso")).status, 2);
    const Ran built = run(build + " --only-heights --json");
    ASSERT_EQ(built.status, 0) << built.err;
    const Json told = Json::parse(built.out);
    EXPECT_EQ(told["texels"], Json::array({4104, 4104}));
    EXPECT_TRUE(told["grid"].is_null());
    EXPECT_LT(told["file_bytes"], 2 * 4104 * 4104 + 1000);
    const auto draw = [&](const std::string& rest, const std::string& options = {}) {
        std::ofstream(path("scene.json"))
            << R"({"mesostructure": [{"asset": "large.meso", "tiles": 1, "method": )" << rest << "}]}";
        return run("render " + path("scene.json") + " --size 64x48 --samples 1 --json -o " + path("large.png") +
                   " --overwrite" + options);
    };
    const Ran drawn = draw(R"("remesh")");
    ASSERT_EQ(drawn.status, 0) << drawn.err;
    const Json figures = Json::parse(drawn.out);
    EXPECT_GT(figures["remeshed_pixels"], 0);
    EXPECT_LE(figures["remeshed_pixels"], 0.5);
    EXPECT_GT(figures["surface_bytes"], 2 * 4104 * 4104);
    const std::string shadowless = "casts no shadows: rays are marched over at most 4096 texels";
    EXPECT_EQ(drawn.err.find(shadowless), std::string::npos) << "nobody asked for any: " << drawn.err;
    const Ran shaded = draw(R"("remesh")", " --shadows");
    EXPECT_EQ(shaded.status, 0);
    EXPECT_NE(shaded.err.find(shadowless), std::string::npos) << shaded.err;
    const Ran marched = draw(R"("boxes")");
    EXPECT_EQ(marched.status, 1);
    EXPECT_NE(marched.err.find("at most 4096"), std::string::npos) << marched.err;
}

TEST_F(MesoCommands, SequencesSayWhatIsCertified) {
    std::ofstream(path("scene.json")) << R"({"mesostructure": [{"asset": "ridged", "method": "remesh"}]})";
    const Ran drawn =
        run("render " + path("scene.json") + " --size 64x48 --turntable 2 --samples 1 --json -o " + path("turn.png"));
    ASSERT_EQ(drawn.status, 0) << drawn.err;
    EXPECT_GT(Json::parse(drawn.out)["remeshed_pixels"], 0);
    EXPECT_LE(Json::parse(drawn.out)["remeshed_pixels"], 0.5);
}

TEST_F(MesoCommands, MeshesMustBeClosed) {
    // A tetrahedron, and the same without a face.
    const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n", faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\n";
    std::ofstream(path("closed.obj")) << corners << faces << "f 1 4 3\n";
    std::ofstream(path("open.obj")) << corners << faces;
    const Ran built = run("meso build " + path("closed.obj") + " -o " + path("a.meso") + " --grid 12 --json");
    ASSERT_EQ(built.status, 0) << built.err;
    EXPECT_EQ(Json::parse(built.out)["source"], "mesh");
    EXPECT_EQ(
        run("meso build " + path("closed.obj") + " -o " + path("b.meso") + " --grid 12 --up y --period 2,1.5 --json")
            .status,
        0);
    const Ran open = run("meso build " + path("open.obj") + " -o " + path("c.meso") + " --grid 12");
    EXPECT_EQ(open.status, 1);
    EXPECT_NE(open.err.find("not closed"), std::string::npos) << open.err;
    EXPECT_NE(open.err.find("open.obj"), std::string::npos) << open.err;
    EXPECT_FALSE(std::filesystem::exists(path("c.meso")));
}

/// Pixels of a .pfm of depths that hit something, and how near they are: the sum of 1 / depth.
std::pair<size_t, double> hitsOf(const std::string& pfm) {
    const std::string bytes = contentOf(pfm);
    size_t at = 0;
    for (int line = 0; line < 3; ++line) at = bytes.find('\n', at) + 1;
    std::vector<float> depths((bytes.size() - at) / sizeof(float));
    std::memcpy(depths.data(), bytes.data() + at, depths.size() * sizeof(float));
    size_t hits = 0;
    double nearness = 0;
    for (const float depth : depths) hits += std::isfinite(depth), nearness += 1 / depth;
    return {hits, nearness};
}

TEST_F(MesoCommands, ScenesHaveSurfacesBesideDatasets) {
    writeBall(path("ball.ply"), 20, 40);
    const std::string surface =
        R"("mesostructure": [{"asset": "hemispheres", "tiles": 2, "up": "y", "method": "pyramid"}],
        "camera": {"position": [0.5, 1, 1.2], "target": [0, 0, 0]})";
    std::ofstream(path("alone.json")) << "{" << surface << "}";
    std::ofstream(path("both.json"))
        << R"({"datasets": [{"file": "ball.ply", "scale": 0.2, "translate": [0, 0.3, 0]}], )" << surface << "}";
    const auto draw = [&](const std::string& scene) {
        const Ran ran = run("render --samples 1 " + path(scene) + " -o " + path("a.png") +
                            " --size 64x48 --progress none --depth " + path("a.pfm") + " --normals " + path("n.png"));
        EXPECT_EQ(ran.status, 0) << ran.err;
        return hitsOf(path("a.pfm"));
    };
    const auto alone = draw("alone.json"), both = draw("both.json");
    EXPECT_GT(alone.first, 500u);
    EXPECT_GE(both.first, alone.first);
    EXPECT_GT(both.second, alone.second * 1.01) << "the ball is nearer than what it hides";
    EXPECT_LT(both.second, alone.second * 1.5) << "most is the surface";
    const Ran turned =
        run("render " + path("both.json") + " -o " + path("b.png") + " --turntable 3 --size 64x48 --progress none");
    EXPECT_EQ(turned.status, 0) << turned.err;
    EXPECT_TRUE(std::filesystem::exists(path("b-0003.png")));
}

TEST_F(MesoCommands, TheScenesOfTheDocumentsAreDrawn) {
    for (const std::string scene : {"maze_ball", "beads_gallery", "kitten_wall"}) {
        const Ran ran = run("render --samples 1 " VCP_SOURCE_DIR "/docs/scenes/" + scene + ".json -o " + path("a.png") +
                            " --size 96x64 --progress none --depth " + path("a.pfm"));
        ASSERT_EQ(ran.status, 0) << ran.err;
        EXPECT_GT(hitsOf(path("a.pfm")).first, 500u) << scene;
    }
}

TEST_F(MesoCommands, WhatMovesIsAnimated) {
    const std::string scene = VCP_SOURCE_DIR "/docs/scenes/maze_ball.json",
                      how = " --samples 1 --size 64x48 --progress none";
    const auto drawn = [&](const std::string& options) {
        return run("render " + scene + options + " -o " + path("a.png") + how + " --depth " + path("a.pfm"));
    };
    const Ran ran = drawn(" --animate --frames 4");
    ASSERT_EQ(ran.status, 0) << ran.err;
    const std::string first = contentOf(path("a-0001.pfm")), second = contentOf(path("a-0002.pfm"));
    EXPECT_TRUE(first != second);
    EXPECT_TRUE(second != contentOf(path("a-0003.pfm")));
    EXPECT_FALSE(std::filesystem::exists(path("a-0005.png")));
    ASSERT_EQ(drawn("").status, 0);
    EXPECT_TRUE(contentOf(path("a.pfm")) == first) << "at the beginning it lies where the scene says";
    const Ran none = run("render " VCP_SOURCE_DIR "/docs/scenes/kitten_wall.json --animate -o " + path("a.png") + how);
    EXPECT_EQ(none.status, 2);
    EXPECT_NE(none.err.find("\"path\""), std::string::npos) << none.err;
}

TEST_F(MesoCommands, TheDogOfTheDocumentsIsDrawn) {
    const auto makeScan = std::filesystem::path(VCP_EXECUTABLE).parent_path() / "make_scan";
    ASSERT_EQ(std::system((makeScan.string() + " --shape dog --triangles 10000 -o " + path("dog.obj")).c_str()), 0);
    std::filesystem::copy_file(VCP_SOURCE_DIR "/docs/scenes/beads_dog.json", path("beads_dog.json"));
    const Ran ran = run("render --samples 1 " + path("beads_dog.json") + " -o " + path("a.png") +
                        " --size 96x64 --progress none --depth " + path("a.pfm"));
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_GT(hitsOf(path("a.pfm")).first, 1500u);
}

TEST_F(MesoCommands, TexturesArePictures) {
    writeRamp("ramp.png", false);
    const auto drawn = [&](const std::string& key) {
        const Ran ran = draw(scene(R"({"asset": "edge", "method": "pyramid")" + key + "}"), "--size 64x48");
        EXPECT_EQ(ran.status, 0) << ran.err;
        return pixels();
    };
    const auto plain = drawn(""), textured = drawn(R"(, "texture": "ramp.png")"),
               bent = drawn(R"(, "normal_texture": "ramp.png")");
    EXPECT_NE(plain, textured);
    EXPECT_NE(plain, bent);
    EXPECT_NE(drawn(R"(, "texture": "ramp.png", "normal_texture": "ramp.png")"), textured);
    std::ofstream(path("text.png")) << "not a picture";
    std::filesystem::remove(path("a.png"));
    for (const std::string file : {"none.png", "text.png"}) {
        const Ran ran =
            draw(scene(R"({"asset": "edge", "method": "pyramid", "texture": ")" + file + R"("})"), "--size 64x48");
        EXPECT_EQ(ran.status, 1);
        EXPECT_NE(ran.err.find(file), std::string::npos) << ran.err;
        EXPECT_EQ(ran.errLines(), 1u) << ran.err;
        EXPECT_FALSE(std::filesystem::exists(path("a.png")));
    }
}

TEST_F(MesoCommands, FarSurfacesAreNotMarched) {
    const auto figures = [&](const std::string& key) {
        const Ran ran = draw(scene(R"({"asset": "hemispheres", "tiles": 40, "height": 0.5)" + key + "}"),
                             "--size 64x48 --camera 30,35,0.5");
        EXPECT_EQ(ran.status, 0) << ran.err;
        return Json::parse(ran.out);
    };
    const Json far = figures(""), marched = figures(R"(, "far": false)");
    EXPECT_GT(far["far_hits"], far["hit_pixels"].get<int>() / 2);
    EXPECT_EQ(marched["far_hits"], 0);
    EXPECT_LT(far["iterations_mean"], 0.5 * marched["iterations_mean"].get<double>());
}

TEST_F(MesoCommands, LightFindsItsWayBetweenWalls) {
    ASSERT_EQ(run("meso build hemispheres --texels 32 --grid 16 --transfer 16 --paths 64 --albedo 0 -o " +
                  path("a.meso") + " --progress none")
                  .status,
              0);
    const Ran told = run("meso info " + path("a.meso") + " --json");
    const Json info = Json::parse(told.out);
    EXPECT_EQ(info["transfer"][0], 16);
    EXPECT_GT(info["transfer_cells"].get<int>(), 255);
    EXPECT_EQ(info["transfer_albedo"], 0.0);
    const auto drawn = [&](const std::string& keys, const std::string& rest) {
        const Ran ran = draw(scene(R"({"asset": "a.meso", "tiles": 2)" + keys + "}", rest), "--size 96x72");
        EXPECT_EQ(ran.status, 0) << ran.err;
        return pixels();
    };
    const std::string sky = R"(, "environment": {"source": "overcast"})";
    const auto open = drawn("", sky), shadowed = drawn(R"(, "transfer": true)", sky);
    // Black walls give nothing back: hollows are darker, and nothing is brighter but by what 64 paths are off.
    int64_t less = 0, more = 0;
    for (size_t i = 0; i < open.size(); ++i)
        (shadowed[i] < open[i] ? less : more) += std::abs(int(shadowed[i]) - int(open[i]));
    EXPECT_GT(less, 20 * more);
    EXPECT_GT(less, int64_t(open.size()) / 2);
    // Without surroundings there is nothing to show.
    EXPECT_EQ(drawn(R"(, "far": false)", ""), drawn(R"(, "transfer": true)", ""));
    const auto refused = [&](const std::string& surface) {
        const Ran ran = draw(scene(surface, sky), "");
        EXPECT_EQ(ran.status, 1);
        return ran.err;
    };
    EXPECT_NE(refused(R"({"asset": "beads", "transfer": true})").find("vcp meso build"), std::string::npos);
    EXPECT_NE(refused(R"({"asset": "a.meso", "height": 2, "transfer": true})").find("height"), std::string::npos);
    EXPECT_EQ(run("meso build beads --transfer 256 --memory 1M -o " + path("b.meso")).status, 1);
}

TEST_F(MesoCommands, SaysWhatIsWrong) {
    std::ofstream(path("empty.png")) << "";
    std::ofstream(path("text.png")) << "not a picture";
    std::ofstream(path("a.exr"), std::ios::binary) << "\x76\x2f\x31\x01 and more";
    writeRamp("cut.png", false);
    std::filesystem::resize_file(path("cut.png"), 60);
    const struct {
        std::string arguments;
        int status;
        std::string says;
    } cases[] = {
        {"meso build " + path("empty.png"), 1, "empty"},      {"meso build " + path("text.png"), 1, "neither a PNG"},
        {"meso build " + path("cut.png"), 1, "damaged"},      {"meso build " + path("a.exr"), 1, "EXR"},
        {"meso build " + path("none.png"), 1, "none.png"},    {"meso build nothing", 2, "no procedural one"},
        {"meso build fbm --texels 60 --grid 7", 2, "divide"}, {"meso build beads --cones 0x1", 2, "--cones"},
        {"meso build beads --cones 99x1", 2, "cones"},        {"meso build beads --blocks 1", 2, "block"},
        {"meso build beads --grid 5000", 2, "grid"}};
    for (const auto& c : cases) {
        const Ran ran = run(c.arguments + " -o " + path("x.meso"));
        EXPECT_EQ(ran.status, c.status) << c.arguments << ": " << ran.err;
        EXPECT_NE(ran.err.find(c.says), std::string::npos) << c.arguments << ": " << ran.err;
        EXPECT_EQ(ran.errLines(), 1u) << ran.err;
        EXPECT_FALSE(std::filesystem::exists(path("x.meso"))) << c.arguments;
    }
    const Ran unnamed = run("meso build ball --grid 8 -o " + path("x"));
    EXPECT_EQ(unnamed.status, 2);
    EXPECT_NE(unnamed.err.find("must end in .meso"), std::string::npos) << unnamed.err;
    EXPECT_FALSE(std::filesystem::exists(path("x")));
    EXPECT_EQ(run("meso info " + path("text.png")).status, 1);
    EXPECT_EQ(run("meso").status, 2);
}

TEST_F(MesoCommands, BenchHasTheFieldsThatProgramsRelyOn) {
    const Ran ran =
        run("bench meso beads needle --methods boxes,ddm-quadric,relief-secant --views 45,shadow --rays 100 "
            "--repetitions 1 --check-rays 100 --progress none --json --out " +
            path("report"));
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json report = Json::parse(ran.out);
    std::set<std::string> methods;
    for (const Json& row : report["rows"]) {
        for (const char* field :
             {"asset", "view", "method", "knob", "ns_per_ray", "ratio_to_peer", "ratio_p25", "ratio_p75",
              "fetches_mean", "iterations_mean", "missed", "false", "wrong_feature", "unresolved", "p50_texels",
              "p95_texels", "p99_texels", "bytes", "preprocess_seconds"})
            ASSERT_TRUE(row.contains(field)) << field;
        double sum = 0;
        for (const char* part : {"hit", "miss", "missed", "false", "wrong_feature", "unresolved"})
            sum += row[part].get<double>();
        EXPECT_NEAR(sum, 1, 1e-9);
        EXPECT_GT(row["bytes"], 0);
        EXPECT_LE(row["p50_texels"], row["p99_texels"]);
        const bool isOurs = row["method"] == "boxes";
        EXPECT_EQ(isOurs && row["asset"] == "needle" ? row["missed"] : Json(0.0), 0) << row;
        EXPECT_EQ(isOurs && row["asset"] == "beads" ? row["solver_missed"] : Json(0.0), 0) << row;
        methods.insert(row["method"]);
    }
    EXPECT_EQ(methods.size(), 3u);
    // Two checks (the rays of needle and of beads) for each of eight maps.
    EXPECT_EQ(report["checks"].size(), 16u);
    for (const Json& check : report["checks"]) {
        EXPECT_TRUE(check["map"] == "4x1 paper" || check["oversteps"] == 0) << check;
        EXPECT_EQ(check["rays"], 100) << check;
    }
    for (const Json& best : report["headline"]) {
        double wrong = 0;
        int views = 0;
        for (const Json& row : report["rows"]) {
            if (row["asset"] != best["asset"] || row["method"] != best["method"] || row["knob"] != best["fetches_knob"])
                continue;
            for (const char* part : {"missed", "false", "wrong_feature", "unresolved"})
                wrong += row[part].get<double>();
            EXPECT_LE(row["p95_texels"], 0.25);
            ++views;
        }
        EXPECT_EQ(views, 2);
        EXPECT_LE(wrong / views, 1e-3);
    }
    EXPECT_TRUE(std::ranges::any_of(report["headline"], [](const Json& best) {
        return best["asset"] == "needle" && best["method"] == "boxes";
    })) << report["headline"];
    for (const char* file : {"bench_meso.json", "bench_meso.csv", "bench_meso.md", "bench_meso_beads_p95_time.svg"})
        EXPECT_TRUE(std::filesystem::exists(folder_ / "report" / file)) << file;
    EXPECT_EQ(run("bench meso beads --methods nothing").status, 2);
    EXPECT_EQ(run("bench meso nothing").status, 2);
}

TEST_F(MesoCommands, BenchMeasuresWhatPrismsDistort) {
    const Ran ran =
        run("bench meso ball --methods sphere --views 45 --rays 2000 --repetitions 1 --prisms --progress "
            "none --json --out " +
            path("report"));
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json report = Json::parse(ran.out);
    ASSERT_EQ(report["prisms"].size(), 12u);
    for (size_t i = 0; i < 12; ++i) {
        const Json& row = report["prisms"][i];
        EXPECT_EQ(row["rays"], 2000);
        EXPECT_LT(row["between"], 500) << row;
        // What differs between the maps of one prism falls as it turns less, and so does what a torus has of corners.
        if (i % 4 == 0) continue;
        const Json& coarser = report["prisms"][i - 1];
        for (const char* map : {"straight", "tetrahedra", "curved_smooth"}) {
            const std::string field = std::string(map) + "_p95_texels";
            EXPECT_LT(row[field].get<double>(), 0.65 * coarser[field].get<double>()) << field << ", row " << i;
        }
    }
    // Without normals there is none to judge.
    for (const Json& row : report["rows"]) EXPECT_TRUE(row["normal_p50_degrees"].is_null()) << row;
}

TEST_F(MesoCommands, RendersOnMeshesWithTextureCoordinates) {
    std::ofstream(path("mapped.obj"))
        << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    const Ran ran = draw(scene(R"({"asset": "hemispheres", "method": "pyramid", "surface": "mapped.obj", "tiles": 2})"),
                         "--size 64x48 --camera 30,35 --shadows");
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json told = Json::parse(ran.out);
    EXPECT_GT(told["hit_pixels"], 64 * 48 / 8);
    EXPECT_EQ(told["unresolved_rays"], 0);
    EXPECT_FALSE(told.contains("methods"));
    EXPECT_EQ(ran.err, "");
    EXPECT_TRUE(std::filesystem::exists(path("a.png")));
    // Two assets, and coordinates along a line.
    std::ofstream(path("line.obj"))
        << "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\nf 1/1 3/3 2/2\nf 1/1 2/1 3/1\n";
    const Ran smeared = draw(scene(R"({"asset": "fbm", "method": "pyramid", "surface": "line.obj", "tiles": 2},
                                      {"asset": "maze", "method": "pyramid", "surface": "line.obj", "tiles": 1})"),
                             "--size 32x32 --shading steps");
    ASSERT_EQ(smeared.status, 0) << smeared.err;
    EXPECT_NE(smeared.err.find("smeared"), std::string::npos) << smeared.err;
}

TEST_F(MesoCommands, DecimatesAScanToABase) {
    const std::filesystem::path makeScan = std::filesystem::path(VCP_EXECUTABLE).parent_path() / "make_scan";
    ASSERT_EQ(std::system((makeScan.string() + " --shape dog --triangles 30000 -o " + path("dog.obj")).c_str()), 0);
    const Ran ran =
        run("meso base " + path("dog.obj") + " --triangles 1500 --progress plain --json -o " + path("base.obj"));
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json told = Json::parse(ran.out);
    EXPECT_LE(told["triangles"], 1500);
    EXPECT_GE(told["triangles"], 1490);
    EXPECT_EQ(told["texture_coordinates"], true);
    EXPECT_NE(ran.err.find("collapsing edges"), std::string::npos) << ran.err;
    // The base carries mesostructure, as it is and smoothed.
    const std::string balls = scene(R"({"asset": "ball", "tiles": 20, "surface": "base.obj"})");
    const Ran once = draw(balls, "--size 32x32"), smooth = draw(balls, "--size 32x32 --subdivide 1");
    ASSERT_EQ(once.status, 0) << once.err;
    ASSERT_EQ(smooth.status, 0) << smooth.err;
    // Three pieces of 112 bytes stand on each of four times as many triangles; the arrays of the asset stay.
    const auto bytesOf = [](const Ran& drawn) { return Json::parse(drawn.out)["surface_bytes"].get<int64_t>(); };
    EXPECT_GT(bytesOf(smooth) - bytesOf(once), 3 * 1490 * 3 * 112);
    // Written once more it is the same file, and it is not written over what it is made from.
    const std::string first = contentOf(path("base.obj"));
    EXPECT_EQ(run("meso base " + path("dog.obj") + " --triangles 1500 -o " + path("base.obj")).status, 0);
    EXPECT_EQ(contentOf(path("base.obj")), first);
    const std::string before = contentOf(path("dog.obj"));
    const Ran over = run("meso base " + path("dog.obj") + " --triangles 1500 --overwrite -o " + path("dog.obj"));
    EXPECT_EQ(over.status, 1);
    EXPECT_EQ(over.errLines(), 1u) << over.err;
    EXPECT_EQ(contentOf(path("dog.obj")), before);
    EXPECT_EQ(run("meso base " + path("dog.obj") + " --triangles 1500 -o " + path("base.ply")).status, 2);
}

TEST_F(MesoCommands, AClosedScanBecomesAClosedBase) {
    writeBall(path("ball.ply"), 40, 80);
    const Ran ran = run("meso base " + path("ball.ply") + " --triangles 400 --json -o " + path("base.obj"));
    ASSERT_EQ(ran.status, 0) << ran.err;
    const Json told = Json::parse(ran.out);
    EXPECT_EQ(told["triangles"], 400);
    EXPECT_EQ(told["closed"], true);
    EXPECT_EQ(told["parts"], 1);
    EXPECT_EQ(told["texture_coordinates"], false);
    EXPECT_EQ(told["vertices"], 202);
    // It has no map yet.
    const Ran bare = draw(scene(R"({"asset": "ball", "surface": "base.obj"})"), "");
    EXPECT_EQ(bare.status, 1);
    EXPECT_NE(bare.err.find("has no texture coordinates"), std::string::npos) << bare.err;
}

TEST_F(MesoCommands, WhatIsNotManifoldIsRefusedInOneLine) {
    std::ofstream(path("fin.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
                                      "f 1/1 2/2 3/3\nf 2/1 1/2 4/3\nf 1/1 2/2 5/3\n";
    const std::string fin = scene(R"({"asset": "ball", "surface": "fin.obj"})");
    for (const std::string& command : {"render --subdivide 1 " + fin, "meso base --triangles 4 " + path("fin.obj"),
                                       "meso build --grid 8 " + path("fin.obj")}) {
        const std::string out = path(command.starts_with("render")      ? "x.png"
                                     : command.starts_with("meso base") ? "x.obj"
                                                                        : "x.meso");
        const Ran ran = run(command + " -o " + out);
        EXPECT_EQ(ran.status, 1) << command;
        EXPECT_EQ(ran.errLines(), 1u) << ran.err;
        EXPECT_NE(ran.err.find("fin.obj: triangle 2: 3 triangles meet at the edge from (0, 0, 0) to (1, 0, 0)"),
                  std::string::npos)
            << ran.err;
        EXPECT_FALSE(std::filesystem::exists(out));
    }
    // As it is it can be drawn, with a warning.
    const Ran drawn = draw(fin, "--size 16x16");
    ASSERT_EQ(drawn.status, 0) << drawn.err;
    EXPECT_NE(drawn.err.find("triangle 2: 3 triangles meet at the edge from"), std::string::npos) << drawn.err;
    EXPECT_NE(drawn.err.find("drawn as it is"), std::string::npos) << drawn.err;
}

TEST_F(MesoCommands, RendersMethodsSideBySide) {
    const std::string both = scene(R"({"asset": "maze", "tiles": 1}, {"asset": "ball", "tiles": 1, "scale": 0.5,
        "translate": [0.1, 0.2, -0.05], "base": false})"),
                      options = "--size 40x32 --camera 30,35 --shading steps ";
    const auto drawn = [&](const std::string& methods) {
        const Ran ran = draw(both, options + methods);
        EXPECT_EQ(ran.status, 0) << ran.err;
        return Json::parse(ran.out);
    };
    const Json told = drawn("--methods boxes,dm,cells --frames 2"), panels = told["methods"];
    ASSERT_EQ(panels.size(), 3u);
    EXPECT_EQ(panels[1]["method"], "dm");
    EXPECT_LT(panels[0]["iterations_mean"], panels[2]["iterations_mean"]);
    EXPECT_EQ(told["iterations_mean"], panels[0]["iterations_mean"]);
    EXPECT_EQ(told["frames"], 2);
    const auto all = readPng(path("a.png"));
    ASSERT_TRUE(all) << all.error().line();
    ASSERT_EQ(all->width, 120u);
    ASSERT_EQ(all->height, 32u);
    // Each part is the picture of that method alone; without a method it is that of the scene, boxes.
    const std::string alone[] = {"", "--methods dm", "--methods cells"};
    for (size_t i = 0; i < 3; ++i) {
        drawn(alone[i]);
        const std::vector<uint8_t> part = pixels();
        ASSERT_EQ(part.size(), 4u * 40 * 32);
        for (size_t y = 0; y < 32; ++y)
            EXPECT_TRUE(
                std::equal(part.begin() + 160 * y, part.begin() + 160 * (y + 1), all->rgba.begin() + 480 * y + 160 * i))
                << alone[i] << ", row " << y;
    }
}

TEST_F(MesoCommands, AMethodHasAGridConesAndSteps) {
    const auto iterations = [&](const std::string& keys) {
        const Ran ran = draw(scene(R"({"asset": "hemispheres", "tiles": 2, "far": false, )" + keys + "}"),
                             "--size 40x32 --camera 30,12");
        EXPECT_EQ(ran.status, 0) << ran.err;
        return Json::parse(ran.out)["iterations_mean"].get<double>();
    };
    EXPECT_LT(iterations(R"("method": "cells", "grid": 16)"), iterations(R"("method": "cells", "grid": 64)"));
    EXPECT_NE(iterations(R"("method": "ddm", "grid": 32, "cones": [1, 1])"),
              iterations(R"("method": "ddm", "grid": 32, "cones": [4, 2])"));
    EXPECT_LT(iterations(R"("method": "relief-binary", "steps": 8)"),
              iterations(R"("method": "relief-binary", "steps": 64)"));
}

TEST_F(MesoCommands, RendersWithAScanInTheSamePicture) {
    // A box from 0 to 0.4 over a quad.
    std::ofstream(path("box.obj"))
        << "v 0 0 0\nv .4 0 0\nv .4 .4 0\nv 0 .4 0\nv 0 0 .4\nv .4 0 .4\nv .4 .4 .4\nv 0 .4 .4\n"
           "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    ASSERT_EQ(run("build " + path("box.obj") + " -o " + path("box.vcp")).status, 0);
    const std::string surface = R"({"asset": "edge", "method": "pyramid", "tiles": 1, "scale": 0.5})",
                      options = "--camera front --size 64x64";
    const Ran alone = draw(scene(surface), options),
              both = draw(scene(surface, R"(, "datasets": [{"file": "box.vcp"}])"), options);
    ASSERT_EQ(alone.status, 0) << alone.err;
    ASSERT_EQ(both.status, 0) << both.err;
    // From the front the quad is a line, the box a square of two fifths of its width, and nearer.
    EXPECT_GT(Json::parse(both.out)["hit_pixels"], Json::parse(alone.out)["hit_pixels"].get<int>() + 64 * 64 / 16);
    EXPECT_EQ(draw(scene(surface, R"(, "datasets": [{"file": "none.vcp"}])"), options).status, 1);
}

TEST_F(MesoCommands, RenderSaysWhatIsWrong) {
    std::ofstream(path("bare.obj")) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
    std::ofstream(path("wild.obj")) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nf 1/1 2/1 9/1\n";
    std::ofstream(path("nan.obj")) << "v 0 0 0\nv 1 nan 0\n";
    std::ofstream(path("back.obj"))
        << "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\nf 1/1 3/3 2/2\n";
    std::ofstream(path("far.obj")) << "v 0 0 0\nv 1e39 0 0\nv 1e39 1e39 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n";
    std::ofstream(path("bare.stl")) << "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 "
                                       "1 0\nendloop\nendfacet\nendsolid a\n";
    writeBall(path("ball.ply"), 4, 8);
    const auto withKeys = [&](const std::string& keys) { return R"({"asset": "fbm", )" + keys + "}"; };
    const std::string plain = R"({"asset": "fbm"})";
    const struct {
        std::string surfaces, options;
        int status;
        std::string says;
    } cases[] = {{withKeys(R"("surface": "bare.obj")"), "", 1, "line 4: has no texture coordinates"},
                 {withKeys(R"("surface": "wild.obj")"), "", 1,
                  "line 5: byte 41: a face names vertex 9, more than a file of this size can hold"},
                 {withKeys(R"("surface": "nan.obj")"), "", 1, "line 2, vertex 2: byte 8: the position is not finite"},
                 {withKeys(R"("surface": "bare.stl")"), "", 1, "has no texture coordinates"},
                 {withKeys(R"("surface": "none.obj")"), "", 1, "none.obj"},
                 {withKeys(R"("surface": "back.obj")"), "", 1, "own backs"},
                 {withKeys(R"("surface": "far.obj")"), "", 1, "single precision"},
                 {R"({"asset": "nothing"})", "", 1, "\"asset\""},
                 {R"({"asset": "beads", "method": "pyramid"})", "", 1, "height fields"},
                 {R"({"asset": "beads"})", "--methods boxes,pyramid", 1, "height fields"},
                 {withKeys(R"("method": "magic")"), "", 1, "pyramid"},
                 {withKeys(R"("cones": [4.5, 2])"), "", 1, "cones"},
                 {withKeys(R"("cones": [33, 1])"), "", 1, "from 1 to 32"},
                 {withKeys(R"("cones": 4)"), "", 1, "\"cones\""},
                 {withKeys(R"("grid": 0)"), "", 1, "\"grid\""},
                 {withKeys(R"("steps": 5000)"), "", 1, "\"steps\""},
                 {withKeys(R"("far": 1)"), "", 1, "\"far\""},
                 {plain, "--methods magic", 2, "--methods"},
                 {plain, "--methods", 2, "--methods"},
                 {plain, "--methods pyramid,boxes --depth " + path("d.pfm"), 2, "--depth"},
                 {plain, "--methods boxes --turntable 3", 2, "--methods"},
                 {plain, "--methods boxes --size 9000x9000", 2, "--methods"},
                 {plain, "--camera 30", 2, "--camera"},
                 {plain, "--camera 30,90", 2, "--camera"},
                 {plain, "--camera 30,35,0", 2, "--camera"},
                 {plain, "--size 0x7", 2, "--size"}};
    for (const auto& c : cases) {
        const Ran ran = draw(scene(c.surfaces), c.options);
        EXPECT_EQ(ran.status, c.status) << c.surfaces << c.options << ": " << ran.err;
        EXPECT_NE(ran.err.find(c.says), std::string::npos) << c.surfaces << c.options << ": " << ran.err;
        EXPECT_EQ(ran.errLines(), 1u) << ran.err;
        EXPECT_FALSE(std::filesystem::exists(path("a.png"))) << c.surfaces << c.options;
    }
    const Ran bare = draw(path("ball.ply"), "--methods boxes");
    EXPECT_EQ(bare.status, 2) << bare.err;
    EXPECT_NE(bare.err.find("mesostructure"), std::string::npos) << bare.err;
}

TEST_F(MesoCommands, TheOldCommandSaysWhereItWent) {
    const Ran ran = run("meso render beads --surface teapot --tiles 6 --shadows --view=-30,35 -o " + path("x.png"));
    EXPECT_EQ(ran.status, 2);
    EXPECT_EQ(ran.errLines(), 1u) << ran.err;
    EXPECT_NE(ran.err.find("`vcp render SCENE.json"), std::string::npos) << ran.err;
    EXPECT_EQ(run("meso help").status, 2);
}

TEST_F(MesoCommands, BenchOnADeviceFindsWhatTheProcessorFinds) {
    const std::string arguments =
        "bench meso beads --methods boxes,dm --views 45 --rays 400 --repetitions 1 --progress none --json";
    const Ran here = run(arguments), there = run(arguments + " --device");
    ASSERT_EQ(here.status, 0) << here.err;
    ASSERT_EQ(there.status, 0) << there.err;
    const Json a = Json::parse(here.out)["rows"], b = Json::parse(there.out)["rows"];
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i) {
        EXPECT_EQ(a[i]["device"], "cpu");
        EXPECT_NE(b[i]["device"], "cpu");
        EXPECT_GT(b[i]["ns_per_ray"], 0);
        // The peer is what times are divided by.
        for (const Json& row : {a[i], b[i]}) EXPECT_TRUE(row["method"] != "dm" || row["ratio_to_peer"] == 1) << row;
        EXPECT_NEAR(a[i]["hit"].get<double>(), b[i]["hit"].get<double>(), 0.01);
        EXPECT_NEAR(a[i]["fetches_mean"].get<double>(), b[i]["fetches_mean"].get<double>(),
                    0.02 * a[i]["fetches_mean"].get<double>());
    }
}

}  // namespace
}  // namespace vcp
