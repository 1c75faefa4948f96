#include "octree/vcp_writer.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

#include "octree/durable_file.h"
#include "octree/page_codec.h"

namespace vcp {

namespace {

uint64_t alignPage(uint64_t bytes) { return (bytes + kPageAlignment - 1) & ~(kPageAlignment - 1); }
uint64_t directoryBytes(uint64_t pages) { return (pages + kEntriesPerBlock - 1) / kEntriesPerBlock * kBlockBytes; }

/// An empty file of that name, held by this process alone, so that two builds never mix. -1: `error` says why.
int createAlone(const std::filesystem::path& file, int& error) {
    for (;;) {
        const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
        error = errno;
        if (fd < 0) return -1;
        const NameLock lock = lockName(fd, file);
        if (lock == NameLock::Taken && ::ftruncate(fd, 0) == 0) return fd;
        error = lock == NameLock::Held ? EWOULDBLOCK : errno;
        if (lock == NameLock::Taken) ::unlink(file.c_str());
        ::close(fd);
        if (lock != NameLock::Gone) return -1;
    }
}

}  // namespace

StoredPage compressPage(std::span<const std::byte> geometry, std::span<const std::byte> colour) {
    StoredPage page;
    PackedPage packed = packPage(geometry, colour);
    page.geometry = std::move(packed.geometry);
    page.colour = std::move(packed.colour);
    page.geometryBytes = static_cast<uint32_t>(geometry.size());
    page.colourBytes = static_cast<uint32_t>(colour.size());
    return page;
}

Result<std::unique_ptr<VcpWriter>> VcpWriter::create(const std::filesystem::path& output, uint64_t pages) {
    std::unique_ptr<VcpWriter> writer(new VcpWriter);
    writer->output_ = output;
    writer->partial_ = output;
    writer->partial_ += ".partial";
    writer->pages_ = pages;
    writer->end_ = alignPage(kDirectoryOffset + directoryBytes(pages));
    if (std::error_code ignored; std::filesystem::is_directory(output, ignored))
        return Error{.code = ErrorCode::Io, .message = "is a folder; give a file name", .file = output.string()};
    int error = 0;
    writer->file_ = createAlone(writer->partial_, error);
    if (writer->file_ < 0 && error == EWOULDBLOCK) return Error{.code = ErrorCode::Io, .message = "another build is writing this file", .file = output.string()};
    if (writer->file_ < 0) return systemError(output, "cannot write here", error);
    return writer;
}

VcpWriter::~VcpWriter() {
    if (file_ < 0) return;
    ::close(file_);
    ::unlink(partial_.c_str());
}

Result<void> VcpWriter::write(uint64_t offset, std::span<const std::byte> bytes) { return writeAll(file_, offset, bytes, output_); }

Result<void> VcpWriter::append(PageEntry entry, const StoredPage& page) {
    entry.offset = end_;
    entry.storedBytes = static_cast<uint32_t>(page.geometry.size());
    entry.pageBytes = page.geometryBytes;
    entry.hash = hashBytes(page.geometry);
    VCP_TRY(write(end_, page.geometry));
    end_ = alignPage(end_ + page.geometry.size());
    if (!page.colour.empty()) {
        entry.colourOffset = end_;
        entry.colourStoredBytes = static_cast<uint32_t>(page.colour.size());
        entry.colourBytes = page.colourBytes;
        entry.colourHash = hashBytes(page.colour);
        VCP_TRY(write(end_, page.colour));
        end_ = alignPage(end_ + page.colour.size());
    }
    entries_.push_back(entry);
    return {};
}

Result<uint64_t> VcpWriter::commit(FileHeader header) {
    std::vector<std::byte> directory(directoryBytes(pages_));
    for (size_t i = 0; i < entries_.size(); ++i) {
        std::byte* block = directory.data() + i / kEntriesPerBlock * kBlockBytes;
        std::memcpy(block + i % kEntriesPerBlock * sizeof(PageEntry), &entries_[i], sizeof(PageEntry));
    }
    for (size_t at = 0; at < directory.size(); at += kBlockBytes) {
        const uint64_t hash = hashBytes(std::span(directory).subspan(at, kBlockBytes - 8));
        std::memcpy(directory.data() + at + kBlockBytes - 8, &hash, 8);
    }
    VCP_TRY(write(kDirectoryOffset, directory));

    header.pages = pages_;
    header.fileBytes = end_ + sizeof(CommitRecord);
    header.hash = 0;
    std::vector<std::byte> first(kDirectoryOffset);
    std::memcpy(first.data(), &header, sizeof header);
    header.hash = hashBytes(first);
    std::memcpy(first.data(), &header, sizeof header);
    VCP_TRY(write(0, first));

    CommitRecord commit;
    commit.fileBytes = header.fileBytes;
    commit.headerHash = header.hash;
    commit.directoryHash = hashBytes(directory);
    commit.hash = hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(CommitRecord, hash)));
    // The record is the promise that all else is there: it goes out after the rest is durable.
    if (::fsync(file_) != 0) return systemError(output_, "cannot make the file durable", errno);
    VCP_TRY(write(end_, std::as_bytes(std::span(&commit, 1))));
    if (::fsync(file_) != 0) return systemError(output_, "cannot make the file durable", errno);
    if (::rename(partial_.c_str(), output_.c_str()) != 0) return systemError(output_, "cannot rename the finished file", errno);
    ::close(file_);
    file_ = -1;
    if (auto synced = syncFolder(output_.parent_path()); !synced) {
        Error late = synced.error();
        late.message += "; " + output_.string() + " is complete, but a power failure may undo its name";
        return late;
    }
    return header.fileBytes;
}

}  // namespace vcp
