#include "builder/texture/jpeg_rows.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "builder/texture/jpeg_blocks.h"
#include "octree/image/jpeg_library.h"

// This header comes after those that it needs.
#include <jerror.h>

namespace vcp {
namespace {

constexpr int kMostScans = 100;                            // each goes over the whole picture, however few its bytes
constexpr uint64_t kMostBlockBytes = uint64_t{256} << 20;  // of a picture that libjpeg holds as a whole

// A block of 8 by 8 texels of some channel takes at least a bit (in Huffman's codes; arithmetic coding is rare).
constexpr uint64_t kMostTexelsOfByte = 8 * 64;

/// Where libjpeg reads from.
struct JpegSource {
    jpeg_source_mgr base{};  // it comes first: libjpeg's calls bring its address
    RandomBytes* file = nullptr;
    uint64_t at = 0;  ///< behind the bytes in `buffer`
    std::optional<Error> broken;
    std::array<char, 64 * 1024> buffer;

    /// Reads the next bytes; returns false at the end, or where that fails.
    bool refill() {
        const auto count = size_t(std::min<uint64_t>(buffer.size(), file->size() - at));
        if (const auto read = file->read(at, buffer.data(), count); !read) broken = read.error();
        if (broken || count == 0) return false;
        at += count;
        base.next_input_byte = reinterpret_cast<const JOCTET*>(buffer.data());
        base.bytes_in_buffer = count;
        return true;
    }
};

extern "C" {
static void vcpJpegNothing(j_decompress_ptr) {}
static boolean vcpJpegRefill(j_decompress_ptr jpeg) {
    // A warning is an error here, which does not return.
    if (!reinterpret_cast<JpegSource*>(jpeg->src)->refill()) WARNMS(jpeg, JWRN_JPEG_EOF);
    return TRUE;
}
static void vcpJpegSkip(j_decompress_ptr jpeg, long count) {
    for (; count > 0 && size_t(count) > jpeg->src->bytes_in_buffer; vcpJpegRefill(jpeg))
        count -= long(jpeg->src->bytes_in_buffer);
    if (count <= 0) return;
    jpeg->src->next_input_byte += count;
    jpeg->src->bytes_in_buffer -= size_t(count);
}
}

class JpegRows final : public ImageRows {
public:
    explicit JpegRows(std::unique_ptr<RandomBytes> file) : file_(std::move(file)) {
        jpeg_.err = &failure_.base;
        source_.base = {.next_input_byte = nullptr,
                        .bytes_in_buffer = 0,
                        .init_source = vcpJpegNothing,
                        .fill_input_buffer = vcpJpegRefill,
                        .skip_input_data = vcpJpegSkip,
                        .resync_to_restart = jpeg_resync_to_restart,
                        .term_source = vcpJpegNothing};
        source_.file = file_.get();
    }
    ~JpegRows() override { jpeg_destroy_decompress(&jpeg_); }
    JpegRows(const JpegRows&) = delete;
    JpegRows& operator=(const JpegRows&) = delete;

    Result<void> open() {
        if (!readHeader()) return failed();
        if (jpeg_.jpeg_color_space == JCS_CMYK || jpeg_.jpeg_color_space == JCS_YCCK)
            return Error{.code = ErrorCode::Unsupported, .message = "a JPEG picture in CMYK; save it as RGB"};
        if (uint64_t{jpeg_.image_width} * jpeg_.image_height / kMostTexelsOfByte > file_->size())
            return damaged(fmt::format("{} bytes cannot hold {} by {} texels", file_->size(), jpeg_.image_width,
                                       jpeg_.image_height));
        blocks_.keep(jpeg_);
        if (jpeg_has_multiple_scans(&jpeg_) && blocks_.bytes() > kMostBlockBytes)
            return Error{
                .code = ErrorCode::Limit,
                .message = fmt::format("a progressive JPEG picture that takes more than {} MiB; save it as baseline",
                                       kMostBlockBytes >> 20)};
        return {};
    }

    [[nodiscard]] glm::uvec2 size() const override { return {jpeg_.image_width, jpeg_.image_height}; }
    [[nodiscard]] uint64_t heldBytes() const override { return blocks_.bytes(); }
    [[nodiscard]] const JpegBlocks* blocks() const override { return hasBlocks_ ? &blocks_ : nullptr; }

    Result<void> read(std::span<Rgba8> texels) override {
        if (!hasBegun_ && !begin()) return failed();
        if (!hasBegun_) hasBlocks_ = blocks_.canBeCut() && blocks_.isComplete();
        hasBegun_ = true;
        return readRows(texels.data(), uint32_t(texels.size() / jpeg_.image_width)) ? Result<void>() : failed();
    }

private:
    // No object with a destructor lives in these functions, since errors jump out of libjpeg back into them.

    bool readHeader() {
        if (setjmp(failure_.back)) return false;
        jpeg_create_decompress(&jpeg_);
        jpeg_.src = &source_.base;
        jpeg_read_header(&jpeg_, TRUE);
        return true;
    }

    /// Begins to decode; reads all scans of a picture that has several.
    bool begin() {
        if (setjmp(failure_.back)) return false;
        // Only so does libjpeg keep the blocks of what has one scan.
        jpeg_.buffered_image = TRUE;
        jpeg_.out_color_space = JCS_EXT_RGBA;
        jpeg_start_decompress(&jpeg_);
        if (jpeg_has_multiple_scans(&jpeg_))
            while (jpeg_consume_input(&jpeg_) != JPEG_REACHED_EOI)
                if (jpeg_.input_scan_number > kMostScans) return false;
        jpeg_start_output(&jpeg_, jpeg_.input_scan_number);
        return true;
    }

    bool readRows(Rgba8* texels, uint32_t count) {
        if (setjmp(failure_.back)) return false;
        for (uint32_t i = 0; i < count; ++i) {
            auto row = reinterpret_cast<JSAMPROW>(texels + size_t{i} * jpeg_.image_width);
            jpeg_read_scanlines(&jpeg_, &row, 1);
        }
        if (jpeg_.output_scanline < jpeg_.output_height) return true;
        jpeg_finish_output(&jpeg_);
        return finish();
    }

    /// Reads what follows the last row, as decoders of whole pictures do; the blocks stay.
    bool finish() {
        while (!jpeg_input_complete(&jpeg_)) jpeg_consume_input(&jpeg_);
        return true;
    }

    static Error damaged(std::string detail) {
        for (char& c : detail)
            if (c < ' ' || c > '~') c = '?';
        return {.code = ErrorCode::InvalidInput, .message = fmt::format("the JPEG picture is damaged ({})", detail)};
    }

    Error failed() {
        if (source_.broken) return *source_.broken;
        if (jpeg_.input_scan_number > kMostScans)
            return {.code = ErrorCode::Limit,
                    .message = fmt::format("a JPEG picture of more than {} scans; save it again", kMostScans)};
        return damaged(failure_.message);
    }

    std::unique_ptr<RandomBytes> file_;
    JpegSource source_;
    JpegFailure failure_;
    jpeg_decompress_struct jpeg_{};
    JpegBlocks blocks_;
    bool hasBegun_ = false, hasBlocks_ = false;
};

}  // namespace

Result<std::unique_ptr<ImageRows>> openJpeg(std::unique_ptr<RandomBytes> file) {
    auto rows = std::make_unique<JpegRows>(std::move(file));
    VCP_TRY(rows->open());
    return std::unique_ptr<ImageRows>(std::move(rows));
}

}  // namespace vcp
