#include "builder/texture/png_chunks.h"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>

namespace vcp {
namespace {

constexpr size_t kSignatureBytes = 8, kFrameBytes = 12, kHeaderBytes = 13;  // a chunk's frame: length, name; checksum
constexpr uint64_t kMostOfDeflate = 1032;
constexpr std::array<std::string_view, 7> kOfTexels{"tRNS", "gAMA", "cHRM", "sRGB", "sBIT", "iCCP", "bKGD"};

uint32_t wordAt(std::string_view bytes, size_t at) {
    uint32_t word = 0;
    for (size_t i = 0; i < 4; ++i) word = word << 8 | uint8_t(bytes[at + i]);
    return word;
}

// Passes name, contents and frame of each whole chunk to `use`; returns where they end.
template <class Use>
size_t eachChunk(std::string_view file, Use use) {
    size_t at = std::min(kSignatureBytes, file.size());
    while (file.size() - at >= kFrameBytes) {
        const size_t bytes = wordAt(file, at);
        if (bytes > file.size() - at - kFrameBytes) break;
        const std::string_view name = file.substr(at + 4, 4);
        use(name, file.substr(at + 8, bytes), file.substr(at, bytes + kFrameBytes));
        at += bytes + kFrameBytes;
        if (name == "IEND") break;
    }
    return at;
}

bool isCritical(std::string_view name) { return (name[0] & 0x20) == 0; }

// Returns the channels of a colour type; 0: there is no such type.
uint8_t channelsOf(uint8_t type) {
    constexpr std::array<uint8_t, 7> kChannels{1, 0, 3, 1, 2, 0, 4};
    return type < kChannels.size() ? kChannels[type] : uint8_t{0};
}

}  // namespace

Result<PngChunks> checkPng(std::string_view file) {
    PngChunks chunks;
    eachChunk(file, [&](std::string_view name, std::string_view data, std::string_view) {
        if (name == "IDAT") chunks.texelBytes += data.size();
        if (name != "IHDR" || data.size() != kHeaderBytes || chunks.bitsOfTexel > 0) return;
        chunks.width = wordAt(data, 0);
        chunks.height = wordAt(data, 4);
        const auto bits = uint8_t(data[8]);
        if (bits <= 16) chunks.bitsOfTexel = uint8_t(bits * channelsOf(uint8_t(data[9])));
    });
    const auto damaged = [](std::string detail) {
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "the PNG picture is damaged (" + std::move(detail) + ")"};
    };
    if (chunks.bitsOfTexel == 0) return damaged("it has no header");
    const uint64_t bytesOfRow = (uint64_t{chunks.width} * chunks.bitsOfTexel + 7) / 8;
    if (bytesOfRow > (chunks.texelBytes + 1) * kMostOfDeflate / std::max<uint64_t>(chunks.height, 1))
        return damaged(fmt::format("{} compressed bytes cannot hold {} by {} texels", chunks.texelBytes, chunks.width,
                                   chunks.height));
    return chunks;
}

bool mayHaveAlpha(std::string_view start) {
    if (!start.starts_with("\x89PNG")) return false;
    // The last chunk need not be whole.
    for (uint64_t at = kSignatureBytes; at + kFrameBytes <= start.size(); at += wordAt(start, at) + kFrameBytes) {
        const std::string_view name = start.substr(at + 4, 4);
        constexpr uint64_t kColourType = 17;
        // Grey with alpha, and colour with alpha.
        if (name == "IHDR" && at + kColourType < start.size())
            if (const char type = start[at + kColourType]; type == 4 || type == 6) return true;
        if (name == "tRNS") return true;
        if (name == "IDAT") return false;
    }
    return true;
}

std::string withoutText(std::string_view file) {
    std::string kept(file.substr(0, kSignatureBytes));
    std::vector<std::string_view> had;
    const size_t end = eachChunk(file, [&](std::string_view name, std::string_view, std::string_view whole) {
        if (!isCritical(name)) {
            const bool wanted = std::ranges::find(kOfTexels, name) != kOfTexels.end();
            if (!wanted || std::ranges::find(had, name) != had.end()) return;
            had.push_back(name);
        }
        kept += whole;
    });
    kept += file.substr(end);
    return kept;
}

}  // namespace vcp
