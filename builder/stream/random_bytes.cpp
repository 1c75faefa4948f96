#include "builder/stream/random_bytes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

#include <xxhash.h>

namespace vcp {
namespace {

Error systemError(std::string what, int code) {
    return {.code = ErrorCode::Io, .message = std::move(what) + ": " + std::generic_category().message(code)};
}

Result<void> readFully(int file, uint64_t offset, char* to, size_t count) {
    while (count > 0) {
        const ssize_t got = ::pread(file, to, count, off_t(offset));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return systemError("cannot be read", errno);
        if (got == 0) return Error{.code = ErrorCode::Io, .message = "the file became shorter while it was read"};
        to += got;
        offset += uint64_t(got);
        count -= size_t(got);
    }
    return {};
}

class FileBytes final : public RandomBytes {
public:
    FileBytes(FileDescriptor file, uint64_t offset, uint64_t size)
        : file_(std::move(file)), offset_(offset), size_(size) {}

    [[nodiscard]] uint64_t size() const override { return size_; }
    Result<void> read(uint64_t offset, char* to, size_t count) override {
        return readFully(file_.number(), offset_ + offset, to, count);
    }

private:
    FileDescriptor file_;
    uint64_t offset_;
    uint64_t size_;
};

class MemoryBytes final : public RandomBytes {
public:
    explicit MemoryBytes(std::string bytes) : owned_(std::move(bytes)), bytes_(owned_) {}
    explicit MemoryBytes(std::string_view bytes) : bytes_(bytes) {}
    MemoryBytes(const MemoryBytes&) = delete;
    MemoryBytes& operator=(const MemoryBytes&) = delete;

    [[nodiscard]] uint64_t size() const override { return bytes_.size(); }
    Result<void> read(uint64_t offset, char* to, size_t count) override {
        if (count > 0) std::memcpy(to, bytes_.data() + offset, count);
        return {};
    }

private:
    std::string owned_;
    std::string_view bytes_;
};

}  // namespace

Result<std::unique_ptr<RandomBytes>> openRandomBytes(const std::filesystem::path& path, uint64_t offset) {
    const auto refuse = [&](Error error) {
        error.file = path.string();
        return error;
    };
    // O_NONBLOCK: a named pipe must not hang the open; it has no effect on regular files.
    FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!file.isOpen() && errno == ENOENT) return refuse({.code = ErrorCode::Io, .message = "no such file"});
    if (!file.isOpen()) return refuse(systemError("cannot be opened", errno));
    struct stat status {};
    if (::fstat(file.number(), &status) != 0 || !S_ISREG(status.st_mode))
        return refuse({.code = ErrorCode::Io, .message = "is not a regular file"});
    const auto size = uint64_t(status.st_size);
    return std::unique_ptr<RandomBytes>(
        std::make_unique<FileBytes>(std::move(file), offset, size > offset ? size - offset : 0));
}

std::unique_ptr<RandomBytes> randomBytesOf(std::string bytes) {
    return std::make_unique<MemoryBytes>(std::move(bytes));
}

std::unique_ptr<RandomBytes> randomBytesAt(std::string_view bytes) { return std::make_unique<MemoryBytes>(bytes); }

Result<void> Spool::append(std::string_view bytes) {
    if (!file_.isOpen() && size_ + bytes.size() > memoryBytes_) VCP_TRY(moveToFile());
    if (!file_.isOpen())
        memory_ += bytes;
    else
        VCP_TRY(write(bytes));
    size_ += bytes.size();
    return {};
}

Result<void> Spool::moveToFile() {
    std::error_code ignored;
    if (folder_.empty()) folder_ = std::filesystem::temp_directory_path(ignored);
    std::string name = (folder_ / "vcp_spool_XXXXXX").string();
    file_ = FileDescriptor(::mkostemp(name.data(), O_CLOEXEC));
    if (!file_.isOpen()) {
        Error error = systemError("no temporary file can be made here", errno);
        error.file = folder_.string();
        return error;
    }
    ::unlink(name.c_str());
    VCP_TRY(write(memory_));
    memory_ = {};
    return {};
}

Result<void> Spool::write(std::string_view bytes) {
    hash(bytes);
    while (!bytes.empty()) {
        const ssize_t put = ::write(file_.number(), bytes.data(), bytes.size());
        if (put < 0 && errno == EINTR) continue;
        if (put < 0) {
            Error error = systemError("a temporary file cannot be written", errno);
            error.file = folder_.string();
            return error;
        }
        bytes.remove_prefix(size_t(put));
    }
    return {};
}

/// Hashes the bytes that the file must return later.
void Spool::hash(std::string_view bytes) {
    while (!bytes.empty()) {
        const size_t n = std::min<size_t>(bytes.size(), kPieceBytes - last_.size());
        last_ += bytes.substr(0, n);
        bytes.remove_prefix(n);
        if (last_.size() < kPieceBytes) continue;
        hashes_.push_back(XXH3_64bits(last_.data(), last_.size()));
        last_.clear();
    }
}

/// Reads a whole piece into piece_.
Result<void> Spool::load(uint64_t piece) {
    if (piece == pieceNumber_) return {};
    pieceNumber_ = ~uint64_t{0};
    piece_.resize(kPieceBytes);
    VCP_TRY(readFully(file_.number(), piece * kPieceBytes, piece_.data(), kPieceBytes));
    if (XXH3_64bits(piece_.data(), kPieceBytes) != hashes_[piece])
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "what was kept of it in a temporary file came back damaged; check the disk of " +
                                folder_.string()};
    pieceNumber_ = piece;
    return {};
}

Result<void> Spool::read(uint64_t offset, char* to, size_t count) {
    if (!file_.isOpen()) {
        if (count > 0) std::memcpy(to, memory_.data() + offset, count);
        return {};
    }
    while (count > 0) {
        const uint64_t piece = offset / kPieceBytes;
        const size_t at = offset % kPieceBytes, n = std::min<size_t>(count, kPieceBytes - at);
        if (piece < hashes_.size()) VCP_TRY(load(piece));
        std::memcpy(to, (piece < hashes_.size() ? piece_ : last_).data() + at, n);
        offset += n;
        to += n;
        count -= n;
    }
    return {};
}

}  // namespace vcp
