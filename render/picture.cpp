#include "render/picture.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include <png.h>
#include <unistd.h>

#include "octree/io/regular_file.h"

namespace vcp {

namespace {

constexpr uint64_t kMaxPixels = uint64_t{1} << 28;

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

Error ioError(const std::filesystem::path& path, const std::string& what) {
    return {.code = ErrorCode::Io, .message = what + ": " + std::strerror(errno), .file = path.string()};
}

std::string pngError(const png_image& image) { return std::string("PNG: ") + image.message; }

png_image imageOf(const Picture& picture) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = picture.width;
    image.height = picture.height;
    image.format = PNG_FORMAT_RGBA;
    // Speed matters more here than the last few percent of size.
    image.flags = PNG_IMAGE_FLAG_FAST;
    return image;
}

}  // namespace

Result<void> writePng(const Picture& picture, const std::filesystem::path& path, const OutputRules& rules) {
    const std::string name = path.string();
    if (picture.width == 0 || picture.height == 0 || uint64_t{picture.width} * picture.height > kMaxPixels ||
        picture.rgba.size() != uint64_t{4} * picture.width * picture.height)
        return Error{.code = ErrorCode::Usage, .message = "the picture's size and its pixels disagree", .file = name};
    VCP_TRY_ASSIGN(auto output, OutputFile::create(path, OutputKind::Png, rules));
    File file(::fdopen(::dup(output.descriptor()), "wb"));
    if (!file) return ioError(path, "cannot write");
    png_image image = imageOf(picture);
    if (png_image_write_to_stdio(&image, file.get(), 0, picture.rgba.data(), 0, nullptr) == 0)
        return Error{.code = ErrorCode::Io, .message = pngError(image), .file = name};
    if (std::fflush(file.get()) != 0) return ioError(path, "cannot write");
    return output.commit();
}

Result<Picture> readPng(const std::filesystem::path& path) {
    VCP_TRY_ASSIGN(const auto opened, openRegularStream(path));
    const auto& file = opened;
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    const auto invalid = [&](const std::string& what) {
        return Error{.code = ErrorCode::InvalidInput, .message = what, .file = path.string()};
    };
    if (png_image_begin_read_from_stdio(&image, file.get()) == 0) return invalid(pngError(image));
    if (uint64_t{image.width} * image.height > kMaxPixels) {
        png_image_free(&image);
        return invalid("the picture is larger than 2^28 pixels");
    }
    image.format = PNG_FORMAT_RGBA;
    Picture picture{image.width, image.height, std::vector<uint8_t>(uint64_t{4} * image.width * image.height)};
    if (png_image_finish_read(&image, nullptr, picture.rgba.data(), 0, nullptr) == 0) return invalid(pngError(image));
    return picture;
}

}  // namespace vcp
