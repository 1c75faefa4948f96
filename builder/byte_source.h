// ByteSource: a file, or bytes in memory, read forward through a bounded window.
//
// A mesh reader looks at the window, takes what it can decode, and advances. The cursor is an absolute
// offset in the file, so every error can name its byte. The window is some 256 KiB; it grows only when a
// reader asks for one item that is larger (and then bounds that itself).
//
// One thread at a time. Movable, not copyable; owns the file descriptor, not the memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "octree/result.h"

namespace vcp {

class ByteSource {
public:
    static constexpr size_t kWindowBytes = 256 * 1024;

    /// Opens a regular file. Errors: Io (missing, a folder, a device, unreadable), each in plain words.
    static Result<ByteSource> open(const std::filesystem::path& path, size_t windowBytes = kWindowBytes);

    /// Reads `bytes`, which must outlive the source; `name` stands for the path in errors. Small windows
    /// let a test cut an item at every byte.
    static ByteSource fromMemory(std::string_view bytes, std::string name, size_t windowBytes = kWindowBytes);

    ByteSource(ByteSource&& other) noexcept;
    ByteSource& operator=(ByteSource&& other) noexcept;
    ~ByteSource();

    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] uint64_t size() const { return size_; }
    [[nodiscard]] uint64_t offset() const { return offset_; }
    [[nodiscard]] uint64_t remaining() const { return size_ - offset_; }
    [[nodiscard]] bool atEnd() const { return offset_ == size_; }

    /// The bytes at the cursor: at least min(atLeast, remaining()), usually more. Valid until the next
    /// call of a member that is not const. Errors: Io (the read failed, or the file shrank meanwhile).
    Result<std::string_view> window(size_t atLeast = 1);

    /// Finds where the last whole item of a text ends: the number of leading bytes that hold whole items,
    /// 0 when not even one is whole.
    using WholeEnd = size_t (*)(std::string_view text);

    /// A window cut where `wholeEnd` says, or uncut when it reaches the end of the file. Empty only at
    /// the end of the file. Errors: Io; Limit when one item is longer than `limit` bytes.
    Result<std::string_view> wholeWindow(WholeEnd wholeEnd, size_t limit);

    /// Takes the next line, without its "\n" or "\r\n"; nothing at the end of the file. Valid as window() is.
    /// Errors: Io; Limit when the line is longer than `limit` bytes.
    Result<std::optional<std::string_view>> line(size_t limit);

    /// Moves the cursor forward by `count` <= remaining() bytes, past the window if need be.
    void advance(uint64_t count);

    /// An error of this file.
    [[nodiscard]] Error error(ErrorCode code, std::string element, std::optional<uint64_t> byte,
                              std::string message) const;

private:
    ByteSource(std::string name, uint64_t size, size_t windowBytes);
    Result<void> fill(size_t atLeast);

    std::string name_;
    uint64_t size_ = 0;
    uint64_t offset_ = 0;
    size_t windowBytes_ = kWindowBytes;
    const char* memory_ = nullptr;  // the whole input when it is in memory
    int file_ = -1;
    std::vector<char> buffer_;
    uint64_t bufferStart_ = 0;  // offset in the file of buffer_[0]
    size_t bufferFilled_ = 0;
};

}  // namespace vcp
