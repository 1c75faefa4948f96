// Writes hostile files and what the reader says to each, for module_test.mjs: hostile_files OUT COUNT SEED...
// SEED: an input of fuzz_file, or a whole .vcp file. OUT: for each file its bytes, the bytes of the line, both as 32
// bits, the file, and the line, which is empty where header and directory are accepted.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string_view>

#include "octree/page/page_codec.h"
#include "tests/fuzz/hostile_file.h"

namespace {

using namespace vcp;
using Bytes = std::vector<std::byte>;

Bytes readWhole(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    const auto bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
}

void append(Bytes& to, std::span<const std::byte> bytes) { to.insert(to.end(), bytes.begin(), bytes.end()); }

Bytes inputOf(const FileHeader& header, std::span<const PageEntry> entries, std::span<const std::byte> pages) {
    const auto count = uint16_t(entries.size());
    Bytes input;
    append(input, std::as_bytes(std::span(&header, 1)));
    append(input, std::as_bytes(std::span(&count, 1)));
    append(input, std::as_bytes(entries));
    append(input, pages);
    return input;
}

/// The input that a whole file comes from.
Bytes inputOf(const Bytes& file) {
    const fuzz::MemoryFile reader(file);
    const auto dataset = readDataset(reader);
    if (!dataset) return {};
    const uint64_t pages = blockOffset(blocksOf(dataset->pages.size()));
    return inputOf(dataset->header, {dataset->pages.data(), dataset->pages.size()},
                   std::span(file).subspan(pages, file.size() - sizeof(CommitRecord) - pages));
}

/// A value that readers trip over.
uint64_t oddValue(std::mt19937_64& random) {
    constexpr uint64_t kOdd[] = {0,
                                 1,
                                 0xff,
                                 0x7fff,
                                 0xffff,
                                 0x7fff'ffff,
                                 0x8000'0000,
                                 0xffff'ffff,
                                 0x1'0000'0000,
                                 std::numeric_limits<int64_t>::max(),
                                 std::numeric_limits<uint64_t>::max(),
                                 0x7ff0'0000'0000'0000,   // infinity
                                 0x7ff8'0000'0000'0000,   // no number
                                 0x3ff0'0000'0000'0000};  // 1.0
    const uint64_t choice = random() % (std::size(kOdd) + 2);
    return choice < std::size(kOdd) ? kOdd[choice] : random();
}

/// Changes bytes from `first` on.
void change(std::span<std::byte> bytes, size_t first, std::mt19937_64& random) {
    const size_t at = first + random() % (bytes.size() - first);
    switch (random() % 6) {
        case 0: {
            const size_t from = random() % bytes.size();
            const size_t count = std::min({size_t{1} + random() % 64, bytes.size() - at, bytes.size() - from});
            std::memmove(&bytes[at], &bytes[from], count);
            break;
        }
        case 1:
        case 2: {
            const uint64_t value = oddValue(random);
            const size_t place = at / 4 * 4, wide = size_t{1} << random() % 4;
            std::memcpy(&bytes[place], &value, std::min(wide, bytes.size() - place));
            break;
        }
        default:
            bytes[at] ^= std::byte(1u << random() % 8);
    }
}

/// Returns the bytes of an input's tables of images; none where they are not there.
std::span<std::byte> tablesIn(std::span<std::byte> input) {
    std::span<const std::byte> rest(input);
    const ImagesPlace place = fuzz::take<FileHeader>(rest).images;
    const uint64_t entries = fuzz::take<uint16_t>(rest), first = blockOffset(blocksOf(entries));
    const uint64_t before = input.size() - rest.size() + entries * sizeof(PageEntry);
    if (place.offset < first || before > input.size() || place.offset - first >= input.size() - before) return {};
    constexpr size_t kMostBytes = 4096;
    const auto section = input.subspan(before + place.offset - first);
    return section.first(std::min({section.size(), size_t(place.bytes), kMostBytes}));
}

/// Changes header, entries, stored pages or images.
void changeStored(Bytes& input, std::mt19937_64& random) {
    const size_t entries = sizeof(FileHeader) + 2;
    if (input.size() <= entries) return;  // it was cut off there
    switch (random() % 8) {
        case 0:
            change(std::span(input).first(entries), 0, random);
            break;
        case 1:
            input.resize(input.size() - random() % (input.size() / 2));
            break;
        case 2:
        case 3:
            change(std::span(input).first(std::min(input.size(), entries + 400)), entries, random);
            break;
        case 4:
            if (const auto tables = tablesIn(input); !tables.empty()) change(tables, 0, random);
            break;
        default:
            change(input, entries, random);
    }
}

/// Moves the section of images in a file to another place: its tiles say where they are.
void moveImages(std::span<std::byte> section, ImagesPlace& place, uint64_t offset) {
    size_t at =
        place.images * sizeof(ImageRow) + place.materials * sizeof(MaterialRow) + place.channels * sizeof(ChannelRow);
    for (uint64_t end = section.size(); at + sizeof(TileRow) <= end; at += sizeof(TileRow)) {
        TileRow row;
        std::memcpy(&row, &section[at], sizeof row);
        end = std::min(end, row.offset - place.offset);
        row.offset += offset - place.offset;
        std::memcpy(&section[at], &row, sizeof row);
    }
    place.offset = offset;
}

/// Changes pages as they are when decoded, so that what lies behind the decoder is met; lays the pages out anew.
Bytes changePages(std::span<const std::byte> input, std::mt19937_64& random) {
    auto header = fuzz::take<FileHeader>(input);
    std::vector<PageEntry> entries(fuzz::take<uint16_t>(input));
    for (PageEntry& entry : entries) entry = fuzz::take<PageEntry>(input);
    const uint64_t first = blockOffset(blocksOf(entries.size()));
    Bytes pages;
    const auto place = [&](std::span<const std::byte> stored) {
        pages.resize((pages.size() + kPageAlignment - 1) / kPageAlignment * kPageAlignment);
        append(pages, stored);
        return first + pages.size() - stored.size();
    };
    for (PageEntry& entry : entries) {
        const auto stored = input.subspan(entry.offset - first, entry.storedBytes);
        auto page = unpackGeometry(stored, entry.pageBytes);
        PackedPage packed{{stored.begin(), stored.end()}, {}, entry.pageBytes};
        if (page && random() % entries.size() < 2) {
            const auto bytes = std::as_writable_bytes(std::span(*page));
            for (uint64_t changes = 1 + random() % 3; changes > 0; --changes) change(bytes, 0, random);
            packed = packPage(bytes, {});
        }
        const uint64_t colour = entry.colourOffset;
        entry.offset = place(packed.geometry);
        entry.storedBytes = uint32_t(packed.geometry.size());
        entry.pageBytes = uint32_t(packed.geometryBytes);
        if (entry.colourStoredBytes > 0)
            entry.colourOffset = place(input.subspan(colour - first, entry.colourStoredBytes));
    }
    if ((header.flags & kFlagImages) != 0) {
        const auto images = input.subspan(header.images.offset - first, header.images.bytes);
        Bytes section{images.begin(), images.end()};
        const uint64_t end = first + pages.size();
        moveImages(section, header.images, (end + kPageAlignment - 1) / kPageAlignment * kPageAlignment);
        place(section);
    }
    return inputOf(header, entries, pages);
}

void write(std::ofstream& out, std::span<const std::byte> bytes) {
    out.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
}

}  // namespace

int main(int count, char** arguments) {
    if (count < 4) return 2;
    std::ofstream out(arguments[1], std::ios::binary);
    const auto files = uint64_t(std::atoi(arguments[2]));
    std::vector<Bytes> seeds;
    for (int i = 3; i < count; ++i) {
        const std::string_view name = arguments[i];
        seeds.push_back(name.ends_with(".vcp") ? inputOf(readWhole(name)) : readWhole(name));
    }
    for (uint64_t i = 0; i < files; ++i) {
        std::mt19937_64 random(i);
        Bytes input = seeds[i % seeds.size()];
        // The first files are the seeds as they are.
        const bool isChanged = i >= seeds.size();
        if (isChanged && random() % 2 == 0)
            input = changePages(input, random);
        else if (isChanged)
            for (uint64_t changes = 1 + random() % 3; changes > 0; --changes) changeStored(input, random);
        const fuzz::MemoryFile file(fuzz::fileOf(input));
        const auto dataset = readDatasetStart(file);
        const std::string line = dataset ? "" : dataset.error().line();
        if (!isChanged && !line.empty()) {
            std::fprintf(stderr, "%s is refused as it is: %s\n", arguments[3 + i], line.c_str());
            return 1;
        }
        const uint32_t sizes[] = {uint32_t(file.bytes.size()), uint32_t(line.size())};
        write(out, std::as_bytes(std::span(sizes)));
        write(out, file.bytes);
        write(out, std::as_bytes(std::span(line)));
    }
    out.close();
    return out ? 0 : 1;
}
