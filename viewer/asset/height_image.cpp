#include "viewer/asset/height_image.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include <fmt/format.h>
#include <png.h>

#include "builder/stream/random_bytes.h"
#include "builder/texture/png_chunks.h"
#include "octree/io/regular_file.h"
#include "viewer/asset/exr_picture.h"
#include "viewer/asset/picture_file.h"

namespace vcp {

namespace {

/// What libpng reads, and what it says when it fails.
struct PngInput {
    PngBytes bytes;
    std::string failure;
    std::optional<Error> broken = std::nullopt;  ///< the file cannot be read
};

/// No object with a destructor lives in the functions that libpng's errors jump out of.
struct PngReader {
    png_structp png = nullptr;
    png_infop info = nullptr;
    PngInput input;

    explicit PngReader(RandomBytes& file) : input{PngBytes(file), {}} {}
    ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
};

void failed(png_structp png, png_const_charp message) {
    static_cast<PngInput*>(png_get_error_ptr(png))->failure = message;
    png_longjmp(png, 1);
}
void warned(png_structp, png_const_charp) {}
bool hasRead(PngInput& input, png_bytep to, size_t count) {
    const auto got = input.bytes.read(reinterpret_cast<char*>(to), count);
    if (!got) input.broken = got.error();
    return got && *got == count;
}
void readBytes(png_structp png, png_bytep to, size_t count) {
    if (!hasRead(*static_cast<PngInput*>(png_get_io_ptr(png)), to, count)) png_error(png, "it ends too early");
}

/// Reads size and form; rows become 8 or 16 bits a channel, without alpha.
bool readStart(PngReader& reader) {
    if (setjmp(png_jmpbuf(reader.png))) return false;
    png_set_read_fn(reader.png, &reader.input, readBytes);
    png_read_info(reader.png, reader.info);
    png_set_expand(reader.png);
    png_set_strip_alpha(reader.png);
    if (std::endian::native == std::endian::little) png_set_swap(reader.png);
    png_read_update_info(reader.png, reader.info);
    return true;
}

bool readRow(PngReader& reader, png_bytep row) {
    if (setjmp(png_jmpbuf(reader.png))) return false;
    png_read_row(reader.png, row, nullptr);
    return true;
}

bool readAllRows(PngReader& reader, png_bytepp rows) {
    if (setjmp(png_jmpbuf(reader.png))) return false;
    png_read_image(reader.png, rows);
    return true;
}

bool readEnd(PngReader& reader) {
    if (setjmp(png_jmpbuf(reader.png))) return false;
    png_read_end(reader.png, nullptr);
    return true;
}

/// Makes heights of a row: the means of its channels.
void takeRow(const png_byte* row, size_t channels, bool isWide, std::span<uint16_t> heights) {
    for (uint16_t& height : heights) {
        uint32_t sum = 0;
        for (size_t c = 0; c < channels; ++c) {
            uint16_t value = 0;
            if (isWide)
                std::memcpy(&value, row, 2);
            else
                value = uint16_t(*row * 257);
            sum += value, row += isWide ? 2 : 1;
        }
        height = uint16_t((sum + channels / 2) / channels);
    }
}

/// Reads the rows of a picture, from its upper one. Only one that is interlaced is held as a whole.
Result<void> readRows(PngReader& reader, const PngChunks& chunks, meso::HeightRows& to) {
    const Error damaged{.message = "the PNG is damaged"};
    const size_t rowBytes = png_get_rowbytes(reader.png, reader.info),
                 channels = png_get_channels(reader.png, reader.info);
    const bool isWide = png_get_bit_depth(reader.png, reader.info) == 16;
    std::vector<png_byte> bytes(rowBytes * (chunks.isInterlaced ? chunks.height : 1));
    std::vector<png_bytep> rows(chunks.height, bytes.data());
    for (uint32_t y = 0; y < chunks.height && chunks.isInterlaced; ++y) rows[y] += y * rowBytes;
    if (chunks.isInterlaced && !readAllRows(reader, rows.data())) return damaged;
    std::vector<uint16_t> heights(chunks.width);
    for (uint32_t y = 0; y < chunks.height; ++y) {
        if (!chunks.isInterlaced && !readRow(reader, rows[y])) return damaged;
        takeRow(rows[y], channels, isWide, heights);
        VCP_TRY(to.write(int(chunks.height - 1 - y), heights));
    }
    return readEnd(reader) ? Result<void>() : damaged;
}

Result<meso::HeightMap> exrHeights(std::span<const std::byte> file, double range, const meso::HeightStore& store) {
    VCP_TRY_ASSIGN(const auto picture, decodeExr(file, meso::kMaxMapEdge));
    return heightsOf(picture, range, store);
}

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";

/// Decodes a PNG, which may be hostile. Errors, without file: as checkPng(), InvalidInput (damaged), Limit (above
/// `kMaxMapEdge`).
Result<meso::HeightMap> pngHeights(RandomBytes& file, double range, const meso::HeightStore& store) {
    VCP_TRY_ASSIGN(const auto chunks, checkPng(file));
    const uint32_t width = chunks.width, height = chunks.height;
    if (width > uint32_t(meso::kMaxMapEdge) || height > uint32_t(meso::kMaxMapEdge))
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("{} x {} texels; a height map has at most {} an edge", width, height,
                                            meso::kMaxMapEdge)};
    PngReader reader(file);
    const auto why = [&](const Error& error) {
        const PngInput& input = reader.input;
        if (input.broken) return *input.broken;
        if (!input.failure.empty())
            return Error{.code = ErrorCode::InvalidInput, .message = "the PNG is damaged: " + input.failure};
        return error;
    };
    reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader.input, failed, warned);
    if (reader.png) reader.info = png_create_info_struct(reader.png);
    if (!reader.info) return Error{.code = ErrorCode::Limit, .message = "not enough memory for the picture"};
    if (!readStart(reader)) return why({});
    const glm::ivec2 size(width, height);
    VCP_TRY_ASSIGN(auto rows, meso::HeightRows::create(size, store));
    if (const auto read = readRows(reader, chunks, rows); !read) return why(read.error());
    return meso::HeightMap{size, range, std::move(rows).take()};
}

}  // namespace

Result<meso::HeightMap> heightsOf(const FloatPicture& picture, double range, const meso::HeightStore& store) {
    const auto [least, most] = std::ranges::minmax(picture.values);
    const double step = most > least ? 65535 / (double(most) - least) : 0, bottom = least;
    VCP_TRY_ASSIGN(auto rows, meso::HeightRows::create(picture.size, store));
    std::vector<uint16_t> heights(size_t(picture.size.x));
    for (int y = 0; y < picture.size.y; ++y) {
        const float* row = &picture.values[size_t(picture.size.y - 1 - y) * heights.size()];
        std::transform(row, row + heights.size(), heights.begin(),
                       [&](float value) { return uint16_t(std::lround((double(value) - bottom) * step)); });
        VCP_TRY(rows.write(y, heights));
    }
    return meso::HeightMap{picture.size, range, std::move(rows).take()};
}

Result<meso::HeightMap> decodeHeights(std::span<const std::byte> file, double range, const meso::HeightStore& store) {
    if (isExr(file)) return exrHeights(file, range, store);
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    if (text.starts_with(kPngSignature)) return pngHeights(*randomBytesAt(text), range, store);
    return Error{.code = ErrorCode::InvalidInput,
                 .message = text.empty() ? "the file is empty" : "is neither a PNG nor an EXR picture"};
}

Result<meso::HeightMap> readHeightImage(const std::filesystem::path& path, double range,
                                        const meso::HeightStore& store) {
    VCP_TRY_ASSIGN(const auto stream, openRegularStream(path));
    char start[kPngSignature.size()] = {};
    const size_t got = std::fread(start, 1, sizeof start, stream.get());
    VCP_TRY_ASSIGN(const auto file, openRandomBytes(path));
    // A PNG is read as it is decoded.
    if (std::string_view(start, got) == kPngSignature && file->size() <= kMostPictureBytes) {
        auto map = pngHeights(*file, range, store);
        if (map) return map;
        Error error = map.error();
        if (error.file.empty()) error.file = path.string();
        return error;
    }
    return decodedFile<meso::HeightMap>(
        path, [&](std::span<const std::byte> bytes) { return decodeHeights(bytes, range, store); });
}

}  // namespace vcp
