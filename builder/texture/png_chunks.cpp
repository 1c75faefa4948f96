#include "builder/texture/png_chunks.h"

#include <algorithm>
#include <array>
#include <cstring>

#include <fmt/format.h>

namespace vcp {
namespace {

constexpr uint64_t kSignatureBytes = 8, kFrameBytes = 12, kHeaderBytes = 13;  // a chunk's frame: length, name; checksum
constexpr uint64_t kMostOfDeflate = 1032;
constexpr uint64_t kBufferBytes = 64 * 1024;
constexpr std::array<std::string_view, 7> kOfTexels{"tRNS", "gAMA", "cHRM", "sRGB", "sBIT", "iCCP", "bKGD"};

uint32_t wordAt(const char* bytes) {
    uint32_t word = 0;
    for (size_t i = 0; i < 4; ++i) word = word << 8 | uint8_t(bytes[i]);
    return word;
}

struct Chunk {
    bool isWhole = false;  ///< all its bytes are there
    std::array<char, 4> letters{};
    uint64_t bytes = 0;  ///< of its contents

    [[nodiscard]] std::string_view name() const { return {letters.data(), letters.size()}; }
    [[nodiscard]] bool isCritical() const { return (letters[0] & 0x20) == 0; }
};

/// Reads the frame of the chunk at a place. Errors: Io.
Result<Chunk> chunkAt(RandomBytes& file, uint64_t at) {
    if (at > file.size() || file.size() - at < kFrameBytes) return Chunk();
    char frame[8];
    VCP_TRY(file.read(at, frame, sizeof frame));
    const uint64_t bytes = wordAt(frame);
    if (bytes > file.size() - at - kFrameBytes) return Chunk();
    return Chunk{true, {frame[4], frame[5], frame[6], frame[7]}, bytes};
}

// Returns the channels of a colour type; 0: there is no such type.
uint8_t channelsOf(uint8_t type) {
    constexpr std::array<uint8_t, 7> kChannels{1, 0, 3, 1, 2, 0, 4};
    return type < kChannels.size() ? kChannels[type] : uint8_t{0};
}

void takeHeader(const char (&data)[kHeaderBytes], PngChunks& chunks) {
    chunks.width = wordAt(data);
    chunks.height = wordAt(data + 4);
    const auto bits = uint8_t(data[8]);
    if (bits <= 16) chunks.bitsOfTexel = uint8_t(bits * channelsOf(uint8_t(data[9])));
    chunks.isInterlaced = data[12] != 0;
}

}  // namespace

Result<PngChunks> checkPng(RandomBytes& file) {
    PngChunks chunks;
    for (uint64_t at = kSignatureBytes;;) {
        VCP_TRY_ASSIGN(const Chunk chunk, chunkAt(file, at));
        if (!chunk.isWhole) break;
        if (chunk.name() == "IDAT") chunks.texelBytes += chunk.bytes;
        if (chunk.name() == "IHDR" && chunk.bytes == kHeaderBytes && chunks.bitsOfTexel == 0) {
            char data[kHeaderBytes];
            VCP_TRY(file.read(at + 8, data, sizeof data));
            takeHeader(data, chunks);
        }
        if (chunk.name() == "IEND") break;
        at += chunk.bytes + kFrameBytes;
    }
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

bool mayHaveAlpha(RandomBytes& file) {
    char start[kSignatureBytes];
    if (file.size() < kSignatureBytes || !file.read(0, start, kSignatureBytes)) return false;
    if (!std::string_view(start, kSignatureBytes).starts_with("\x89PNG")) return false;
    for (uint64_t at = kSignatureBytes;;) {
        const auto chunk = chunkAt(file, at);
        if (!chunk || !chunk->isWhole || chunk->name() == "IDAT") return false;
        if (chunk->name() == "tRNS") return true;
        if (chunk->name() == "IHDR" && chunk->bytes == kHeaderBytes) {
            char data[kHeaderBytes];
            if (!file.read(at + 8, data, sizeof data)) return false;
            // Grey with alpha, and colour with alpha.
            if (data[9] == 4 || data[9] == 6) return true;
        }
        at += chunk->bytes + kFrameBytes;
    }
}

Result<void> PngBytes::findPart() {
    if (!hasBegun_) {
        hasBegun_ = true;
        end_ = std::min(kSignatureBytes, file_.size());
        return {};
    }
    while (!isRaw_) {
        VCP_TRY_ASSIGN(const Chunk chunk, chunkAt(file_, end_));
        at_ = end_;
        isRaw_ = !chunk.isWhole;
        if (isRaw_) break;
        end_ += chunk.bytes + kFrameBytes;
        isRaw_ = chunk.name() == "IEND";
        const bool isWanted = std::ranges::find(kOfTexels, chunk.name()) != kOfTexels.end();
        if (chunk.isCritical() || (isWanted && had_.emplace(chunk.name()).second)) return {};
    }
    at_ = end_;
    end_ = file_.size();
    return {};
}

Result<size_t> PngBytes::read(char* to, size_t count) {
    size_t done = 0;
    while (done < count) {
        if (at_ == end_) VCP_TRY(findPart());
        if (at_ == end_) break;
        if (at_ < bufferAt_ || at_ >= bufferAt_ + buffer_.size()) {
            buffer_.resize(size_t(std::min(kBufferBytes, file_.size() - at_)));
            VCP_TRY(file_.read(at_, buffer_.data(), buffer_.size()));
            bufferAt_ = at_;
        }
        const uint64_t there = std::min(bufferAt_ + buffer_.size(), end_) - at_;
        const auto n = size_t(std::min<uint64_t>(count - done, there));
        std::memcpy(to + done, buffer_.data() + (at_ - bufferAt_), n);
        at_ += n;
        done += n;
    }
    return done;
}

}  // namespace vcp
