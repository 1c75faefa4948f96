#include "builder/texture/jpeg_blocks.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <iterator>
#include <mutex>
#include <numeric>

#include "octree/image/jpeg_library.h"

namespace vcp {

namespace {

/// Writes blocks for libjpeg. No object with a destructor lives in its member functions, since errors jump out of
/// libjpeg back into them.
class TileWriter {
public:
    explicit TileWriter(glm::uvec2 size) : size_(size), bytes_(size) { jpeg_.err = &failure_.base; }
    ~TileWriter() { jpeg_destroy_compress(&jpeg_); }
    TileWriter(const TileWriter&) = delete;
    TileWriter& operator=(const TileWriter&) = delete;

    /// Makes room for the blocks of a tile of a picture, and takes them. `corner`: of the tile, in texels.
    bool take(jpeg_decompress_struct& picture, jvirt_barray_ptr* blocks, glm::uvec2 corner) {
        if (setjmp(failure_.back)) return false;
        picture.err = &failure_.base;
        jpeg_create_compress(&jpeg_);
        bytes_.receive(jpeg_);
        jpeg_copy_critical_parameters(&picture, &jpeg_);
        jpeg_.image_width = size_.x;
        jpeg_.image_height = size_.y;
#if JPEG_LIB_VERSION >= 70
        jpeg_.jpeg_width = size_.x;
        jpeg_.jpeg_height = size_.y;
#endif
        jpeg_.optimize_coding = TRUE;
        for (int c = 0; c < picture.num_components; ++c) {
            const jpeg_component_info& from = picture.comp_info[c];
            const auto blocksOf = [](uint32_t texels, int factor, int most) {
                return (texels * uint32_t(factor) + uint32_t(most) * DCTSIZE - 1) / (uint32_t(most) * DCTSIZE);
            };
            const uint32_t width = blocksOf(size_.x, from.h_samp_factor, picture.max_h_samp_factor);
            const uint32_t height = blocksOf(size_.y, from.v_samp_factor, picture.max_v_samp_factor);
            const auto together = uint32_t(from.v_samp_factor);  // rows
            blocks_[c] = jpeg_.mem->request_virt_barray(reinterpret_cast<j_common_ptr>(&jpeg_), JPOOL_IMAGE, TRUE,
                                                        width, (height + together - 1) / together * together, together);
        }
        jpeg_write_coefficients(&jpeg_, blocks_);
        for (int c = 0; c < picture.num_components; ++c) {
            const jpeg_component_info& from = picture.comp_info[c];
            const glm::uvec2 first(
                corner.x * uint32_t(from.h_samp_factor) / uint32_t(picture.max_h_samp_factor * DCTSIZE),
                corner.y * uint32_t(from.v_samp_factor) / uint32_t(picture.max_v_samp_factor * DCTSIZE));
            const jpeg_component_info& to = jpeg_.comp_info[c];
            for (uint32_t y = 0; y < to.height_in_blocks; ++y) {
                const JBLOCKROW source = picture.mem->access_virt_barray(reinterpret_cast<j_common_ptr>(&picture),
                                                                         blocks[c], first.y + y, 1, FALSE)[0];
                const JBLOCKROW target =
                    jpeg_.mem->access_virt_barray(reinterpret_cast<j_common_ptr>(&jpeg_), blocks_[c], y, 1, TRUE)[0];
                std::memcpy(target, source + first.x, to.width_in_blocks * sizeof(JBLOCK));
            }
        }
        return true;
    }

    bool write() {
        if (setjmp(failure_.back)) return false;
        jpeg_finish_compress(&jpeg_);
        return true;
    }

    [[nodiscard]] std::vector<std::byte> bytes() const { return bytes_.written(); }

private:
    glm::uvec2 size_;
    JpegBytes bytes_;
    jpeg_compress_struct jpeg_{};
    JpegFailure failure_;
    jvirt_barray_ptr blocks_[MAX_COMPONENTS] = {};
};

/// Returns the sum of a table's steps.
uint32_t stepsOf(const JQUANT_TBL& table) {
    return std::accumulate(std::begin(table.quantval), std::end(table.quantval), uint32_t{0});
}

/// Returns the highest quality whose steps of light are no smaller.
int qualityOf(uint32_t steps) {
    jpeg_compress_struct jpeg{};
    JpegFailure failure;
    jpeg.err = &failure.base;
    if (setjmp(failure.back)) {
        jpeg_destroy_compress(&jpeg);
        return 1;
    }
    jpeg_create_compress(&jpeg);
    int quality = 100;
    for (; quality > 1; --quality) {
        jpeg_set_quality(&jpeg, quality, TRUE);
        if (stepsOf(*jpeg.quant_tbl_ptrs[0]) >= steps) break;
    }
    jpeg_destroy_compress(&jpeg);
    return quality;
}

class Blocks final : public JpegBlocks {
public:
    Blocks() { jpeg_.err = &failure_.base; }
    ~Blocks() override { jpeg_destroy_decompress(&jpeg_); }

    /// Returns whether it has the blocks.
    bool read(const std::string& file) {
        if (setjmp(failure_.back)) return false;
        jpeg_create_decompress(&jpeg_);
        jpeg_.mem->max_memory_to_use = 0;  // whatever the environment says
        jpeg_mem_src(&jpeg_, reinterpret_cast<const unsigned char*>(file.data()),
                     static_cast<unsigned long>(file.size()));
        jpeg_read_header(&jpeg_, TRUE);
        if (!canBeCut()) return false;
        blocks_ = jpeg_read_coefficients(&jpeg_);
        if (!isComplete() || jpeg_.comp_info[0].quant_table == nullptr) return false;
        quality_ = qualityOf(stepsOf(*jpeg_.comp_info[0].quant_table));
        return true;
    }

    [[nodiscard]] int quality() const override { return quality_; }

    [[nodiscard]] std::vector<std::byte> tile(const ImageLevel& level, glm::uvec2 tile) const override {
        assert(level.width == jpeg_.image_width && level.height == jpeg_.image_height);
        const glm::uvec2 size = level.sizeOf(tile);
        // A decoder does not blend halved colours where there are so few columns.
        if (size.x <= 4 && size.x < level.width) return {};
        TileWriter writer(size);
        {
            // libjpeg notes what was asked for, and whom to tell of errors.
            const std::scoped_lock lock(mutex_);
            const bool isTaken = writer.take(jpeg_, blocks_, tile * level.tileEdge);
            jpeg_.err = &failure_.base;
            if (!isTaken) return {};
        }
        return writer.write() ? writer.bytes() : std::vector<std::byte>();
    }

private:
    /// Whether tiles begin at whole blocks, and their colours are what tiles have (unpackJpeg()).
    [[nodiscard]] bool canBeCut() const {
        if (jpeg_.jpeg_color_space != JCS_YCbCr && jpeg_.jpeg_color_space != JCS_GRAYSCALE) return false;
        const auto suits = [](int factor, int most) {
            return factor == most || factor * 2 == most || factor * 4 == most;
        };
        for (int c = 0; c < jpeg_.num_components; ++c) {
            const jpeg_component_info& info = jpeg_.comp_info[c];
            if (!suits(info.h_samp_factor, mostOf(&jpeg_component_info::h_samp_factor)) ||
                !suits(info.v_samp_factor, mostOf(&jpeg_component_info::v_samp_factor)))
                return false;
        }
        return true;
    }
    /// The largest factor of the components; libjpeg says it only once it has begun to decode.
    [[nodiscard]] int mostOf(int jpeg_component_info::*factor) const {
        int most = 1;
        for (int c = 0; c < jpeg_.num_components; ++c) most = std::max(most, jpeg_.comp_info[c].*factor);
        return most;
    }
    /// Whether all bits of all coefficients came. What lacks some is smoothed where it is decoded as a whole.
    [[nodiscard]] bool isComplete() const {
        if (jpeg_.coef_bits == nullptr) return true;
        for (int c = 0; c < jpeg_.num_components; ++c)
            if (!std::all_of(jpeg_.coef_bits[c], jpeg_.coef_bits[c] + DCTSIZE2, [](int bits) { return bits == 0; }))
                return false;
        return true;
    }

    mutable jpeg_decompress_struct jpeg_{};
    mutable JpegFailure failure_;
    mutable std::mutex mutex_;
    jvirt_barray_ptr* blocks_ = nullptr;
    int quality_ = 0;
};

}  // namespace

std::unique_ptr<JpegBlocks> JpegBlocks::read(const std::string& file) {
    if (!file.starts_with("\xFF\xD8")) return nullptr;
    auto blocks = std::make_unique<Blocks>();
    if (!blocks->read(file)) return nullptr;
    return blocks;
}

}  // namespace vcp
