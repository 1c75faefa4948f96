#include "octree/io/output_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "tests/support/test_folder.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

class OutputFiles : public testing::Test {
protected:
    fs::path put(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ / name, std::ios::binary) << text;
        return folder_ / name;
    }
    static std::string contentOf(const fs::path& path) {
        std::ifstream file(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    size_t files() const {
        return size_t(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()));
    }
    static std::string refusal(const Result<void>& result) { return result ? "" : result.error().line(); }

    const std::string png_ = "\x89PNG\r\n\x1a\nold";
    TestFolder folder_{"vcp_output_file_test"};
};

TEST_F(OutputFiles, AppearWholeOrNotAtAll) {
    const fs::path path = folder_ / "a.json";
    {
        auto file = OutputFile::create(path, OutputKind::JsonText);
        ASSERT_TRUE(file.ok());
        ASSERT_TRUE(file->append(std::as_bytes(std::span("{}", 2))).ok());
        EXPECT_FALSE(fs::exists(path));
    }
    EXPECT_EQ(files(), 0u);
    ASSERT_TRUE(writeFile(path, OutputKind::JsonText, "{}").ok());
    EXPECT_EQ(contentOf(path), "{}\n");
    EXPECT_EQ(files(), 1u);
}

TEST_F(OutputFiles, NeverReplaceWhatIsRead) {
    const fs::path input = put("in.png", png_);
    fs::create_symlink(input, folder_ / "link.png");
    fs::create_hard_link(input, folder_ / "hard.png");
    fs::create_directory(folder_ / "d");
    for (const fs::path& name :
         {input, folder_ / "link.png", folder_ / "hard.png", folder_ / "d/../in.png", fs::relative(input)}) {
        const auto refused =
            writeFile(name, OutputKind::Png, png_ + "new", {.overwrite = true, .inputs = {folder_ / "missing", input}});
        EXPECT_NE(refusal(refused).find(" give another name"), std::string::npos) << name;
        EXPECT_FALSE(checkOutput(name, OutputKind::Png, {.overwrite = true, .inputs = {input}}).ok());
    }
    EXPECT_EQ(contentOf(input), png_);
}

TEST_F(OutputFiles, InputsThatComeLaterAreSeenAtTheEnd) {
    const fs::path path = folder_ / "a.png";
    auto file = OutputFile::create(path, OutputKind::Png, {.inputs = {path}});
    ASSERT_TRUE(file.ok());
    put("a.png", png_);
    EXPECT_FALSE(file->commit().ok());
    EXPECT_EQ(contentOf(path), png_);
}

TEST_F(OutputFiles, OtherKindsAreReplacedWhenAskedFor) {
    const fs::path ply = put("a.ply", "ply\nformat");
    EXPECT_NE(refusal(writeFile(ply, OutputKind::Dataset, std::string_view("x"))).find("is not a dataset"),
              std::string::npos);
    EXPECT_EQ(contentOf(ply), "ply\nformat");
    EXPECT_TRUE(writeFile(ply, OutputKind::JsonText, "{}", {.overwrite = true}).ok());
    EXPECT_EQ(contentOf(ply), "{}\n");
    // An empty file, as mktemp makes it, is of any kind.
    EXPECT_TRUE(writeFile(put("empty", ""), OutputKind::Png, png_).ok());
    EXPECT_TRUE(writeFile(put("b.png", png_), OutputKind::Png, png_ + "new").ok());
}

TEST_F(OutputFiles, WriteProtectedOnesAreKept) {
    const fs::path path = put("a.json", "{}");
    fs::permissions(path, fs::perms::owner_read);
    EXPECT_NE(refusal(writeFile(path, OutputKind::JsonText, "[]")).find("write-protected"), std::string::npos);
    EXPECT_EQ(contentOf(path), "{}");
    EXPECT_TRUE(writeFile(path, OutputKind::JsonText, "[]", {.overwrite = true}).ok());
    EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read);
}

TEST_F(OutputFiles, MeshesThatOthersWroteAreReplacedWhenAskedFor) {
    const auto path = folder_ / "scan.obj";
    const auto holds = [&](const std::string& text) { std::ofstream(path) << text; };
    holds("# exported by a scanner\nv 0 0 0\n");
    EXPECT_NE(writeFile(path, OutputKind::Obj, "v 1 1 1\n").error().line().find("did not write"), std::string::npos);
    EXPECT_EQ(contentOf(path), "# exported by a scanner\nv 0 0 0\n");
    EXPECT_TRUE(writeFile(path, OutputKind::Obj, "# certified_distance 0\nv 1 1 1\n", {.overwrite = true}).ok());
    EXPECT_TRUE(writeFile(path, OutputKind::Obj, "v 2 2 2\n").ok()) << "what was there is an export";
}

TEST_F(OutputFiles, OnlyRegularFilesAreReplaced) {
    ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
    const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    const std::string socketPath = folder_ / "socket";
    ASSERT_LT(socketPath.size(), sizeof name.sun_path);
    std::copy(socketPath.begin(), socketPath.end(), name.sun_path);
    ASSERT_EQ(::bind(socket, reinterpret_cast<sockaddr*>(&name), sizeof name), 0);
    fs::create_directory(folder_ / "folder");
    for (const fs::path& special : {folder_ / "pipe", folder_ / "socket", folder_ / "folder", fs::path("/dev/null")}) {
        EXPECT_FALSE(checkOutput(special, OutputKind::Png, {.overwrite = true}).ok()) << special;
        EXPECT_FALSE(writeFile(special, OutputKind::Png, png_, {.overwrite = true}).ok()) << special;
        EXPECT_FALSE(fs::is_regular_file(special));
        EXPECT_FALSE(fs::exists(special.string() + ".partial"));
    }
    ::close(socket);
}

TEST_F(OutputFiles, LinksStayAndNameTheOutput) {
    const fs::path target = put("target.json", "{}");
    fs::create_symlink("target.json", folder_ / "link.json");
    ASSERT_TRUE(writeFile(folder_ / "link.json", OutputKind::JsonText, "[]").ok());
    EXPECT_TRUE(fs::is_symlink(folder_ / "link.json"));
    EXPECT_EQ(contentOf(target), "[]\n");
    fs::create_symlink("new.json", folder_ / "dangling.json");
    ASSERT_TRUE(writeFile(folder_ / "dangling.json", OutputKind::JsonText, "[1]").ok());
    EXPECT_EQ(contentOf(folder_ / "new.json"), "[1]\n");
    fs::create_symlink("circle", folder_ / "circle");
    EXPECT_FALSE(writeFile(folder_ / "circle", OutputKind::JsonText, "[]").ok());
}

TEST_F(OutputFiles, PartialNamesAreOurOwn) {
    const fs::path treasure = put("treasure", "gold"), out = folder_ / "out.vcp";
    fs::create_symlink(treasure, folder_ / "out.vcp.partial");
    put("out.vcp.partial.2", "a user's own");
    fs::create_hard_link(treasure, folder_ / "out.vcp.partial.3");
    for (const OutputKind kind : {OutputKind::Dataset, OutputKind::Asset, OutputKind::JsonText}) {
        ASSERT_TRUE(checkOutput(out, kind, {.overwrite = true}).ok());
        ASSERT_TRUE(writeFile(out, kind, "{}", {.overwrite = true}).ok());
    }
    EXPECT_EQ(contentOf(treasure), "gold");
    EXPECT_TRUE(fs::is_symlink(folder_ / "out.vcp.partial"));
    EXPECT_EQ(contentOf(folder_ / "out.vcp.partial.2"), "a user's own");
    EXPECT_EQ(files(), 5u);
}

TEST_F(OutputFiles, LeftoversOfInterruptedWritersGo) {
    const fs::path out = folder_ / "out.vcp", left = put("out.vcp.partial", std::string(kPartialMark) + "half");
    {
        const int holder = ::open(left.c_str(), O_RDONLY);
        ASSERT_EQ(::flock(holder, LOCK_EX | LOCK_NB), 0);
        EXPECT_NE(refusal(checkOutput(out, OutputKind::Dataset, {})).find("another build is writing"),
                  std::string::npos);
        ::close(holder);
    }
    EXPECT_TRUE(fs::exists(left));
    EXPECT_TRUE(checkOutput(out, OutputKind::Dataset, {}).ok());
    EXPECT_FALSE(fs::exists(left));
}

TEST_F(OutputFiles, StandardOutputTakesWhatIsWrittenFrontToBack) {
    EXPECT_TRUE(checkOutput("-", OutputKind::Png, {}).ok());
    EXPECT_FALSE(checkOutput("-", OutputKind::Dataset, {}).ok());
    EXPECT_FALSE(checkOutput("-", OutputKind::Asset, {}).ok());
    testing::internal::CaptureStdout();
    EXPECT_TRUE(writeFile("-", OutputKind::JsonText, "{}").ok());
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "{}\n");
    EXPECT_FALSE(fs::exists("-"));
}

TEST_F(OutputFiles, ExtensionsSayTheKind) {
    EXPECT_EQ(outputKindOf("a/B.PNG"), OutputKind::Png);
    EXPECT_EQ(outputKindOf("b.vcp"), OutputKind::Dataset);
    EXPECT_EQ(outputKindOf("b.jpg"), std::nullopt);
    EXPECT_EQ(outputKindOf("png"), std::nullopt);
}

}  // namespace
}  // namespace vcp
