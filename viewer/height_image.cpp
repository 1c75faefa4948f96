#include "viewer/height_image.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

#include <fmt/format.h>
#include <png.h>

#include "octree/regular_file.h"
#include "viewer/exr_picture.h"

namespace vcp {

namespace {

struct PngFailure {
    std::string message;
};

/// No object with a destructor lives in the functions that libpng's errors jump out of.
struct PngReader {
    png_structp png = nullptr;
    png_infop info = nullptr;
    PngFailure failure;

    ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
};

void failed(png_structp png, png_const_charp message) {
    static_cast<PngFailure*>(png_get_error_ptr(png))->message = message;
    png_longjmp(png, 1);
}
void warned(png_structp, png_const_charp) {}

/// Size and form; rows become 8 or 16 bits a channel, without alpha.
bool readStart(PngReader& reader, std::FILE* file) {
    if (setjmp(png_jmpbuf(reader.png))) return false;
    png_init_io(reader.png, file);
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

constexpr size_t kMostExrBytes = size_t{1} << 29;

Result<std::vector<std::byte>> wholeFile(std::FILE* file) {
    std::vector<std::byte> bytes;
    while (true) {
        const size_t had = bytes.size();
        bytes.resize(std::max<size_t>(2 * had, 1 << 16));
        const size_t got = std::fread(bytes.data() + had, 1, bytes.size() - had, file);
        bytes.resize(had + got);
        if (std::ferror(file)) return Error{.code = ErrorCode::Io, .message = "cannot be read"};
        if (bytes.size() > kMostExrBytes) return Error{.code = ErrorCode::Limit, .message = "is larger than 512 MiB"};
        if (got == 0) return bytes;
    }
}

Result<meso::HeightMap> exrHeights(std::FILE* file, double range) {
    const auto bytes = wholeFile(file);
    if (!bytes) return bytes.error();
    const auto picture = decodeExr(*bytes, meso::kMaxGridEdge);
    if (!picture) return picture.error();
    return heightsOf(*picture, range);
}

}  // namespace

meso::HeightMap heightsOf(const FloatPicture& picture, double range) {
    const auto [least, most] = std::ranges::minmax(picture.values);
    const double step = most > least ? 65535 / (double(most) - least) : 0;
    meso::HeightMap map{picture.size, range, {}};
    map.texels.reserve(picture.values.size());
    for (int y = picture.size.y; y-- > 0;)
        for (int x = 0; x < picture.size.x; ++x)
            map.texels.push_back(uint16_t(std::lround((double(picture.values[size_t(y) * size_t(picture.size.x) + size_t(x)]) - least) * step)));
    return map;
}

Result<meso::HeightMap> readHeightImage(const std::filesystem::path& path, double range) {
    const auto fail = [&](ErrorCode code, std::string message) { return Error{.code = code, .message = std::move(message), .file = path.string()}; };
    const auto opened = openRegularStream(path);
    if (!opened) return opened.error();
    const auto& file = *opened;
    png_byte signature[8] = {};
    const size_t got = std::fread(signature, 1, 8, file.get());
    std::rewind(file.get());
    if (isExr(std::as_bytes(std::span(signature, got)))) {
        auto map = exrHeights(file.get(), range);
        if (map) return map;
        Error error = map.error();
        error.file = path.string();
        // OpenEXR names the stream that it reads, which has no name.
        constexpr std::string_view kNobody = "image file \"\"";
        if (const size_t at = error.message.find(kNobody); at != std::string::npos) error.message.replace(at, kNobody.size(), "the picture");
        return error;
    }
    if (got < 8 || png_sig_cmp(signature, 0, 8) != 0) return fail(ErrorCode::InvalidInput, got == 0 ? "the file is empty" : "is neither a PNG nor an EXR picture");

    PngReader reader;
    reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader.failure, failed, warned);
    if (reader.png) reader.info = png_create_info_struct(reader.png);
    if (!reader.info) return fail(ErrorCode::Limit, "not enough memory for the picture");
    if (!readStart(reader, file.get())) return fail(ErrorCode::InvalidInput, "the PNG is damaged: " + reader.failure.message);
    const uint32_t width = png_get_image_width(reader.png, reader.info), height = png_get_image_height(reader.png, reader.info);
    if (width > uint32_t(meso::kMaxGridEdge) || height > uint32_t(meso::kMaxGridEdge))
        return fail(ErrorCode::Limit, fmt::format("{} x {} texels; a height map has at most {} an edge", width, height, meso::kMaxGridEdge));
    const size_t rowBytes = png_get_rowbytes(reader.png, reader.info), channels = png_get_channels(reader.png, reader.info);
    const bool isWide = png_get_bit_depth(reader.png, reader.info) == 16;
    std::vector<png_byte> bytes(rowBytes * height);
    std::vector<png_bytep> rows(height);
    for (uint32_t y = 0; y < height; ++y) rows[y] = bytes.data() + y * rowBytes;
    if (!readRows(reader, rows.data())) return fail(ErrorCode::InvalidInput, "the PNG is damaged: " + reader.failure.message);

    meso::HeightMap map{{int(width), int(height)}, range, std::vector<uint16_t>(size_t(width) * height)};
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            uint32_t sum = 0;
            for (size_t c = 0; c < channels; ++c) {
                const png_byte* at = rows[height - 1 - y] + (x * channels + c) * (isWide ? 2 : 1);
                uint16_t value = 0;
                if (isWide) std::memcpy(&value, at, 2);
                else value = uint16_t(*at * 257);
                sum += value;
            }
            map.texels[size_t(y) * width + x] = uint16_t((sum + channels / 2) / channels);
        }
    return map;
}

}  // namespace vcp
