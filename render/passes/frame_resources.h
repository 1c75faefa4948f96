// What the passes share: the descriptor set, its layout, and the buffers that depend on the picture's size.
//
// binding   what                           written by        read by
//  0        frame constants                CPU (upload)      all
//  1, 2     page pool, texels and storage  page_pool         beam, trace, light
//  3, 4     page pool, for colour          page_pool         trace with kColour
//  5, 6     page table                     CPU (upload)      beam, trace, light, feedback
//  7, 8     tile starts                    beam              trace, shade
//  9, 10    tile list, indirect dispatch   beam              trace, light, shade
// 11, 12    hits                           trace, light      light, shade, readback
// 13        picture                        begin, shade      accumulate, readback, present
// 14        counters                       trace             readback
// 15        feedback (passes/feedback.h)   feedback          readback
// 16, 17    picture and depths of all      compose           readback, present
//           datasets (passes/compose.h)
// 18, 19    sums of samples, and picture   accumulate        accumulate, readback, present
//           of their mean
// 20        normals, lifts and light of   compose,           scene light, shade
//           all datasets                  scene light
// 21        images (pages/image_words.h)  CPU (upload)       trace with images
#pragma once

#include <array>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "render/frame_result.h"
#include "render/page_pool.h"
#include "render/shared/frame.h"
#include "render/vulkan/compute_pipeline.h"
#include "render/vulkan/device.h"

namespace vcp {

struct PictureSize {
    uint32_t width = 0, height = 0;
    bool operator==(const PictureSize&) const = default;
    [[nodiscard]] uint64_t pixels() const { return uint64_t{width} * height; }
    [[nodiscard]] uint32_t tilesX() const { return (width + frame::kTileSize - 1) / frame::kTileSize; }
    [[nodiscard]] uint32_t tilesY() const { return (height + frame::kTileSize - 1) / frame::kTileSize; }
};

/// Values of the specialization constants that all passes have (bindings.glsl).
struct PassConstants {
    PageAccess access = PageAccess::TexelBuffer;
    uint32_t poolChunks = 1, chunkShift = 26;
    bool colour = false, images = false, channels = false, countSteps = false, falseColour = false;
    bool seams = false;  ///< pages of different levels may leave gaps between them
    bool operator==(const PassConstants&) const = default;
};

class FrameResources;

/// The pipelines of one shader, one for each choice of its specialization constants, made on first use.
class PipelineVariants {
public:
    explicit PipelineVariants(std::span<const uint32_t> spirv) : spirv_(spirv) {}
    /// Makes a variant the current one. `more`: values of the constants that only this shader has. Errors: Device.
    Result<void> choose(FrameResources& resources, const PassConstants& constants,
                        std::initializer_list<uint32_t> more = {});
    /// Precondition: choose().
    [[nodiscard]] VkPipeline current() const { return current_; }
    /// Forgets all variants, before pools with another layout come.
    void clear() { variants_.clear(); }

private:
    std::span<const uint32_t> spirv_;
    std::map<std::vector<uint32_t>, ComputePipeline> variants_;
    VkPipeline current_ = VK_NULL_HANDLE;
};

/// A buffer that shaders read as 32-bit texels as well.
struct WordBuffer {
    Buffer buffer;
    TexelView view;
};

/// Tiles of the list that one dispatch works on.
struct TileRange {
    uint32_t first = 0;
    uint32_t count = 0;  ///< 0: all there are; else whole rows of kTileRow tiles, or a part of one row
};

/// The words of one pixel's hit: the start distance of its tile, its depth and its normal.
struct HitWords {
    uint32_t tileStart = 0, depth = 0, normal = 0;
};

/// What a frame tells the CPU.
struct FrameCounts {
    frame::FrameCounters counters;
    uint32_t listedTiles = 0;  ///< tiles that the beam pass could not prove empty
    HitWords cursor;           ///< the hit at the pixel that recordReadback() was given
};

/// What one frame of one dataset is drawn with. A frame in flight has resources of its own: nothing here is changed
/// until it has ended.
class FrameResources {
public:
    static Result<std::unique_ptr<FrameResources>> create(Device& device);
    ~FrameResources();
    FrameResources(const FrameResources&) = delete;
    FrameResources& operator=(const FrameResources&) = delete;

    /// Makes the buffers as large as the picture needs. `hitPlanes`: words that a pixel's hit takes. Errors: Device.
    Result<void> resize(PictureSize size, uint32_t hitPlanes);
    /// Sets the table for the frames from the next one on; grows its buffer. Where the CPU does not see the device's
    /// memory, begin() copies it. Errors: Device.
    Result<void> setTable(std::span<const frame::TableRecord> table);
    /// Sets what the picture shows where nothing is hit: a word a row. Precondition: resize(), and a word for each row.
    void setBackground(std::vector<uint32_t> rows);
    /// Sets the pools; both may be the same. Null: nothing is shown, or nothing has colour.
    void setPools(const PagePool* pages, const PagePool* colours);
    /// Sets the images of the dataset (image_buffer.h); null: none are read.
    void setImages(const Buffer* images);
    /// Sets the feedback buffer: not null as long as frames with the feedback pass are drawn.
    void setFeedback(const Buffer* feedback);

    /// Sets what the pictures of several datasets are composed into, or null. `light`: null where datasets do not shade
    /// each other.
    void setTarget(const Buffer* picture, const Buffer* depths, const Buffer* light);

    /// Sets what the picture of the next frame is added to (passes/accumulate.h).
    void setSums(const Buffer& sums, const Buffer& shown);

    /// Copies the constants, clears counters, tile list and picture, binds the set. Comes after barrierToAll, and ends
    /// with it.
    void begin(VkCommandBuffer commands, const frame::FrameConstants& constants);
    /// Binds the set again, after passes with sets of their own.
    void bind(VkCommandBuffer commands) const;
    /// Dispatches a workgroup for each listed tile of the range; beyond the list there is nothing.
    void dispatchTiles(VkCommandBuffer commands, TileRange tiles) const;
    /// Dispatches a workgroup for each tile of the range, of all in the picture; beyond them are some more.
    void dispatchAnyTiles(VkCommandBuffer commands, TileRange tiles) const;

    /// Records the copy of what a frame counted, and of the hit at `cursor`, to where counts() reads it. Comes after
    /// the last pass's barrierComputeToReadback; ends with barrierTransferToHost. Precondition: `cursor` is in the
    /// picture.
    void recordReadback(VkCommandBuffer commands, const std::optional<PicturePixel>& cursor) const;
    /// Records the copy of the number of listed tiles alone, after the beam pass.
    void recordListedTiles(VkCommandBuffer commands) const;
    /// Returns what recordReadback() copied. Precondition: the frame is done.
    [[nodiscard]] FrameCounts counts() const;

    [[nodiscard]] VkPipelineLayout layout() const { return layout_; }
    [[nodiscard]] PictureSize size() const { return size_; }
    [[nodiscard]] const Buffer& hits() const { return hits_.buffer; }
    [[nodiscard]] const Buffer& picture() const { return picture_; }
    [[nodiscard]] const Buffer& tileStarts() const { return tileStarts_.buffer; }
    [[nodiscard]] const Buffer& tileList() const { return tileList_.buffer; }

    /// Makes one pipeline of this layout, and counts it.
    Result<ComputePipeline> pipeline(std::span<const uint32_t> spirv, std::span<const uint32_t> constants);
    [[nodiscard]] uint32_t pipelinesMade() const { return pipelinesMade_; }

private:
    explicit FrameResources(Device& device) : device_(device) {}
    Result<void> createLayout();
    Result<WordBuffer> wordBuffer(uint64_t words, VkBufferUsageFlags more, VkFormat format = VK_FORMAT_R32_UINT) const;
    void writeSet();

    Device& device_;
    VkDescriptorSetLayout setLayout_ = VK_NULL_HANDLE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    VkDescriptorPool descriptorPool_ = VK_NULL_HANDLE;
    VkDescriptorSet set_ = VK_NULL_HANDLE;

    PictureSize size_;
    uint32_t hitPlanes_ = 0;
    Buffer constants_, picture_, counters_;
    Buffer counted_;            // FrameCounts
    Buffer tableUpload_;        // the next frame's table, where the CPU does not see the device's memory
    uint64_t tableToCopy_ = 0;  // bytes
    Buffer background_;         // as large as the picture, copied over it before each frame
    std::vector<uint32_t> backgroundRows_;
    WordBuffer tileStarts_, tileList_, hits_, table_, none_;
    const PagePool* pages_ = nullptr;
    const PagePool* colours_ = nullptr;
    const Buffer* images_ = nullptr;
    const Buffer* feedback_ = nullptr;
    VkBuffer feedbackHandle_ = VK_NULL_HANDLE;  // as of the last call
    const Buffer* targetPicture_ = nullptr;
    const Buffer* targetDepths_ = nullptr;
    const Buffer* targetLight_ = nullptr;
    std::array<VkBuffer, 3> targetHandles_{};  // as of the last call
    const Buffer* sums_ = nullptr;
    const Buffer* shown_ = nullptr;
    bool setStale_ = true;
    uint32_t pipelinesMade_ = 0;
};

}  // namespace vcp
