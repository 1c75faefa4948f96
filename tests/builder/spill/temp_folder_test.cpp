// The folder of temporary files: made and marked by a build; what is not a build's own is neither followed nor touched.
#include "builder/spill/temp_folder.h"

#include <fstream>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "builder/build.h"
#include "builder/spill/temp_space.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, const std::string& text = "text") { std::ofstream(path) << text; }

void expectRefused(const Result<void>& result, const std::string& words) {
    ASSERT_FALSE(result.ok()) << "should say: " << words;
    EXPECT_EQ(result.error().code, ErrorCode::Io);
    EXPECT_NE(result.error().line().find(words), std::string::npos) << result.error().line();
    EXPECT_EQ(result.error().line().find('\n'), std::string::npos);
}

class TempFolderTest : public ::testing::Test {
protected:
    fs::path place() const { return folder_ / "out.vcp.build"; }

    TestFolder folder_{"vcp_temp_folder_test"};
};

TEST_F(TempFolderTest, IsMadeMarkedAndRemoved) {
    {
        TempFolder temp(place());
        EXPECT_FALSE(temp.exists());
        ASSERT_TRUE(temp.take().ok());
        ASSERT_TRUE(temp.take().ok()) << "it has it already";
        EXPECT_TRUE(fs::is_regular_file(place() / kTempMark));
        EXPECT_TRUE(temp.create("level3.spill").ok());
    }
    // An interrupted build's, and that of one that was killed before it made the mark.
    TempFolder again(place());
    ASSERT_TRUE(again.take().ok());
    EXPECT_TRUE(fs::exists(place() / "level3.spill"));
    again.remove();
    EXPECT_FALSE(fs::exists(place()));
    fs::create_directory(place());
    ASSERT_TRUE(again.take().ok());
    again.remove();
    EXPECT_FALSE(fs::exists(place()));
    EXPECT_TRUE(fs::exists(folder_.path()));
}

TEST_F(TempFolderTest, RemovesItsOwnFilesOnly) {
    TempFolder temp(place());
    ASSERT_TRUE(temp.take().ok());
    const char* const own[] = {"level1.spill",   "level12.spill", "waiting3.spill", "waiting.spill",  "pages3.spill",
                               "entries3.spill", "floats.spill",  "doubles.spill",  "vertices.spill", "journal"};
    const char* const others[] = {"diary.txt",        "my.spill", "level.txt", "levels3.spill",
                                  "level3.spill.bak", "3.spill",  ".spill"};
    for (const char* name : own) write(place() / name);
    for (const char* name : others) write(place() / name);
    fs::create_directory(place() / "pages9.spill");
    temp.clear({kJournalName, "pages3.spill"});
    EXPECT_TRUE(fs::exists(place() / "journal"));
    EXPECT_TRUE(fs::exists(place() / "pages3.spill"));
    EXPECT_FALSE(fs::exists(place() / "level12.spill"));
    temp.remove();
    for (const char* name : own) EXPECT_FALSE(fs::exists(place() / name)) << name;
    for (const char* name : others) EXPECT_EQ(contentOf(place() / name), "text") << name;
    EXPECT_TRUE(fs::is_directory(place() / "pages9.spill"));
    // It is still a build's: the next one may use it.
    EXPECT_TRUE(TempFolder(place()).take().ok());
    // Not held: not touched.
    write(place() / "level1.spill");
    TempFolder(place()).remove();
    EXPECT_TRUE(fs::exists(place() / "level1.spill"));
}

TEST_F(TempFolderTest, FoldersOfOthersAreRefused) {
    fs::create_directory(place());
    for (const char* name : {"pages3.spill", "journal", "diary.txt"}) write(place() / name);
    TempFolder temp(place());
    expectRefused(temp.take(), "out.vcp.build: is not known to be a build's");
    temp.clear();
    temp.remove();
    for (const char* name : {"pages3.spill", "journal", "diary.txt"})
        EXPECT_EQ(contentOf(place() / name), "text") << name;
    // A link is no mark.
    write(folder_ / "elsewhere");
    fs::create_symlink(folder_ / "elsewhere", place() / kTempMark);
    expectRefused(temp.take(), "is not known to be a build's");
    EXPECT_EQ(contentOf(folder_ / "elsewhere"), "text");
}

TEST_F(TempFolderTest, LinksAndFilesInItsPlaceAreRefused) {
    TempFolder temp(place());
    fs::create_directory(folder_ / "target");
    write(folder_ / "target" / "pages3.spill");
    write(folder_ / "target" / kTempMark, "");
    for (const char* target : {"target", "none"}) {
        fs::create_directory_symlink(folder_ / target, place());
        expectRefused(temp.take(), "it is a link or a file");
        temp.clear();
        temp.remove();
        EXPECT_TRUE(fs::is_symlink(place()));
        fs::remove(place());
    }
    EXPECT_EQ(contentOf(folder_ / "target" / "pages3.spill"), "text");
    EXPECT_FALSE(fs::exists(folder_ / "none"));
    write(place());
    expectRefused(temp.take(), "it is a link or a file");
    EXPECT_EQ(contentOf(place()), "text");
    // A link on the way there is the user's wish.
    fs::create_directory_symlink(folder_ / "target", folder_ / "way");
    TempFolder there(folder_ / "way" / "out.vcp.build");
    EXPECT_TRUE(there.take().ok());
    EXPECT_TRUE(fs::exists(folder_ / "target" / "out.vcp.build" / kTempMark));
}

TEST_F(TempFolderTest, FilesAreNotOpenedThroughLinks) {
    TempFolder temp(place());
    ASSERT_TRUE(temp.take().ok());
    const fs::path victim = folder_ / "victim", name = place() / "level3.spill";
    write(victim);
    const auto make = [&](int kind) {
        if (kind == 0) fs::create_symlink(victim, name);
        if (kind == 1) fs::create_symlink(folder_ / "none", name);
        if (kind == 2) fs::create_hard_link(victim, name);
        if (kind == 3) fs::create_directory(name);
        if (kind < 4) return;
        EXPECT_EQ(::mkfifo(name.c_str(), 0600), 0);
    };
    for (int kind = 0; kind < 5; ++kind) {
        make(kind);
        const auto opened = temp.open("level3.spill");
        ASSERT_FALSE(opened.ok()) << kind;
        EXPECT_NE(opened.error().line().find("level3.spill: is not a file that a build made"), std::string::npos)
            << opened.error().line();
        const auto created = temp.create("level3.spill");
        ASSERT_FALSE(created.ok()) << kind;
        EXPECT_NE(created.error().line().find("level3.spill: a build makes this file itself"), std::string::npos)
            << created.error().line();
        EXPECT_EQ(contentOf(victim), "text") << kind;
        EXPECT_FALSE(fs::exists(folder_ / "none"));
        fs::remove(name);
    }
    EXPECT_EQ(*temp.open("level3.spill"), -1) << "there is none";
}

TEST_F(TempFolderTest, FilesWithTwoNamesAreNotCut) {
    const fs::path victim = folder_ / "victim", name = place() / "level3.spill";
    write(victim);
    TempSpace space(place(), 0);
    ASSERT_TRUE(space.folder().take().ok());
    fs::create_hard_link(victim, name);
    TempFile file(space, "level3.spill");
    EXPECT_FALSE(file.reopen(1).ok());
    EXPECT_EQ(contentOf(victim), "text");
}

TEST_F(TempFolderTest, NothingIsLeftOfParentsThatWereMade) {
    const fs::path deep = folder_ / "a" / "b" / "out.vcp.build";
    TempFolder temp(deep);
    ASSERT_TRUE(temp.take().ok());
    temp.remove();
    EXPECT_FALSE(fs::exists(folder_ / "a"));
    // What was there, and what others have put there, stays.
    fs::create_directory(folder_ / "a");
    ASSERT_TRUE(temp.take().ok());
    temp.remove();
    EXPECT_TRUE(fs::is_empty(folder_ / "a"));
    ASSERT_TRUE(temp.take().ok());
    write(folder_ / "a" / "b" / "diary.txt");
    temp.remove();
    EXPECT_FALSE(fs::exists(deep));
    EXPECT_EQ(contentOf(folder_ / "a" / "b" / "diary.txt"), "text");
    // A name that is too long, after its parents could be made.
    TempFolder never(folder_ / "c" / "d" / std::string(300, 'x'));
    expectRefused(never.take(), "cannot make the temporary folder");
    EXPECT_FALSE(fs::exists(folder_ / "c"));
}

TEST_F(TempFolderTest, BuildsLeaveWhatIsNotTheirs) {
    writeBall(folder_ / "ball.ply", 12, 24);
    BuildOptions options;
    options.inputs = {folder_ / "ball.ply"};
    options.output = folder_ / "out.vcp";
    options.threads = 2;
    options.checkpointSeconds = 0;
    const auto expectRefusal = [&](const char* words) {
        for (const bool resume : {false, true}) {
            options.resume = resume;
            const auto report = buildOctree(options);
            ASSERT_FALSE(report.ok()) << words;
            EXPECT_NE(report.error().line().find(words), std::string::npos) << report.error().line();
            EXPECT_FALSE(fs::exists(options.output));
        }
    };
    // A link to a folder of the user's.
    fs::create_directory(folder_ / "target");
    for (const char* name : {"pages3.spill", "journal"}) write(folder_ / "target" / name);
    fs::create_directory_symlink(folder_ / "target", place());
    expectRefusal("it is a link or a file");
    fs::remove(place());
    // That folder itself.
    fs::rename(folder_ / "target", place());
    expectRefusal("is not known to be a build's");
    for (const char* name : {"pages3.spill", "journal"}) EXPECT_EQ(contentOf(place() / name), "text") << name;
    // A link in a folder that is a build's.
    write(place() / kTempMark, "");
    write(folder_ / "victim");
    fs::remove(place() / "journal");
    fs::create_symlink(folder_ / "victim", place() / "level1.spill");
    options.resume = false;
    const auto report = buildOctree(options);
    ASSERT_FALSE(report.ok());
    EXPECT_NE(report.error().line().find("level1.spill: a build makes this file itself"), std::string::npos)
        << report.error().line();
    EXPECT_EQ(contentOf(folder_ / "victim"), "text");
    EXPECT_TRUE(fs::is_symlink(place() / "level1.spill"));
}

}  // namespace
}  // namespace vcp
