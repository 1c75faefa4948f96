// What is no file is refused at once: a test that waits for a pipe never ends.
#include "octree/io/regular_file.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <fstream>

#include <gtest/gtest.h>

#include "octree/io/byte_reader.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

TEST(RegularFile, OpensFilesAndLinksToThem) {
    const TestFolder folder("vcp_regular_file_test");
    std::ofstream(folder / "file") << "abc";
    std::filesystem::create_symlink(folder / "file", folder / "link");
    for (const char* name : {"file", "link"}) {
        auto stream = openRegularStream(folder / name);
        ASSERT_TRUE(stream.ok()) << stream.error().line();
        char text[4] = {};
        EXPECT_EQ(std::fread(text, 1, 4, stream->get()), 3u);
        EXPECT_STREQ(text, "abc");
    }
}

TEST(RegularFile, RefusesWhatIsNoFile) {
    const TestFolder folder("vcp_regular_file_test");
    ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
    std::filesystem::create_directory(folder / "folder");
    std::filesystem::create_symlink(folder / "pipe", folder / "link");
    const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::snprintf(address.sun_path, sizeof address.sun_path, "%s", (folder / "socket").c_str());
    const bool bound = ::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    const auto expectRefused = [&](const std::filesystem::path& path, const std::string& words) {
        const auto file = openRegular(path);
        ASSERT_FALSE(file.ok()) << path;
        EXPECT_EQ(file.error().code, ErrorCode::Io);
        EXPECT_EQ(file.error().line(), path.string() + ": " + words);
        const auto dataset = openFile(path);
        ASSERT_FALSE(dataset.ok()) << path;
        EXPECT_EQ(dataset.error().line(), path.string() + ": " + words);
    };
    expectRefused(folder / "pipe", "is a pipe, not a file");
    expectRefused(folder / "link", "is a pipe, not a file");
    expectRefused(folder / "folder", "is a folder, not a file");
    expectRefused("/dev/zero", "is a device, not a file");
    expectRefused(folder / "none", "cannot open: No such file or directory");
    if (bound) expectRefused(folder / "socket", "is a socket, not a file");
    ::close(socket);
}

}  // namespace
}  // namespace vcp
