// JPEG pictures for tests, of any kind that libjpeg writes.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <ostream>
#include <string>
#include <vector>

#include <jpeglib.h>

#include "builder/texture/image.h"

namespace vcp::test {

struct JpegKind {
    bool progressive = false;
    J_COLOR_SPACE colours = JCS_YCbCr;
    bool isArithmetic = false;
    int quality = 95;
    int sampling[2] = {2, 2};                ///< of light: along x and y, as often as of colour
    std::vector<jpeg_scan_info> scans = {};  ///< none: as the others say
};

inline std::ostream& operator<<(std::ostream& out, const JpegKind& kind) {
    return out << (kind.progressive ? "progressive " : "") << (kind.isArithmetic ? "arithmetic " : "") << "colours "
               << int(kind.colours) << ", quality " << kind.quality << ", " << kind.sampling[0] << " x "
               << kind.sampling[1];
}

inline std::string jpegOf(const Image& image, const JpegKind& kind = {}) {
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    unsigned char* data = nullptr;
    unsigned long bytes = 0;
    jpeg_mem_dest(&jpeg, &data, &bytes);
    jpeg.image_width = image.width;
    jpeg.image_height = image.height;
    jpeg.input_components = 4;
    jpeg.in_color_space = JCS_EXT_RGBA;
    jpeg_set_defaults(&jpeg);
    jpeg_set_colorspace(&jpeg, kind.colours);
    jpeg_set_quality(&jpeg, kind.quality, TRUE);
    jpeg.comp_info[0].h_samp_factor = kind.sampling[0];
    jpeg.comp_info[0].v_samp_factor = kind.sampling[1];
    jpeg.arith_code = kind.isArithmetic ? TRUE : FALSE;
    if (kind.progressive) jpeg_simple_progression(&jpeg);
    if (!kind.scans.empty()) {
        jpeg.scan_info = kind.scans.data();
        jpeg.num_scans = int(kind.scans.size());
    }
    jpeg_start_compress(&jpeg, TRUE);
    while (jpeg.next_scanline < jpeg.image_height) {
        auto* row = const_cast<JSAMPROW>(
            reinterpret_cast<const JSAMPLE*>(image.texels.data() + jpeg.next_scanline * image.width));
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    std::string file(reinterpret_cast<const char*>(data), bytes);
    jpeg_destroy_compress(&jpeg);
    std::free(data);
    return file;
}

}  // namespace vcp::test
