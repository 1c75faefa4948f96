#include "octree/io/durable_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cerrno>
#include <system_error>

namespace vcp {

namespace {

/// Calls `write(bytes)`, which says how many it took, until all are taken.
template <class Write>
Result<void> untilAllAreTaken(std::span<const std::byte> bytes, const std::filesystem::path& file, const char* whenFull,
                              const Write& write) {
    while (!bytes.empty()) {
        const ssize_t n = write(bytes);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return systemError(file, "write failed", n == 0 ? EIO : errno, whenFull);
        bytes = bytes.subspan(size_t(n));
    }
    return {};
}

}  // namespace

Error systemError(const std::filesystem::path& file, const char* what, int code, const char* whenFull) {
    // strerror is not used: it may share its buffer between threads.
    std::string message = std::string(what) + ": " + std::generic_category().message(code);
    if (code == ENOSPC || code == EDQUOT) message += std::string("; ") + whenFull;
    return {.code = ErrorCode::Io, .message = std::move(message), .file = file.string()};
}

Result<void> writeAll(int descriptor, uint64_t offset, std::span<const std::byte> bytes,
                      const std::filesystem::path& file, const char* whenFull) {
    const uint64_t end = offset + bytes.size();
    return untilAllAreTaken(bytes, file, whenFull, [&](std::span<const std::byte> left) {
        return ::pwrite(descriptor, left.data(), left.size(), off_t(end - left.size()));
    });
}

Result<void> appendAll(int descriptor, std::span<const std::byte> bytes, const std::filesystem::path& file,
                       const char* whenFull) {
    return untilAllAreTaken(bytes, file, whenFull, [&](std::span<const std::byte> left) {
        return ::write(descriptor, left.data(), left.size());
    });
}

Result<void> syncFolder(const std::filesystem::path& folder) {
    const std::filesystem::path named = folder.empty() ? "." : folder;
    const int fd = ::open(named.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return systemError(named, "cannot open the folder", errno);
    const bool ok = ::fsync(fd) == 0 || errno == EINVAL;  // some file systems have no fsync of folders
    const int code = errno;
    ::close(fd);
    if (!ok) return systemError(named, "cannot make the folder durable", code);
    return {};
}

NameLock lockName(int descriptor, const std::filesystem::path& path) {
    if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) return NameLock::Held;
    struct stat opened {
    }, named{};
    const bool isSame = ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
                        opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
    return isSame ? NameLock::Taken : NameLock::Gone;
}

}  // namespace vcp
