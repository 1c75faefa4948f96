#include "octree/vcp_writer.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "octree/io/content_hash.h"
#include "octree/page/page_codec.h"

namespace vcp {

namespace {

uint64_t directoryBytes(uint64_t pages) { return blocksOf(pages) * kBlockBytes; }

StoredPage storedPage(PackedPage packed, std::span<const std::byte> colour) {
    return {.geometry = std::move(packed.geometry),
            .colour = std::move(packed.colour),
            .geometryBytes = uint32_t(packed.geometryBytes),
            .colourBytes = uint32_t(colour.size())};
}

}  // namespace

void StoredPage::describe(PageEntry& entry) const {
    entry.storedBytes = uint32_t(geometry.size());
    entry.pageBytes = geometryBytes;
    entry.hash = hashBytes(geometry);
    entry.colourStoredBytes = uint32_t(colour.size());
    entry.colourBytes = colour.empty() ? 0 : colourBytes;
    entry.colourHash = colour.empty() ? 0 : hashBytes(colour);
}

StoredPage compressPage(std::span<const std::byte> geometry, std::span<const std::byte> colour) {
    return storedPage(packPage(geometry, colour), colour);
}

Result<StoredPage> compressPage(const PageDraft& draft, std::span<const std::byte> colour) {
    VCP_TRY_ASSIGN(auto packed, packPage(draft, colour));
    return storedPage(std::move(packed), colour);
}

Result<std::unique_ptr<VcpWriter>> VcpWriter::create(const std::filesystem::path& output, uint64_t pages,
                                                     const OutputRules& rules) {
    VCP_TRY_ASSIGN(auto file, OutputFile::create(output, OutputKind::Dataset, rules));
    return std::unique_ptr<VcpWriter>(new VcpWriter(std::move(file), pages));
}

VcpWriter::VcpWriter(OutputFile file, uint64_t pages)
    : file_(std::move(file)), end_(alignPage(kDirectoryOffset + directoryBytes(pages))), pages_(pages) {
    entries_.reserve(pages);
}

size_t VcpWriter::place(PageEntry entry) {
    entry.offset = end_;
    end_ = alignPage(end_ + entry.storedBytes);
    entry.colourOffset = entry.colourStoredBytes > 0 ? end_ : 0;
    end_ = alignPage(end_ + entry.colourStoredBytes);
    entries_.push_back(entry);
    return entries_.size() - 1;
}

Result<void> VcpWriter::write(size_t number, const StoredPage& page) {
    const PageEntry& placed = entries_[number];
    VCP_TRY(file_.write(placed.offset, page.geometry));
    return page.colour.empty() ? Result<void>() : file_.write(placed.colourOffset, page.colour);
}

Result<void> VcpWriter::append(const PageEntry& entry, const StoredPage& page) {
    PageEntry described = entry;
    page.describe(described);
    return write(place(described), page);
}

Result<void> VcpWriter::beginImages(ImageTables tables) {
    images_ = {.offset = end_,
               .images = uint32_t(tables.images.size()),
               .materials = uint32_t(tables.materials.size()),
               .channels = uint32_t(tables.channels.size())};
    images_.bytes = tables.bytes();
    for (TileRow& tile : tables.tiles) {
        tile.offset = images_.offset + images_.bytes;
        images_.bytes += tile.storedBytes;
    }
    const std::vector<std::byte> stored = tables.stored();
    images_.hash = hashBytes(stored);
    VCP_TRY(file_.write(end_, stored));
    end_ += stored.size();
    return {};
}

uint64_t VcpWriter::placeTile(uint64_t bytes) { return std::exchange(end_, end_ + bytes); }

Result<void> VcpWriter::writeTile(uint64_t offset, std::span<const std::byte> stored) {
    return file_.write(offset, stored);
}

Result<void> VcpWriter::appendTile(std::span<const std::byte> stored) {
    return writeTile(placeTile(stored.size()), stored);
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
    VCP_TRY(file_.write(kDirectoryOffset, directory));

    if (std::ranges::any_of(entries_, [](const PageEntry& e) { return (e.parts & kPageHasMarks) != 0; })) {
        header.version = kMarkedFileVersion;
        header.flags |= kFlagMarks;
    }
    if (images_.images > 0) {
        header.version = kImagesFileVersion;
        header.flags |= kFlagImages;
        header.images = images_;
    }
    if (images_.channels > 0) {
        header.version = kChannelsFileVersion;
        header.flags |= kFlagChannels;
    }
    if (std::ranges::any_of(entries_, [](const PageEntry& e) { return e.colourErrorMax != 0; })) {
        header.version = kColourErrorsFileVersion;
        header.flags |= kFlagColourErrors;
    }
    if ((header.flags & kFlagFineSlabs) != 0) header.version = kFineSlabsFileVersion;
    header.pages = pages_;
    header.fileBytes = end_ + sizeof(CommitRecord);
    header.hash = 0;
    std::vector<std::byte> first(kDirectoryOffset);
    std::memcpy(first.data(), &header, sizeof header);
    header.hash = hashBytes(first);
    std::memcpy(first.data(), &header, sizeof header);

    CommitRecord commit;
    commit.fileBytes = header.fileBytes;
    commit.headerHash = header.hash;
    commit.directoryHash = hashBytes(directory);
    commit.hash = hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(CommitRecord, hash)));
    // Header and record promise that all else is there, so they are written after the rest is durable.
    VCP_TRY(file_.sync());
    VCP_TRY(file_.write(0, first));
    VCP_TRY(file_.write(end_, std::as_bytes(std::span(&commit, 1))));
    VCP_TRY(file_.commit());
    return header.fileBytes;
}

}  // namespace vcp
