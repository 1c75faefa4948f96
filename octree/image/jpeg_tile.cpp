#include "octree/image/jpeg_tile.h"

#include "octree/image/jpeg_library.h"

namespace vcp {

namespace {

// No object with a destructor lives in these functions, since errors jump out of libjpeg back into them.

bool decode(jpeg_decompress_struct& jpeg, JpegFailure& failure, std::span<const std::byte> packed, glm::uvec2 size,
            uint32_t* texels) {
    if (setjmp(failure.back)) return false;
    jpeg_create_decompress(&jpeg);
    jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(packed.data()),
                 static_cast<unsigned long>(packed.size()));
    jpeg_read_header(&jpeg, TRUE);
    const bool isTile = jpeg.image_width == size.x && jpeg.image_height == size.y &&
                        (jpeg.jpeg_color_space == JCS_YCbCr || jpeg.jpeg_color_space == JCS_GRAYSCALE);
    // Several scans would be kept as a whole, and each goes over the whole tile.
    if (!isTile || jpeg_has_multiple_scans(&jpeg) || jpeg.arith_code) return false;
    jpeg.out_color_space = JCS_EXT_RGBA;
    jpeg_start_decompress(&jpeg);
    while (jpeg.output_scanline < jpeg.output_height) {
        auto row = reinterpret_cast<JSAMPROW>(texels + size_t{jpeg.output_scanline} * size.x);
        jpeg_read_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_decompress(&jpeg);
    return true;
}

bool encode(jpeg_compress_struct& jpeg, JpegFailure& failure, std::span<const uint32_t> texels, glm::uvec2 size,
            int quality, JpegBytes& bytes) {
    if (setjmp(failure.back)) return false;
    jpeg_create_compress(&jpeg);
    bytes.receive(jpeg);
    jpeg.image_width = size.x;
    jpeg.image_height = size.y;
    jpeg.input_components = 4;
    jpeg.in_color_space = JCS_EXT_RGBX;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, quality, TRUE);
    jpeg.comp_info[0].h_samp_factor = jpeg.comp_info[0].v_samp_factor = 1;
    jpeg.optimize_coding = TRUE;
    jpeg_start_compress(&jpeg, TRUE);
    while (jpeg.next_scanline < jpeg.image_height) {
        // libjpeg takes rows that may change, and leaves them as they are.
        auto row = reinterpret_cast<JSAMPROW>(const_cast<uint32_t*>(texels.data() + jpeg.next_scanline * size.x));
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    return true;
}

}  // namespace

Result<std::vector<std::byte>> packJpeg(std::span<const uint32_t> texels, glm::uvec2 size, int quality) {
    jpeg_compress_struct jpeg{};
    JpegFailure failure;
    jpeg.err = &failure.base;
    JpegBytes bytes(size);
    const bool done = encode(jpeg, failure, texels, size, quality, bytes);
    jpeg_destroy_compress(&jpeg);
    if (!done) return Error{.code = ErrorCode::Limit, .message = failure.message};
    return bytes.written();
}

Result<void> unpackJpeg(std::span<const std::byte> packed, glm::uvec2 size, std::span<uint32_t> texels) {
    jpeg_decompress_struct jpeg{};
    JpegFailure failure;
    jpeg.err = &failure.base;
    const bool done = decode(jpeg, failure, packed, size, texels.data());
    jpeg_destroy_decompress(&jpeg);
    if (done) return {};
    return Error{.code = ErrorCode::InvalidInput, .message = "does not decode to its texels"};
}

}  // namespace vcp
