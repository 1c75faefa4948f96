#include "octree/io/byte_reader.h"

#include <sys/stat.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>

#include "octree/io/file_descriptor.h"
#include "octree/io/regular_file.h"

namespace vcp {

namespace {

class LocalFile final : public ByteReader {
public:
    LocalFile(FileDescriptor file, uint64_t size, std::string name)
        : file_(std::move(file)), size_(size), name_(std::move(name)) {}

    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override {
        while (!bytes.empty()) {
            const ssize_t n = ::pread(file_.number(), bytes.data(), bytes.size(), off_t(offset));
            if (n < 0 && errno == EINTR) continue;
            if (n < 0) return fail(offset, std::string("read failed: ") + std::strerror(errno));
            if (n == 0) return fail(offset, "the file ends here; it was truncated");
            offset += uint64_t(n);
            bytes = bytes.subspan(size_t(n));
        }
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return size_; }
    [[nodiscard]] const std::string& name() const override { return name_; }

private:
    Error fail(uint64_t offset, std::string message) const {
        return {.code = ErrorCode::Io, .message = std::move(message), .file = name_, .byte = offset};
    }
    FileDescriptor file_;
    uint64_t size_;
    std::string name_;
};

}  // namespace

Result<std::shared_ptr<ByteReader>> openFile(const std::filesystem::path& path) {
    VCP_TRY_ASSIGN(auto file, openRegular(path));
    struct stat info {};
    if (::fstat(file.number(), &info) != 0)
        return Error{.code = ErrorCode::Io, .message = "its size cannot be asked", .file = path.string()};
    return std::shared_ptr<ByteReader>(
        std::make_shared<LocalFile>(std::move(file), uint64_t(info.st_size), path.string()));
}

Error brokenBytes(const std::string& file, std::string element, uint64_t byte, std::string message) {
    return {.code = ErrorCode::InvalidInput,
            .message = std::move(message),
            .file = file,
            .element = std::move(element),
            .byte = byte};
}

}  // namespace vcp
