// Builds in parts: the bytes of a whole build, whatever the order; parts that are lost, cut off, killed or foreign.
#include "builder/parts/part_dealing.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>
#include <thread>
#include <utility>

#include <sys/resource.h>

#include <gtest/gtest.h>

#include "builder/parts/build_parts.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/mesh_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

std::string bytesOf(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void spoil(const fs::path& file) {
    std::string content = bytesOf(file);
    content[content.size() / 2] = char(content[content.size() / 2] ^ 1);
    std::ofstream(file, std::ios::binary) << content;
}

/// Triangles across many bins, an open part and a closed one, coordinates far from zero.
IndexedMesh mixedMesh() {
    IndexedMesh mesh = test::randomTriangles(200, 5, true);
    for (glm::dvec3& p : mesh.positions) p = p * 60.0 + 2.0;
    test::append(mesh, test::torusMesh({31, 33, 30}, 20, 6, 240, 120));
    test::append(mesh, test::sphereMesh({20, 20, 20}, 9, 60));
    mesh.triangles.pop_back();
    for (glm::dvec3& p : mesh.positions) p += glm::dvec3(500000, 4000000, 1000);
    return mesh;
}

class BuildParts : public ::testing::Test {
protected:
    void SetUp() override {
        const IndexedMesh mesh = mixedMesh();
        std::mt19937 random{7};
        std::vector<uint32_t> colours(mesh.positions.size());
        for (uint32_t& colour : colours) colour = uint32_t(random());
        test::writePly(mesh, input(), colours);
        buildWhole(options(), whole_);
    }

    /// Builds in one process; sets `whole` to the bytes of the output, which goes.
    void buildWhole(const BuildOptions& o, std::string& whole) const {
        const auto built = buildOctree(o);
        ASSERT_TRUE(built.ok()) << built.error().line();
        whole = bytesOf(output());
        fs::remove(output());
    }

    fs::path input() const { return folder_ / "mesh.ply"; }
    fs::path output() const { return folder_ / "out.vcp"; }
    fs::path plan() const { return folder_ / "out.vcp.parts"; }
    BuildOptions options() const {
        BuildOptions o;
        o.inputs = {input()};
        o.output = output();
        o.threads = 2;
        return o;
    }

    Result<PartReport> run(const std::string& stage, unsigned number) const {
        return runPart({.folder = plan(), .stage = stage, .number = number, .threads = 2});
    }
    void runAll(const std::string& stage, unsigned parts, uint64_t seed = 0) const {
        std::vector<unsigned> order(parts);
        for (unsigned i = 0; i < parts; ++i) order[i] = i;
        std::shuffle(order.begin(), order.end(), std::mt19937_64(seed));
        for (const unsigned i : order) {
            const auto done = run(stage, i);
            ASSERT_TRUE(done.ok()) << stage << " " << i << ": " << done.error().line();
        }
    }
    void dealAll(unsigned parts) const {
        ASSERT_NO_FATAL_FAILURE(runAll("read", parts));
        ASSERT_NO_FATAL_FAILURE(runAll("count", 1));
        ASSERT_NO_FATAL_FAILURE(runAll("deal", parts));
    }
    void buildPages(unsigned parts) const {
        ASSERT_NO_FATAL_FAILURE(dealAll(parts));
        ASSERT_NO_FATAL_FAILURE(runAll("vertices", parts));
        ASSERT_NO_FATAL_FAILURE(runAll("pages", parts));
    }
    void planned(unsigned parts) const {
        const auto folder = planParts(options(), parts);
        ASSERT_TRUE(folder.ok()) << folder.error().line();
        ASSERT_EQ(*folder, plan());
    }
    void expectRefused(const Result<PartReport>& done, ErrorCode code, const std::string& said) const {
        ASSERT_FALSE(done.ok());
        EXPECT_EQ(done.error().code, code) << done.error().line();
        EXPECT_NE(done.error().line().find(said), std::string::npos) << done.error().line();
        EXPECT_EQ(done.error().line().find('\n'), std::string::npos);
        for (const auto& each : fs::directory_iterator(plan()))
            EXPECT_EQ(each.path().string().find(".partial"), std::string::npos) << each.path();
    }

    TestFolder folder_{"vcp_build_parts_test"};
    std::string whole_;
};

TEST_F(BuildParts, AreTheBytesOfTheWhole) {
    for (const unsigned parts : {1u, 3u, 8u}) {
        planned(parts);
        for (const PartStage& stage : stagesOf(parts)) ASSERT_NO_FATAL_FAILURE(runAll(stage.name, stage.parts, parts));
        EXPECT_EQ(bytesOf(output()), whole_) << parts << " parts";
        size_t files = 0;
        for (const auto& each : fs::recursive_directory_iterator(plan())) files += each.is_regular_file() ? 1 : 0;
        // The plan; of a part mark, journal and three files, or of each of at most 16 levels four.
        EXPECT_LE(files, 1 + (1 + 3 * parts) * 5 + parts * (2 + 16 * 4));
        fs::remove_all(plan());
        fs::remove(output());
    }
}

/// Files that this process has open.
size_t openFiles() { return size_t(std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator())); }

TEST_F(BuildParts, MergeCopiesOnAnyThreadsAndHasFewFilesOpen) {
    constexpr unsigned kParts = 8;
    planned(kParts);
    ASSERT_NO_FATAL_FAILURE(buildPages(kParts));
    rlimit before{};
    getrlimit(RLIMIT_NOFILE, &before);
    for (const unsigned threads : {1u, 2u, 7u}) {
        // Of each part its folder and its pages of one level; those that are read at once, and some of the merge's own.
        const rlimit few{openFiles() + 2 * kParts + 2 * threads + 16, before.rlim_max};
        setrlimit(RLIMIT_NOFILE, &few);
        const auto done = runPart({.folder = plan(), .stage = "merge", .threads = threads});
        setrlimit(RLIMIT_NOFILE, &before);
        ASSERT_TRUE(done.ok()) << done.error().line();
        EXPECT_EQ(bytesOf(output()), whole_) << threads << " threads";
        fs::remove(output());
    }
}

TEST_F(BuildParts, AMergeThatEndsEarlyLeavesNothing) {
    planned(3);
    ASSERT_NO_FATAL_FAILURE(buildPages(3));
    const auto expectNothing = [&] {
        for (const fs::path& folder : {folder_.path(), plan()})
            for (const auto& each : fs::directory_iterator(folder))
                EXPECT_TRUE(each.path() != output() && each.path().extension() != ".partial" &&
                            !each.path().filename().string().starts_with("merge"))
                    << each.path();
    };
    for (const double after : {0.0, 0.5}) {
        const auto done =
            runPart({.folder = plan(), .stage = "merge", .threads = 3, .progress = [&](const BuildProgress& at) {
                         std::this_thread::sleep_for(std::chrono::milliseconds(101));
                         return at.fraction <= after;
                     }});
        ASSERT_FALSE(done.ok()) << after;
        EXPECT_EQ(done.error().code, ErrorCode::Cancelled) << done.error().line();
        expectNothing();
    }
    for (const size_t limit : {size_t{4200}, whole_.size() / 2, whole_.size() - 1}) {
        const auto full = [&] {
            const test::FileSizeLimit disk(limit);
            return run("merge", 0);
        }();
        ASSERT_FALSE(full.ok()) << limit;
        EXPECT_EQ(full.error().code, ErrorCode::Io);
        EXPECT_NE(full.error().line().find("out.vcp: write failed"), std::string::npos) << full.error().line();
        expectNothing();
    }
    ASSERT_TRUE(run("merge", 0).ok());
    EXPECT_EQ(bytesOf(output()), whole_);
}

TEST_F(BuildParts, TwoCopiesOfAPartAtOnce) {
    planned(2);
    for (const PartStage& stage : stagesOf(2))
        for (unsigned i = 0; i < stage.parts; ++i) {
            Result<PartReport> other = PartReport{};
            std::thread copy([&] { other = run(stage.name, i); });
            const auto one = run(stage.name, i);
            copy.join();
            EXPECT_TRUE(one.ok() || other.ok()) << one.error().line() << "; " << other.error().line();
            for (const Result<PartReport>* each : {&one, &std::as_const(other)}) {
                if (each->ok()) continue;
                // Two merges that write at once have one name to write to.
                EXPECT_EQ(stage.name, "merge") << each->error().line();
                EXPECT_NE(each->error().line().find("another build is writing this file"), std::string::npos)
                    << each->error().line();
            }
        }
    EXPECT_EQ(bytesOf(output()), whole_);
}

TEST_F(BuildParts, APartThatIsDoneIsNotRunAgain) {
    planned(2);
    ASSERT_NO_FATAL_FAILURE(dealAll(2));
    for (const char* stage : {"read", "count", "deal"}) {
        const auto again = run(stage, 0);
        ASSERT_TRUE(again.ok());
        EXPECT_TRUE(again->wasDone) << stage;
    }
}

TEST_F(BuildParts, MissingPartsAreNamed) {
    planned(2);
    expectRefused(run("vertices", 0), ErrorCode::Usage, "count 0");
    ASSERT_TRUE(run("read", 0).ok());
    expectRefused(run("count", 0), ErrorCode::Usage, "read 1");
    ASSERT_TRUE(run("read", 1).ok());
    expectRefused(run("deal", 1), ErrorCode::Usage, "count 0");
    ASSERT_TRUE(run("count", 0).ok());
    ASSERT_TRUE(run("deal", 1).ok());
    expectRefused(run("vertices", 0), ErrorCode::Usage, "deal 0");
    ASSERT_TRUE(run("deal", 0).ok());
    ASSERT_TRUE(run("vertices", 0).ok());
    expectRefused(run("pages", 0), ErrorCode::Usage, "vertices 1");
    ASSERT_TRUE(run("vertices", 1).ok());
    ASSERT_TRUE(run("pages", 1).ok());
    expectRefused(run("merge", 0), ErrorCode::Usage, "pages 0");
    EXPECT_FALSE(fs::exists(output()));
    expectRefused(run("pages", 2), ErrorCode::Usage, "parts 0 to 1");
    expectRefused(run("paint", 0), ErrorCode::Usage, "paint");
}

/// A part, how messages name it, and the stage that reads it.
struct Read {
    std::string stage;
    unsigned number;
    std::string by;

    [[nodiscard]] std::string name() const { return stage + " " + std::to_string(number); }
    [[nodiscard]] std::string folder() const { return stage + "-" + std::to_string(number); }
};

TEST_F(BuildParts, CutOffAndLostFilesNameTheirPart) {
    planned(3);
    for (const Read& part : {Read{"read", 0, "count"}, Read{"count", 0, "deal"}, Read{"deal", 0, "vertices"},
                             Read{"vertices", 1, "pages"}, Read{"pages", 1, "merge"}}) {
        ASSERT_NO_FATAL_FAILURE(runAll(part.stage, part.stage == "count" ? 1 : 3));
        size_t tried = 0;
        for (const auto& each : fs::directory_iterator(plan() / part.folder())) {
            const fs::path file = each.path();
            const auto size = fs::file_size(file);
            if (size == 0) continue;
            const std::string content = bytesOf(file);
            // A journal's line is whole without its end.
            const bool isJournal = file.filename() == "journal";
            fs::resize_file(file, isJournal ? size / 2 : size - 1);
            expectRefused(run(part.by, 0), ErrorCode::InvalidInput, part.name());
            fs::remove(file);
            expectRefused(run(part.by, 0), isJournal ? ErrorCode::Usage : ErrorCode::InvalidInput, part.name());
            std::ofstream(file, std::ios::binary) << content;
            ++tried;
        }
        EXPECT_GE(tried, part.stage == "count"                               ? 1u
                         : part.stage == "vertices" || part.stage == "pages" ? 3u
                                                                             : 2u)
            << part.stage;
        fs::remove_all(plan() / part.folder());
        expectRefused(run(part.by, 0), ErrorCode::Usage, part.name());
        ASSERT_TRUE(run(part.stage, part.number).ok());
    }
    ASSERT_TRUE(run("merge", 0).ok());
    EXPECT_EQ(bytesOf(output()), whole_);
}

TEST_F(BuildParts, WrongBytesNameTheirPart) {
    planned(2);
    for (const Read& part : {Read{"read", 0, "count"}, Read{"count", 0, "deal"}, Read{"deal", 0, "vertices"},
                             Read{"vertices", 0, "pages"}, Read{"pages", 1, "merge"}}) {
        ASSERT_NO_FATAL_FAILURE(runAll(part.stage, part.stage == "count" ? 1 : 2));
        for (const auto& each : fs::directory_iterator(plan() / part.folder())) {
            const std::string content = bytesOf(each.path());
            if (content.empty()) continue;
            std::string wrong = content;
            wrong[content.size() / 2] = char(wrong[content.size() / 2] ^ 16);
            std::ofstream(each.path(), std::ios::binary) << wrong;
            // One of the readers meets the byte.
            auto refused = run(part.by, 0);
            if (refused && part.by != "merge" && part.by != "count") refused = run(part.by, 1);
            expectRefused(refused, ErrorCode::InvalidInput, part.name());
            std::ofstream(each.path(), std::ios::binary) << content;
            for (const char* number : {"-0", "-1"}) fs::remove_all(plan() / (part.by + number));
        }
    }
    ASSERT_TRUE(run("merge", 0).ok());
    EXPECT_EQ(bytesOf(output()), whole_);
}

TEST_F(BuildParts, PartsOfOtherBinsAreRefused) {
    planned(2);
    ASSERT_NO_FATAL_FAILURE(dealAll(2));
    ASSERT_NO_FATAL_FAILURE(runAll("vertices", 2));
    ASSERT_NO_FATAL_FAILURE(runAll("pages", 2));
    // The same again, as after a loss: what was made from it stays good.
    for (const char* stage : {"read", "count", "deal"}) {
        fs::remove_all(plan() / (std::string(stage) + "-0"));
        ASSERT_TRUE(run(stage, 0).ok());
    }
    const auto again = run("pages", 1);
    ASSERT_TRUE(again.ok()) << again.error().line();
    EXPECT_TRUE(again->wasDone);
    // Another memory may have other bins; here, another cell has.
    BuildOptions coarser = options();
    coarser.cell = 1;
    coarser.temp = folder_ / "coarser";
    fs::create_directory(coarser.temp);
    const auto other = planParts(coarser, 2);
    ASSERT_TRUE(other.ok()) << other.error().line();
    for (const unsigned reader : {0u, 1u})
        ASSERT_TRUE(runPart({.folder = *other, .stage = "read", .number = reader, .threads = 1}).ok());
    ASSERT_TRUE(runPart({.folder = *other, .stage = "count", .number = 0, .threads = 1}).ok());
    fs::rename(plan() / "count-0", folder_ / "count-0");
    fs::rename(*other / "count-0", plan() / "count-0");
    expectRefused(run("merge", 0), ErrorCode::Usage, "deal 0");
    expectRefused(run("pages", 1), ErrorCode::Usage, "pages 1");
    fs::remove_all(plan() / "pages-0");
    expectRefused(run("pages", 0), ErrorCode::Usage, "vertices 0");
    expectRefused(run("vertices", 1), ErrorCode::Usage, "vertices 1");
    expectRefused(run("deal", 1), ErrorCode::Usage, "deal 1");
    fs::remove_all(plan() / "count-0");
    fs::rename(folder_ / "count-0", plan() / "count-0");
    for (const PartStage& stage : stagesOf(2)) ASSERT_NO_FATAL_FAILURE(runAll(stage.name, stage.parts));
    EXPECT_EQ(bytesOf(output()), whole_);
}

TEST_F(BuildParts, AnotherProgramIsRefused) {
    planned(2);
    std::string text = bytesOf(plan() / "plan.json");
    const size_t at = text.find("\"program\": \"") + 12;
    text[at] = text[at] == '9' ? '8' : '9';
    std::ofstream(plan() / "plan.json", std::ios::binary) << text;
    expectRefused(run("read", 0), ErrorCode::Usage, "another build of vcp");
    std::ofstream(plan() / "plan.json", std::ios::binary) << text.substr(0, text.size() / 2);
    expectRefused(run("read", 0), ErrorCode::InvalidInput, "not a whole plan");
}

TEST_F(BuildParts, ChangedInputsAreRefusedAndTouchedOnesAreNot) {
    planned(1);
    fs::last_write_time(input(), fs::file_time_type::clock::now() + std::chrono::hours(1000));
    const std::string before = bytesOf(input());
    spoil(input());
    expectRefused(run("read", 0), ErrorCode::Usage, "was changed since");
    std::ofstream(input(), std::ios::binary) << before;
    EXPECT_TRUE(run("read", 0).ok());
}

TEST_F(BuildParts, InputsAreSharedOutByTheirBytes) {
    const auto is = [](const InputShare& share, unsigned reader, unsigned first, unsigned last) {
        EXPECT_EQ(share.reader, reader);
        EXPECT_EQ(share.firstPart, first);
        EXPECT_EQ(share.lastPart, last);
    };
    is(inputShares({12345}, 4)[0], 0, 0, 3);
    const auto equal = inputShares({100, 100, 100, 100}, 2);
    for (unsigned i = 0; i < 4; ++i) is(equal[i], i / 2, i / 2, i / 2);
    const auto mixed = inputShares({0, 50, 1000, 50}, 3);
    is(mixed[0], 0, 0, 0);
    is(mixed[1], 0, 0, 0);
    is(mixed[2], 0, 0, 2);
    is(mixed[3], 2, 2, 2);
}

TEST_F(BuildParts, OfTilesEachPartDealsItsOwn) {
    const IndexedMesh mesh = mixedMesh();
    BuildOptions o = options();
    o.inputs.clear();
    constexpr size_t kTiles = 6;
    for (size_t tile = 0; tile < kTiles; ++tile) {
        IndexedMesh part;
        part.positions = mesh.positions;
        for (size_t i = tile; i < mesh.triangles.size(); i += kTiles) part.triangles.push_back(mesh.triangles[i]);
        o.inputs.push_back(folder_ / ("tile" + std::to_string(tile) + ".ply"));
        test::writePly(part, o.inputs.back(), {});
    }
    std::string whole;
    ASSERT_NO_FATAL_FAILURE(buildWhole(o, whole));
    ASSERT_TRUE(planParts(o, 3).ok());
    for (const PartStage& stage : stagesOf(3)) {
        ASSERT_NO_FATAL_FAILURE(runAll(stage.name, stage.parts, 3));
    }
    EXPECT_EQ(bytesOf(output()), whole);
}

/// Who reads what is planned: an input that is gone meanwhile changes no part's share.
TEST_F(BuildParts, AnInputThatIsGoneIsMissedByItsOwnPartAlone) {
    BuildOptions o = options();
    o.inputs.clear();
    for (size_t tile = 0; tile < 4; ++tile) {
        o.inputs.push_back(folder_ / ("tile" + std::to_string(tile) + ".ply"));
        test::writePly(test::sphereMesh({30.0 * double(tile), 20, 20}, 9, 40), o.inputs.back());
    }
    std::string whole;
    ASSERT_NO_FATAL_FAILURE(buildWhole(o, whole));
    ASSERT_TRUE(planParts(o, 2).ok());
    ASSERT_TRUE(run("read", 0).ok());
    fs::remove(o.inputs[0]);
    ASSERT_TRUE(run("read", 1).ok());
    for (const PartStage& stage : stagesOf(2)) ASSERT_NO_FATAL_FAILURE(runAll(stage.name, stage.parts));
    EXPECT_EQ(bytesOf(output()), whole);
    fs::remove_all(plan() / "read-0");
    expectRefused(run("read", 0), ErrorCode::Io, "tile0.ply");
}

/// With less memory triangles come in another order, and so would go to other parts than before.
TEST_F(BuildParts, ReadAgainInAnotherOrderIsRefused) {
    planned(2);
    ASSERT_NO_FATAL_FAILURE(runAll("read", 2));
    ASSERT_TRUE(run("count", 0).ok());
    ASSERT_TRUE(run("deal", 0).ok());
    // The same mesh, its triangles turned about, stands for what another memory makes of the order.
    const fs::path other = folder_ / "other";
    fs::create_directory(other);
    IndexedMesh mesh = mixedMesh();
    std::reverse(mesh.triangles.begin(), mesh.triangles.end());
    BuildOptions turned = options();
    turned.inputs = {other / "mesh.ply"};
    turned.output = other / "out.vcp";
    test::writePly(mesh, turned.inputs[0], std::vector<uint32_t>(mesh.positions.size(), 7));
    const auto folder = planParts(turned, 2);
    ASSERT_TRUE(folder.ok());
    ASSERT_TRUE(runPart({.folder = *folder, .stage = "read", .number = 0, .threads = 1}).ok());
    fs::rename(plan() / "read-0", folder_ / "read-0");
    fs::rename(*folder / "read-0", plan() / "read-0");
    expectRefused(run("deal", 1), ErrorCode::Usage, "count 0");
    fs::remove_all(plan() / "count-0");
    ASSERT_TRUE(run("count", 0).ok());
    expectRefused(run("deal", 0), ErrorCode::Usage, "deal 0");
    // The same reading again, whoever did what, is as good.
    fs::remove_all(plan() / "read-0");
    fs::remove_all(plan() / "count-0");
    fs::rename(folder_ / "read-0", plan() / "read-0");
    ASSERT_TRUE(run("count", 0).ok());
    EXPECT_TRUE(run("deal", 0)->wasDone);
    fs::remove_all(plan() / "read-0");
    ASSERT_TRUE(run("read", 0).ok());
    EXPECT_TRUE(run("deal", 1).ok());
}

TEST_F(BuildParts, WhatAMeshNamesMayNotChangeMeanwhile) {
    const fs::path material = folder_ / "square.mtl", mesh = folder_ / "square.obj";
    std::ofstream(mesh) << "mtllib square.mtl\nusemtl paint\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
                           "f 1/1 2/2 3/3\n";
    std::ofstream(material) << "newmtl paint\nKd 1 0 0\nKe nan nan nan\nmap_Ke missing.png\n";
    BuildOptions o = options();
    o.inputs = {mesh};
    std::string whole;
    ASSERT_NO_FATAL_FAILURE(buildWhole(o, whole));
    ASSERT_TRUE(planParts(o, 1).ok());
    ASSERT_TRUE(run("read", 0).ok());
    const std::string before = bytesOf(material);
    spoil(material);
    expectRefused(run("count", 0), ErrorCode::Usage, "square.mtl");
    std::ofstream(material, std::ios::binary) << before;
    ASSERT_TRUE(run("count", 0).ok()) << "the bytes decide, not the times";
    spoil(material);
    expectRefused(run("deal", 0), ErrorCode::Usage, "square.mtl");
    std::ofstream(material, std::ios::binary) << before;
    for (const PartStage& stage : stagesOf(1)) ASSERT_NO_FATAL_FAILURE(runAll(stage.name, stage.parts));
    EXPECT_EQ(bytesOf(output()), whole) << "numbers that are none count for nothing in parts as well";
}

TEST_F(BuildParts, WhatCannotBePlanned) {
    BuildOptions o = options();
    o.error = 0.1;
    EXPECT_FALSE(planParts(o, 2).ok());
    o = options();
    o.inputs = {"-"};
    EXPECT_FALSE(planParts(o, 2).ok());
    EXPECT_FALSE(planParts(options(), 0).ok());
    EXPECT_FALSE(planParts(options(), kMostParts + 1).ok());
    EXPECT_FALSE(fs::exists(plan()));
    planned(2);
    const auto again = planParts(options(), 2);
    ASSERT_FALSE(again.ok());
    EXPECT_NE(again.error().message.find("already"), std::string::npos);
}

}  // namespace
}  // namespace vcp
