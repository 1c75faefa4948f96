#include "builder/byte_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace vcp {
namespace {

// Not strerror: it may share its buffer between threads.
std::string systemMessage(int code) { return std::generic_category().message(code); }

}  // namespace

ByteSource::ByteSource(std::string name, uint64_t size, size_t windowBytes)
    : name_(std::move(name)), size_(size), windowBytes_(std::max<size_t>(windowBytes, 1)) {}

ByteSource::ByteSource(ByteSource&& other) noexcept
    : name_(std::move(other.name_)),
      size_(other.size_),
      offset_(other.offset_),
      windowBytes_(other.windowBytes_),
      memory_(other.memory_),
      file_(std::exchange(other.file_, -1)),
      buffer_(std::move(other.buffer_)),
      bufferStart_(other.bufferStart_),
      bufferFilled_(other.bufferFilled_) {}

ByteSource& ByteSource::operator=(ByteSource&& other) noexcept {
    name_ = std::move(other.name_);
    size_ = other.size_;
    offset_ = other.offset_;
    windowBytes_ = other.windowBytes_;
    memory_ = other.memory_;
    std::swap(file_, other.file_);
    buffer_ = std::move(other.buffer_);
    bufferStart_ = other.bufferStart_;
    bufferFilled_ = other.bufferFilled_;
    return *this;
}

ByteSource::~ByteSource() {
    if (file_ >= 0) ::close(file_);
}

Result<ByteSource> ByteSource::open(const std::filesystem::path& path, size_t windowBytes) {
    ByteSource source(path.string(), 0, windowBytes);
    const auto refuse = [&](std::string message) {
        return source.error(ErrorCode::Io, "", std::nullopt, std::move(message));
    };
    // O_NONBLOCK: a named pipe must not hang the open; it has no effect on regular files.
    source.file_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (source.file_ < 0) {
        if (errno == ENOENT) return refuse("no such file");
        return refuse("cannot be opened: " + systemMessage(errno));
    }
    struct stat status {};
    if (::fstat(source.file_, &status) != 0) return refuse("cannot be examined: " + systemMessage(errno));
    if (S_ISDIR(status.st_mode)) return refuse("is a folder, not a mesh file");
    if (!S_ISREG(status.st_mode)) return refuse("is not a regular file; save the mesh to a file first");
    source.size_ = static_cast<uint64_t>(status.st_size);
    ::posix_fadvise(source.file_, 0, 0, POSIX_FADV_SEQUENTIAL);
    return source;
}

ByteSource ByteSource::fromMemory(std::string_view bytes, std::string name, size_t windowBytes) {
    ByteSource source(std::move(name), bytes.size(), windowBytes);
    source.memory_ = bytes.data() ? bytes.data() : "";
    return source;
}

Result<std::string_view> ByteSource::window(size_t atLeast) {
    const auto wanted = static_cast<size_t>(std::min<uint64_t>(atLeast, remaining()));
    if (memory_) {
        const auto length = static_cast<size_t>(std::min<uint64_t>(std::max(wanted, windowBytes_), remaining()));
        return std::string_view(memory_ + offset_, length);
    }
    const bool inside = offset_ >= bufferStart_ && offset_ + wanted <= bufferStart_ + bufferFilled_;
    if (!inside || wanted == 0) VCP_TRY(fill(wanted));
    const auto skipped = static_cast<size_t>(offset_ - bufferStart_);
    return std::string_view(buffer_.data() + skipped, bufferFilled_ - skipped);
}

// Brings the bytes from the cursor on to the front of the buffer and reads until it is full.
Result<void> ByteSource::fill(size_t atLeast) {
    size_t kept = 0;
    if (offset_ >= bufferStart_ && offset_ < bufferStart_ + bufferFilled_) {
        const auto skipped = static_cast<size_t>(offset_ - bufferStart_);
        kept = bufferFilled_ - skipped;
        if (skipped > 0) std::memmove(buffer_.data(), buffer_.data() + skipped, kept);
    }
    bufferStart_ = offset_;
    bufferFilled_ = kept;
    const auto wanted = static_cast<size_t>(std::min<uint64_t>(std::max(atLeast, windowBytes_), remaining()));
    if (buffer_.size() < wanted) buffer_.resize(wanted);
    while (bufferFilled_ < wanted) {
        const uint64_t at = bufferStart_ + bufferFilled_;
        const ssize_t got =
            ::pread(file_, buffer_.data() + bufferFilled_, wanted - bufferFilled_, static_cast<off_t>(at));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return error(ErrorCode::Io, "", at, "cannot be read: " + systemMessage(errno));
        if (got == 0) return error(ErrorCode::Io, "", at, "the file became shorter while it was read");
        bufferFilled_ += static_cast<size_t>(got);
    }
    return {};
}

Result<std::string_view> ByteSource::wholeWindow(WholeEnd wholeEnd, size_t limit) {
    size_t asked = 1;
    while (true) {
        auto text = window(asked);
        if (!text || text->size() == remaining()) return text;
        if (const size_t whole = wholeEnd(*text)) return text->substr(0, whole);
        if (text->size() > limit)
            return error(ErrorCode::Limit, "", offset_,
                         fmt::format("no line break in {} bytes; this is not a text file of this format", limit));
        asked = text->size() * 2;
    }
}

Result<std::optional<std::string_view>> ByteSource::line(size_t limit) {
    if (atEnd()) return std::optional<std::string_view>();
    const auto afterLastBreak = [](std::string_view text) { return text.rfind('\n') + 1; };
    auto text = wholeWindow(afterLastBreak, limit);
    if (!text) return text.error();
    std::string_view taken = text->substr(0, text->find('\n'));
    if (taken.size() > limit)
        return error(ErrorCode::Limit, "", offset_, fmt::format("a line is longer than {} bytes", limit));
    advance(std::min(taken.size() + 1, text->size()));
    if (taken.ends_with('\r')) taken.remove_suffix(1);
    return std::optional(taken);
}

void ByteSource::advance(uint64_t count) {
    assert(count <= remaining());
    offset_ += count;
}

Error ByteSource::error(ErrorCode code, std::string element, std::optional<uint64_t> byte, std::string message) const {
    return {code, std::move(message), name_, std::move(element), byte};
}

}  // namespace vcp
