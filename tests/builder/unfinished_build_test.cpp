// What an unfinished build left, with one wrong bit, or with a journal that says something else: a clear error, or the
// same file as ever.
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <map>
#include <random>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "builder/build.h"
#include "builder/spill/journal.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// How many flips are tried: some in every run, more by hand.
uint64_t flips() {
    const char* asked = std::getenv("VCP_FLIPS");
    return asked ? std::strtoull(asked, nullptr, 10) : 50;
}

class UnfinishedBuild : public ::testing::Test {
protected:
    void SetUp() override {
        writeBall(folder_ / "ball.ply", 30, 60);
        ASSERT_TRUE(buildOctree(options()).ok());
        whole_ = contentOf(output());
        fs::remove(output());
    }

    fs::path output() const { return folder_ / "out.vcp"; }
    fs::path temp() const { return folder_ / "out.vcp.build"; }
    BuildOptions options() const {
        BuildOptions o;
        o.inputs = {input_};
        o.output = output();
        o.cell = 0.03;  // three levels
        o.threads = 2;
        o.checkpointSeconds = 0;
        return o;
    }

    /// Stops a build when a stage of that name begins, "writing" when all pages are there; keeps what it left.
    void stopAt(const std::string& stage) {
        BuildOptions o = options();
        o.progress = [&](const BuildProgress& now) {
            // A folder of the output's name lets the last stage fail; it is looked for once more when all is read.
            if (stage == "writing")
                return now.stage == "reading" || fs::exists(output()) || fs::create_directory(output());
            // A call that takes so long is followed by one for each report.
            std::this_thread::sleep_for(std::chrono::milliseconds(101));
            return !std::string(now.stage).starts_with(stage);
        };
        const auto report = buildOctree(o);
        ASSERT_FALSE(report.ok()) << "stop at " << stage;
        EXPECT_NE(report.error().line().find("resumed"), std::string::npos) << report.error().line();
        fs::remove(output());
        left_.clear();
        for (const auto& entry : fs::directory_iterator(temp()))
            left_[entry.path().filename().string()] = contentOf(entry.path());
        for (const char* name : {"journal", kTempMark}) EXPECT_TRUE(left_.contains(name)) << name;
    }

    void restore() const {
        fs::remove_all(temp());
        fs::create_directory(temp());
        for (const auto& [name, bytes] : left_) std::ofstream(temp() / name, std::ios::binary) << bytes;
        fs::remove(output());
    }

    Result<BuildReport> resume() const {
        BuildOptions o = options();
        o.resume = true;
        return buildOctree(o);
    }

    /// Goes on from what is there: the same file, or one line that names a file and says what to do.
    void expectSameOrError(const std::string& what, std::map<std::string, int>& endings) const {
        const auto report = resume();
        ++endings[report ? "same" : "error"];
        if (report) {
            EXPECT_TRUE(contentOf(output()) == whole_) << what << ": another file";
            EXPECT_FALSE(fs::exists(temp())) << what;
            return;
        }
        const std::string line = report.error().line();
        EXPECT_EQ(line.find('\n'), std::string::npos) << what;
        EXPECT_TRUE(line.starts_with(temp().string())) << what << ": " << line;
        EXPECT_NE(line.find("from the start"), std::string::npos) << what << ": " << line;
        EXPECT_FALSE(fs::exists(output())) << what;
        EXPECT_FALSE(fs::exists(folder_ / "out.vcp.partial")) << what;
        EXPECT_TRUE(fs::exists(temp())) << what << ": what there is stays";
    }

    TestFolder folder_{"vcp_unfinished_build_test"};
    fs::path input_ = folder_ / "ball.ply";
    std::string whole_;
    std::map<std::string, std::string> left_;
};

TEST_F(UnfinishedBuild, FlippedBitsAreFoundOrHarmless) {
    const std::string stages[] = {"sorting", "level 1 of", "level 2 of", "writing"};
    std::map<std::string, int> endings;
    for (size_t stage = 0; stage < std::size(stages); ++stage) {
        stopAt(stages[stage]);
        uint64_t bits = 0;
        for (const auto& [name, bytes] : left_) bits += bytes.size() * 8;
        restore();
        expectSameOrError(stages[stage] + ", intact", endings);
        ASSERT_EQ(endings["error"], 0);
        endings.clear();
        const uint64_t count = flips() / std::size(stages) + (stage == 0 ? flips() % std::size(stages) : 0);
        for (uint64_t i = 0; i < count; ++i) {
            std::mt19937_64 random(stage * 1000000 + i);
            // Files are of very different sizes, so every other flip falls into any of them.
            auto file = left_.begin();
            uint64_t bit = random() % bits;
            while (bit >= file->second.size() * 8) bit -= file++->second.size() * 8;
            if (i % 2 == 1) {
                do file = std::next(left_.begin(), ptrdiff_t(random() % left_.size()));
                while (file->second.empty());
                bit = random() % (file->second.size() * 8);
            }
            restore();
            std::string damaged = file->second;
            damaged[bit / 8] = char(damaged[bit / 8] ^ 1 << bit % 8);
            std::ofstream(temp() / file->first, std::ios::binary) << damaged;
            expectSameOrError(fmt::format("{}: {}, bit {} of {}", stages[stage], file->first, bit, damaged.size() * 8),
                              endings);
        }
        fs::remove_all(temp());
        fs::remove(output());
        if (count >= 10) {
            EXPECT_GT(endings["error"], 0) << stages[stage];
        }
        endings.clear();
    }
}

TEST_F(UnfinishedBuild, ProgressGoesOnFromWhereItWas) {
    double last = 0;
    for (const std::string stage : {"sorting", "level 2 of", "writing"}) {
        stopAt(stage);
        std::vector<BuildProgress> told;
        BuildOptions o = options();
        o.resume = true;
        o.progress = [&](const BuildProgress& now) { return told.push_back(now), true; };
        const auto report = buildOctree(o);
        ASSERT_TRUE(report) << report.error().line();
        EXPECT_TRUE(report->isResumed) << stage;
        ASSERT_GE(told.size(), 2u) << stage;
        EXPECT_GT(told.front().begun, last) << stage << ": more was done than where it was stopped before";
        EXPECT_LT(told.front().begun, 1) << stage;
        for (const BuildProgress& each : told) {
            EXPECT_EQ(each.begun, told.front().begun) << each.stage;
            EXPECT_GE(each.fraction, each.begun) << each.stage;
        }
        last = told.front().begun;
        fs::remove(output());
    }
}

TEST_F(UnfinishedBuild, FlippedBitsInTheSameRunAreFound) {
    // The disk gives back something else while the build runs on.
    for (const std::string& name : {std::string("pages"), std::string("entries")}) {
        bool isDone = false;
        BuildOptions o = options();
        o.progress = [&](const BuildProgress& now) {
            std::this_thread::sleep_for(std::chrono::milliseconds(101));
            if (isDone || !std::string(now.stage).starts_with("level 2 of")) return true;
            for (const auto& entry : fs::directory_iterator(temp())) {
                if (!entry.path().filename().string().starts_with(name)) continue;
                std::string bytes = contentOf(entry.path());
                bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 8);
                std::fstream(entry.path(), std::ios::in | std::ios::out | std::ios::binary) << bytes;
                isDone = true;
            }
            return true;
        };
        const auto report = buildOctree(o);
        ASSERT_TRUE(isDone);
        if (report) {
            // Entries are in memory and need not be read.
            EXPECT_EQ(name, "entries");
            EXPECT_TRUE(contentOf(output()) == whole_);
            continue;
        }
        EXPECT_EQ(name, "pages");
        EXPECT_NE(report.error().line().find("came back damaged"), std::string::npos) << report.error().line();
        EXPECT_FALSE(fs::exists(output()));
        fs::remove_all(temp());
    }
}

TEST_F(UnfinishedBuild, ATornLastLineOfTheJournalCountsAsAbsent) {
    stopAt("level 1 of");
    const std::string journal = left_["journal"];
    const size_t last = journal.rfind('\n', journal.size() - 2);
    ASSERT_GT(last, 100u) << "there are two lines";
    // What is durable after a line is removed only when the next one is: the state before the last line had all files.
    stopAt("sorting");
    std::map<std::string, int> endings;
    for (const char* torn : {"0", "0123456789abcdef", "0123456789abcdef {\"stage\": \"lev"}) {
        restore();
        std::ofstream(temp() / "journal", std::ios::binary | std::ios::app) << '\n' << torn;
        expectSameOrError(torn, endings);
    }
    EXPECT_EQ(endings["same"], 3);
}

/// All that one could say instead of one of the journal's fields.
void forOtherValues(json& root, json& value, const std::function<void(const std::string&, bool isWrongType)>& visit,
                    const std::string& name) {
    const json before = value;
    for (const json& other : {json(), json("text"), json(-7), json(0.5), json(1e300), json(uint64_t{1} << 62), json(0),
                              json(true), json::array(), json::object()}) {
        const bool isNumber = before.is_number() && other.is_number();
        value = other;
        visit(name + " " + other.dump(), before.type_name() != std::string(other.type_name()) && !isNumber);
    }
    value = before;
    if (before.is_object()) {
        for (auto& [key, part] : before.items()) {
            value.erase(key);
            visit(name + "." + key + " missing", true);
            value[key] = part;
            forOtherValues(root, value[key], visit, name + "." + key);
        }
    } else if (before.is_array() && !before.empty()) {
        value.erase(value.size() - 1);
        visit(name + " shorter", false);
        value = before;
        forOtherValues(root, value[0], visit, name + "[0]");
    }
}

TEST_F(UnfinishedBuild, JournalsThatSaySomethingElse) {
    for (const char* stage : {"sorting", "level 2 of"}) {
        stopAt(stage);
        json fields;
        {
            TempFolder temp(this->temp());
            ASSERT_TRUE(temp.take().ok());
            fields = *Journal::read(temp);
            fields.erase("resumed");
        }
        ASSERT_TRUE(fields.contains("measures"));
        left_.erase("journal");
        int tried = 0;
        forOtherValues(
            fields, fields,
            [&](const std::string& what, bool isWrongType) {
                if (!fields.is_object()) return;
                restore();
                {
                    TempFolder temp(this->temp());
                    ASSERT_TRUE(temp.take().ok());
                    ASSERT_TRUE(Journal().record(temp, fields).ok());
                }
                // Some of it cannot be told from the truth, but all of it ends well.
                const auto report = resume();
                ++tried;
                const bool isNeeded = what.find("pass") == std::string::npos && what.find("bin") == std::string::npos &&
                                      what.find("partition") == std::string::npos;
                if (isWrongType && (isNeeded || std::string(stage) != "sorting")) {
                    ASSERT_FALSE(report.ok()) << stage << what;
                }
                if (report) return;
                EXPECT_FALSE(report.error().message.empty());
                EXPECT_EQ(report.error().line().find('\n'), std::string::npos);
                EXPECT_FALSE(fs::exists(output())) << what;
            },
            "");
        EXPECT_GT(tried, 100);
        fs::remove_all(temp());
        fs::remove(output());
    }
}

/// What an OBJ names is part of what is built: as it was, or not at all. Names may have any bytes.
TEST_F(UnfinishedBuild, WhatAMeshNamesIsRemembered) {
    input_ = folder_ / "ball.obj";
    const fs::path materials = folder_ / "red\xff.mtl";
    std::ofstream(materials) << "newmtl red\nKd 1 0 0\n";
    std::ofstream(input_) << "mtllib red\xff.mtl\nusemtl red\n";
    test::writeObj(test::sphereMesh(glm::dvec3(0), 1, 24), folder_ / "shape.obj");
    std::ofstream(input_, std::ios::app) << contentOf(folder_ / "shape.obj");
    const auto straight = buildOctree(options());
    ASSERT_TRUE(straight) << straight.error().line();
    ASSERT_EQ(straight->sideFiles.size(), 1u);
    whole_ = contentOf(output());
    fs::remove(output());

    stopAt("level 2 of");
    const auto resumed = resume();
    ASSERT_TRUE(resumed) << resumed.error().line();
    EXPECT_TRUE(contentOf(output()) == whole_);
    ASSERT_EQ(resumed->sideFiles.size(), 1u);
    EXPECT_EQ(resumed->sideFiles[0].path, straight->sideFiles[0].path);
    fs::remove(output());

    stopAt("level 2 of");
    fs::create_symlink(materials, output());
    BuildOptions overwriting = options();
    overwriting.resume = overwriting.overwrite = true;
    const auto over = buildOctree(overwriting);
    ASSERT_FALSE(over);
    EXPECT_NE(over.error().line().find("which is read"), std::string::npos) << over.error().line();
    fs::remove(output());

    restore();
    std::ofstream(materials) << "newmtl red\nKd 0 1 0\n";
    const auto changed = resume();
    ASSERT_FALSE(changed);
    EXPECT_EQ(changed.error().code, ErrorCode::Usage);
    EXPECT_TRUE(fs::path(changed.error().file) == straight->sideFiles[0].path) << changed.error().line();
    EXPECT_NE(changed.error().message.find("from the start"), std::string::npos);
    EXPECT_TRUE(fs::exists(temp())) << "what there is stays";
    EXPECT_FALSE(fs::exists(output()));
}

}  // namespace
}  // namespace vcp
