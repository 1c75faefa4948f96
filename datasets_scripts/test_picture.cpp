#include "datasets_scripts/test_picture.h"

#include <algorithm>
#include <cstdio>
#include <vector>

#include <png.h>

// This header needs the one before it.
#include <jpeglib.h>

#include "datasets_scripts/procedural_noise.h"

namespace vcp::scan {
namespace {

constexpr uint32_t kCell = 128, kLine = 3, kTick = 16;
constexpr uint32_t kDotsFrom = 88;            // rows of a cell
constexpr uint32_t kDigit = 8, kDigits = 3;   // texels a dot of a digit; digits of a number
constexpr uint32_t kDigitWidth = 4 * kDigit;  // three dots, and one between digits
constexpr std::array<uint16_t, 10> kDots{0x7B6F, 0x2C97, 0x73E7, 0x73CF, 0x5BC9,
                                         0x79CF, 0x79EF, 0x7249, 0x7BEF, 0x7BCF};  // five rows of three dots

/// Whether a texel of a cell is on one of the digits of `number`, whose upper left corner is (8, top).
bool isOnNumber(uint32_t number, uint32_t x, uint32_t y, uint32_t top) {
    const uint32_t left = 16;
    if (x < left || y < top || y >= top + 5 * kDigit) return false;
    const uint32_t digit = (x - left) / kDigitWidth, column = (x - left) % kDigitWidth / kDigit,
                   row = (y - top) / kDigit;
    if (digit >= kDigits || column >= 3) return false;
    uint32_t value = number;
    for (uint32_t i = digit + 1; i < kDigits; ++i) value /= 10;
    return (kDots[value % 10] >> (14 - 3 * row - column) & 1) != 0;
}

/// Takes what a library writes; after an error nothing more.
struct Sink {
    const std::function<Result<void>(std::span<const std::byte>)>& write;
    Result<void> result = {};

    void take(const void* bytes, size_t count) {
        if (result && count > 0) result = write({static_cast<const std::byte*>(bytes), count});
    }
};

/// libjpeg's way to write into a sink.
struct JpegSink {
    jpeg_destination_mgr base{};  // it comes first: libjpeg's calls bring its address
    Sink* sink = nullptr;
    std::array<JOCTET, 64 * 1024> buffer{};

    void begin() {
        base.next_output_byte = buffer.data();
        base.free_in_buffer = buffer.size();
    }
};

extern "C" {
static void vcpPngTake(png_structp png, png_bytep bytes, size_t count) {
    static_cast<Sink*>(png_get_io_ptr(png))->take(bytes, count);
}
static void vcpPngKept(png_structp) {}
static void vcpJpegBegin(j_compress_ptr jpeg) { reinterpret_cast<JpegSink*>(jpeg->dest)->begin(); }
static boolean vcpJpegFull(j_compress_ptr jpeg) {
    auto* const to = reinterpret_cast<JpegSink*>(jpeg->dest);
    to->sink->take(to->buffer.data(), to->buffer.size());
    to->begin();
    return TRUE;
}
static void vcpJpegEnd(j_compress_ptr jpeg) {
    auto* const to = reinterpret_cast<JpegSink*>(jpeg->dest);
    to->sink->take(to->buffer.data(), to->buffer.size() - to->base.free_in_buffer);
}
}

void fillRow(uint32_t y, std::vector<uint8_t>& row) {
    for (uint32_t x = 0; 3 * x < row.size(); ++x) std::ranges::copy(testTexel(x, y), row.begin() + 3 * x);
}

// Both libraries end the program where there is no memory: nothing else can go wrong here.

void writePng(uint32_t edge, Sink& sink) {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_set_write_fn(png, &sink, vcpPngTake, vcpPngKept);
    png_set_compression_level(png, 3);
    png_set_IHDR(png, info, edge, edge, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    std::vector<uint8_t> row(size_t{edge} * 3);
    for (uint32_t y = 0; y < edge && sink.result; ++y) {
        fillRow(y, row);
        png_write_row(png, row.data());
    }
    if (sink.result) png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
}

void writeJpeg(uint32_t edge, Sink& sink) {
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    JpegSink to;
    to.sink = &sink;
    to.base.init_destination = vcpJpegBegin;
    to.base.empty_output_buffer = vcpJpegFull;
    to.base.term_destination = vcpJpegEnd;
    jpeg.dest = &to.base;
    jpeg.image_width = jpeg.image_height = edge;
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 90, TRUE);
    jpeg_start_compress(&jpeg, TRUE);
    std::vector<uint8_t> row(size_t{edge} * 3);
    while (jpeg.next_scanline < edge && sink.result) {
        fillRow(jpeg.next_scanline, row);
        JSAMPROW samples = row.data();
        jpeg_write_scanlines(&jpeg, &samples, 1);
    }
    if (sink.result) jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
}

}  // namespace

std::array<uint8_t, 3> testTexel(uint32_t x, uint32_t y) {
    const uint32_t column = x / kCell, row = y / kCell, inX = x % kCell, inY = y % kCell;
    if (inX < kLine || inY < kLine) return {20, 20, 30};
    if (isOnNumber(column, inX, inY, 8)) return {200, 30, 20};
    if (inY < kDotsFrom && isOnNumber(row, inX, inY, 48)) return {20, 60, 190};
    if (inY >= kDotsFrom) {
        // Dots of one texel each, as many as chance has it.
        const uint8_t grey = (hash(uint64_t{y} << 32 | x) & 3) == 0 ? 60 : 215;
        return {grey, grey, grey};
    }
    if (inX % kTick == 0 || inY % kTick == 0) return {150, 150, 140};
    const uint64_t h = hash(uint64_t{row} << 32 | column);
    return {uint8_t(190 + h % 60), uint8_t(190 + (h >> 8) % 60), uint8_t(180 + (h >> 16) % 60)};
}

Result<void> writeTestPicture(uint32_t edge, PictureKind kind,
                              const std::function<Result<void>(std::span<const std::byte>)>& write) {
    Sink sink{write};
    if (kind == PictureKind::Png)
        writePng(edge, sink);
    else
        writeJpeg(edge, sink);
    return sink.result;
}

}  // namespace vcp::scan
