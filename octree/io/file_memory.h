// What is too large for main memory: bytes in a file without a name, written once and read as memory.
//
// The system keeps in main memory what is read of them, and takes it away where something else needs the room. Nobody
// else can open the file, cut it off or change it, and its room on the disk is taken when it is written: so reading is
// as safe as reading memory. It vanishes with the object, and with the process.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "octree/io/file_descriptor.h"
#include "octree/io/result.h"

namespace vcp {

class ByteReader;

/// One thread writes; any thread may read what was written.
class FileMemory {
public:
    /// Makes `bytes` zero bytes, at least one. `folder`: where the file lies; empty: the system's folder for temporary
    /// files. Errors: Io, with the folder's name.
    static Result<std::shared_ptr<FileMemory>> create(uint64_t bytes, const std::filesystem::path& folder = {});
    /// Does so with all that a file has. Errors: also those of reading it.
    static Result<std::shared_ptr<const FileMemory>> copyOf(const ByteReader& file,
                                                            const std::filesystem::path& folder = {});
    FileMemory(const FileMemory&) = delete;
    FileMemory& operator=(const FileMemory&) = delete;
    ~FileMemory();

    /// Precondition: offset and bytes are within the size. Errors: Io, with the folder's name.
    Result<void> write(uint64_t offset, std::span<const std::byte> bytes);
    [[nodiscard]] std::span<const std::byte> bytes() const { return {data_, size_}; }
    /// Takes what was read out of the process's main memory; whoever reads it again gets it again.
    void letGo() const;

private:
    FileMemory(std::filesystem::path folder, FileDescriptor file)
        : folder_(std::move(folder)), file_(std::move(file)) {}

    std::filesystem::path folder_;
    FileDescriptor file_;
    std::byte* data_ = nullptr;
    size_t size_ = 0;
};

}  // namespace vcp
