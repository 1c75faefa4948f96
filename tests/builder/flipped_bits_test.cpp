// Files that were built, with one wrong bit: verifyFile finds every one.
#include <atomic>
#include <cstring>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "octree/vcp_verify.h"
#include "tests/support/built_mesh.h"

namespace vcp {
namespace {

class FlippedFile final : public ByteReader {
public:
    static constexpr uint64_t kIntact = ~uint64_t{0};
    FlippedFile(const std::string& bytes, uint64_t bit) : bytes_(bytes), bit_(bit) {}

    Result<void> read(uint64_t offset, std::span<std::byte> out) const override {
        if (offset > bytes_.size() || out.size() > bytes_.size() - offset)
            return Error{.code = ErrorCode::Io, .message = "read past the end", .file = name_};
        if (!out.empty()) std::memcpy(out.data(), bytes_.data() + offset, out.size());
        if (bit_ / 8 >= offset && bit_ / 8 - offset < out.size())
            out[bit_ / 8 - offset] ^= std::byte{1} << int(bit_ % 8);
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return bytes_.size(); }
    [[nodiscard]] const std::string& name() const override { return name_; }

private:
    const std::string& bytes_;
    uint64_t bit_;
    std::string name_ = "flipped.vcp";
};

std::string built(const IndexedMesh& mesh, double cell) { return contentOf(test::BuiltMesh(mesh, cell).file()); }

/// A bit of `bits` that is not found when it is wrong.
template <class BitOf>
uint64_t missedBit(const std::string& bytes, uint64_t count, const BitOf& bitOf) {
    std::atomic<uint64_t> next = 0, missed = FlippedFile::kIntact;
    const auto work = [&] {
        for (uint64_t i; (i = next++) < count;)
            if (verifyFile(FlippedFile(bytes, bitOf(i))).ok()) missed = bitOf(i);
    };
    std::vector<std::thread> threads;
    for (unsigned i = 1; i < std::min(4u, std::thread::hardware_concurrency()); ++i) threads.emplace_back(work);
    work();
    for (std::thread& thread : threads) thread.join();
    return missed;
}

TEST(FlippedBits, AllOfASmallFile) {
    IndexedMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0.1, 0}, {0.2, 1, 0.3}, {0.3, 0.2, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 3, 1}};
    const std::string bytes = built(mesh, 0.2);
    ASSERT_TRUE(verifyFile(FlippedFile(bytes, FlippedFile::kIntact)).ok());
    EXPECT_EQ(missedBit(bytes, bytes.size() * 8, [](uint64_t i) { return i; }), FlippedFile::kIntact);
}

TEST(FlippedBits, RandomOnesOfALargerFile) {
    const std::string bytes = built(test::torusMesh({1, 2, 3}, 2, 0.7, 180, 90), 0.08);
    ASSERT_TRUE(verifyFile(FlippedFile(bytes, FlippedFile::kIntact)).ok());
    ASSERT_GT(bytes.size(), 64u << 10);
    const uint64_t bits = bytes.size() * 8;
    EXPECT_EQ(missedBit(bytes, 500, [bits](uint64_t i) { return std::mt19937_64(i)() % bits; }), FlippedFile::kIntact);
}

}  // namespace
}  // namespace vcp
