#include "builder/texture/image.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "builder/texture/filled_rows.h"
#include "builder/texture/jpeg_rows.h"
#include "builder/texture/png_chunks.h"
#include "builder/texture/png_rows.h"

namespace vcp {
namespace {

Error tooLarge(glm::uvec2 size, const ImageLimits& limits) {
    return {.code = ErrorCode::Limit,
            .message = fmt::format("a picture of {} by {} texels; at most {} an edge and {} MiB are read", size.x,
                                   size.y, limits.edge, limits.bytes >> 20)};
}

Result<Image> readWhole(ImageRows& rows, const ImageLimits& limits) {
    const glm::uvec2 size = rows.size();
    if (uint64_t{size.x} * size.y * sizeof(Rgba8) > limits.bytes) return tooLarge(size, limits);
    Image image{size.x, size.y, std::vector<Rgba8>(size_t{size.x} * size.y)};
    VCP_TRY(rows.read(image.texels));
    return image;
}

}  // namespace

Result<std::unique_ptr<ImageRows>> ImageRows::open(std::unique_ptr<RandomBytes> file, const ImageLimits& limits) {
    std::array<char, 4> first{};
    VCP_TRY(file->read(0, first.data(), size_t(std::min<uint64_t>(first.size(), file->size()))));
    const std::string_view begin(first.data(), first.size());
    const bool isPng = begin == "\x89PNG";
    if (!isPng && !begin.starts_with("\xFF\xD8"))
        return Error{.code = ErrorCode::Unsupported, .message = "the picture is neither PNG nor JPEG"};
    VCP_TRY_ASSIGN(auto rows, isPng ? openPng(std::move(file)) : openJpeg(std::move(file)));
    const glm::uvec2 size = rows->size();
    if (size.x > limits.edge || size.y > limits.edge || rows->heldBytes() > limits.bytes) return tooLarge(size, limits);
    return rows;
}

Error namedImageError(const ImageSource& source, Error error) {
    if (!source.bytes) error.file = source.path.string();
    return error;
}

Result<std::unique_ptr<ImageRows>> openImage(const ImageSource& source, const ImageLimits& limits) {
    std::unique_ptr<RandomBytes> file;
    if (source.bytes) {
        file = randomBytesAt(*source.bytes);
    } else {
        VCP_TRY_ASSIGN(file, openRandomBytes(source.path));
    }
    if (file->size() > limits.fileBytes)
        return namedImageError(source,
                               {.code = ErrorCode::Limit,
                                .message = fmt::format("a picture file of more than {} MiB", limits.fileBytes >> 20)});
    auto rows = ImageRows::open(std::move(file), limits);
    if (!rows) return namedImageError(source, rows.error());
    return rows;
}

namespace {

/// Hands on the rows of another image, all of them opaque.
class OpaqueRows final : public ImageRows {
public:
    explicit OpaqueRows(std::unique_ptr<ImageRows> image) : image_(std::move(image)) {}

    [[nodiscard]] glm::uvec2 size() const override { return image_->size(); }
    [[nodiscard]] uint64_t heldBytes() const override { return image_->heldBytes(); }
    Result<void> read(std::span<Rgba8> texels) override {
        VCP_TRY(image_->read(texels));
        for (Rgba8& texel : texels) texel |= Rgba8{255} << 24;
        return {};
    }
    [[nodiscard]] const JpegBlocks* blocks() const override { return image_->blocks(); }

private:
    std::unique_ptr<ImageRows> image_;
};

}  // namespace

Result<std::unique_ptr<ImageRows>> openImage(const Material& material, const ImageLimits& limits) {
    VCP_TRY_ASSIGN(auto image, openImage(material.image, limits));
    if (material.ignoresAlpha) return std::unique_ptr<ImageRows>(std::make_unique<OpaqueRows>(std::move(image)));
    if (material.isCutOut && mayBeTransparent(material.image))
        image = filledRows(std::move(image), [source = material.image, limits] { return openImage(source, limits); });
    return image;
}

bool mayBeTransparent(const ImageSource& source) {
    if (source.bytes) return mayHaveAlpha(*randomBytesAt(*source.bytes));
    const auto file = openRandomBytes(source.path);
    return file && mayHaveAlpha(**file);
}

Result<Image> decodeImage(std::string_view file, const ImageLimits& limits) {
    VCP_TRY_ASSIGN(const auto rows, ImageRows::open(randomBytesAt(file), limits));
    return readWhole(*rows, limits);
}

Result<Image> loadImage(const ImageSource& source, const ImageLimits& limits) {
    VCP_TRY_ASSIGN(const auto rows, openImage(source, limits));
    auto image = readWhole(*rows, limits);
    if (!image) return namedImageError(source, image.error());
    return image;
}

Result<Image> loadImage(const Material& material, const ImageLimits& limits) {
    VCP_TRY_ASSIGN(const auto rows, openImage(material, limits));
    auto image = readWhole(*rows, limits);
    if (!image) return namedImageError(material.image, image.error());
    return image;
}

}  // namespace vcp
