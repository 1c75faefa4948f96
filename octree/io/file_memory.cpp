#include "octree/io/file_memory.h"

#include <sys/mman.h>
#include <unistd.h>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <utility>

#include <fcntl.h>

#include "octree/io/byte_reader.h"
#include "octree/io/durable_file.h"

namespace vcp {

Result<std::shared_ptr<FileMemory>> FileMemory::create(uint64_t bytes, const std::filesystem::path& folder) {
    std::error_code ignored;
    const std::filesystem::path where = folder.empty() ? std::filesystem::temp_directory_path(ignored) : folder;
    std::string name = (where / "vcp_memory_XXXXXX").string();
    FileDescriptor file(::mkostemp(name.data(), O_CLOEXEC));
    if (!file.isOpen()) return systemError(where, "no temporary file can be made here", errno);
    ::unlink(name.c_str());
    if (::ftruncate(file.number(), off_t(bytes)) != 0)
        return systemError(where, "a temporary file cannot be made so large", errno);
    std::shared_ptr<FileMemory> made(new FileMemory(where, std::move(file)));
    void* const data = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, made->file_.number(), 0);
    if (data == MAP_FAILED) return systemError(where, "a temporary file cannot be read as memory", errno);
    made->data_ = static_cast<std::byte*>(data), made->size_ = bytes;
    return made;
}

Result<std::shared_ptr<const FileMemory>> FileMemory::copyOf(const ByteReader& file,
                                                             const std::filesystem::path& folder) {
    VCP_TRY_ASSIGN(auto made, create(file.size(), folder));
    uint64_t at = 0;
    VCP_TRY(readInPieces(file, 0, file.size(), [&](std::span<const std::byte> piece) {
        const uint64_t to = std::exchange(at, at + piece.size());
        return made->write(to, piece);
    }));
    return std::shared_ptr<const FileMemory>(std::move(made));
}

FileMemory::~FileMemory() {
    if (data_ != nullptr) ::munmap(data_, size_);
}

Result<void> FileMemory::write(uint64_t offset, std::span<const std::byte> bytes) {
    return writeAll(file_.number(), offset, bytes, folder_);
}

void FileMemory::letGo() const { ::madvise(data_, size_, MADV_DONTNEED); }

}  // namespace vcp
