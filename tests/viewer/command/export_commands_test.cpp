// `vcp export` and `vcp compare` as people and scripts meet them.
#include <filesystem>
#include <fstream>
#include <memory>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "builder/measure/indexed_mesh.h"
#include "render/picture.h"
#include "tests/support/vcp_program.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class ExportCommands : public testing::Test {
protected:
    static void SetUpTestSuite() {
        folder_ = std::make_unique<TestFolder>("vcp_export_commands_test");
        writeBall(path("ball.ply"), 60, 120);
        const Ran built = run({"build", path("ball.ply"), "-o", path("ball.vcp"), "--cell", "0.05"});
        EXPECT_EQ(built.status, 0) << built.err;
    }
    static void TearDownTestSuite() { folder_.reset(); }

    static std::string path(const std::string& file) { return (*folder_ / file).string(); }
    static Ran run(const std::vector<std::string>& arguments) { return VcpProgram(*folder_).run(arguments); }
    static Json runJson(std::vector<std::string> arguments) {
        arguments.push_back("--json");
        const Ran ran = run(arguments);
        EXPECT_EQ(ran.status, 0) << ran.err;
        return ran.status == 0 ? Json::parse(ran.out) : Json();
    }
    static void expectUsage(const Ran& ran, const std::string& named) {
        EXPECT_EQ(ran.status, 2) << ran.err;
        EXPECT_EQ(ran.errLines(), 1u) << ran.err;
        EXPECT_NE(ran.err.find(named), std::string::npos) << ran.err;
    }

    static std::unique_ptr<TestFolder> folder_;
};
std::unique_ptr<TestFolder> ExportCommands::folder_;

TEST_F(ExportCommands, MeshesOfEveryFormatComeBack) {
    const auto mesh = loadMesh(*folder_ / "ball.ply");
    ASSERT_TRUE(mesh.ok());
    for (const std::string file : {"out.ply", "out.obj", "out.stl", "out.glb"}) {
        SCOPED_TRACE(file);
        const Json said = runJson({"export", path("ball.vcp"), "-o", path(file)});
        EXPECT_EQ(said["triangles"], mesh->triangles.size());
        EXPECT_EQ(said["is_mesh"], true);
        EXPECT_GT(said["certified_distance"], 0.0);
        EXPECT_LT(said["certified_distance"], 0.001);
        EXPECT_EQ(said["file_bytes"], fs::file_size(path(file)));
        const auto out = loadMesh(*folder_ / file);
        ASSERT_TRUE(out.ok()) << out.error().line();
        EXPECT_EQ(out->triangles.size(), mesh->triangles.size());
    }
}

TEST_F(ExportCommands, ErrorChoosesTheLevelAndIsHeld) {
    const Json info = Json::parse(run({"info", path("ball.vcp"), "--json"}).out);
    ASSERT_GE(info["levels"], 2);
    const double error = double(info["level"][0]["certified_error_max"]) * 1.5;
    const Json coarse =
        runJson({"export", path("ball.vcp"), "-o", path("coarse.ply"), "--error", std::to_string(error)});
    EXPECT_EQ(coarse["level"], 0);
    EXPECT_LE(coarse["certified_distance"], error);
    const Json named = runJson({"export", path("ball.vcp"), "-o", path("coarse.ply"), "--level", "0"});
    EXPECT_EQ(named["triangles"], coarse["triangles"]);
    expectUsage(run({"export", path("ball.vcp"), "-o", path("x.ply"), "--error", "1e-12"}), "finest level");
    expectUsage(run({"export", path("ball.vcp"), "-o", path("x.ply"), "--level", "40"}), "no level 40");
    EXPECT_FALSE(fs::exists(path("x.ply")));
}

TEST_F(ExportCommands, SectionsAreDrawings) {
    for (const std::string file : {"cut.svg", "cut.dxf"}) {
        SCOPED_TRACE(file);
        const Json said = runJson({"export", path("ball.vcp"), "-o", path(file), "--section", "z>50%", "--unit", "mm"});
        EXPECT_GE(said["lines"], 1);
        EXPECT_EQ(said["lines"], said["closed_lines"]);
        EXPECT_NEAR(said["length"], 6.28, 1.5);
        EXPECT_EQ(said["file_bytes"].get<uint64_t>(), fs::file_size(path(file)));
    }
    expectUsage(run({"export", path("ball.vcp"), "-o", path("cut.svg")}), "--section");
    expectUsage(run({"export", path("ball.vcp"), "-o", path("cut.ply"), "--section", "z>50%"}), ".svg");
}

TEST_F(ExportCommands, WrongUsageIsNamed) {
    expectUsage(run({"export", path("ball.vcp"), "-o", path("a.off")}), ".glb");
    expectUsage(run({"export", path("ball.vcp"), "-o", "-"}), ".ply");
    expectUsage(run({"export", path("ball.vcp"), "-o", path("a.ply"), "--level", "0", "--error", "1"}), "--level");
    expectUsage(run({"export", path("ball.vcp"), "-o", path("a.ply"), "--box", "1,1,1,0,2,2"}), "--box");
    expectUsage(run({"export", path("ball.vcp"), "-o", path("a.ply"), "--unit", "furlong"}), "furlong");
    expectUsage(run({"compare", path("ball.vcp")}), "required");
    expectUsage(run({"compare", path("ball.vcp"), path("ball.ply"), "-o", path("a.obj")}), ".png");
}

TEST_F(ExportCommands, NothingElseIsReplaced) {
    std::ofstream(path("precious.ply")) << "no mesh";
    const Ran refused = run({"export", path("ball.vcp"), "-o", path("precious.ply")});
    EXPECT_EQ(refused.status, 1);
    EXPECT_NE(refused.err.find("is there and is not a PLY mesh"), std::string::npos) << refused.err;
    EXPECT_EQ(contentOf(path("precious.ply")), "no mesh");
    EXPECT_EQ(run({"export", path("ball.vcp"), "-o", path("precious.ply"), "--overwrite"}).status, 0);
    EXPECT_EQ(run({"export", path("ball.vcp"), "-o", path("precious.ply")}).status, 0) << "a PLY replaces a PLY";
    fs::create_symlink(path("ball.vcp"), path("link.ply"));
    EXPECT_EQ(run({"export", path("ball.vcp"), "-o", path("link.ply"), "--overwrite"}).status, 1);
}

TEST_F(ExportCommands, ADatasetComparedWithItsMeshIsWithinWhatIsCertified) {
    const Json said = runJson({"compare", path("ball.vcp"), path("ball.ply"), "--both", "--samples", "20000", "-o",
                               path("d.png"), "-o", path("d.ply"), "--csv", path("d.csv"), "--size", "320x200"});
    for (const char* way : {"a_to_b", "b_to_a"}) {
        EXPECT_LE(said[way]["absolute_max"], said["certified_a"]);
        EXPECT_EQ(said[way]["samples"], 20000);
    }
    EXPECT_EQ(said["certified_b"], 0.0);
    const auto picture = readPng(path("d.png"));
    ASSERT_TRUE(picture.ok());
    EXPECT_EQ(picture->width, 320u);
    EXPECT_NE(contentOf(path("d.ply")).find("property float distance"), std::string::npos);
    const std::string csv = contentOf(path("d.csv"));
    EXPECT_TRUE(csv.starts_with("quantity,from,to,value\nmean,,,"));
    EXPECT_NE(csv.find("\ncount,"), std::string::npos);
    const Ran table = run({"compare", path("ball.vcp"), path("ball.ply"), "--samples", "1000"});
    EXPECT_EQ(table.status, 0);
    EXPECT_NE(table.out.find("rms"), std::string::npos);
}

}  // namespace
}  // namespace vcp
