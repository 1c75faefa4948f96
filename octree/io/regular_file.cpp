#include "octree/io/regular_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <cerrno>

#include "octree/io/durable_file.h"

namespace vcp {

namespace {

/// Names what stands there instead of a file; null for a regular file.
const char* otherThanFile(mode_t mode) {
    if (S_ISREG(mode)) return nullptr;
    if (S_ISDIR(mode)) return "is a folder, not a file";
    if (S_ISFIFO(mode)) return "is a pipe, not a file";
    if (S_ISSOCK(mode)) return "is a socket, not a file";
    return "is a device, not a file";
}

}  // namespace

Result<FileDescriptor> openRegular(const std::filesystem::path& path) {
    const auto refuse = [&](const char* what) {
        return Error{.code = ErrorCode::Io, .message = what, .file = path.string()};
    };
    struct stat status {};
    // The type is checked before opening too, since opening a device can already have effects.
    if (::stat(path.c_str(), &status) != 0) return systemError(path, "cannot open", errno);
    if (const char* other = otherThanFile(status.st_mode)) return refuse(other);
    // O_NONBLOCK: should it have become a pipe since, open() must not wait; it changes nothing for files.
    FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!file.isOpen()) return systemError(path, "cannot open", errno);
    const char* other =
        ::fstat(file.number(), &status) != 0 ? "cannot be asked what it is" : otherThanFile(status.st_mode);
    if (other) return refuse(other);
    return file;
}

Result<std::unique_ptr<std::FILE, FileCloser>> openRegularStream(const std::filesystem::path& path) {
    VCP_TRY_ASSIGN(auto file, openRegular(path));
    std::unique_ptr<std::FILE, FileCloser> stream(::fdopen(file.number(), "rb"));
    if (!stream) return systemError(path, "cannot open", errno);
    static_cast<void>(file.release());
    return stream;
}

}  // namespace vcp
