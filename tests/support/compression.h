// Compresses bytes for the tests of what decompresses them.
#pragma once

#include <string>
#include <string_view>

#include <zlib.h>
#include <zstd.h>

namespace vcp::test {

inline std::string gzipped(std::string_view bytes) {
    constexpr int kGzip = 16 + MAX_WBITS;
    z_stream state{};
    ::deflateInit2(&state, 6, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY);
    std::string out(::deflateBound(&state, bytes.size()) + 64, '\0');
    state.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    state.avail_in = uInt(bytes.size());
    state.next_out = reinterpret_cast<Bytef*>(out.data());
    state.avail_out = uInt(out.size());
    ::deflate(&state, Z_FINISH);
    out.resize(state.total_out);
    ::deflateEnd(&state);
    return out;
}

inline std::string zstandard(std::string_view bytes) {
    std::string out(::ZSTD_compressBound(bytes.size()), '\0');
    out.resize(::ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3));
    return out;
}

}  // namespace vcp::test
