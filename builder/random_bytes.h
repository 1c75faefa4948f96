// RandomBytes: bytes that may be read anywhere, as the buffers of glTF are: a part of a file, or a spool of what
// came through a pipe. One thread at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "octree/result.h"

namespace vcp {

class RandomBytes {
public:
    virtual ~RandomBytes() = default;

    [[nodiscard]] virtual uint64_t size() const = 0;

    /// Precondition: offset + count <= size(). Errors: Io, without file and byte.
    virtual Result<void> read(uint64_t offset, char* to, size_t count) = 0;
};

/// A regular file from `offset` on; nothing else is opened. Errors: Io, with the file's name.
Result<std::unique_ptr<RandomBytes>> openRandomBytes(const std::filesystem::path& path, uint64_t offset = 0);

std::unique_ptr<RandomBytes> randomBytesOf(std::string bytes);

/// Bytes appended one after another, then read anywhere: in memory up to `memoryBytes`, beyond that in a file
/// without a name in `folder` (empty: the system's folder for temporary files), which vanishes with the process.
class Spool final : public RandomBytes {
public:
    explicit Spool(std::filesystem::path folder, size_t memoryBytes = 1024 * 1024)
        : folder_(std::move(folder)), memoryBytes_(memoryBytes) {}
    Spool(const Spool&) = delete;
    Spool& operator=(const Spool&) = delete;
    ~Spool() override;

    /// Errors: Io (no space, the folder cannot be written), with the folder's name.
    Result<void> append(std::string_view bytes);

    [[nodiscard]] uint64_t size() const override { return size_; }
    Result<void> read(uint64_t offset, char* to, size_t count) override;

private:
    Result<void> moveToFile();
    Result<void> write(std::string_view bytes);

    std::filesystem::path folder_;
    size_t memoryBytes_;
    std::string memory_;
    int file_ = -1;
    uint64_t size_ = 0;
};

}  // namespace vcp
