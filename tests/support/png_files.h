// PNG files put together chunk by chunk for the tests of their readers.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace vcp::test {

inline std::string bigEndian(uint32_t word) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += char(word >> shift);
    return bytes;
}

inline std::string pngChunk(std::string_view name, std::string_view data) {
    std::string body(name);
    body += data;
    const auto sum = ::crc32(0, reinterpret_cast<const Bytef*>(body.data()), uInt(body.size()));
    return bigEndian(uint32_t(data.size())) + body + bigEndian(uint32_t(sum));
}

inline std::string deflated(std::string_view data) {
    uLongf bytes = ::compressBound(uLong(data.size()));
    std::string out(bytes, '\0');
    ::compress2(reinterpret_cast<Bytef*>(out.data()), &bytes, reinterpret_cast<const Bytef*>(data.data()),
                uLong(data.size()), 9);
    out.resize(bytes);
    return out;
}

/// `rows`: filter bytes and texels of all rows, not compressed; `extra`: whole chunks between header and texels.
inline std::string pngFile(uint32_t width, uint32_t height, int bits, int type, std::string_view rows,
                           std::string_view extra = "", bool isInterlaced = false) {
    std::string header = bigEndian(width) + bigEndian(height);
    for (const int value : {bits, type, 0, 0, isInterlaced ? 1 : 0}) header += char(value);
    return "\x89PNG\r\n\x1a\n" + pngChunk("IHDR", header) + std::string(extra) + pngChunk("IDAT", deflated(rows)) +
           pngChunk("IEND", "");
}

/// 8 MB less a little out of some 8 KB, for each of `count`: what libpng reads of texts.
inline std::string textBombs(size_t count) {
    const std::string one = pngChunk("zTXt", std::string("Comment\0\0", 9) + deflated(std::string(7'900'000, ' ')));
    std::string all;
    for (size_t i = 0; i < count; ++i) all += one;
    return all;
}

}  // namespace vcp::test
