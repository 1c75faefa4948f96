#include "builder/stream/byte_source.h"

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

// strerror is not used: it may share its buffer between threads.
std::string systemMessage(int code) { return std::generic_category().message(code); }

struct OpenFile {
    std::unique_ptr<ByteInput> input;
    std::optional<uint64_t> bytes;
};

Error ioError(std::string message) { return {.code = ErrorCode::Io, .message = std::move(message)}; }

// Checks that the file can be read forward: regular files, from where they stand, and pipes can.
Result<OpenFile> asInput(int file, bool owns) {
    auto input = std::make_unique<FileInput>(file, owns);
    struct stat status {};
    if (::fstat(file, &status) != 0) return ioError("cannot be examined: " + systemMessage(errno));
    if (S_ISDIR(status.st_mode)) return ioError("is a folder, not a mesh file");
    if (S_ISREG(status.st_mode)) {
        const off_t begin = std::max<off_t>(::lseek(file, 0, SEEK_CUR), 0);
        ::posix_fadvise(file, 0, 0, POSIX_FADV_SEQUENTIAL);
        return OpenFile{std::move(input), uint64_t(std::max<off_t>(status.st_size - begin, 0))};
    }
    if (!S_ISFIFO(status.st_mode) && !S_ISSOCK(status.st_mode))
        return ioError(::isatty(file) ? "is a terminal; pipe a mesh into it"
                                      : "is a device, neither a file nor a pipe");
    return OpenFile{std::move(input), std::nullopt};
}

Result<OpenFile> openFile(const std::filesystem::path& path) {
    if (path == "-") return asInput(STDIN_FILENO, false);
    struct stat status {};
    // The type is checked before opening: a named pipe's open waits for a writer, which is right, but a device's might
    // do anything.
    if (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode) &&
        !S_ISFIFO(status.st_mode))
        return ioError("is a device, neither a file nor a pipe");
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0 && errno == ENOENT) return ioError("no such file");
    if (file < 0) return ioError("cannot be opened: " + systemMessage(errno));
    return asInput(file, true);
}

}  // namespace

ByteSource::ByteSource(std::string name, uint64_t size, size_t windowBytes)
    : name_(std::move(name)), size_(size), fileBytes_(size), windowBytes_(std::max<size_t>(windowBytes, 1)) {}

Result<ByteSource> ByteSource::open(const std::filesystem::path& path, size_t windowBytes) {
    const std::string name = path == "-" ? "standard input" : path.string();
    auto file = openFile(path);
    if (!file) {
        Error error = file.error();
        error.file = name;
        return error;
    }
    auto source = fromInput(std::move(file->input), file->bytes, name, windowBytes);
    if (source) source->plainFile_ = file->bytes && path != "-" && !source->compressed_;
    return source;
}

ByteSource ByteSource::fromMemory(std::string_view bytes, std::string name, size_t windowBytes) {
    ByteSource source(std::move(name), bytes.size(), windowBytes);
    source.memory_ = bytes.data() ? bytes.data() : "";
    return source;
}

Result<ByteSource> ByteSource::fromInput(std::unique_ptr<ByteInput> input, std::optional<uint64_t> inputBytes,
                                         std::string name, size_t windowBytes) {
    ByteSource source(std::move(name), inputBytes.value_or(kUnknownSize), windowBytes);
    source.fileBytes_ = inputBytes.value_or(0);
    source.input_ = std::move(input);
    VCP_TRY_ASSIGN(const auto start, source.window(kCompressionMarkBytes));
    const Compression compression = compressionOf(start);
    if (compression == Compression::None) return source;

    std::string read(source.buffer_.data(), source.bufferFilled_);
    source.input_ = makeDecompressor(compression, std::move(source.input_), std::move(read));
    source.compressed_ = true;
    source.size_ = kUnknownSize;
    source.bufferFilled_ = 0;
    VCP_TRY(source.window());
    return source;
}

uint64_t ByteSource::fileBytesRead() const { return compressed_ ? input_->taken() : offset_; }

Result<std::string_view> ByteSource::window(size_t atLeast) {
    auto wanted = size_t(std::min<uint64_t>(atLeast, remaining()));
    if (memory_) {
        const auto length = size_t(std::min<uint64_t>(std::max(wanted, windowBytes_), remaining()));
        return std::string_view(memory_ + offset_, length);
    }
    const size_t heldBack = sizeKnown() ? 0 : 1;
    const bool inside = offset_ >= bufferStart_ && offset_ + wanted + heldBack <= bufferStart_ + bufferFilled_;
    if (!inside || wanted == 0) VCP_TRY(fill(wanted));
    const auto skipped = size_t(offset_ - bufferStart_);
    return std::string_view(buffer_.data() + skipped, bufferFilled_ - skipped - (sizeKnown() ? 0 : 1));
}

// Moves the bytes from the cursor on to the front of the buffer and reads until it is full. While the end is not known
// it reads one byte more than the window will show: so it is always known whether the end or a byte follows the
// window.
Result<void> ByteSource::fill(size_t atLeast) {
    assert(offset_ >= bufferStart_ && offset_ <= bufferStart_ + bufferFilled_);
    const auto skipped = size_t(offset_ - bufferStart_);
    bufferFilled_ -= skipped;
    if (skipped > 0) std::memmove(buffer_.data(), buffer_.data() + skipped, bufferFilled_);
    bufferStart_ = offset_;
    const auto wanted = size_t(std::min<uint64_t>(std::max(atLeast, windowBytes_) + 1, remaining()));
    while (bufferFilled_ < wanted) {
        // The buffer grows with what arrives, not with what is asked for.
        if (buffer_.size() < wanted) buffer_.resize(std::min(wanted, std::max(windowBytes_ + 1, 2 * bufferFilled_)));
        VCP_TRY_ASSIGN(const auto got,
                       readSome(buffer_.data() + bufferFilled_, std::min(wanted, buffer_.size()) - bufferFilled_));
        bufferFilled_ += got;
        if (got == 0) {
            size_ = bufferStart_ + bufferFilled_;
            break;
        }
    }
    return {};
}

// Reads the next bytes of the input; returns 0 only at the end of one whose length was not known.
Result<size_t> ByteSource::readSome(char* to, size_t capacity) {
    const auto got = input_->read(to, capacity);
    const uint64_t at = bufferStart_ + bufferFilled_;
    if (!got) return error(got.error().code, "", at, got.error().message);
    if (*got == 0 && sizeKnown()) return error(ErrorCode::Io, "", at, "the file became shorter while it was read");
    return got;
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
    const auto afterLastBreak = [](std::string_view text) { return text.rfind('\n') + 1; };
    VCP_TRY_ASSIGN(auto text, wholeWindow(afterLastBreak, limit));
    if (atEnd()) return std::optional<std::string_view>();
    std::string_view taken = text.substr(0, text.find('\n'));
    if (taken.size() > limit)
        return error(ErrorCode::Limit, "", offset_, fmt::format("a line is longer than {} bytes", limit));
    advance(std::min(taken.size() + 1, text.size()));
    if (taken.ends_with('\r')) taken.remove_suffix(1);
    return std::optional(taken);
}

void ByteSource::advance(uint64_t count) {
    assert(count <= remaining() && (memory_ || offset_ + count <= bufferStart_ + bufferFilled_));
    offset_ += count;
}

Result<uint64_t> ByteSource::skip(uint64_t count) {
    uint64_t done = 0;
    while (done < count && !atEnd()) {
        VCP_TRY_ASSIGN(const auto text, window());
        const uint64_t step = std::min<uint64_t>(count - done, text.size());
        advance(step);
        done += step;
    }
    return done;
}

Error ByteSource::error(ErrorCode code, std::string element, std::optional<uint64_t> byte, std::string message) const {
    if (compressed_ && byte) message += " (bytes are counted after decompression)";
    return {code, std::move(message), name_, std::move(element), byte};
}

}  // namespace vcp
