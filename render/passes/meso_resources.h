// What the mesostructure passes share: one descriptor set layout, its pipelines, and asset buffers
// (shaders/meso_bindings.glsl).
//
// binding   what                          written by              read by
//  0        MesoRecord, MesoView          copies                  all
//  1, 2     words of the asset, as words  CPU (upload)            rays, surface, merge
//           and as fours; or levels of
//           heights, as fours alone
//  3        rays, or the shell; or what   CPU (upload), copies    rays, surface, merge
//           was rasterized
//  4        results, or hits              rays, surface           surface, shade, readback
//  5        picture, of the frame         shade pass, shade       readback, present
//  6        counters                      surface, shade          readback
//  7        appearance, textures          CPU (upload)            surface
//  8, 9     planes of light and depths    gather, scene light,    scene light, shade
//           of the whole picture          surface
// 10        light over the base; or the   copies, CPU (upload)    surface, merge
//           frames of base triangles
// 11        tiles of heights that were    merge                   readback
//           read
//
// Push constants: the ray of light that is cast, MesoLightRay.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "mesostructure/march_arrays.h"
#include "render/height_pool.h"
#include "render/shared/meso_view.h"
#include "render/vulkan/compute_pipeline.h"
#include "render/vulkan/device.h"

namespace vcp {

/// The specialization constants of a pipeline that marches.
inline std::vector<uint32_t> wordsOf(const meso::MarchConstants& c) {
    return {c.walk, c.skip, c.surface, c.refinement};
}

struct MesoConstants {
    meso::f32::MesoRecord record;
    frame::MesoView view;
};

/// A buffer that shaders read as texels of one or two formats.
struct MesoTexels {
    Buffer buffer;
    TexelView view, quads;  ///< `quads` are views of words, which may have nothing else
};

/// A descriptor set with a pool of its own; frees both.
class MesoSet {
public:
    MesoSet() = default;
    MesoSet(VkDevice device, VkDescriptorPool pool) : device_(device), pool_(pool) {}
    MesoSet(MesoSet&& other) noexcept { *this = std::move(other); }
    MesoSet& operator=(MesoSet&& other) noexcept {
        std::swap(device_, other.device_), std::swap(pool_, other.pool_), std::swap(set, other.set);
        return *this;
    }
    ~MesoSet() {
        if (pool_ != VK_NULL_HANDLE) vkDestroyDescriptorPool(device_, pool_, nullptr);
    }
    VkDescriptorSet set = VK_NULL_HANDLE;

private:
    VkDevice device_ = VK_NULL_HANDLE;
    VkDescriptorPool pool_ = VK_NULL_HANDLE;
};

/// Allocates a set from a pool of its own, which has room for `sizes`. Errors: Device.
Result<MesoSet> allocateSet(VkDevice device, VkDescriptorSetLayout layout, std::span<const VkDescriptorPoolSize> sizes);

class MesoResources {
public:
    static Result<std::unique_ptr<MesoResources>> create(Device& device);
    ~MesoResources();
    MesoResources(const MesoResources&) = delete;
    MesoResources& operator=(const MesoResources&) = delete;

    /// Makes texels of words. Errors: Device (no memory); Limit (more texels than the device reads).
    Result<MesoTexels> words(std::span<const uint32_t> words);
    Result<MesoTexels> vectors(std::span<const glm::vec4> vectors);
    Result<MesoTexels> halfs(std::span<const uint64_t> halfs);  ///< four to a texel
    Result<MesoTexels> emptyHalfs(uint64_t texels);             ///< to be filled by copies
    Result<Buffer> storage(uint64_t bytes) const;

    struct Bound {
        const Buffer* constants;
        const MesoTexels* words;  ///< null: there are heights
        const MesoTexels* input;
        const Buffer *hits, *picture, *counters;
        const MesoTexels* look = nullptr;                       ///< null: the shaders read none
        const Buffer *sceneLight = nullptr, *depths = nullptr;  ///< null: surfaces and datasets do not shade each other
        const MesoTexels* baseLight = nullptr;                  ///< null: the shaders read none
        const HeightPool* heights = nullptr;                    ///< in place of words
    };
    /// Makes a descriptor set. Errors: Device.
    Result<MesoSet> makeSet(const Bound& bound) const;

    /// Returns the pipeline of a shader and its constants, made on first use. Errors: Device.
    Result<VkPipeline> pipeline(std::span<const uint32_t> spirv, const std::vector<uint32_t>& constants);
    [[nodiscard]] uint32_t pipelinesMade() const { return uint32_t(pipelines_.size()); }
    [[nodiscard]] VkPipelineLayout layout() const { return layout_; }

private:
    explicit MesoResources(Device& device) : device_(device) {}
    Result<void> createLayout();
    [[nodiscard]] Result<void> checkTexels(uint64_t count, const char* what) const;
    Result<MesoTexels> texels(std::span<const std::byte> bytes, uint32_t texelBytes, VkFormat format, const char* what);

    Device& device_;
    VkDescriptorSetLayout setLayout_ = VK_NULL_HANDLE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    std::map<std::pair<const uint32_t*, std::vector<uint32_t>>, ComputePipeline> pipelines_;
};

}  // namespace vcp
