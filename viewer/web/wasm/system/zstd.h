// Decoding of zstd frames by the page that holds the module: pages are coded otherwise, but for rare ones. Nothing is
// compressed in a browser.
#pragma once

#include <cstddef>

extern "C" {

/// Writes the frame's content to `to`, at most `room` bytes. Returns its size; a negative number where the frame is
/// broken or holds more.
__attribute__((import_module("vcp"), import_name("unzstd"))) int vcp_unzstd(void* to, size_t room, const void* from,
                                                                            size_t bytes);
}

inline size_t ZSTD_compressBound(size_t bytes) { return bytes; }
inline size_t ZSTD_compress(void*, size_t, const void*, size_t, int) { return size_t(-1); }
inline unsigned ZSTD_isError(size_t code) { return code == size_t(-1); }
inline size_t ZSTD_decompress(void* to, size_t room, const void* from, size_t bytes) {
    const int size = vcp_unzstd(to, room, from, bytes);
    return size < 0 ? size_t(-1) : size_t(size);
}

/// Returns the content's size as the frame's header has it (RFC 8878, 3.1.1.1); -2 where it says none.
inline unsigned long long ZSTD_getFrameContentSize(const void* frame, size_t bytes) {
    constexpr unsigned long long kNone = static_cast<unsigned long long>(-2);
    const auto* at = static_cast<const unsigned char*>(frame);
    if (bytes < 6 || at[0] != 0x28 || at[1] != 0xb5 || at[2] != 0x2f || at[3] != 0xfd) return kNone;
    const unsigned descriptor = at[4], code = descriptor >> 6;
    const bool isSingleSegment = (descriptor >> 5 & 1) != 0;
    if (code == 0 && !isSingleSegment) return kNone;
    static constexpr size_t kDictionaryBytes[] = {0, 1, 2, 4}, kSizeBytes[] = {1, 2, 4, 8};
    const size_t first = 5 + (isSingleSegment ? 0 : 1) + kDictionaryBytes[descriptor & 3];
    if (bytes < first + kSizeBytes[code]) return kNone;
    unsigned long long size = 0;
    for (size_t i = 0; i < kSizeBytes[code]; ++i) size |= static_cast<unsigned long long>(at[first + i]) << 8 * i;
    return code == 1 ? size + 256 : size;
}
