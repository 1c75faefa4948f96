// One process at a time builds an output, whatever became of the last one.
#include "octree/io/output_claim.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>
#include <fstream>
#include <functional>

#include <gtest/gtest.h>

#include "octree/io/durable_file.h"
#include "octree/io/output_folder.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

/// A process that does something and then waits to be killed.
class Other {
public:
    explicit Other(const std::function<bool()>& work) {
        int ends[2] = {-1, -1};
        EXPECT_EQ(::pipe(ends), 0);
        process_ = ::fork();
        if (process_ == 0) {
            const char done = work() ? 'y' : 'n';
            if (::write(ends[1], &done, 1) != 1) ::_exit(1);
            for (;;) ::pause();
        }
        char done = 'n';
        EXPECT_EQ(::read(ends[0], &done, 1), 1);
        EXPECT_EQ(done, 'y');
        ::close(ends[0]);
        ::close(ends[1]);
    }
    ~Other() { kill(); }
    void kill() {
        if (process_ <= 0) return;
        ::kill(process_, SIGKILL);
        ::waitpid(process_, nullptr, 0);
        process_ = -1;
    }
    [[nodiscard]] std::string name() const { return "process " + std::to_string(process_); }

private:
    pid_t process_ = -1;
};

class OutputClaims : public testing::Test {
protected:
    [[nodiscard]] size_t files() const {
        return size_t(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()));
    }
    TestFolder folder_{"vcp_output_claim_test"};
    const fs::path out_ = folder_ / "out.vcp", lock_ = folder_ / "out.vcp.lock";
};

TEST_F(OutputClaims, TheSecondIsToldOfTheFirst) {
    std::optional<OutputClaim> held;
    Other first([&] {
        auto taken = OutputClaim::take(out_);
        if (taken) held = *std::move(taken);
        return held && fs::exists(lock_);
    });
    const auto second = OutputClaim::take(out_);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().line(),
              out_.string() + ": " + first.name() + " is building this file; wait for it, or choose another output");
    fs::create_symlink("out.vcp", folder_ / "link.vcp");
    EXPECT_FALSE(OutputClaim::take(folder_ / "link.vcp")) << "it is the same file";
    EXPECT_TRUE(OutputClaim::take(folder_ / "other.vcp"));
    first.kill();
    EXPECT_TRUE(fs::exists(lock_)) << "it was killed";
    {
        const auto third = OutputClaim::take(out_);
        ASSERT_TRUE(third) << third.error().line();
        const auto fourth = OutputClaim::take(out_);
        ASSERT_FALSE(fourth);
        EXPECT_NE(fourth.error().line().find("process " + std::to_string(::getpid()) + " is"), std::string::npos);
    }
    EXPECT_EQ(files(), 1u) << "the link is left, and no lock";
    EXPECT_TRUE(OutputClaim::take(out_));
}

TEST_F(OutputClaims, AnotherMachineIsNamed) {
    std::ofstream(lock_) << "vcp process 12 on elsewhere\n";
    const int holder = ::open(lock_.c_str(), O_RDONLY);
    ASSERT_EQ(lockName(holder, lock_), NameLock::Taken);
    const auto refused = OutputClaim::take(out_);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().line().find("process 12 on elsewhere is"), std::string::npos) << refused.error().line();
    ::close(holder);
    EXPECT_TRUE(OutputClaim::take(out_));
}

TEST_F(OutputClaims, WhatIsNotOursStaysAsItIs) {
    std::ofstream(lock_) << "a user's own";
    EXPECT_TRUE(OutputClaim::take(out_));
    EXPECT_EQ(contentOf(lock_), "a user's own");
    fs::remove(lock_);
    std::ofstream(folder_ / "treasure");
    fs::create_symlink(folder_ / "treasure", lock_);
    EXPECT_TRUE(OutputClaim::take(out_));
    EXPECT_EQ(contentOf(folder_ / "treasure"), "");
    fs::remove(lock_);
    fs::create_hard_link(folder_ / "treasure", lock_);
    EXPECT_TRUE(OutputClaim::take(out_));
    EXPECT_TRUE(fs::exists(lock_));
    for (const char* none : {"-", "/dev/null", ""}) EXPECT_TRUE(OutputClaim::take(none)) << none;
    EXPECT_FALSE(fs::exists("-.lock"));
    EXPECT_FALSE(fs::exists("/dev/null.lock"));
}

class OutputFolders : public OutputClaims {
protected:
    const fs::path out_ = folder_ / "scan";
    const FolderRules rules_{.isOurs = [](std::string_view name) { return name.ends_with(".vcp"); },
                             .ofWhat = "a scan",
                             .overwrite = false,
                             .howToReplace = "give another name",
                             .inputs = {}};
};

TEST_F(OutputFolders, TheSecondIsToldOfTheFirstAndWhatIsLeftGoes) {
    std::optional<OutputFolder> held;
    Other first([&] {
        auto made = OutputFolder::create(out_, rules_);
        if (!made) return false;
        held.emplace(*std::move(made));
        std::ofstream(held->unfinished() / "1.vcp") << "one";
        std::ofstream(held->unfinished() / "2.vcp.partial") << "tw";
        return true;
    });
    const auto second = OutputFolder::create(out_, rules_);
    ASSERT_FALSE(second);
    EXPECT_NE(second.error().line().find(first.name() + " is writing this folder"), std::string::npos)
        << second.error().line();
    EXPECT_EQ(files(), 1u);
    first.kill();
    EXPECT_EQ(files(), 1u) << "it was killed";
    {
        auto third = OutputFolder::create(out_, rules_);
        ASSERT_TRUE(third) << third.error().line();
        EXPECT_EQ(files(), 1u) << "what was left is gone";
        std::ofstream(third->unfinished() / "1.vcp") << "one";
        ASSERT_TRUE(third->commit());
    }
    EXPECT_EQ(contentOf(out_ / "1.vcp"), "one");
    EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFolders, LeftoversWithOtherFilesStay) {
    fs::create_directory(folder_ / "scan.unfinished-999999999");
    std::ofstream(folder_ / "scan.unfinished-999999999" / "thesis.txt") << "mine";
    fs::create_directory(folder_ / "scan.unfinished-soon");
    fs::create_directory(folder_ / ("scan.unfinished-" + std::to_string(::getppid())));
    EXPECT_TRUE(OutputFolder::create(out_, rules_));
    EXPECT_EQ(files(), 3u);
}

}  // namespace
}  // namespace vcp
