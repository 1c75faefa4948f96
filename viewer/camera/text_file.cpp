#include "viewer/camera/text_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "octree/io/regular_file.h"

namespace vcp {

namespace {

/// Whether a path is a descriptor of this program by the name that a shell gives it: "<(...)" is one.
bool isOwnDescriptor(const std::string& path) {
    return path == "/dev/stdin" || path.starts_with("/dev/fd/") || path.starts_with("/proc/self/fd/");
}

/// Opens a pipe that stands for a file; returns null where it is something else, or not there.
std::unique_ptr<std::FILE, FileCloser> ownPipe(const std::filesystem::path& path) {
    struct stat status {};
    if (!isOwnDescriptor(path.string()) || ::stat(path.c_str(), &status) != 0 || !S_ISFIFO(status.st_mode)) return {};
    return std::unique_ptr<std::FILE, FileCloser>(std::fopen(path.c_str(), "rbe"));
}

}  // namespace

Result<std::string> readText(const std::filesystem::path& path, size_t most, const std::string& what,
                             const std::string& unopened) {
    auto file = ownPipe(path);
    if (!file) {
        std::error_code failed;
        const bool isThere = std::filesystem::exists(path, failed);
        auto opened = openRegularStream(path);
        if (!opened)
            return isThere ? opened.error() : Error{.code = ErrorCode::Io, .message = unopened, .file = path.string()};
        file = *std::move(opened);
    }
    std::string text, block(size_t{1} << 16, '\0');
    while (const size_t got = std::fread(block.data(), 1, block.size(), file.get())) {
        text.append(block, 0, got);
        if (text.size() > most)
            return Error{.code = ErrorCode::Limit, .message = "too large for " + what, .file = path.string()};
    }
    if (std::ferror(file.get()))
        return Error{.code = ErrorCode::Io, .message = "cannot be read", .file = path.string()};
    return text;
}

}  // namespace vcp
