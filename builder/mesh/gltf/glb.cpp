#include "builder/mesh/gltf/glb.h"

#include <cstring>

#include <fmt/format.h>

namespace vcp {
namespace {

constexpr size_t kGlbHeaderBytes = 12;
constexpr size_t kChunkHeaderBytes = 8;
constexpr uint32_t kJsonChunk = 0x4E4F534A;
constexpr uint32_t kBinaryChunk = 0x004E4942;

uint32_t wordAt(std::string_view bytes, size_t offset) {
    uint32_t word;
    std::memcpy(&word, bytes.data() + offset, sizeof word);
    return word;
}

}  // namespace

Result<std::unique_ptr<RandomBytes>> openGlbBinary(ByteSource& source, const std::filesystem::path& path,
                                                   const std::filesystem::path& tempFolder) {
    VCP_TRY_ASSIGN(const auto header, source.window(kChunkHeaderBytes));
    if (header.size() < kChunkHeaderBytes || wordAt(header, 4) != kBinaryChunk) return std::unique_ptr<RandomBytes>();
    const uint64_t bytes = wordAt(header, 0);
    source.advance(kChunkHeaderBytes);
    if (source.isPlainFile()) return openRandomBytes(path, source.offset());
    auto spool = std::make_unique<Spool>(tempFolder);
    while (spool->size() < bytes && !source.atEnd()) {
        VCP_TRY_ASSIGN(const auto window, source.window());
        const std::string_view taken = window.substr(0, bytes - spool->size());
        VCP_TRY(spool->append(taken));
        source.advance(taken.size());
    }
    return std::unique_ptr<RandomBytes>(std::move(spool));
}

Result<uint64_t> readGlbHeader(ByteSource& source) {
    VCP_TRY_ASSIGN(const auto start, source.window(kGlbHeaderBytes + kChunkHeaderBytes));
    if (start.size() < kGlbHeaderBytes + kChunkHeaderBytes)
        return source.error(ErrorCode::InvalidInput, "header", source.size(), "the file ends inside the GLB header");
    if (wordAt(start, 4) != 2)
        return source.error(ErrorCode::Unsupported, "header", 4,
                            fmt::format("is GLB version {}; 2 is read", wordAt(start, 4)));
    const uint64_t bytes = wordAt(start, 12);
    if (wordAt(start, 16) != kJsonChunk)
        return source.error(ErrorCode::InvalidInput, "header", 16, "its first chunk is not JSON");
    source.advance(kGlbHeaderBytes + kChunkHeaderBytes);
    if (bytes > source.remaining())
        return source.error(ErrorCode::InvalidInput, "header", 12,
                            fmt::format("declares {} bytes of JSON, more than the file holds: it is truncated", bytes));
    return bytes;
}

}  // namespace vcp
