// ByteInput: where a ByteSource gets bytes that have no offsets beforehand: files, pipes, and the output of a
// decompressor. It is read forward, once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "octree/io/result.h"

namespace vcp {

class ByteInput {
public:
    virtual ~ByteInput() = default;

    /// Reads up to `capacity` > 0 bytes; returns 0 only at the end. Errors: Io; InvalidInput and Limit of a
    /// decompressor. They name neither file nor byte; the ByteSource does.
    virtual Result<size_t> read(char* to, size_t capacity) = 0;

    /// The bytes taken so far of the file or pipe itself, before decompression; for progress.
    [[nodiscard]] virtual uint64_t taken() const = 0;
};

/// Reads an open file, pipe or socket from where it stands. Closes it if it `owns` it.
class FileInput final : public ByteInput {
public:
    FileInput(int file, bool owns) : file_(file), owns_(owns) {}
    FileInput(const FileInput&) = delete;
    FileInput& operator=(const FileInput&) = delete;
    ~FileInput() override;

    Result<size_t> read(char* to, size_t capacity) override;
    [[nodiscard]] uint64_t taken() const override { return taken_; }

private:
    int file_;
    bool owns_;
    uint64_t taken_ = 0;
};

enum class Compression { None, Gzip, Zstd };

/// Returns how data that begin with these bytes are compressed; four bytes are enough.
Compression compressionOf(std::string_view start);
constexpr size_t kCompressionMarkBytes = 4;

/// Decompresses `inner`, of which `start` was read already. Any number of gzip members or zstd frames; zero
/// bytes may follow. Memory: under 1 MiB for gzip, at most 128 MiB (the largest window accepted) for zstd.
/// Limit: more than 2000 times the bytes that went in, beyond the first 256 MiB.
std::unique_ptr<ByteInput> makeDecompressor(Compression compression, std::unique_ptr<ByteInput> inner,
                                            std::string start);

}  // namespace vcp
