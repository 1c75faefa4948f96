// RandomBytes: bytes that may be read anywhere, as the buffers of glTF are: a part of a file, or a spool of what
// came through a pipe. One thread at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "octree/io/file_descriptor.h"
#include "octree/io/result.h"

namespace vcp {

class RandomBytes {
public:
    virtual ~RandomBytes() = default;

    [[nodiscard]] virtual uint64_t size() const = 0;

    /// Reads bytes. Precondition: offset + count <= size(). Errors: Io, without file and byte.
    virtual Result<void> read(uint64_t offset, char* to, size_t count) = 0;
};

/// Opens a regular file from `offset` on; nothing else is opened. Errors: Io, with the file's name.
Result<std::unique_ptr<RandomBytes>> openRandomBytes(const std::filesystem::path& path, uint64_t offset = 0);

std::unique_ptr<RandomBytes> randomBytesOf(std::string bytes);
/// Reads bytes that stay where they are as long as it is used.
std::unique_ptr<RandomBytes> randomBytesAt(std::string_view bytes);

/// Bytes appended one after another, then read anywhere: in memory up to `memoryBytes`, beyond that in a file
/// without a name in `folder` (empty: the system's folder for temporary files), which vanishes with the process.
/// The file's bytes are checked when they are read, piece by piece, against hashes of what was appended.
class Spool final : public RandomBytes {
public:
    explicit Spool(std::filesystem::path folder, size_t memoryBytes = 1024 * 1024)
        : folder_(std::move(folder)), memoryBytes_(memoryBytes) {}
    Spool(const Spool&) = delete;
    Spool& operator=(const Spool&) = delete;

    /// Appends bytes. Errors: Io (no space, the folder cannot be written), with the folder's name.
    Result<void> append(std::string_view bytes);

    [[nodiscard]] uint64_t size() const override { return size_; }
    /// Reads bytes. Errors: as above, and InvalidInput where the file's bytes are not those that were appended.
    Result<void> read(uint64_t offset, char* to, size_t count) override;

private:
    static constexpr uint64_t kPieceBytes = 64 * 1024;

    Result<void> moveToFile();
    Result<void> write(std::string_view bytes);
    void hash(std::string_view bytes);
    Result<void> load(uint64_t piece);

    std::filesystem::path folder_;
    size_t memoryBytes_;
    std::string memory_;
    FileDescriptor file_;
    uint64_t size_ = 0;
    std::vector<uint64_t> hashes_;  ///< hashes of the file's whole pieces
    std::string last_;              ///< the bytes after them, which the file has too
    std::string piece_;             ///< the piece that was read last
    uint64_t pieceNumber_ = ~uint64_t{0};
};

}  // namespace vcp
