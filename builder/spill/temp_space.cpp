#include "builder/spill/temp_space.h"

#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "octree/io/durable_file.h"

namespace vcp {

void TempSpace::addDisk(int64_t bytes) {
    const uint64_t now = disk_ += uint64_t(bytes);
    uint64_t peak = peakDisk_;
    while (now > peak && !peakDisk_.compare_exchange_weak(peak, now)) {
    }
}

Result<void> TempSpace::spill() {
    const std::scoped_lock lock(filesMutex_);
    for (TempFile* file : files_) {
        const std::scoped_lock fileLock(file->mutex_);
        if (!file->tail_.empty()) VCP_TRY(file->flush());
    }
    return {};
}

TempFile::TempFile(TempSpace& space, std::string name) : space_(space), name_(std::move(name)) {
    const std::scoped_lock lock(space_.filesMutex_);
    space_.files_.push_back(this);
}

TempFile::~TempFile() {
    {
        const std::scoped_lock lock(space_.filesMutex_);
        std::erase(space_.files_, this);
    }
    dropTail();
    if (file_ >= 0) ::close(file_);
}

void TempFile::dropTail() {
    space_.held_ -= tail_.size() * kPieceBytes;
    tail_.clear();
}

Result<uint64_t> TempFile::append(std::span<const std::byte> bytes) {
    const std::scoped_lock lock(mutex_);
    const uint64_t offset = end_;
    while (!bytes.empty()) {
        const uint64_t inTail = end_ - flushed_;
        const size_t at = inTail % kPieceBytes;
        if (inTail / kPieceBytes == tail_.size()) {
            tail_.push_back(std::make_unique_for_overwrite<std::byte[]>(kPieceBytes));
            space_.held_ += kPieceBytes;
        }
        const size_t n = std::min(bytes.size(), kPieceBytes - at);
        std::memcpy(tail_.back().get() + at, bytes.data(), n);
        bytes = bytes.subspan(n);
        end_ += n;
    }
    if (space_.held_ > space_.memoryBytes_) VCP_TRY(flush());
    return offset;
}

Result<void> TempFile::flush() {
    if (file_ < 0) {
        VCP_TRY(space_.folder().take());
        VCP_TRY_ASSIGN(file_, space_.folder().create(name_));
    }
    uint64_t left = end_ - flushed_;
    for (const auto& piece : tail_) {
        const size_t n = size_t(std::min<uint64_t>(left, kPieceBytes));
        VCP_TRY(writeAll(file_, flushed_, std::span(piece.get(), n), path(), kWhenTempIsFull));
        flushed_ += n;
        left -= n;
        space_.addDisk(int64_t(n));
    }
    dropTail();
    return {};
}

Result<void> TempFile::read(uint64_t offset, std::span<std::byte> bytes) const {
    while (!bytes.empty()) {
        std::unique_lock lock(mutex_);
        if (offset >= flushed_) {
            const uint64_t inTail = offset - flushed_;
            const size_t at = inTail % kPieceBytes;
            const size_t n = std::min(bytes.size(), kPieceBytes - at);
            std::memcpy(bytes.data(), tail_[inTail / kPieceBytes].get() + at, n);
            offset += n;
            bytes = bytes.subspan(n);
            continue;
        }
        const size_t wanted = size_t(std::min<uint64_t>(bytes.size(), flushed_ - offset));
        lock.unlock();
        const ssize_t n = ::pread(file_, bytes.data(), wanted, off_t(offset));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return tempError(path(), "read failed", n == 0 ? EIO : errno);
        offset += uint64_t(n);
        bytes = bytes.subspan(size_t(n));
    }
    return {};
}

Result<void> TempFile::sync() {
    const std::scoped_lock lock(mutex_);
    VCP_TRY(flush());
    if (::fdatasync(file_) != 0) return tempError(path(), "cannot be made durable", errno);
    if (!isNamed_) VCP_TRY(space_.folder().sync());
    isNamed_ = true;
    return {};
}

Result<void> TempFile::reopen(uint64_t bytes) {
    VCP_TRY_ASSIGN(const auto file, space_.folder().open(name_));
    file_ = file;
    const off_t size = file_ < 0 ? -1 : ::lseek(file_, 0, SEEK_END);
    if (size < 0 || uint64_t(size) < bytes)
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "is shorter than the journal says; build again from the start",
                     .file = path().string()};
    const bool isCut = space_.folder().use() == FolderUse::Own;
    if (isCut && ::ftruncate(file_, off_t(bytes)) != 0) return tempError(path(), "cannot be cut", errno);
    flushed_ = end_ = bytes;
    space_.addDisk(int64_t(bytes));
    return {};
}

void TempFile::rest() {
    if (file_ < 0 || space_.folder().use() == FolderUse::Own) return;
    ::close(file_);
    file_ = -1;
    isAtRest_ = true;
}

Result<void> TempFile::wake() {
    if (!std::exchange(isAtRest_, false)) return {};
    space_.addDisk(-int64_t(flushed_));
    return reopen(flushed_);
}

void TempFile::remove() {
    const std::scoped_lock lock(mutex_);
    dropTail();
    if (file_ >= 0) {
        ::close(file_);
        space_.folder().unlink(name_);
        space_.addDisk(-int64_t(flushed_));
    }
    file_ = -1;
    isNamed_ = false;
    flushed_ = end_ = 0;
}

}  // namespace vcp
