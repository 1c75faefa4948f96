// libjpeg as it is used here: how it fails, which is a call that must not return, and where it writes to.
//
//   JpegFailure failure;
//   jpeg.err = &failure.base;
//   if (setjmp(failure.back)) ...  // failure.message; no object with a destructor may live in this function
#pragma once

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <vector>

#include <glm/vec2.hpp>

// This header needs the one before it.
#include <jpeglib.h>

namespace vcp {

struct JpegFailure {
    JpegFailure();

    jpeg_error_mgr base{};  // it comes first: libjpeg's calls bring its address
    std::jmp_buf back;
    char message[JMSG_LENGTH_MAX] = {};
};

/// The bytes of a tile's JPEG while they are written.
class JpegBytes {
public:
    /// Has room for what any tile of that size takes; libjpeg takes memory of its own where it takes more.
    explicit JpegBytes(glm::uvec2 size);
    ~JpegBytes();
    JpegBytes(const JpegBytes&) = delete;
    JpegBytes& operator=(const JpegBytes&) = delete;

    void receive(jpeg_compress_struct& jpeg);
    /// Returns them, once libjpeg has finished.
    [[nodiscard]] std::vector<std::byte> written() const;

private:
    std::vector<unsigned char> room_;
    unsigned char* first_;
    unsigned long count_;
};

}  // namespace vcp
