// Bytes in a file without a name: written, read as memory, let go and read again.
#include "octree/io/file_memory.h"

#include <algorithm>
#include <fstream>
#include <vector>

#include <gtest/gtest.h>

#include "octree/io/byte_reader.h"
#include "octree/io/content_hash.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

std::vector<std::byte> someBytes(size_t count) {
    std::vector<std::byte> bytes(count);
    for (size_t i = 0; i < count; ++i) bytes[i] = std::byte(i * 31 + i / 251);
    return bytes;
}

TEST(FileMemory, HasWhatWasWrittenAlsoAfterItWasLetGo) {
    const TestFolder folder("vcp_file_memory_test");
    const auto bytes = someBytes(300'001);
    const auto memory = FileMemory::create(bytes.size(), folder.path());
    ASSERT_TRUE(memory) << memory.error().line();
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "the file has no name";
    EXPECT_TRUE(std::ranges::all_of((*memory)->bytes(), [](std::byte b) { return b == std::byte{0}; }));
    ASSERT_TRUE((*memory)->write(100'000, std::span(bytes).subspan(100'000)));
    ASSERT_TRUE((*memory)->write(0, std::span(bytes).first(100'000)));
    for (int i = 0; i < 2; ++i) {
        EXPECT_TRUE(std::ranges::equal((*memory)->bytes(), bytes));
        (*memory)->letGo();
    }
}

/// A file that is cut off or overwritten after it was copied changes nothing.
TEST(FileMemory, ACopyIsItsOwn) {
    const TestFolder folder("vcp_file_memory_test");
    const auto bytes = someBytes(3'000'000);
    std::ofstream(folder / "a", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    const auto reader = openFile(folder / "a");
    ASSERT_TRUE(reader);
    const auto copy = FileMemory::copyOf(**reader, folder.path());
    ASSERT_TRUE(copy) << copy.error().line();
    std::filesystem::resize_file(folder / "a", 10);
    (*copy)->letGo();
    EXPECT_TRUE(std::ranges::equal((*copy)->bytes(), bytes));
    EXPECT_FALSE(FileMemory::copyOf(**reader, folder.path())) << "the file is shorter than it was";
}

TEST(FileMemory, FoldersThatTakeNoFileAreSaid) {
    const auto refused = FileMemory::create(10, "/no/such/folder");
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Io);
    EXPECT_EQ(refused.error().file, "/no/such/folder");
}

TEST(ContentHash, OfPiecesIsThatOfTheWhole) {
    const auto bytes = someBytes(100'000);
    ContentHash hash;
    for (size_t at = 0, step = 1; at < bytes.size(); at += step, step = step * 3 % 7919 + 1)
        hash.add(std::span(bytes).subspan(at, std::min(step, bytes.size() - at)));
    EXPECT_EQ(hash.value(), hashBytes(bytes));
}

}  // namespace
}  // namespace vcp
