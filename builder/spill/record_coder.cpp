#include "builder/spill/record_coder.h"

#include <cstdint>
#include <cstring>

#include <zstd.h>

namespace vcp {

namespace {

constexpr int kFastCompression = 1;

/// Writes, word by word, the difference to the record before, folded so that small ones of either sign have high bytes
/// of zero, one byte plane after the other.
void toPlanes(const std::byte* records, size_t count, size_t recordBytes, std::byte* planes) {
    const size_t words = recordBytes / 4;
    for (size_t w = 0; w < words; ++w) {
        std::byte* plane = planes + w * 4 * count;
        uint32_t before = 0;
        for (size_t i = 0; i < count; ++i) {
            uint32_t word;
            std::memcpy(&word, records + i * recordBytes + w * 4, 4);
            const uint32_t difference = word - before;
            const uint32_t folded = difference << 1 ^ (0 - (difference >> 31));
            before = word;
            for (size_t b = 0; b < 4; ++b) plane[b * count + i] = std::byte(folded >> 8 * b);
        }
    }
}

void fromPlanes(const std::byte* planes, size_t count, size_t recordBytes, std::byte* records) {
    const size_t words = recordBytes / 4;
    for (size_t w = 0; w < words; ++w) {
        const std::byte* plane = planes + w * 4 * count;
        uint32_t before = 0;
        for (size_t i = 0; i < count; ++i) {
            uint32_t folded = 0;
            for (size_t b = 0; b < 4; ++b) folded |= uint32_t(plane[b * count + i]) << 8 * b;
            before += folded >> 1 ^ (0 - (folded & 1));
            std::memcpy(records + i * recordBytes + w * 4, &before, 4);
        }
    }
}

}  // namespace

bool codeRecords(std::span<const std::byte> records, size_t recordBytes, std::vector<std::byte>& out) {
    std::vector<std::byte> planes(records.size());
    toPlanes(records.data(), records.size() / recordBytes, recordBytes, planes.data());
    const size_t before = out.size();
    out.resize(before + records.size());
    const size_t coded =
        ZSTD_compress(out.data() + before, records.size(), planes.data(), planes.size(), kFastCompression);
    const bool isLess = ZSTD_isError(coded) == 0 && coded < records.size();
    out.resize(before + (isLess ? coded : 0));
    return isLess;
}

bool decodeRecords(std::span<const std::byte> coded, size_t recordBytes, std::span<std::byte> records) {
    std::vector<std::byte> planes(records.size());
    if (ZSTD_decompress(planes.data(), planes.size(), coded.data(), coded.size()) != planes.size()) return false;
    fromPlanes(planes.data(), records.size() / recordBytes, recordBytes, records.data());
    return true;
}

}  // namespace vcp
