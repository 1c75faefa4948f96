// Work in a child: its value, its error, its memory and its end reach the parent.
#include "viewer/bench/child_process.h"

#include <csignal>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/test_folder.h"

namespace vcp {
namespace {

TEST(ChildProcess, TheValueArrivesAsItIs) {
    std::string large;
    for (int i = 0; i < 1'000'000; ++i) large += char(i * 7);
    const pid_t parent = ::getpid();
    pid_t child = 0;
    const auto outcome = runInChild([&](const ChildProgress&) -> Result<std::string> {
        child = ::getpid();
        return large + (::getpid() == parent ? "parent" : "child");
    });
    ASSERT_TRUE(outcome) << outcome.error().line();
    EXPECT_EQ(outcome->value, large + "child");
    EXPECT_EQ(child, 0) << "the child shares the parent's memory";
    const auto empty = runInChild([](const ChildProgress&) -> Result<std::string> { return std::string(); });
    ASSERT_TRUE(empty);
    EXPECT_EQ(empty->value, "");
}

TEST(ChildProcess, TheErrorArrivesWhole) {
    const Error sent{ErrorCode::Unsupported, "a message", "a file", "vertex 17", uint64_t(1) << 40};
    for (const bool hasByte : {true, false}) {
        Error error = sent;
        if (!hasByte) error.byte.reset();
        const auto outcome = runInChild([&](const ChildProgress&) -> Result<std::string> { return error; });
        ASSERT_FALSE(outcome);
        EXPECT_EQ(outcome.error().code, error.code);
        EXPECT_EQ(outcome.error().byte, error.byte);
        EXPECT_EQ(outcome.error().line(), error.line());
    }
}

TEST(ChildProcess, ThePeakOfMemoryIsTheChildsOwn) {
    constexpr size_t kMany = 96 << 20;
    const auto peakWith = [](size_t bytes) {
        const auto outcome = runInChild([=](const ChildProgress&) -> Result<std::string> {
            const std::vector<char> block(bytes, 'x');
            return std::string(1, block[bytes / 2]);
        });
        EXPECT_TRUE(outcome);
        return outcome ? outcome->peakRssBytes : 0;
    };
    const uint64_t many = peakWith(kMany), few = peakWith(1);
    EXPECT_GE(many, few + kMany * 9 / 10);
    EXPECT_LT(few + kMany / 2, many) << "a child does not inherit the peak of the one before";
}

TEST(ChildProcess, ProgressArrives) {
    std::vector<double> fractions;
    std::string last;
    const auto outcome = runInChild(
        [](const ChildProgress& progress) -> Result<std::string> {
            for (int i = 0; i <= 10; ++i)
                if (!progress("step " + std::to_string(i), i / 10.0))
                    return Error{.code = ErrorCode::Cancelled, .message = "cancelled"};
            return std::string("done");
        },
        [&](const std::string& what, double fraction) {
            fractions.push_back(fraction);
            last = what;
            return true;
        });
    ASSERT_TRUE(outcome) << outcome.error().line();
    EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
    EXPECT_EQ(last, "step 10");
}

TEST(ChildProcess, AChildThatIsAskedToStopStops) {
    const auto outcome = runInChild(
        [](const ChildProgress& progress) -> Result<std::string> {
            while (progress("turning", 0.5)) ::usleep(1000);
            return Error{.code = ErrorCode::Cancelled, .message = "stopped when asked"};
        },
        [](const std::string& what, double) { return what.empty(); });
    ASSERT_FALSE(outcome);
    EXPECT_EQ(outcome.error().code, ErrorCode::Cancelled);
    EXPECT_EQ(outcome.error().message, "stopped when asked");
}

TEST(ChildProcess, AChildThatDiesIsAnError) {
    const auto killed = runInChild([](const ChildProgress&) -> Result<std::string> {
        ::kill(::getpid(), SIGKILL);
        return std::string();
    });
    ASSERT_FALSE(killed);
    EXPECT_EQ(killed.error().code, ErrorCode::Limit);
    EXPECT_NE(killed.error().message.find("memory"), std::string::npos) << killed.error().line();
    const auto gone = runInChild([](const ChildProgress&) -> Result<std::string> { ::_exit(0); });
    ASSERT_FALSE(gone);
    EXPECT_EQ(gone.error().code, ErrorCode::Limit);
}

TEST(ChildProcess, ProgramsRun) {
    const TestFolder folder("vcp_child_process_test");
    const std::string file = (folder / "made").string();
    ASSERT_TRUE(runProgram({"/bin/sh", "-c", "echo loud; echo made >\"$0\"", file}));
    EXPECT_EQ(contentOf(file), "made\n");

    const auto failed = runProgram({"/bin/sh", "-c", "echo first >&2; echo second >&2; exit 3"});
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().line(), "/bin/sh: first");
    EXPECT_FALSE(runProgram({"/bin/sh", "-c", "exit 3"}));
    const auto missing = runProgram({(folder / "nothing").string()});
    ASSERT_FALSE(missing);
    EXPECT_NE(missing.error().line().find("cannot be started"), std::string::npos) << missing.error().line();

    const auto stopped = runProgram({"/bin/sh", "-c", "exec sleep 600"}, [] { return false; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace vcp
