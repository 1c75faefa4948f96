#include "viewer/asset/height_image.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <span>
#include <string_view>

#include <fmt/format.h>
#include <png.h>

#include "builder/stream/random_bytes.h"
#include "builder/texture/png_chunks.h"
#include "viewer/asset/exr_picture.h"
#include "viewer/asset/picture_file.h"

namespace vcp {

namespace {

/// What libpng reads, and what it says when it fails.
struct PngBytes {
    std::string_view left;
    std::string failure;
};

/// No object with a destructor lives in the functions that libpng's errors jump out of.
struct PngReader {
    png_structp png = nullptr;
    png_infop info = nullptr;
    PngBytes bytes;

    ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
};

void failed(png_structp png, png_const_charp message) {
    static_cast<PngBytes*>(png_get_error_ptr(png))->failure = message;
    png_longjmp(png, 1);
}
void warned(png_structp, png_const_charp) {}
void readBytes(png_structp png, png_bytep to, size_t count) {
    auto* const bytes = static_cast<PngBytes*>(png_get_io_ptr(png));
    if (count > bytes->left.size()) png_error(png, "it ends too early");
    std::memcpy(to, bytes->left.data(), count);
    bytes->left.remove_prefix(count);
}

/// Reads size and form; rows become 8 or 16 bits a channel, without alpha.
bool readStart(PngReader& reader) {
    if (setjmp(png_jmpbuf(reader.png))) return false;
    png_set_read_fn(reader.png, &reader.bytes, readBytes);
    png_read_info(reader.png, reader.info);
    png_set_expand(reader.png);
    png_set_strip_alpha(reader.png);
    if (std::endian::native == std::endian::little) png_set_swap(reader.png);
    png_read_update_info(reader.png, reader.info);
    return true;
}

bool readRows(PngReader& reader, png_bytepp rows) {
    if (setjmp(png_jmpbuf(reader.png))) return false;
    png_read_image(reader.png, rows);
    png_read_end(reader.png, nullptr);
    return true;
}

Result<meso::HeightMap> exrHeights(std::span<const std::byte> file, double range) {
    VCP_TRY_ASSIGN(const auto picture, decodeExr(file, meso::kMaxMapEdge));
    return heightsOf(picture, range);
}

/// Decodes a PNG, which may be hostile. Errors, without file: as checkPng(), InvalidInput (damaged), Limit (above
/// `kMaxMapEdge`).
Result<meso::HeightMap> pngHeights(std::string_view file, double range) {
    VCP_TRY_ASSIGN(const auto chunks, checkPng(*randomBytesAt(file)));
    const uint32_t width = chunks.width, height = chunks.height;
    if (width > uint32_t(meso::kMaxMapEdge) || height > uint32_t(meso::kMaxMapEdge))
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("{} x {} texels; a height map has at most {} an edge", width, height,
                                            meso::kMaxMapEdge)};
    const std::string texels = withoutText(file);
    PngReader reader;
    const auto damaged = [&] {
        return Error{.code = ErrorCode::InvalidInput, .message = "the PNG is damaged: " + reader.bytes.failure};
    };
    reader.bytes.left = texels;
    reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader.bytes, failed, warned);
    if (reader.png) reader.info = png_create_info_struct(reader.png);
    if (!reader.info) return Error{.code = ErrorCode::Limit, .message = "not enough memory for the picture"};
    if (!readStart(reader)) return damaged();
    const size_t rowBytes = png_get_rowbytes(reader.png, reader.info),
                 channels = png_get_channels(reader.png, reader.info);
    const bool isWide = png_get_bit_depth(reader.png, reader.info) == 16;
    std::vector<png_byte> bytes(rowBytes * height);
    std::vector<png_bytep> rows(height);
    for (uint32_t y = 0; y < height; ++y) rows[y] = bytes.data() + y * rowBytes;
    if (!readRows(reader, rows.data())) return damaged();

    meso::HeightMap map{{int(width), int(height)}, range, std::vector<uint16_t>(size_t(width) * height)};
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            uint32_t sum = 0;
            for (size_t c = 0; c < channels; ++c) {
                const png_byte* at = rows[height - 1 - y] + (x * channels + c) * (isWide ? 2 : 1);
                uint16_t value = 0;
                if (isWide)
                    std::memcpy(&value, at, 2);
                else
                    value = uint16_t(*at * 257);
                sum += value;
            }
            map.texels[size_t(y) * width + x] = uint16_t((sum + channels / 2) / channels);
        }
    return map;
}

}  // namespace

meso::HeightMap heightsOf(const FloatPicture& picture, double range) {
    const auto [least, most] = std::ranges::minmax(picture.values);
    const double step = most > least ? 65535 / (double(most) - least) : 0;
    meso::HeightMap map{picture.size, range, {}};
    map.texels.reserve(picture.values.size());
    for (int y = picture.size.y; y-- > 0;)
        for (int x = 0; x < picture.size.x; ++x)
            map.texels.push_back(uint16_t(
                std::lround((double(picture.values[size_t(y) * size_t(picture.size.x) + size_t(x)]) - least) * step)));
    return map;
}

Result<meso::HeightMap> decodeHeights(std::span<const std::byte> file, double range) {
    if (isExr(file)) return exrHeights(file, range);
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    if (text.starts_with("\x89PNG\r\n\x1a\n")) return pngHeights(text, range);
    return Error{.code = ErrorCode::InvalidInput,
                 .message = text.empty() ? "the file is empty" : "is neither a PNG nor an EXR picture"};
}

Result<meso::HeightMap> readHeightImage(const std::filesystem::path& path, double range) {
    const auto decode = [range](std::span<const std::byte> file) { return decodeHeights(file, range); };
    return decodedFile<meso::HeightMap>(path, decode);
}

}  // namespace vcp
