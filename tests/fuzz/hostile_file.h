// The file that an input of fuzz_file stands for, however hostile: hashes, the number of bytes and the commit record
// are made here, so that what they guard is reached.
//
// The input: a FileHeader, the number of entries that follow (16 bits), PageEntries, then the bytes of the pages from
// the first page's place on. The rest of the file is zero.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "octree/dataset_reader.h"
#include "octree/image/image_tables.h"
#include "octree/io/content_hash.h"

namespace vcp::fuzz {

/// A file in memory. Reads beyond its end are bugs of the reader.
class MemoryFile final : public ByteReader {
public:
    explicit MemoryFile(std::vector<std::byte> content) : bytes(std::move(content)) {}
    Result<void> read(uint64_t offset, std::span<std::byte> out) const override {
        if (offset > bytes.size() || out.size() > bytes.size() - offset) std::abort();
        if (!out.empty()) std::memcpy(out.data(), &bytes[offset], out.size());
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return bytes.size(); }
    [[nodiscard]] const std::string& name() const override { return name_; }

    std::vector<std::byte> bytes;

private:
    std::string name_ = "fuzz.vcp";
};

template <class T>
T take(std::span<const std::byte>& from) {
    T value{};
    const size_t size = std::min(sizeof value, from.size());
    if (size > 0) std::memcpy(static_cast<void*>(&value), from.data(), size);
    from = from.subspan(size);
    return value;
}

/// A page's hash is that of the bytes where it says it lies.
inline void hashPage(const std::vector<std::byte>& file, uint64_t offset, uint32_t stored, uint64_t& hash) {
    if (stored > 0 && offset < file.size() && stored <= file.size() - offset)
        hash = hashBytes(std::span(file).subspan(offset, stored));
}

/// Gives the tables of images the hashes of the tiles that they name, and the header that of the tables, as far as they
/// lie in the file.
inline void hashImages(std::vector<std::byte>& file, ImagesPlace& place) {
    uint64_t at = place.offset + uint64_t{place.images} * sizeof(ImageRow);
    if (place.offset > file.size() || at > file.size()) return;
    uint64_t tiles = 0;
    for (uint64_t i = 0; i < place.images; ++i) {
        ImageRow row;
        std::memcpy(&row, &file[place.offset + i * sizeof row], sizeof row);
        if (std::min(row.width, row.height) < 1 || std::max(row.width, row.height) > kMaxImageEdge) return;
        tiles += tilesOf(levelsOf(row));
    }
    at += uint64_t{place.materials} * sizeof(MaterialRow) + uint64_t{place.channels} * sizeof(ChannelRow);
    const uint64_t end = at + tiles * sizeof(TileRow);
    if (end > file.size()) return;
    for (; at < end; at += sizeof(TileRow)) {
        TileRow row;
        std::memcpy(&row, &file[at], sizeof row);
        hashPage(file, row.offset, row.storedBytes, row.hash);
        std::memcpy(&file[at], &row, sizeof row);
    }
    place.hash = hashBytes(std::span(file).subspan(place.offset, end - place.offset));
}

/// The file that the input stands for.
inline std::vector<std::byte> fileOf(std::span<const std::byte> input) {
    auto header = take<FileHeader>(input);
    std::vector<PageEntry> entries(std::min<size_t>(take<uint16_t>(input), input.size() / sizeof(PageEntry)));
    for (PageEntry& entry : entries) entry = take<PageEntry>(input);
    const uint64_t pages = blockOffset(blocksOf(entries.size()));
    const uint64_t end =
        (pages + input.size() + kPageAlignment - 1) / kPageAlignment * kPageAlignment + sizeof(CommitRecord);
    std::vector<std::byte> file(end);
    if (!input.empty()) std::memcpy(&file[pages], input.data(), input.size());
    for (size_t i = 0; i < entries.size(); ++i) {
        hashPage(file, entries[i].offset, entries[i].storedBytes, entries[i].hash);
        if (entries[i].colourStoredBytes > 0)
            hashPage(file, entries[i].colourOffset, entries[i].colourStoredBytes, entries[i].colourHash);
        std::memcpy(&file[blockOffset(i / kEntriesPerBlock) + i % kEntriesPerBlock * sizeof(PageEntry)], &entries[i],
                    sizeof(PageEntry));
    }
    if ((header.flags & kFlagImages) != 0) hashImages(file, header.images);
    for (uint64_t at = kDirectoryOffset; at < pages; at += kBlockBytes) {
        const uint64_t hash = hashBytes(std::span(file).subspan(at, kBlockBytes - 8));
        std::memcpy(&file[at + kBlockBytes - 8], &hash, sizeof hash);
    }
    header.fileBytes = file.size();
    header.hash = 0;
    std::memcpy(file.data(), &header, sizeof header);
    header.hash = hashBytes(std::span(file).first(kDirectoryOffset));
    std::memcpy(file.data(), &header, sizeof header);
    CommitRecord commit;
    commit.fileBytes = file.size();
    commit.headerHash = header.hash;
    const uint64_t directory = std::min(blocksOf(header.pages), blocksOf(entries.size())) * kBlockBytes;
    commit.directoryHash = hashBytes(std::span(file).subspan(kDirectoryOffset, directory));
    commit.hash = hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(CommitRecord, hash)));
    std::memcpy(&file[file.size() - sizeof commit], &commit, sizeof commit);
    return file;
}

}  // namespace vcp::fuzz
