#include "builder/texture/png_rows.h"

#include <algorithm>
#include <csetjmp>
#include <cstring>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <png.h>

#include "builder/texture/png_chunks.h"

namespace vcp {
namespace {

/// How libpng fails: it jumps back, and never returns.
struct PngFailure {
    std::jmp_buf back;
    char message[128] = {};
};

extern "C" {
static void vcpPngFailed(png_structp png, png_const_charp message) {
    auto* const failure = static_cast<PngFailure*>(png_get_error_ptr(png));
    std::strncpy(failure->message, message, sizeof failure->message - 1);
    std::longjmp(failure->back, 1);
}
static void vcpPngWarned(png_structp, png_const_charp) {}
static void vcpPngRead(png_structp png, png_bytep to, size_t count);
}

class PngRows final : public ImageRows {
public:
    PngRows(std::unique_ptr<RandomBytes> file, const PngChunks& chunks)
        : file_(std::move(file)),
          bytes_(*file_),
          size_(chunks.width, chunks.height),
          isInterlaced_(chunks.isInterlaced) {}
    ~PngRows() override { png_destroy_read_struct(&png_, &info_, nullptr); }
    PngRows(const PngRows&) = delete;
    PngRows& operator=(const PngRows&) = delete;

    [[nodiscard]] glm::uvec2 size() const override { return size_; }
    [[nodiscard]] uint64_t heldBytes() const override {
        return isInterlaced_ ? uint64_t{size_.x} * size_.y * sizeof(Rgba8) : 0;
    }

    Result<void> read(std::span<Rgba8> texels) override {
        if (!hasBegun_ && !begin()) return failed();
        if (!isInterlaced_) return readRows(texels.data(), texels.size() / size_.x) ? Result<void>() : failed();
        if (whole_.empty()) {
            whole_.resize(size_t{size_.x} * size_.y);
            if (!readPasses()) return failed();
        }
        std::copy_n(whole_.begin() + std::ptrdiff_t(done_), texels.size(), texels.begin());
        done_ += texels.size();
        return {};
    }

    /// Hands bytes to libpng; returns false where there are too few.
    bool take(char* to, size_t count) {
        const auto got = bytes_.read(to, count);
        if (!got) broken_ = got.error();
        return got && *got == count;
    }

private:
    // No object with a destructor lives in these functions, since errors jump out of libpng back into them.

    /// Reads the header, and asks for what png_image_finish_read() makes of any PNG: 8 bits of red, green, blue and
    /// alpha, encoded as sRGB; 16 bits are light unless the file says otherwise.
    bool begin() {
        hasBegun_ = true;
        if (setjmp(failure_.back)) return false;
        png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure_, vcpPngFailed, vcpPngWarned);
        if (png_ == nullptr) return false;
        info_ = png_create_info_struct(png_);
        if (info_ == nullptr) return false;
        png_set_read_fn(png_, this, vcpPngRead);
        png_set_benign_errors(png_, 1);
        png_read_info(png_, info_);
        const bool isColour = (png_get_color_type(png_, info_) & PNG_COLOR_MASK_COLOR) != 0;
        const bool hasAlpha = (png_get_color_type(png_, info_) & PNG_COLOR_MASK_ALPHA) != 0 ||
                              png_get_valid(png_, info_, PNG_INFO_tRNS) != 0;
        const bool isDeep = png_get_bit_depth(png_, info_) == 16;
        png_set_expand(png_);
        if (!isColour) png_set_gray_to_rgb(png_);
        png_set_alpha_mode_fixed(png_, PNG_ALPHA_PNG, isDeep ? PNG_GAMMA_LINEAR : PNG_DEFAULT_sRGB);
        if (isDeep) png_set_scale_16(png_);
        if (!hasAlpha) png_set_add_alpha(png_, 255, PNG_FILLER_AFTER);
        png_set_alpha_mode_fixed(png_, PNG_ALPHA_PNG, PNG_DEFAULT_sRGB);
        passes_ = png_set_interlace_handling(png_);
        png_read_update_info(png_, info_);
        // The sizes are those that were checked, unless the header comes twice.
        return png_get_image_width(png_, info_) == size_.x && png_get_image_height(png_, info_) == size_.y &&
               png_get_rowbytes(png_, info_) == size_t{size_.x} * sizeof(Rgba8) && (passes_ > 1) == isInterlaced_;
    }

    bool readRows(Rgba8* texels, size_t count) {
        if (setjmp(failure_.back)) return false;
        for (size_t row = 0; row < count; ++row)
            png_read_row(png_, reinterpret_cast<png_bytep>(texels + row * size_.x), nullptr);
        return true;
    }

    bool readPasses() {
        for (int pass = 0; pass < passes_; ++pass)
            if (!readRows(whole_.data(), size_.y)) return false;
        return true;
    }

    Error failed() {
        if (broken_) return *broken_;
        std::string detail = failure_.message;
        for (char& c : detail)
            if (c < ' ' || c > '~') c = '?';
        return {.code = ErrorCode::InvalidInput, .message = fmt::format("the PNG picture is damaged ({})", detail)};
    }

    std::unique_ptr<RandomBytes> file_;
    PngBytes bytes_;
    glm::uvec2 size_;
    bool isInterlaced_;
    bool hasBegun_ = false;
    png_structp png_ = nullptr;
    png_infop info_ = nullptr;
    int passes_ = 1;
    PngFailure failure_;
    std::optional<Error> broken_;  ///< what is wrong with the file's bytes
    std::vector<Rgba8> whole_;     ///< of an interlaced picture
    size_t done_ = 0;              ///< texels of it that were handed on
};

extern "C" {
static void vcpPngRead(png_structp png, png_bytep to, size_t count) {
    if (!static_cast<PngRows*>(png_get_io_ptr(png))->take(reinterpret_cast<char*>(to), count))
        png_error(png, "it ends too early");
}
}

}  // namespace

Result<std::unique_ptr<ImageRows>> openPng(std::unique_ptr<RandomBytes> file) {
    VCP_TRY_ASSIGN(const auto chunks, checkPng(*file));
    return std::unique_ptr<ImageRows>(std::make_unique<PngRows>(std::move(file), chunks));
}

}  // namespace vcp
