#include "streaming/caching_reader.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "octree/io/content_hash.h"
#include "octree/io/durable_file.h"
#include "octree/io/regular_file.h"

namespace vcp {

namespace fs = std::filesystem;

namespace {

constexpr const char* kExtension = ".vcpblock";

/// Returns the XXH3 of a block, mixed with which block it is: so a file under a wrong name does not match.
uint64_t sealOf(uint64_t source, uint64_t block, std::span<const std::byte> bytes) {
    return hashBytes(bytes) ^ (source + 0x9e3779b97f4a7c15u * (block + 1));
}

struct KeptFile {
    fs::file_time_type used;
    fs::path path;
    uint64_t bytes;
};

/// Lists the folder's blocks; those used longest ago come first.
std::vector<KeptFile> keptFiles(const fs::path& folder) {
    std::vector<KeptFile> files;
    std::error_code failed;
    for (auto entry = fs::directory_iterator(folder, failed); !failed && entry != fs::directory_iterator();
         entry.increment(failed)) {
        if (entry->path().extension() != kExtension) continue;
        std::error_code gone;
        const auto used = entry->last_write_time(gone);
        const uint64_t bytes = gone ? 0 : entry->file_size(gone);
        if (!gone) files.push_back({used, entry->path(), bytes});
    }
    std::sort(files.begin(), files.end(), [](const KeptFile& a, const KeptFile& b) {
        return a.used != b.used ? a.used < b.used : a.path < b.path;
    });
    return files;
}

}  // namespace

Result<std::shared_ptr<CachingReader>> CachingReader::open(std::shared_ptr<const ByteReader> reader,
                                                           const std::string& identity, const fs::path& folder,
                                                           uint64_t limitBytes) {
    std::error_code failed;
    fs::create_directories(folder, failed);
    if (failed)
        return Error{.code = ErrorCode::Io,
                     .message = "the cache folder cannot be made: " + failed.message(),
                     .file = folder.string()};
    const uint64_t source = hashBytes(std::as_bytes(std::span(identity)));
    std::shared_ptr<CachingReader> made(new CachingReader(std::move(reader), source, folder, limitBytes));
    for (const KeptFile& file : keptFiles(folder)) made->kept_ += file.bytes;
    made->trim();
    return made;
}

fs::path CachingReader::pathOf(uint64_t block) const {
    return folder_ / fmt::format("{:016x}-{:08x}{}", source_, block, kExtension);
}

uint64_t CachingReader::sizeOf(uint64_t block) const {
    return std::min(kCacheBlockBytes, size() - block * kCacheBlockBytes);
}

uint64_t CachingReader::bytesKept() const {
    const std::lock_guard lock(mutex_);
    return kept_;
}

bool CachingReader::load(uint64_t block, std::span<std::byte> bytes) const {
    const fs::path path = pathOf(block);
    const auto file = openRegularStream(path);
    if (!file) return false;
    uint64_t seal = 0;
    const bool isRead = std::fread(&seal, sizeof seal, 1, file->get()) == 1 &&
                        std::fread(bytes.data(), 1, bytes.size(), file->get()) == bytes.size();
    std::error_code ignored;
    if (isRead && std::fgetc(file->get()) == EOF && seal == sealOf(source_, block, bytes)) {
        fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);
        return true;
    }
    fs::remove(path, ignored);
    return false;
}

void CachingReader::keep(uint64_t block, std::span<const std::byte> bytes) const {
    static std::atomic<uint64_t> number{0};
    const fs::path path = pathOf(block),
                   partial = folder_ / fmt::format("{:016x}-{}-{}.partial", source_, ::getpid(), number++);
    // The name is our own: what is there already, or leads elsewhere, is not written into.
    const int file = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (file < 0) return;
    const uint64_t seal = sealOf(source_, block, bytes);
    const bool isWritten =
        appendAll(file, std::as_bytes(std::span(&seal, 1)), partial).ok() && appendAll(file, bytes, partial).ok();
    std::error_code failed;
    if (::close(file) == 0 && isWritten) fs::rename(partial, path, failed);
    if (!isWritten || failed) {
        fs::remove(partial, failed);
        return;
    }
    {
        const std::lock_guard lock(mutex_);
        kept_ += bytes.size() + sizeof seal;
        if (kept_ <= limitBytes_) return;
    }
    trim();
}

void CachingReader::trim() const {
    const std::lock_guard lock(mutex_);
    if (kept_ <= limitBytes_) return;
    // The bytes are counted anew, since others may have added or removed blocks. Some spare room makes this rare.
    const std::vector<KeptFile> files = keptFiles(folder_);
    kept_ = 0;
    for (const KeptFile& file : files) kept_ += file.bytes;
    for (const KeptFile& file : files) {
        if (kept_ <= limitBytes_ - limitBytes_ / 8) break;
        std::error_code ignored;
        fs::remove(file.path, ignored);
        kept_ -= file.bytes;
    }
}

void CachingReader::distrust(uint64_t offset, uint64_t bytes) const {
    for (uint64_t block = offset / kCacheBlockBytes; bytes > 0 && block <= (offset + bytes - 1) / kCacheBlockBytes;
         ++block) {
        std::error_code ignored;
        const std::lock_guard lock(mutex_);
        if (fs::remove(pathOf(block), ignored)) kept_ -= std::min(kept_, sizeOf(block) + sizeof(uint64_t));
    }
    reader_->distrust(offset, bytes);
}

Result<void> CachingReader::read(uint64_t offset, std::span<std::byte> bytes) const {
    if (bytes.empty()) return {};
    if (offset > size() || bytes.size() > size() - offset) return reader_->read(offset, bytes);
    const uint64_t first = offset / kCacheBlockBytes, last = (offset + bytes.size() - 1) / kCacheBlockBytes;
    const uint64_t begin = first * kCacheBlockBytes;
    std::vector<std::byte> blocks(last * kCacheBlockBytes + sizeOf(last) - begin);
    const auto spanOf = [&](uint64_t block) {
        return std::span(blocks).subspan((block - first) * kCacheBlockBytes, sizeOf(block));
    };
    for (uint64_t block = first; block <= last;) {
        if (load(block, spanOf(block))) {
            ++block;
            continue;
        }
        // Consecutive missing blocks are read at once; a block that is there ends the run.
        uint64_t end = block + 1;
        while (end <= last && !load(end, spanOf(end))) ++end;
        const uint64_t from = block * kCacheBlockBytes;
        const std::span missing =
            std::span(blocks).subspan(from - begin, (end - 1) * kCacheBlockBytes + sizeOf(end - 1) - from);
        VCP_TRY(reader_->read(from, missing));
        for (uint64_t got = block; got < end; ++got) keep(got, spanOf(got));
        block = end + 1;
    }
    std::memcpy(bytes.data(), blocks.data() + (offset - begin), bytes.size());
    return {};
}

}  // namespace vcp
