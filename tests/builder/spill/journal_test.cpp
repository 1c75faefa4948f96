// The journal: later lines override earlier ones; torn and damaged lines count as absent.
#include "builder/spill/journal.h"

#include <algorithm>
#include <fstream>

#include <gtest/gtest.h>

#include "builder/spill/temp_space.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class JournalFile : public ::testing::Test {
protected:
    void SetUp() override { ASSERT_TRUE(temp_.take().ok()); }
    fs::path path() const { return temp_.path() / kJournalName; }
    json read() const {
        const auto fields = Journal::read(temp_);
        EXPECT_TRUE(fields.ok());
        return *fields;
    }
    void write(const std::string& text) const { std::ofstream(path(), std::ios::binary) << text; }

    TestFolder folder_{"vcp_journal_test"};
    TempFolder temp_{folder_ / "out.vcp.build"};
};

TEST_F(JournalFile, NoneIsNull) { EXPECT_TRUE(read().is_null()); }

TEST_F(JournalFile, LaterLinesOverride) {
    Journal journal;
    EXPECT_FALSE(journal.active());
    ASSERT_TRUE(journal.record(temp_, {{"stage", "read"}, {"bytes", 5}, {"files", {{"a", 1}, {"b", 2}}}}).ok());
    EXPECT_TRUE(journal.active());
    ASSERT_TRUE(journal.record(temp_, {{"stage", "levels"}, {"files", {{"c", 3}}}}).ok());
    EXPECT_EQ(read(), json({{"stage", "levels"}, {"bytes", 5}, {"files", {{"c", 3}}}}));
}

TEST_F(JournalFile, DoublesSurvive) {
    const double values[] = {0.1, 1.0 / 3, 1e-300, 4.9e-324, 483920.123456789012, -0.0};
    Journal journal;
    for (const double value : values) {
        ASSERT_TRUE(journal.record(temp_, {{"value", value}}).ok());
        EXPECT_EQ(read().at("value").get<double>(), value);
    }
}

TEST_F(JournalFile, EveryTruncationLeavesWholeLines) {
    std::vector<size_t> ends;
    {
        Journal journal;
        for (int i = 0; i < 4; ++i) {
            ASSERT_TRUE(journal.record(temp_, {{"step", i}, {"text", std::string(20, 'x')}}).ok());
            ends.push_back(contentOf(path()).size());
        }
    }
    const std::string whole = contentOf(path());
    for (size_t size = 0; size <= whole.size(); ++size) {
        write(whole.substr(0, size));
        // The line break at the end does not belong to what is said.
        const auto lines = std::count_if(ends.begin(), ends.end(), [&](size_t end) { return size + 1 >= end; });
        const json fields = read();
        ASSERT_EQ(fields.is_null(), lines == 0) << size;
        if (lines > 0) {
            ASSERT_EQ(fields.at("step"), lines - 1) << size;
        }
        // Another build goes on in the same file.
        Journal next;
        ASSERT_TRUE(next.record(temp_, {{"step", 77}}).ok());
        EXPECT_EQ(read().at("step"), 77) << size;
    }
}

TEST_F(JournalFile, DamagedLinesAreAbsent) {
    {
        Journal journal;
        ASSERT_TRUE(journal.record(temp_, {{"step", 1}}).ok());
    }
    const size_t first = contentOf(path()).size();
    {
        Journal journal;
        ASSERT_TRUE(journal.record(temp_, {{"step", 2}}).ok());
    }
    const std::string whole = contentOf(path());
    for (size_t at = first; at + 1 < whole.size(); ++at)
        for (int bit = 0; bit < 8; ++bit) {
            std::string damaged = whole;
            damaged[at] = char(damaged[at] ^ 1 << bit);
            if (at == first) continue;  // the line break in front
            write(damaged);
            ASSERT_EQ(read().at("step"), 1) << "byte " << at << " bit " << bit;
        }
    write("rubbish\n\n\x01\x02" + whole);
    EXPECT_EQ(read().at("step"), 2);
}

TEST_F(JournalFile, LinksAreNotFollowed) {
    std::ofstream(folder_ / "diary") << "dear diary";
    const auto expectRefused = [&](const Result<void>& result, const char* how) {
        ASSERT_FALSE(result.ok()) << how;
        EXPECT_EQ(result.error().code, ErrorCode::Io);
        EXPECT_NE(result.error().line().find("journal: is not a file that a build made"), std::string::npos)
            << result.error().line();
        EXPECT_EQ(contentOf(folder_ / "diary"), "dear diary") << how;
        const auto fields = Journal::read(temp_);
        EXPECT_FALSE(fields.ok()) << how;
    };
    Journal journal;
    fs::create_symlink(folder_ / "diary", path());
    expectRefused(journal.record(temp_, {{"step", 1}}), "symbolic link");
    fs::remove(path());
    fs::create_hard_link(folder_ / "diary", path());
    expectRefused(journal.record(temp_, {{"step", 1}}), "hard link");
    fs::remove(path());
    fs::create_directory(path());
    expectRefused(journal.record(temp_, {{"step", 1}}), "folder");
    EXPECT_FALSE(journal.active());
}

}  // namespace
}  // namespace vcp
