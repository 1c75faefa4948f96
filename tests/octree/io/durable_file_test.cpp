// Whole writes whatever the system takes at a time; folders made durable; one holder of a name.
#include "octree/io/durable_file.h"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fstream>
#include <random>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/file_size_limit.h"
#include "tests/support/random_bytes.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::byte>;

std::string textOf(const Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

/// A descriptor that is closed.
class Opened {
public:
    Opened(const fs::path& path, int flags) : fd_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
    ~Opened() { close(); }
    Opened(const Opened&) = delete;
    Opened& operator=(const Opened&) = delete;
    void close() {
        if (fd_ >= 0) ::close(fd_);
        fd_ = -1;
    }
    operator int() const { return fd_; }

private:
    int fd_;
};

class DurableFile : public testing::Test {
protected:
    TestFolder folder_{"vcp_durable_file_test"};
    const fs::path file_ = folder_ / "file";
};

TEST_F(DurableFile, WritesWhereItIsTold) {
    const Opened fd(file_, O_RDWR | O_CREAT);
    const Bytes bytes = test::randomBytes(3000, 1);
    ASSERT_TRUE(writeAll(fd, 1000, std::span(bytes).subspan(1000), file_).ok());
    ASSERT_TRUE(writeAll(fd, 0, std::span(bytes).first(1000), file_).ok());
    ASSERT_TRUE(writeAll(fd, 77, {}, file_).ok());
    EXPECT_EQ(contentOf(file_), textOf(bytes));
    const Opened end(file_, O_WRONLY | O_APPEND);
    ASSERT_TRUE(appendAll(end, std::span(bytes).first(5), file_).ok());
    EXPECT_EQ(contentOf(file_), textOf(bytes) + textOf(bytes).substr(0, 5));
}

// Part of the bytes still fit: they are written, and then it is an error.
TEST_F(DurableFile, PartialWritesGoOnToTheEndOrTheError) {
    const Bytes bytes = test::randomBytes(5000, 2);
    const Opened fd(file_, O_RDWR | O_CREAT);
    const auto result = [&] {
        const test::FileSizeLimit limit(4096);
        return writeAll(fd, 0, bytes, file_);
    }();
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::Io);
    EXPECT_EQ(result.error().line(), file_.string() + ": write failed: File too large");
    EXPECT_EQ(contentOf(file_), textOf(bytes).substr(0, 4096));
}

std::atomic<int> signals = 0;

// A pipe takes as much as it has room for, and a signal ends a write that waits: with what it took, or with EINTR.
TEST_F(DurableFile, InterruptedWritesGoOn) {
    struct sigaction action {
    }, before{};
    action.sa_handler = [](int) { ++signals; };
    ASSERT_EQ(sigaction(SIGUSR1, &action, &before), 0);
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const Bytes bytes = test::randomBytes(300000, 3);
    const pthread_t writer = pthread_self();
    std::string read;
    std::thread reader([&] {
        char buffer[40000];
        do {
            // Twice, so that one of them finds no room at all.
            for (int i = 0; i < 2; ++i) {
                std::this_thread::sleep_for(std::chrono::milliseconds(2));
                pthread_kill(writer, SIGUSR1);
            }
            const ssize_t n = ::read(ends[0], buffer, std::min(sizeof buffer, bytes.size() - read.size()));
            if (n <= 0) return;
            read.append(buffer, size_t(n));
        } while (read.size() < bytes.size());
    });
    const auto result = appendAll(ends[1], bytes, "pipe");
    ::close(ends[1]);
    reader.join();
    ::close(ends[0]);
    sigaction(SIGUSR1, &before, nullptr);
    EXPECT_TRUE(result.ok()) << result.error().line();
    EXPECT_TRUE(read == textOf(bytes));
    EXPECT_GT(signals, 5);
}

TEST_F(DurableFile, ErrorsSayWhatAndWhatToDo) {
    std::ofstream(file_) << "x";
    const Opened readOnly(file_, O_RDONLY);
    const Bytes bytes(10);
    for (const auto& result : {writeAll(readOnly, 0, bytes, file_), appendAll(readOnly, bytes, file_)}) {
        ASSERT_FALSE(result.ok());
        EXPECT_EQ(result.error().line(), file_.string() + ": write failed: Bad file descriptor");
    }
    EXPECT_EQ(systemError("a/b", "cannot do", EACCES).line(), "a/b: cannot do: Permission denied");
    EXPECT_EQ(systemError("a/b", "cannot do", ENOSPC).line(),
              "a/b: cannot do: No space left on device; free some space or choose another folder");
    EXPECT_EQ(systemError("a/b", "cannot do", EDQUOT, "do this").line(),
              "a/b: cannot do: Disk quota exceeded; do this");
    if (!fs::exists("/dev/full")) return;
    const Opened full("/dev/full", O_WRONLY);
    const auto result = writeAll(full, 0, bytes, "/dev/full", "do that");
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().line(), "/dev/full: write failed: No space left on device; do that");
}

TEST_F(DurableFile, FoldersThatAreNone) {
    EXPECT_TRUE(syncFolder(folder_.path()).ok());
    EXPECT_TRUE(syncFolder({}).ok());
    std::ofstream(file_) << "x";
    for (const fs::path& none : {folder_ / "none", file_}) {
        const auto result = syncFolder(none);
        ASSERT_FALSE(result.ok());
        EXPECT_EQ(result.error().code, ErrorCode::Io);
        EXPECT_EQ(result.error().file, none.string());
        EXPECT_NE(result.error().line().find("cannot open the folder"), std::string::npos) << result.error().line();
    }
}

TEST_F(DurableFile, ANameHasOneHolder) {
    std::ofstream(file_) << "x";
    Opened first(file_, O_RDWR), second(file_, O_RDWR);
    EXPECT_EQ(lockName(first, file_), NameLock::Taken);
    EXPECT_EQ(lockName(first, file_), NameLock::Taken) << "it has it already";
    EXPECT_EQ(lockName(second, file_), NameLock::Held);
    first.close();
    EXPECT_EQ(lockName(second, file_), NameLock::Taken);
    // A folder as well.
    Opened folder(folder_.path(), O_RDONLY | O_DIRECTORY);
    const Opened again(folder_.path(), O_RDONLY | O_DIRECTORY);
    EXPECT_EQ(lockName(folder, folder_.path()), NameLock::Taken);
    EXPECT_EQ(lockName(again, folder_.path()), NameLock::Held);
}

TEST_F(DurableFile, ALockOfAnotherFileIsGone) {
    std::ofstream(file_) << "x";
    const Opened removed(file_, O_RDWR);
    fs::remove(file_);
    EXPECT_EQ(lockName(removed, file_), NameLock::Gone);
    std::ofstream(file_) << "y";
    EXPECT_EQ(lockName(removed, file_), NameLock::Gone) << "another file of that name";
    const Opened renamed(file_, O_RDWR);
    fs::rename(file_, folder_ / "finished");
    EXPECT_EQ(lockName(renamed, file_), NameLock::Gone);
    EXPECT_EQ(lockName(renamed, folder_ / "finished"), NameLock::Taken);
}

}  // namespace
}  // namespace vcp
