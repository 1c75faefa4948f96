// Scene files: what they say is taken over, and what is wrong is said with line and key.
#include "viewer/scene/scene_file.h"

#include <algorithm>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "render/picture.h"
#include "tests/support/test_folder.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {
namespace {

TEST(SceneFile, TheDocumentsExampleIsRead) {
    const std::string document = contentOf(std::string(VCP_SOURCE_DIR) + "/docs/scenes.md");
    const size_t begin = document.find("```json\n") + 8, end = document.find("```", begin);
    const auto scene = sceneFromJson(document.substr(begin, end - begin), "museum.json", "/data");
    ASSERT_TRUE(scene) << scene.error().line();
    ASSERT_EQ(scene->datasets.size(), 3u);
    EXPECT_EQ(scene->datasets[0].file, "/data/statue.vcp");
    EXPECT_EQ(scene->datasets[0].placement, Similarity{});
    const Similarity& turned = scene->datasets[1].placement;
    EXPECT_LT(glm::distance(turned.toWorld({0, 0, 1}), glm::dvec3(0.8, 0, 0)), 1e-15);
    EXPECT_LT(glm::distance(scene->datasets[2].placement.toWorld({1, 2, 3}), glm::dvec3(1, 1.8, 3)), 1e-15);
    ASSERT_EQ(scene->lights.size(), 2u);
    EXPECT_FALSE(scene->lights[0].followsCamera);
    EXPECT_NEAR(glm::length(scene->lights[0].direction), 1, 1e-6);
    EXPECT_EQ(scene->lights[0].strength, 1);
    EXPECT_FLOAT_EQ(float(scene->lights[1].strength), 0.3f);
    EXPECT_EQ(scene->environment, (EnvironmentChoice{"overcast", 30, 1}));
    ASSERT_TRUE(scene->camera);
    EXPECT_EQ(scene->camera->position, glm::dvec3(0, 0.2, 1.5));
    EXPECT_EQ(scene->sections, (std::vector<SectionPlane>{{{1, 0, 0}, 0.05}}));
    EXPECT_EQ(scene->sectionCaps, Caps::Closed);
}

TEST(SceneFile, WhatIsWrongIsSaidWithItsLine) {
    const auto inDataset = [](const std::string& more) {
        return "{\n \"datasets\": [\n  {\"file\": \"a.vcp\",\n   " + more + "}\n ]\n}";
    };
    const auto beside = [](const std::string& more) {
        return "{\"datasets\": [{\"file\": \"a.vcp\"}],\n\n" + more + "}";
    };
    const std::tuple<std::string, size_t, const char*> wrong[] = {
        {"[]", 1, "object"},
        {"{}", 1, "\"datasets\" is missing"},
        {"{\n\"datasets\": []}", 2, "1 to 256"},
        {"{\n\"datasets\":\n[\n{}]}", 4, "\"file\" is missing"},
        {"{\n\"datasets\": [{\"file\": 7}]}", 2, "\"file\""},
        {inDataset("\"color\": 1"), 4, "\"color\" is no key"},
        {inDataset("\"colour\": [1, 0, 2]"), 4, "from 0 to 1"},
        {inDataset("\"opacity\": 1.5"), 4, "\"opacity\" must be from 0 to 1"},
        {inDataset("\"scale\": [1, 2, 1]"), 4, "not supported"},
        {inDataset("\"scale\": 0"), 4, "above 0"},
        {inDataset("\"scale\": -1"), 4, "above 0"},
        {inDataset("\"translate\": [1, 2]"), 4, "three numbers"},
        {inDataset("\"translate\": [1, 2, \"3\"]"), 4, "three numbers"},
        {inDataset("\"rotate\": {\"axis\": [0, 0, 0], \"degrees\": 1}"), 4, "\"axis\" must not be zero"},
        {inDataset("\"rotate\": {\"axis\": [0, 0, 1]}"), 4, "degrees"},
        {inDataset("\"rotate\": 90"), 4, "object"},
        {inDataset("\"transform\": [1, 2]"), 4, "four rows"},
        {inDataset("\"transform\": [[1,0,0,0],[0,2,0,0],[0,0,1,0],[0,0,0,1]]"), 4, "stretches"},
        {inDataset("\"transform\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]],\n\"scale\": 2"), 5, "does not go with"},
        {beside("\"mesostructure\": []"), 3, "1 to 64"},
        {beside("\"mesostructure\": [{\"tiles\": 2}]"), 3, "\"asset\" or \"displacement\" is missing"},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"displacement\": \"a.png\"}]"), 3,
         "\"asset\" does not go with"},
        {beside("\"mesostructure\": [{\n\"displacement\": 1}]"), 4, "must be a name or a file's name"},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"method\": \"magic\"}]"), 4, "must be one of"},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"up\": \"x\"}]"), 4, "\"up\""},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"tiles\": 0}]"), 4, "\"tiles\""},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"subdivide\": 1.5}]"), 4, "\"subdivide\""},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"subdivide\": 9}]"), 4, "from 0 to 8"},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"subdivide\": true}]"), 4, "\"subdivide\""},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"colour\": [1, 2, 1]}]"), 4, "from 0 to 1"},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"texture\": 7}]"), 4, "\"texture\""},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"normal_texture\": \"\"}]"), 4, "\"normal_texture\""},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"transfer\": 1}]"), 4, "\"transfer\""},
        {beside("\"mesostructure\": [{\n\"asset\": \"brick\"}]"), 4, "\"asset\" must be"},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"path\": [[1, 2, 3]]}]"), 4, "2 to 1000 points"},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"path\": [[1, 2, 3], 4]}]"), 4, "three numbers"},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"seconds\": 0}]"), 4, "seconds"},
        {beside("\"lights\": [{}, {}, {}, {}, {}]"), 3, "at most 4 lights"},
        {beside("\"lights\": [{\"direction\": [1, 0, 0], \"strength\": -1}]"), 3, "must be from 0 to 10"},
        {beside("\"lights\": [{}]"), 3, "direction"},
        {beside("\"environment\": \"studio\""), 3, "environment"},
        {beside("\"environment\": {\"turn_degrees\": 1}"), 3, "\"source\" is missing"},
        {beside("\"environment\": {\"source\": \"studio\", \"strength\": 11}"), 3, "must be from 0 to 10"},
        {beside("\"environment\": {\"source\": \"studio\", \"turn\": 1}"), 3, "turn"},
        {beside("\"caps\": 1"), 3, "true or false"},
        {beside("\"camera\": {\"position\": [0, 0, 0],\n \"target\": [0, 0, 0]}"), 4, "\"target\""},
        {beside("\"camera\": {\"position\": [0, 0, 0]}"), 3, "\"target\""},
        {beside("\"sections\": [\n{\"normal\": [1, 0, 0], \"offset\": 0},\n{\"normal\": [0, 0, 0], \"offset\": 0}]"), 5,
         "\"normal\""},
        {beside("\"sections\": [{\"normal\": [1, 0, 0]}]"), 3, "offset"},
        {beside("\"sections\": [\n{\"normal\": [1e-320, 0, 0], \"offset\": 0}]"), 4, "\"normal\" is too short"},
        {beside("\"camera\": {\"position\": [0, 0, 5], \"target\": [0, 0, 0],\n \"fov_degrees\": 178.5}"), 4,
         "\"fov_degrees\""},
        {"{\n\n\"datasets\" [", 3, "JSON"},
        {"", 1, "JSON"},
        {beside("\"caps\":\n 1e999"), 4, "out of range"},
        {beside("\"caps\": true,\n\"caps\": false"), 4, "\"caps\" is there twice"},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"curvatures\": 4}]"), 4,
         "must be an odd number from 1 to 17"},
        {beside("\"mesostructure\": [{\"asset\": \"beads\",\n\"curvature\": 0.6}]"), 4, "above 0 and at most 0.5"},
        {inDataset("\"scale\": 1e200"), 4, "must be between"},
        {inDataset("\"scale\": 1e-310"), 4, "above 0"},
        {inDataset("\"translate\": [0, -1e13, 0]"), 4, "must be between"},
        {inDataset("\"transform\": [[1,0,0,1e300],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"), 4, "moves by more"},
    };
    for (const auto& [text, line, word] : wrong) {
        const auto refused = sceneFromJson(text, "wrong.json", {});
        ASSERT_FALSE(refused) << text;
        const std::string said = refused.error().line();
        EXPECT_NE(said.find(fmt::format("wrong.json: line {}: ", line)), std::string::npos) << said << "\n" << text;
        EXPECT_NE(said.find(word), std::string::npos) << said;
    }
    // Lines are kept of nothing that a scene has not: this would be 50 GB of them.
    const std::string key(500'000, 'k');
    std::string zeros = "0";
    for (int i = 0; i < 100'000; ++i) zeros += ",0";
    EXPECT_FALSE(sceneFromJson("{\"" + key + "\": [" + zeros + "]}", "wide.json", {}));
    EXPECT_FALSE(sceneFromJson(std::string(5000, '['), "deep.json", {}));
    EXPECT_FALSE(sceneFromJson(std::string(40, '[') + std::string(40, ']'), "deep.json", {}));
}

// What is wrong only with the file or the asset that a scene names is the scene's fault too, not that of who typed its
// name.
void expectNear(glm::dvec3 a, glm::dvec3 b) { EXPECT_LT(glm::distance(a, b), 1e-12 * (1 + glm::length(b))); }

// A scene that was written is read as it was: everything that differs from what is usual, names as they are.
TEST(SceneFile, WhatIsWrittenIsReadAgain) {
    SceneFile scene;
    scene.datasets.push_back({.file = "/scans/statue.vcp", .placement = {}});
    scene.datasets.push_back(
        {.file = "http://127.0.0.1:1/a.vcp",
         .placement = {glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, -0.5))), 0.125, {483920.25, -3, 1e-9}}});
    scene.datasets[1].colour = glm::vec3(0.5f, 0.25f, 1);
    scene.datasets[1].opacity = 0.75f;
    MesoSurfaceDescription& surface = scene.surfaces.emplace_back();
    surface.asset = "beads";
    surface.base = "torus";
    surface.tiles = 3;
    surface.subdivide = 2;
    surface.heightScale = 0.5;
    surface.place = {1, 2, 3};
    surface.up = UpAxis::Y;
    surface.colour = {0.25f, 0.5f, 1};
    surface.method.name = "ddm";
    surface.method.cells = 32;
    surface.method.cones = {2, 2};
    surface.method.steps = 7;
    surface.method.refinements = 2;
    surface.method.rank = 0;
    surface.method.directions = {8, 12};
    surface.method.curvatures = {9, 0.25};
    surface.withBase = surface.withFar = false;
    surface.withTransfer = true;
    scene.lights = {{true, glm::vec3(0.6f, 0, 0.8f), 1}, {false, glm::vec3(0, 1, 0), 0.25f}};
    scene.environment = EnvironmentChoice{"/elsewhere/roof.hdr", -30, 0.5f};
    scene.camera = OrbitCamera();
    scene.camera->position = {1, 2, 30};
    scene.sections = {{{0, 0, -2}, -0.25}, {{1, 0.5, 0}, 7}};
    scene.sectionCaps = Caps::All;
    scene.annotations = {{{0.1, -2e5, 3}, "Nose, \"chipped\"", "Repaired in 1904: \u00fcbermalt"}, {{1, 1, 1}, ""}};

    const std::string text = sceneToJson(scene);
    const auto read = sceneFromJson(text, "scene.json", "/elsewhere");
    ASSERT_TRUE(read) << read.error().line() << "\n" << text;
    ASSERT_EQ(read->datasets.size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(read->datasets[i].file, scene.datasets[i].file);
        const Similarity &a = read->datasets[i].placement, &b = scene.datasets[i].placement;
        EXPECT_EQ(a.scale, b.scale);
        EXPECT_EQ(read->datasets[i].colour, scene.datasets[i].colour);
        EXPECT_EQ(read->datasets[i].opacity, scene.datasets[i].opacity);
        EXPECT_EQ(a.translation, b.translation);
        for (const glm::dvec3 axis : {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)})
            expectNear(a.rotation * axis, b.rotation * axis);
    }
    const std::vector<DatasetLook> looks = looksOf(*read);
    ASSERT_EQ(looks.size(), 1u) << "the first dataset is shown as it is";
    EXPECT_EQ(looks[0].dataset, 1u);
    EXPECT_NEAR(looks[0].colour->g, std::pow(0.25, 2.2), 1e-6);
    ASSERT_EQ(read->surfaces.size(), 1u);
    EXPECT_EQ(read->surfaces[0].asset, "beads");
    EXPECT_EQ(read->surfaces[0].base, "torus");
    EXPECT_EQ(read->surfaces[0].tiles, 3);
    EXPECT_EQ(read->surfaces[0].subdivide, 2);
    EXPECT_EQ(read->surfaces[0].heightScale, 0.5);
    EXPECT_EQ(read->surfaces[0].place, surface.place);
    EXPECT_EQ(read->surfaces[0].up, UpAxis::Y);
    EXPECT_EQ(read->surfaces[0].colour, surface.colour);
    EXPECT_EQ(read->surfaces[0].method.name, "ddm");
    EXPECT_EQ(read->surfaces[0].method.cells, 32);
    EXPECT_EQ(read->surfaces[0].method.cones.count(), 4);
    EXPECT_EQ(read->surfaces[0].method.steps, 7);
    EXPECT_EQ(read->surfaces[0].method.refinements, 2);
    EXPECT_EQ(read->surfaces[0].method.rank, 0);
    EXPECT_EQ(read->surfaces[0].method.directions, glm::ivec2(8, 12));
    EXPECT_EQ(read->surfaces[0].method.curvatures, (meso::Curvatures{9, 0.25}));
    EXPECT_FALSE(read->surfaces[0].withBase || read->surfaces[0].withFar);
    EXPECT_TRUE(read->surfaces[0].withTransfer);
    ASSERT_TRUE(read->lights.size() == 2 && read->camera);
    for (size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(read->lights[i].followsCamera, i == 0);
        EXPECT_LT(glm::distance(read->lights[i].direction, scene.lights[i].direction), 1e-6f);
        EXPECT_EQ(read->lights[i].strength, scene.lights[i].strength);
    }
    EXPECT_EQ(read->environment, scene.environment);
    expectNear(read->camera->position, scene.camera->position);
    EXPECT_EQ(read->sections, scene.sections);
    EXPECT_EQ(read->sectionCaps, Caps::All);
    EXPECT_EQ(read->annotations, scene.annotations);
    EXPECT_EQ(sceneToJson(*sceneFromJson(sceneToJson(*read), "scene.json", "")), sceneToJson(*read));
}

TEST(SceneFile, AddressesAreWrittenWithoutPasswords) {
    SceneFile scene;
    scene.datasets.push_back({.file = "https://ada:secret@example.org/a.vcp", .placement = {}});
    const std::string text = sceneToJson(scene);
    EXPECT_EQ(text.find("secret"), std::string::npos) << text;
    EXPECT_NE(text.find("https://example.org/a.vcp"), std::string::npos) << text;
}

TEST(SceneFile, AnnotationsAreLinesOfText) {
    const auto errorOf = [](const std::string& annotation) {
        const auto read = annotationsFromJson("[" + annotation + "]", "notes");
        return read ? std::string() : read.error().line();
    };
    EXPECT_EQ(errorOf(R"({"position": [1, 2, 3], "title": "a"})"), "");
    EXPECT_NE(errorOf(R"({"title": "a"})").find("\"position\" is missing"), std::string::npos);
    EXPECT_NE(errorOf(R"({"position": [1, 2, 3], "titel": "a"})").find("is no key here"), std::string::npos);
    EXPECT_NE(errorOf(R"({"position": [1, 2, 3], "title": "a\u001b[2J"})").find("one line of text"), std::string::npos);
    EXPECT_NE(errorOf("{\"position\": [1, 2, 3], \"text\": \"" + std::string(kLongestText + 1, 'x') + "\"}")
                  .find("one line of text"),
              std::string::npos);
    EXPECT_NE(annotationsFromJson("{}", "notes").error().line().find("must be a list"), std::string::npos);
}

TEST(SceneFile, WhatItNamesIsBlamedOnIt) {
    const auto refusal = [](const std::string& text) {
        auto scene = sceneFromJson(text, "museum.json", {});
        EXPECT_TRUE(scene) << scene.error().line();
        const auto open = [](const std::string& file) -> Result<OpenDataset> {
            return Error{.code = ErrorCode::Usage, .message = "unknown mesh format", .file = file};
        };
        const auto opened = openScene(*std::move(scene), "museum.json", open);
        EXPECT_FALSE(opened);
        return opened ? Error{} : opened.error();
    };
    const Error dataset = refusal("{\n\"datasets\": [{\n\"file\": \"a.xyz\"}]}");
    EXPECT_EQ(dataset.code, ErrorCode::InvalidInput);
    EXPECT_EQ(dataset.line(), "museum.json: line 3: \"file\": a.xyz: unknown mesh format");
    const Error method = refusal("{\n\"mesostructure\": [\n{\"asset\": \"beads\", \"surface\": \"nowhere\"}]}");
    EXPECT_EQ(method.code, ErrorCode::InvalidInput);
    EXPECT_TRUE(method.line().starts_with("museum.json: line 3: ")) << method.line();
    // What cannot be read is named itself, as before.
    EXPECT_EQ(ScenePlace({"museum.json", 3, "file"}).blamed({ErrorCode::Io, "no such file", "a.vcp"}).line(),
              "a.vcp: no such file");
    EXPECT_EQ(ScenePlace().blamed({ErrorCode::Usage, "no such name"}).code, ErrorCode::Usage);
}

TEST(SceneFile, SurfacesMayBeRemeshed) {
    const auto sceneOf = [](const std::string& more) {
        return sceneFromJson(R"({"mesostructure": [{"asset": "ridged", "method": "remesh")" + more + "}]}", "m.json",
                             {});
    };
    const auto scene = sceneOf(R"(, "cell": 5)");
    ASSERT_TRUE(scene) << scene.error().line();
    EXPECT_EQ(scene->surfaces[0].method.name, kRemeshMethod);
    EXPECT_EQ(scene->surfaces[0].cell, 5);
    EXPECT_EQ(sceneFromJson(sceneToJson(*scene), "m.json", {})->surfaces[0].cell, 5);
    for (const char* cell : {"0", "-1", "1001", "\"2\"", "null"})
        EXPECT_EQ(sceneOf(std::string(", \"cell\": ") + cell).error().line(),
                  "m.json: line 1: \"cell\" must be from 0.25 to 1000 pixels")
            << cell;
    const auto made = makeMesoScene(scene->surfaces);
    ASSERT_TRUE(made) << made.error().line();
    EXPECT_TRUE(made->surfaces[0].remeshed.surface);
    EXPECT_TRUE(made->surfaces[0].arrays) << "it casts shadows";
    EXPECT_GT(made->surfaces[0].lift, 0);
    EXPECT_TRUE(made->warnings.empty());
    ASSERT_TRUE(made->surfaces[0].remeshed.cells) << "an error is certified";
    EXPECT_FALSE(makeMesoScene(sceneOf(R"(, "error": 0)")->surfaces)->surfaces[0].remeshed.cells);
    const auto stopped =
        makeMesoScene(scene->surfaces, [](std::string_view stage, double) { return stage != "cutting the surface"; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
    SceneFile unshaded = *scene;
    SurfaceChoices{.method = {}, .subdivide = {}, .withLightRays = false}.applyTo(unshaded);
    const auto lean = makeMesoScene(unshaded.surfaces);
    ASSERT_TRUE(lean) << lean.error().line();
    EXPECT_TRUE(lean->surfaces[0].remeshed.surface);
    EXPECT_FALSE(lean->surfaces[0].arrays) << "nobody asks for shadows";
    EXPECT_TRUE(lean->warnings.empty());
    EXPECT_EQ(made->surfaces[0].remeshed.options.cell, 5);
    EXPECT_EQ(made->surfaces[0].remeshed.options.errorPixels, 0.5);
    for (const double error : {0.0, 0.05, 4.0}) {
        const auto allowed = sceneOf(fmt::format(", \"error\": {}", error));
        ASSERT_TRUE(allowed) << allowed.error().line();
        EXPECT_EQ(allowed->surfaces[0].errorPixels, error);
        EXPECT_EQ(sceneFromJson(sceneToJson(*allowed), "m.json", {})->surfaces[0].errorPixels, error);
    }
    for (const char* error : {"-1", "0.01", "101", "\"2\"", "null", "true"})
        EXPECT_EQ(sceneOf(std::string(", \"error\": ") + error).error().line(),
                  "m.json: line 1: \"error\" must be 0 or from 0.05 to 100 pixels")
            << error;
    EXPECT_NEAR(made->bounds.high.x, 1, 1e-9);
    EXPECT_GT(made->bounds.high.z, 0.01);
}

TEST(SceneFile, ADisplacementIsAPictureOfHeights) {
    const TestFolder folder("displacement");
    const auto file = folder / "heights.png";
    Picture picture{2, 2, {0, 0, 0, 255, 255, 255, 255, 255, 51, 51, 51, 255, 0, 0, 0, 255}};
    ASSERT_TRUE(writePng(picture, file));
    const auto sceneOf = [&](const std::string& more) {
        return sceneFromJson(R"({"mesostructure": [{"displacement": "heights.png", "tiles": 1)" + more + "}]}",
                             "m.json", folder.path());
    };
    const auto scene = sceneOf(R"(, "height": 0.25)");
    ASSERT_TRUE(scene) << scene.error().line();
    EXPECT_EQ(scene->surfaces[0].method.name, kRemeshMethod);
    EXPECT_EQ(sceneOf("")->surfaces[0].heightScale, 0.1);
    EXPECT_EQ(std::ranges::count(filesOf(*scene), file), 1);
    const auto again = sceneFromJson(sceneToJson(*scene), "m.json", {});
    ASSERT_TRUE(again) << again.error().line();
    EXPECT_EQ(again->surfaces[0].displacement, file.string());
    const auto made = makeMesoScene(scene->surfaces);
    ASSERT_TRUE(made) << made.error().line();
    const meso::RemeshSurface& surface = *made->surfaces[0].remeshed.surface;
    // The quad is two units wide and has one tile; the picture's lower row is the map's first.
    EXPECT_NEAR(surface.high.z - surface.low.z, 0.5, 1e-6);
    EXPECT_EQ(surface.heights->levels()[0].texels, (std::vector<uint16_t>{51 * 257, 0, 0, 65535}));

    std::ofstream(folder / "broken.png") << "not a picture";
    const auto broken =
        sceneFromJson(R"({"mesostructure": [{"displacement": "broken.png"}]})", "m.json", folder.path());
    ASSERT_TRUE(broken);
    EXPECT_EQ(makeMesoScene(broken->surfaces).error().file, (folder / "broken.png").string());
}

TEST(SceneFile, WhatCannotBeRemeshedIsSaid) {
    const auto errorOf = [](const std::string& surface) {
        const auto scene = sceneFromJson(R"({"mesostructure": [{"method": "remesh", )" + surface + "}]}", "m.json", {});
        EXPECT_TRUE(scene);
        return scene ? makeMesoScene(scene->surfaces).error().line() : scene.error().line();
    };
    EXPECT_NE(errorOf(R"("asset": "bead")").find("remesh is for height fields; bead is a solid"), std::string::npos);
}

TEST(SceneFile, SurfacesGoAlongPaths) {
    const auto scene = sceneFromJson(R"({"mesostructure": [
        {"asset": "ball", "path": [[1, 0, 0], [1, 3, 0], [2, 3, 0]], "seconds": 2},
        {"asset": "ball", "translate": [5, 0, 0], "path": [[0, 0, 0], [0, 0, 2], [0, 0, 0]]},
        {"asset": "ball"}]})",
                                     "m.json", {});
    ASSERT_TRUE(scene) << scene.error().line();
    EXPECT_EQ(sceneToJson(*sceneFromJson(sceneToJson(*scene), "m.json", {})), sceneToJson(*scene));
    const auto &open = scene->surfaces[0], &closed = scene->surfaces[1];
    EXPECT_EQ(open.place, glm::dvec3(1, 0, 0));
    EXPECT_EQ(closed.place, glm::dvec3(5, 0, 0));
    // Even speed, to the end and back.
    EXPECT_EQ(open.path.period(), 4);
    for (const auto& [time, at] : {std::pair(0.0, glm::dvec3(1, 0, 0)), std::pair(1.0, glm::dvec3(1, 2, 0)),
                                   std::pair(1.75, glm::dvec3(1.5, 3, 0)), std::pair(2.25, glm::dvec3(1.5, 3, 0)),
                                   std::pair(7.0, glm::dvec3(1, 2, 0))})
        EXPECT_LT(glm::distance(open.path.at(time), at), 1e-12) << time;
    EXPECT_EQ(closed.path.period(), 8);
    for (const auto& [time, z] : {std::pair(2.0, 1.0), std::pair(4.0, 2.0), std::pair(6.0, 1.0), std::pair(8.0, 0.0)})
        EXPECT_NEAR(closed.path.at(time).z, z, 1e-12);
    const auto made = makeMesoScene(scene->surfaces);
    ASSERT_TRUE(made) << made.error().line();
    EXPECT_EQ(periodOf(made->paths), 8);
    const auto moved = surfacesMovedAt(made->paths, 1);
    ASSERT_EQ(moved.size(), 3u);
    EXPECT_EQ(moved[0], glm::dvec3(0, 2, 0));
    EXPECT_EQ(moved[1], glm::dvec3(-5, 0, 0.5)) << "from where it lies";
    EXPECT_EQ(moved[2], glm::dvec3(0));
    const MesoSurfaceDescription still = scene->surfaces[2];
    const auto alone = makeMesoScene({&still, 1});
    EXPECT_EQ(periodOf(alone->paths), 0);
    EXPECT_TRUE(surfacesMovedAt(alone->paths, 1).empty());
    EXPECT_LT(made->bounds.low.x, -0.5) << "wherever they go is within the bounds";
    MesoSurfaceDescription remeshed = open;
    remeshed.asset = "ridged", remeshed.method.name = kRemeshMethod;
    EXPECT_FALSE(makeMesoScene({&remeshed, 1}));
}

// Whatever is cut off or in the wrong place is an error or a scene, nothing else.
TEST(SceneFile, EveryPrefixAndFlippedByteIsAnAnswer) {
    const std::string document = contentOf(std::string(VCP_SOURCE_DIR) + "/docs/scenes.md");
    const size_t begin = document.find("```json\n") + 8, end = document.find("```", begin);
    const std::string text = document.substr(begin, end - begin);
    for (size_t i = 0; i + 2 < text.size(); ++i) EXPECT_FALSE(sceneFromJson(text.substr(0, i), "cut.json", {}));
    size_t refused = 0;
    for (size_t i = 0; i < text.size(); ++i) {
        std::string flipped = text;
        flipped[i] = char(flipped[i] ^ 1 << i % 7);
        refused += sceneFromJson(flipped, "flipped.json", {}) ? 0 : 1;
    }
    EXPECT_GT(refused, text.size() / 4);
}

TEST(SceneFile, FilesThatAreNone) {
    EXPECT_TRUE(isSceneName("a/b.json"));
    EXPECT_FALSE(isSceneName("a.vcp"));
    EXPECT_FALSE(isSceneName("https://host/a.json"));
    EXPECT_EQ(readScene("/nowhere/scene.json").error().code, ErrorCode::Io);
    TestFolder folder("vcp_scene_file_test");
    std::ofstream(folder / "large.json") << std::string((1 << 20) + 1, ' ');
    EXPECT_EQ(readScene(folder / "large.json").error().code, ErrorCode::Limit);
}

}  // namespace
}  // namespace vcp
