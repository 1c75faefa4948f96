#include "builder/texture/jpeg_blocks.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <iterator>
#include <numeric>

namespace vcp {

namespace {

// Rows of blocks of all components, as they come together, that a decoder may be ahead of the texels that it gives.
constexpr uint32_t kRowsAhead = 2;

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

}  // namespace

int JpegBlocks::mostOf(int jpeg_component_info::*factor) const {
    // libjpeg says it only once it has begun to decode.
    int most = 1;
    for (int c = 0; c < jpeg_->num_components; ++c) most = std::max(most, jpeg_->comp_info[c].*factor);
    return most;
}

JDIMENSION JpegBlocks::rowsOf(int component) const {
    const jpeg_component_info& info = jpeg_->comp_info[component];
    const auto together = JDIMENSION(info.v_samp_factor);
    const JDIMENSION all = (info.height_in_blocks + together - 1) / together * together;
    if (jpeg_has_multiple_scans(jpeg_)) return all;
    const uint32_t ofTiles = kLargeTileEdge / uint32_t(mostOf(&jpeg_component_info::v_samp_factor) * DCTSIZE);
    return std::min(all, (ofTiles + kRowsAhead) * together);
}

void JpegBlocks::keep(jpeg_decompress_struct& jpeg) {
    jpeg_ = &jpeg;
    jpeg.client_data = this;
    jpeg.mem->request_virt_barray = request;
    jpeg.mem->access_virt_barray = access;
}

uint64_t JpegBlocks::bytes() const {
    uint64_t blocks = 0;
    for (int c = 0; c < jpeg_->num_components; ++c) {
        const jpeg_component_info& info = jpeg_->comp_info[c];
        blocks += (uint64_t{info.width_in_blocks} + uint64_t(info.h_samp_factor)) * rowsOf(c);
    }
    return blocks * sizeof(JBLOCK);
}

// Both functions are called by libjpeg, and leave by a jump where there is no memory.

jvirt_barray_ptr JpegBlocks::request(j_common_ptr info, int pool, boolean, JDIMENSION width, JDIMENSION height,
                                     JDIMENSION) {
    auto* const blocks = static_cast<JpegBlocks*>(info->client_data);
    // libjpeg asks for those of each component in turn, as it has them.
    const int number = blocks->requested_++ % MAX_COMPONENTS;
    Ring& ring = blocks->rings_[size_t(number)];
    ring.count = std::min(height, blocks->rowsOf(std::min(number, blocks->jpeg_->num_components - 1)));
    ring.width = width;
    ring.rows = info->mem->alloc_barray(info, pool, width, ring.count);
    for (JDIMENSION row = 0; row < ring.count; ++row) std::memset(ring.rows[row], 0, width * sizeof(JBLOCK));
    return reinterpret_cast<jvirt_barray_ptr>(&ring);
}

JBLOCKARRAY JpegBlocks::access(j_common_ptr, jvirt_barray_ptr blocks, JDIMENSION first, JDIMENSION count,
                               boolean isWritten) {
    Ring& ring = *reinterpret_cast<Ring*>(blocks);
    // Decoders of one scan rely on zeros in rows that are new to them.
    for (; isWritten && ring.end < first + count; ++ring.end)
        if (ring.end >= ring.count) std::memset(ring.rows[ring.end % ring.count], 0, ring.width * sizeof(JBLOCK));
    return ring.rows + first % ring.count;
}

bool JpegBlocks::canBeCut() const {
    if (jpeg_->jpeg_color_space != JCS_YCbCr && jpeg_->jpeg_color_space != JCS_GRAYSCALE) return false;
    const auto suits = [](int factor, int most) { return factor == most || factor * 2 == most || factor * 4 == most; };
    for (int c = 0; c < jpeg_->num_components; ++c) {
        const jpeg_component_info& info = jpeg_->comp_info[c];
        if (!suits(info.h_samp_factor, mostOf(&jpeg_component_info::h_samp_factor)) ||
            !suits(info.v_samp_factor, mostOf(&jpeg_component_info::v_samp_factor)))
            return false;
    }
    return true;
}

bool JpegBlocks::isComplete() const {
    if (jpeg_->comp_info[0].quant_table == nullptr) return false;
    if (jpeg_->coef_bits == nullptr) return true;
    for (int c = 0; c < jpeg_->num_components; ++c)
        if (!std::all_of(jpeg_->coef_bits[c], jpeg_->coef_bits[c] + DCTSIZE2, [](int bits) { return bits == 0; }))
            return false;
    return true;
}

int JpegBlocks::quality() const { return qualityOf(stepsOf(*jpeg_->comp_info[0].quant_table)); }

// No object with a destructor lives in the next two functions, since errors jump out of libjpeg back into them.

bool JpegBlocks::takeTile(jpeg_compress_struct& tile, jvirt_barray_ptr* blocks, glm::uvec2 corner,
                          glm::uvec2 size) const {
    jpeg_copy_critical_parameters(jpeg_, &tile);
    tile.image_width = size.x;
    tile.image_height = size.y;
#if JPEG_LIB_VERSION >= 70
    tile.jpeg_width = size.x;
    tile.jpeg_height = size.y;
#endif
    tile.optimize_coding = TRUE;
    for (int c = 0; c < jpeg_->num_components; ++c) {
        const jpeg_component_info& from = jpeg_->comp_info[c];
        const auto blocksOf = [](uint32_t texels, int factor, int most) {
            return (texels * uint32_t(factor) + uint32_t(most) * DCTSIZE - 1) / (uint32_t(most) * DCTSIZE);
        };
        const uint32_t width = blocksOf(size.x, from.h_samp_factor, jpeg_->max_h_samp_factor);
        const uint32_t height = blocksOf(size.y, from.v_samp_factor, jpeg_->max_v_samp_factor);
        const auto together = uint32_t(from.v_samp_factor);  // rows
        blocks[c] = tile.mem->request_virt_barray(reinterpret_cast<j_common_ptr>(&tile), JPOOL_IMAGE, TRUE, width,
                                                  (height + together - 1) / together * together, together);
    }
    jpeg_write_coefficients(&tile, blocks);
    for (int c = 0; c < jpeg_->num_components; ++c) {
        const jpeg_component_info& from = jpeg_->comp_info[c];
        const glm::uvec2 first(corner.x * uint32_t(from.h_samp_factor) / uint32_t(jpeg_->max_h_samp_factor * DCTSIZE),
                               corner.y * uint32_t(from.v_samp_factor) / uint32_t(jpeg_->max_v_samp_factor * DCTSIZE));
        const jpeg_component_info& to = tile.comp_info[c];
        const Ring& ring = rings_[size_t(c)];
        if (first.y + to.height_in_blocks > ring.end || ring.end > first.y + ring.count) return false;
        for (uint32_t y = 0; y < to.height_in_blocks; ++y) {
            const JBLOCKROW target =
                tile.mem->access_virt_barray(reinterpret_cast<j_common_ptr>(&tile), blocks[c], y, 1, TRUE)[0];
            std::memcpy(target, ring.rows[(first.y + y) % ring.count] + first.x, to.width_in_blocks * sizeof(JBLOCK));
        }
    }
    return true;
}

namespace {

/// What writes a tile; its destructor frees libjpeg's memory.
struct TileJpeg {
    explicit TileJpeg(glm::uvec2 size) : bytes(size) { jpeg.err = &failure.base; }
    ~TileJpeg() { jpeg_destroy_compress(&jpeg); }
    TileJpeg(const TileJpeg&) = delete;
    TileJpeg& operator=(const TileJpeg&) = delete;

    /// `take` gives it blocks. Returns whether it was written.
    template <class Take>
    bool write(const Take& take) {
        if (setjmp(failure.back)) return false;
        jpeg_create_compress(&jpeg);
        bytes.receive(jpeg);
        if (!take(jpeg, blocks)) return false;
        jpeg_finish_compress(&jpeg);
        return true;
    }

    JpegBytes bytes;
    jpeg_compress_struct jpeg{};
    JpegFailure failure;
    jvirt_barray_ptr blocks[MAX_COMPONENTS] = {};
};

}  // namespace

std::vector<std::byte> JpegBlocks::tile(const ImageLevel& level, glm::uvec2 tile) const {
    assert(level.width == jpeg_->image_width && level.height == jpeg_->image_height);
    const glm::uvec2 size = level.sizeOf(tile);
    // A decoder does not blend halved colours where there are so few columns.
    if (size.x <= 4 && size.x < level.width) return {};
    TileJpeg written(size);
    const bool isWritten = written.write([&](jpeg_compress_struct& jpeg, jvirt_barray_ptr* blocks) {
        return takeTile(jpeg, blocks, tile * level.tileEdge, size);
    });
    return isWritten ? written.bytes.written() : std::vector<std::byte>();
}

}  // namespace vcp
