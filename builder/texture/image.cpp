#include "builder/texture/image.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <png.h>

#include "builder/stream/random_bytes.h"
#include "builder/texture/png_chunks.h"
#include "octree/image/jpeg_library.h"

// This header comes after those that it needs.
#include <jerror.h>

namespace vcp {
namespace {

Error damaged(const char* format, std::string detail) {
    for (char& c : detail)
        if (c < ' ' || c > '~') c = '?';
    return {.code = ErrorCode::InvalidInput, .message = fmt::format("the {} picture is damaged ({})", format, detail)};
}

Result<void> checkSize(uint64_t width, uint64_t height, const ImageLimits& limits) {
    if (width > 0 && height > 0 && width <= limits.edge && height <= limits.edge &&
        width * height * sizeof(Rgba8) <= limits.bytes)
        return {};
    return Error{.code = ErrorCode::Limit,
                 .message = fmt::format("a picture of {} by {} texels; at most {} an edge and {} MiB are read", width,
                                        height, limits.edge, limits.bytes >> 20)};
}

Result<Image> decodePng(std::string_view file, const ImageLimits& limits) {
    VCP_TRY_ASSIGN(const auto chunks, checkPng(file));
    VCP_TRY(checkSize(chunks.width, chunks.height, limits));
    const std::string texels = withoutText(file);
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    const auto fail = [&]() {
        Error error = damaged("PNG", png.message);
        png_image_free(&png);
        return error;
    };
    if (!png_image_begin_read_from_memory(&png, texels.data(), texels.size())) return fail();
    png.format = PNG_FORMAT_RGBA;
    Image image{png.width, png.height, std::vector<Rgba8>(size_t{png.width} * png.height)};
    if (!png_image_finish_read(&png, nullptr, image.texels.data(), 0, nullptr)) return fail();
    return image;
}

constexpr int kMostJpegScans = 100;
constexpr long kJpegBytes = 256L << 20;  // bytes of a progressive picture, which libjpeg holds as a whole

struct PictureFailure : JpegFailure {
    jpeg_progress_mgr progress{};
    bool tooManyScans = false;
};

extern "C" {
// Limits the scans: each goes over the whole picture, however few its bytes; a usual picture has some ten.
void vcpJpegProgress(j_common_ptr info) {
    const int scans = reinterpret_cast<j_decompress_ptr>(info)->input_scan_number;
    if (scans <= kMostJpegScans) return;
    auto* const failure = static_cast<PictureFailure*>(reinterpret_cast<JpegFailure*>(info->err));
    failure->tooManyScans = true;
    std::longjmp(failure->back, 1);
}
}

// A block of 8 by 8 texels of some channel takes at least a bit (in Huffman's codes; arithmetic coding is rare).
constexpr uint64_t kMostJpegTexels = 8 * 64;  // texels of a byte

// No object with a destructor lives in this function, since errors jump out of libjpeg back into it. `isWanted` looks
// at the header.
template <class IsWanted>
bool runJpeg(std::string_view file, jpeg_decompress_struct& jpeg, PictureFailure& failure, Image& image,
             IsWanted isWanted) {
    if (setjmp(failure.back)) return false;
    jpeg_create_decompress(&jpeg);
    jpeg.mem->max_memory_to_use = kJpegBytes;
    failure.progress.progress_monitor = vcpJpegProgress;
    jpeg.progress = &failure.progress;
    jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(file.data()), static_cast<unsigned long>(file.size()));
    jpeg_read_header(&jpeg, TRUE);
    if (!isWanted()) return false;
    jpeg.out_color_space = JCS_EXT_RGBA;
    jpeg_start_decompress(&jpeg);
    image.width = jpeg.output_width;
    image.height = jpeg.output_height;
    image.texels.resize(size_t{image.width} * image.height);
    while (jpeg.output_scanline < jpeg.output_height) {
        JSAMPROW row = reinterpret_cast<JSAMPROW>(image.texels.data() + size_t{jpeg.output_scanline} * image.width);
        jpeg_read_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_decompress(&jpeg);
    return true;
}

Result<Image> decodeJpeg(std::string_view file, const ImageLimits& limits) {
    jpeg_decompress_struct jpeg{};
    PictureFailure failure;
    jpeg.err = &failure.base;
    Image image;
    std::optional<Error> refused;
    const bool done = runJpeg(file, jpeg, failure, image, [&] {
        if (const auto fits = checkSize(jpeg.image_width, jpeg.image_height, limits); !fits) refused = fits.error();
        if (jpeg.jpeg_color_space == JCS_CMYK || jpeg.jpeg_color_space == JCS_YCCK)
            refused = Error{.code = ErrorCode::Unsupported, .message = "a JPEG picture in CMYK; save it as RGB"};
        if (uint64_t{jpeg.image_width} * jpeg.image_height / kMostJpegTexels > file.size())
            refused = damaged("JPEG", fmt::format("{} bytes cannot hold {} by {} texels", file.size(), jpeg.image_width,
                                                  jpeg.image_height));
        return !refused;
    });
    jpeg_destroy_decompress(&jpeg);
    if (refused) return *refused;
    if (done) return image;
    if (failure.tooManyScans)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a JPEG picture of more than {} scans; save it again", kMostJpegScans)};
    if (failure.base.msg_code == JERR_NO_BACKING_STORE)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format("a progressive JPEG picture that takes more than {} MiB; save it as baseline",
                                   kJpegBytes >> 20)};
    return damaged("JPEG", failure.message);
}

}  // namespace

Result<Image> decodeImage(std::string_view file, const ImageLimits& limits) {
    if (file.starts_with("\x89PNG")) return decodePng(file, limits);
    if (file.starts_with("\xFF\xD8")) return decodeJpeg(file, limits);
    return Error{.code = ErrorCode::Unsupported, .message = "the picture is neither PNG nor JPEG"};
}

namespace {

Error named(const ImageSource& source, Error error) {
    error.file = source.path.string();
    return error;
}

}  // namespace

Result<std::shared_ptr<const std::string>> imageFile(const ImageSource& source, const ImageLimits& limits) {
    if (source.bytes) return source.bytes;
    VCP_TRY_ASSIGN(auto bytes, openRandomBytes(source.path));
    if (bytes->size() > limits.fileBytes)
        return named(source, {.code = ErrorCode::Limit,
                              .message = fmt::format("a picture file of more than {} MiB", limits.fileBytes >> 20)});
    auto file = std::make_shared<std::string>(bytes->size(), '\0');
    if (const auto read = bytes->read(0, file->data(), file->size()); !read) return named(source, read.error());
    return std::shared_ptr<const std::string>(std::move(file));
}

void ignoreAlpha(Image& image) {
    for (Rgba8& texel : image.texels) texel |= Rgba8{255} << 24;
}

bool mayBeTransparent(const ImageSource& source) {
    if (source.bytes) return mayHaveAlpha(*source.bytes);
    constexpr size_t kStartBytes = 64 * 1024;
    const auto file = openRandomBytes(source.path);
    if (!file) return false;
    std::string start(std::min<uint64_t>((*file)->size(), kStartBytes), '\0');
    return (*file)->read(0, start.data(), start.size()) && mayHaveAlpha(start);
}

Result<Image> decodeImage(const ImageSource& source, const std::string& file, const ImageLimits& limits) {
    auto image = decodeImage(file, limits);
    return image || source.bytes ? std::move(image) : named(source, image.error());
}

Result<Image> loadImage(const ImageSource& source, const ImageLimits& limits) {
    VCP_TRY_ASSIGN(const auto file, imageFile(source, limits));
    return decodeImage(source, *file, limits);
}

}  // namespace vcp
