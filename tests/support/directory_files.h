// Whole .vcp files around trees without pages: valid header, directory and commit record; every page is zeros.
#pragma once

#include <algorithm>
#include <cstring>
#include <memory>
#include "octree/dataset_reader.h"
#include "octree/io/content_hash.h"

namespace vcp::test {

/// A file in memory that counts what is read.
class CountedFile final : public ByteReader {
public:
    explicit CountedFile(std::vector<std::byte> content) : bytes(std::move(content)) {}
    Result<void> read(uint64_t offset, std::span<std::byte> to) const override {
        if (offset > bytes.size() || to.size() > bytes.size() - offset)
            return Error{.code = ErrorCode::Io, .message = "past the end", .file = name_};
        std::copy_n(bytes.begin() + std::ptrdiff_t(offset), to.size(), to.begin());
        ++reads;
        bytesRead += to.size();
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return bytes.size(); }
    [[nodiscard]] const std::string& name() const override { return name_; }

    std::vector<std::byte> bytes;
    mutable uint64_t reads = 0, bytesRead = 0;

private:
    std::string name_ = "counted.vcp";
};

/// Hashes of all that hashes cover, after a change.
inline void sealFile(std::vector<std::byte>& bytes) {
    FileHeader header;
    std::memcpy(&header, bytes.data(), sizeof header);
    const uint64_t blocks = (header.pages + kEntriesPerBlock - 1) / kEntriesPerBlock;
    const std::span all(bytes);
    const auto put = [&](uint64_t at, uint64_t hash) { std::memcpy(&bytes[at], &hash, sizeof hash); };
    for (uint64_t b = 0; b < blocks; ++b)
        put(blockOffset(b + 1) - 8, hashBytes(all.subspan(blockOffset(b), kBlockBytes - 8)));
    put(offsetof(FileHeader, hash), 0);
    put(offsetof(FileHeader, hash), hashBytes(all.first(kDirectoryOffset)));
    std::memcpy(&header, bytes.data(), sizeof header);
    CommitRecord commit;
    commit.fileBytes = bytes.size();
    commit.headerHash = header.hash;
    commit.directoryHash = hashBytes(all.subspan(kDirectoryOffset, blocks * kBlockBytes));
    commit.hash = hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(CommitRecord, hash)));
    std::memcpy(&bytes[bytes.size() - sizeof commit], &commit, sizeof commit);
}

/// The tree as a file; its pages get places there.
inline std::vector<std::byte> directoryFile(Dataset& tree) {
    FileHeader& h = tree.header;
    h.pages = tree.pages.size();
    for (LevelRow& row : h.level) row = {};
    const uint64_t blocks = (h.pages + kEntriesPerBlock - 1) / kEntriesPerBlock;
    uint64_t end = blockOffset(blocks);
    const auto place = [&](uint64_t bytes) {
        const uint64_t at = (end + kPageAlignment - 1) / kPageAlignment * kPageAlignment;
        end = at + bytes;
        return at;
    };
    for (uint64_t i = 0; i < h.pages; ++i) {
        PageEntry& e = tree.pages[i];
        LevelRow& row = h.level[e.level];
        if (row.pages++ == 0) row.firstEntry = i;
        row.certifiedError = std::max(row.certifiedError, double(e.certifiedError));
        e.offset = place(e.storedBytes);
        if (e.colourStoredBytes != 0) e.colourOffset = place(e.colourStoredBytes);
    }
    while (h.levels > 1 && h.level[h.levels - 1].pages == 0) --h.levels;
    h.certifiedErrorMax = h.level[h.levels - 1].certifiedError;
    h.fileBytes = (end + kPageAlignment - 1) / kPageAlignment * kPageAlignment + sizeof(CommitRecord);
    std::vector<std::byte> bytes(h.fileBytes);
    std::memcpy(bytes.data(), &h, sizeof h);
    for (uint64_t i = 0; i < h.pages; ++i)
        std::memcpy(&bytes[blockOffset(i / kEntriesPerBlock) + i % kEntriesPerBlock * sizeof(PageEntry)],
                    &tree.pages[i], sizeof(PageEntry));
    sealFile(bytes);
    return bytes;
}

}  // namespace vcp::test
