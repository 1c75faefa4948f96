#include "builder/texture/image.h"

#include <algorithm>
#include <string>

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

Result<std::unique_ptr<RandomBytes>> bytesOf(const ImageSource& source) {
    if (source.bytes) return randomBytesAt(*source.bytes);
    return openRandomBytes(source.path);
}

/// Returns the first bytes of a file, with zeros behind its end.
Result<std::string> beginningOf(RandomBytes& file) {
    std::string begin(4, '\0');
    VCP_TRY(file.read(0, begin.data(), size_t(std::min<uint64_t>(begin.size(), file.size()))));
    return begin;
}
constexpr std::string_view kPngBegins = "\x89PNG";

}  // namespace

Result<std::unique_ptr<ImageRows>> ImageRows::open(std::unique_ptr<RandomBytes> file, const ImageLimits& limits) {
    VCP_TRY_ASSIGN(const auto begin, beginningOf(*file));
    const bool isPng = begin == kPngBegins;
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
    VCP_TRY_ASSIGN(auto file, bytesOf(source));
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

/// Hands on the rows of an image with the alpha of another, whatever its size, or its grey where it is opaque
/// throughout.
class AlphaOfRows final : public ImageRows {
public:
    /// `alpha`: of `source`.
    AlphaOfRows(std::unique_ptr<ImageRows> image, std::unique_ptr<ImageRows> alpha, ImageSource source,
                const ImageLimits& limits)
        : image_(std::move(image)),
          alpha_(std::move(alpha)),
          source_(std::move(source)),
          limits_(limits),
          row_(alpha_->size().x) {}

    [[nodiscard]] glm::uvec2 size() const override { return image_->size(); }
    [[nodiscard]] uint64_t heldBytes() const override {
        return image_->heldBytes() + alpha_->heldBytes() + row_.size() * sizeof(Rgba8);
    }
    Result<void> read(std::span<Rgba8> texels) override {
        if (y_ == 0) VCP_TRY(begin());
        VCP_TRY(image_->read(texels));
        const glm::uvec2 own = image_->size(), other = alpha_->size();
        for (size_t at = 0; at < texels.size(); at += own.x, ++y_) {
            for (const uint32_t wanted = middle(y_, own.y, other.y); rows_ <= wanted; ++rows_)
                VCP_TRY(alpha_->read(row_));
            for (uint32_t x = 0; x < own.x; ++x) {
                const Rgba8 texel = row_[middle(x, own.x, other.x)];
                const Rgba8 alpha = isGrey_ ? texel >> 8 & 255u : texel >> 24;
                texels[at + x] = (texels[at + x] & 0xFFFFFFu) | alpha << 24;
            }
        }
        return {};
    }

private:
    /// Finds out whether the grey counts, and starts again.
    Result<void> begin() {
        const glm::uvec2 size = alpha_->size();
        for (uint32_t y = 0; y < size.y && isGrey_; ++y) {
            VCP_TRY(alpha_->read(row_));
            isGrey_ = std::all_of(row_.begin(), row_.end(), [](Rgba8 texel) { return texel >> 24 == 255; });
        }
        alpha_.reset();
        VCP_TRY_ASSIGN(alpha_, openImage(source_, limits_));
        if (alpha_->size() == size) return {};
        return Error{.code = ErrorCode::InvalidInput, .message = "the mask changed while it was read"};
    }

    /// Returns which of `count` texels lies over the middle of one of `size`.
    static uint32_t middle(uint32_t at, uint32_t size, uint32_t count) {
        return uint32_t((2 * uint64_t{at} + 1) * count / (2 * uint64_t{size}));
    }

    std::unique_ptr<ImageRows> image_, alpha_;
    ImageSource source_;  // of the alpha
    ImageLimits limits_;
    bool isGrey_ = true;
    std::vector<Rgba8> row_;  // of the alpha
    uint32_t y_ = 0;          // the next row
    uint32_t rows_ = 0;       // of the alpha, that were read
};

bool isPng(const ImageSource& source) {
    const auto file = bytesOf(source);
    const auto begin = file ? beginningOf(**file) : Result<std::string>(file.error());
    return begin && *begin == kPngBegins;
}

/// Whether a mask that is an image of its own says what of a material's image is there, texel by texel.
bool hasMaskOverImage(const Material& material) {
    const MaskRule& mask = material.mask;
    return material.isCutOut && material.ignoresAlpha && mask.image.exists() && mask.uvScale == glm::vec2(1) &&
           mask.uvOffset == glm::vec2(0) && isPng(material.image);
}

}  // namespace

Result<std::unique_ptr<ImageRows>> openImage(const Material& material, const ImageLimits& limits) {
    if (hasMaskOverImage(material)) {
        const auto open = [source = material.image, mask = material.mask.image,
                           limits]() -> Result<std::unique_ptr<ImageRows>> {
            VCP_TRY_ASSIGN(auto image, openImage(source, limits));
            auto alpha = openImage(mask, limits);
            if (!alpha) return std::unique_ptr<ImageRows>(std::make_unique<OpaqueRows>(std::move(image)));
            return std::unique_ptr<ImageRows>(
                std::make_unique<AlphaOfRows>(std::move(image), *std::move(alpha), mask, limits));
        };
        VCP_TRY_ASSIGN(auto image, open());
        return filledRows(std::move(image), open);
    }
    VCP_TRY_ASSIGN(auto image, openImage(material.image, limits));
    if (material.ignoresAlpha) return std::unique_ptr<ImageRows>(std::make_unique<OpaqueRows>(std::move(image)));
    if (material.isCutOut && mayBeTransparent(material.image))
        image = filledRows(std::move(image), [source = material.image, limits] { return openImage(source, limits); });
    return image;
}

bool mayBeTransparent(const ImageSource& source) {
    const auto file = bytesOf(source);
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
