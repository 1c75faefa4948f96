// What libjpeg says of a file that it cannot read: it reports an error by a call that must not return.
//
//   JpegFailure failure;
//   jpeg.err = &failure.base;
//   if (setjmp(failure.back)) ...  // failure.message; no object with a destructor may live in this function
#pragma once

#include <csetjmp>
#include <cstdio>

// This header needs the one before it.
#include <jpeglib.h>

namespace vcp {

struct JpegFailure {
    JpegFailure();

    jpeg_error_mgr base{};  // it comes first: libjpeg's calls bring its address
    std::jmp_buf back;
    char message[JMSG_LENGTH_MAX] = {};
};

}  // namespace vcp
