#include "builder/stream/byte_input.h"

#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace vcp {

FileInput::~FileInput() {
    if (owns_) ::close(file_);
}

Result<size_t> FileInput::read(char* to, size_t capacity) {
    while (true) {
        const ssize_t got = ::read(file_, to, capacity);
        if (got < 0 && errno == EINTR) continue;
        // strerror is not used: it may share its buffer between threads.
        if (got < 0)
            return Error{.code = ErrorCode::Io, .message = "cannot be read: " + std::generic_category().message(errno)};
        taken_ += uint64_t(got);
        return size_t(got);
    }
}

Compression compressionOf(std::string_view start) {
    // 8 stands for deflate, the only method there is.
    if (start.starts_with("\x1F\x8B\x08")) return Compression::Gzip;
    if (start.starts_with("\x28\xB5\x2F\xFD")) return Compression::Zstd;
    // A skippable frame may come first.
    const bool skippable = start.size() >= 4 && (start[0] & 0xF0) == 0x50 && start.substr(1, 3) == "\x2A\x4D\x18";
    return skippable ? Compression::Zstd : Compression::None;
}

}  // namespace vcp
