// ByteSource: a file, a pipe or bytes in memory, read forward through a bounded window; what gzip or zstd
// compressed is decompressed on the way.
//
// A mesh reader looks at the window, takes what it can decode, and advances. The cursor is an absolute
// offset in the (decompressed) bytes, so every error can name its byte. The window is some 256 KiB; it grows
// only when a reader asks for one item that is larger (and then bounds that itself).
//
// How long the input is may not be known before its end has been seen. Until then size() and remaining() are
// upper limits that no real input reaches: counts that a header declares pass the checks against them, and
// are found out where the bytes end. So nothing may be allocated for declared counts, only for what arrives.
//
// One thread at a time. Movable, not copyable; owns the file descriptor, not the memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "builder/stream/byte_input.h"
#include "octree/io/result.h"

namespace vcp {

class ByteSource {
public:
    static constexpr size_t kWindowBytes = 256 * 1024;
    static constexpr uint64_t kUnknownSize = uint64_t{1} << 62;

    /// Opens a regular file or a named pipe (and waits for its writer), or standard input for "-".
    /// Errors: Io (missing, a folder, a device, a terminal, unreadable), each in plain words; InvalidInput
    /// where compressed data are damaged.
    static Result<ByteSource> open(const std::filesystem::path& path, size_t windowBytes = kWindowBytes);

    /// Reads `bytes` as they are; they must outlive the source. `name` stands for the path in errors. Small
    /// windows let a test cut an item at every byte.
    static ByteSource fromMemory(std::string_view bytes, std::string name, size_t windowBytes = kWindowBytes);

    /// Reads `input`, decompressed if it is compressed. `inputBytes`: how long it is, if that is known.
    static Result<ByteSource> fromInput(std::unique_ptr<ByteInput> input, std::optional<uint64_t> inputBytes,
                                        std::string name, size_t windowBytes = kWindowBytes);

    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] bool sizeKnown() const { return size_ < kUnknownSize; }
    [[nodiscard]] uint64_t size() const { return size_; }
    [[nodiscard]] uint64_t offset() const { return offset_; }
    [[nodiscard]] uint64_t remaining() const { return size_ - offset_; }
    [[nodiscard]] bool atEnd() const { return offset_ == size_; }

    /// Whether this is a regular file that is not compressed: it may also be opened by its path and read at offset().
    [[nodiscard]] bool isPlainFile() const { return plainFile_; }

    /// The bytes of the file itself, before decompression; for progress. 0: a pipe, which does not say.
    [[nodiscard]] uint64_t fileBytes() const { return fileBytes_; }
    [[nodiscard]] uint64_t fileBytesRead() const;

    /// Returns the bytes at the cursor: at least min(atLeast, remaining()), usually more. Valid until the next call of
    /// a member that is not const. Where fewer bytes come than were asked for, the end is known from then on; where the
    /// window reaches the end of the input, that is known too. Errors: Io (the read failed, or the file shrank
    /// meanwhile); InvalidInput, Limit of a decompressor.
    Result<std::string_view> window(size_t atLeast = 1);

    /// Finds where the last whole item of a text ends: the number of leading bytes that hold whole items,
    /// 0 when not even one is whole.
    using WholeEnd = size_t (*)(std::string_view text);

    /// Returns a window cut where `wholeEnd` says, or uncut when it reaches the end of the file. It is empty only at
    /// the end of the file. Errors: as window(); Limit when one item is longer than `limit` bytes.
    Result<std::string_view> wholeWindow(WholeEnd wholeEnd, size_t limit);

    /// Takes the next line, without its "\n" or "\r\n"; nothing at the end of the file. Valid as window() is.
    /// Errors: as window(); Limit when the line is longer than `limit` bytes.
    Result<std::optional<std::string_view>> line(size_t limit);

    /// Moves the cursor forward by `count` bytes of the latest window.
    void advance(uint64_t count);

    /// Moves the cursor forward, past the window if need be; returns by how much, which is less only at the end.
    /// Errors: as window().
    Result<uint64_t> skip(uint64_t count);

    /// Makes an error of this file.
    [[nodiscard]] Error error(ErrorCode code, std::string element, std::optional<uint64_t> byte,
                              std::string message) const;

private:
    ByteSource(std::string name, uint64_t size, size_t windowBytes);
    Result<void> fill(size_t atLeast);
    Result<size_t> readSome(char* to, size_t capacity);

    std::string name_;
    uint64_t size_ = 0;
    uint64_t offset_ = 0;
    uint64_t fileBytes_ = 0;
    size_t windowBytes_ = kWindowBytes;
    bool compressed_ = false;
    bool plainFile_ = false;
    const char* memory_ = nullptr;  // the whole input when it is in memory
    std::unique_ptr<ByteInput> input_;
    std::vector<char> buffer_;
    uint64_t bufferStart_ = 0;  // offset of buffer_[0]
    size_t bufferFilled_ = 0;   // one byte more than the window where the end is not known
};

}  // namespace vcp
