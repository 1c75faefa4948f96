#include "render/passes/frame_resources.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <utility>
#include <vector>

#include "render/passes/descriptor_types.h"
#include "render/vulkan/check.h"

namespace vcp {

namespace {

struct Binding {
    VkDescriptorType type;
    uint32_t count;
};
constexpr Binding kBindings[] = {
    {kUniform, 1},
    {kTexels, frame::kMaxPoolChunks},
    {kStorage, frame::kMaxPoolChunks},
    {kTexels, frame::kMaxPoolChunks},
    {kStorage, frame::kMaxPoolChunks},
    {kTexels, 1},
    {kStorage, 1},
    {kStorage, 1},
    {kTexels, 1},
    {kStorage, 1},
    {kTexels, 1},
    {kStorage, 1},
    {kTexels, 1},
    {kStorage, 1},
    {kStorage, 1},
    {kStorage, 1},
    {kStorage, 1},
    {kStorage, 1},
    {kStorage, 1},
    {kStorage, 1},
    {kStorage, 1},
    {kStorage, 1},
};
constexpr uint32_t kBindingCount = std::size(kBindings);

// Word of the tile list's header that counts the tiles (frame_layout.h).
constexpr uint64_t kListedTilesWord = 3;

}  // namespace

Result<std::unique_ptr<FrameResources>> FrameResources::create(Device& device) {
    std::unique_ptr<FrameResources> made(new FrameResources(device));
    VCP_TRY(made->createLayout());
    VCP_TRY_ASSIGN(
        made->constants_,
        device.createBuffer(sizeof(frame::FrameConstants),
                            VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Local));
    VCP_TRY_ASSIGN(made->counters_,
                   device.createBuffer(sizeof(frame::FrameCounters),
                                       VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                                           VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                       MemoryUse::Local));
    VCP_TRY_ASSIGN(made->counted_,
                   device.createBuffer(sizeof(FrameCounts), VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Readback));
    VCP_TRY_ASSIGN(made->none_, made->wordBuffer(16, 0, VK_FORMAT_R32G32B32A32_UINT));
    const frame::TableRecord empty[1] = {};
    VCP_TRY(made->setTable(empty));
    return made;
}

Result<void> FrameResources::createLayout() {
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    std::vector<VkDescriptorPoolSize> sizes;
    for (uint32_t i = 0; i < kBindingCount; ++i) {
        bindings.push_back({i, kBindings[i].type, kBindings[i].count, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
        sizes.push_back({kBindings[i].type, kBindings[i].count});
    }
    VkDescriptorSetLayoutCreateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    set.bindingCount = kBindingCount;
    set.pBindings = bindings.data();
    VCP_VK(vkCreateDescriptorSetLayout, device_.handle(), &set, nullptr, &setLayout_);
    VkPipelineLayoutCreateInfo layout{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    layout.setLayoutCount = 1;
    layout.pSetLayouts = &setLayout_;
    const VkPushConstantRange ray{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(frame::SceneRay)};
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &ray;
    VCP_VK(vkCreatePipelineLayout, device_.handle(), &layout, nullptr, &layout_);
    VkDescriptorPoolCreateInfo pool{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    pool.maxSets = 1;
    pool.poolSizeCount = uint32_t(sizes.size());
    pool.pPoolSizes = sizes.data();
    VCP_VK(vkCreateDescriptorPool, device_.handle(), &pool, nullptr, &descriptorPool_);
    VkDescriptorSetAllocateInfo allocation{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
    allocation.descriptorPool = descriptorPool_;
    allocation.descriptorSetCount = 1;
    allocation.pSetLayouts = &setLayout_;
    VCP_VK(vkAllocateDescriptorSets, device_.handle(), &allocation, &set_);
    return {};
}

FrameResources::~FrameResources() {
    vkDestroyDescriptorPool(device_.handle(), descriptorPool_, nullptr);
    vkDestroyPipelineLayout(device_.handle(), layout_, nullptr);
    vkDestroyDescriptorSetLayout(device_.handle(), setLayout_, nullptr);
}

Result<WordBuffer> FrameResources::wordBuffer(uint64_t words, VkBufferUsageFlags more, VkFormat format) const {
    WordBuffer made;
    VCP_TRY_ASSIGN(auto buffer,
                   device_.createBuffer(
                       words * 4, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | more,
                       MemoryUse::Local));
    made.buffer = std::move(buffer);
    // A device of shorter texel buffers reads the storage buffer.
    const uint64_t viewed = std::min<uint64_t>(words, device_.limits().maxTexelBufferElements);
    VCP_TRY_ASSIGN(made.view, device_.createTexelView(made.buffer, format, viewed * 4));
    return made;
}

Result<void> FrameResources::resize(PictureSize size, uint32_t hitPlanes) {
    if (size == size_ && hitPlanes <= hitPlanes_) return {};
    const uint64_t tiles = uint64_t{size.tilesX()} * size.tilesY();
    VCP_TRY_ASSIGN(auto starts, wordBuffer(tiles, VK_BUFFER_USAGE_TRANSFER_SRC_BIT));
    VCP_TRY_ASSIGN(auto list, wordBuffer(frame::kTileListHeader + tiles, VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                                                                             VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                                                                             VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT));
    VCP_TRY_ASSIGN(auto hits, wordBuffer(size.pixels() * hitPlanes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT));
    VCP_TRY_ASSIGN(auto picture,
                   device_.createBuffer(size.pixels() * 4,
                                        VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                                            VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                        MemoryUse::Local));
    VCP_TRY_ASSIGN(background_,
                   device_.createBuffer(size.pixels() * 4, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryUse::Upload));
    backgroundRows_.clear();
    tileStarts_ = std::move(starts);
    tileList_ = std::move(list);
    hits_ = std::move(hits);
    picture_ = std::move(picture);
    size_ = size;
    hitPlanes_ = hitPlanes;
    setStale_ = true;
    return {};
}

void FrameResources::setBackground(std::vector<uint32_t> rows) {
    if (rows == backgroundRows_) return;
    auto* words = reinterpret_cast<uint32_t*>(background_.mapped());
    for (const uint32_t row : rows) words = std::fill_n(words, size_.width, row);
    backgroundRows_ = std::move(rows);
}

Result<void> FrameResources::setTable(std::span<const frame::TableRecord> table) {
    if (table_.buffer.bytes() < table.size_bytes()) {
        const uint64_t words = std::bit_ceil(std::max<uint64_t>(table.size_bytes() / 4, 1024));
        VCP_TRY_ASSIGN(table_, wordBuffer(words, VK_BUFFER_USAGE_TRANSFER_DST_BIT, VK_FORMAT_R32G32B32A32_UINT));
        setStale_ = true;
    }
    if (std::byte* mapped = table_.buffer.mapped()) {
        std::memcpy(mapped, table.data(), table.size_bytes());
        return {};
    }
    if (tableUpload_.bytes() < table.size_bytes()) {
        VCP_TRY_ASSIGN(tableUpload_, device_.createBuffer(table_.buffer.bytes(), VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                                          MemoryUse::Upload));
    }
    std::memcpy(tableUpload_.mapped(), table.data(), table.size_bytes());
    tableToCopy_ = table.size_bytes();
    return {};
}

void FrameResources::setPools(const PagePool* pages, const PagePool* colours) {
    pages_ = pages;
    colours_ = colours;
    setStale_ = true;
}

void FrameResources::setImages(const Buffer* images) {
    if (std::exchange(images_, images) != images) setStale_ = true;
}

void FrameResources::setFeedback(const Buffer* feedback) {
    if (feedback_ == feedback && feedbackHandle_ == feedback->handle()) return;
    feedback_ = feedback;
    feedbackHandle_ = feedback->handle();
    setStale_ = true;
}

void FrameResources::setTarget(const Buffer* picture, const Buffer* depths, const Buffer* light) {
    std::array<VkBuffer, 3> handles{};
    const Buffer* const buffers[] = {picture, depths, light};
    for (size_t i = 0; i < handles.size(); ++i)
        if (buffers[i] != nullptr) handles[i] = buffers[i]->handle();
    targetPicture_ = picture;
    targetDepths_ = depths;
    targetLight_ = light;
    if (std::exchange(targetHandles_, handles) != handles) setStale_ = true;
}

void FrameResources::setSums(const Buffer& sums, const Buffer& shown) {
    sums_ = &sums;
    shown_ = &shown;
    // Another buffer may have the handle of one that is gone.
    setStale_ = true;
}

void FrameResources::writeSet() {
    VkDescriptorBufferInfo buffers[kBindingCount][frame::kMaxPoolChunks] = {};
    VkBufferView views[kBindingCount][frame::kMaxPoolChunks] = {};
    const auto useBuffer = [&](uint32_t binding, uint32_t i, const Buffer& buffer) {
        buffers[binding][i] = {buffer.handle(), 0,
                               std::min<uint64_t>(buffer.bytes(), device_.limits().maxStorageBufferRange)};
    };
    const auto usePool = [&](uint32_t binding, const PagePool* pool) {
        for (uint32_t i = 0; i < frame::kMaxPoolChunks; ++i) {
            // Every element must be valid; those past the last chunk are never read.
            const uint32_t chunk = pool != nullptr ? std::min(i, pool->chunks() - 1) : 0;
            views[binding][i] = pool != nullptr ? pool->view(chunk) : none_.view.handle();
            useBuffer(binding + 1, i, pool != nullptr ? pool->chunk(chunk) : none_.buffer);
        }
    };
    useBuffer(0, 0, constants_);
    usePool(1, pages_);
    usePool(3, colours_);
    views[5][0] = table_.view.handle();
    useBuffer(6, 0, table_.buffer);
    useBuffer(7, 0, tileStarts_.buffer);
    views[8][0] = tileStarts_.view.handle();
    useBuffer(9, 0, tileList_.buffer);
    views[10][0] = tileList_.view.handle();
    useBuffer(11, 0, hits_.buffer);
    views[12][0] = hits_.view.handle();
    useBuffer(13, 0, picture_);
    useBuffer(14, 0, counters_);
    useBuffer(15, 0, feedback_ != nullptr ? *feedback_ : none_.buffer);
    useBuffer(16, 0, targetPicture_ != nullptr ? *targetPicture_ : none_.buffer);
    useBuffer(17, 0, targetDepths_ != nullptr ? *targetDepths_ : none_.buffer);
    useBuffer(18, 0, sums_ != nullptr ? *sums_ : none_.buffer);
    useBuffer(19, 0, shown_ != nullptr ? *shown_ : none_.buffer);
    useBuffer(20, 0, targetLight_ != nullptr ? *targetLight_ : none_.buffer);
    useBuffer(21, 0, images_ != nullptr ? *images_ : none_.buffer);

    VkWriteDescriptorSet writes[kBindingCount];
    for (uint32_t i = 0; i < kBindingCount; ++i) {
        writes[i] = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        writes[i].dstSet = set_;
        writes[i].dstBinding = i;
        writes[i].descriptorCount = kBindings[i].count;
        writes[i].descriptorType = kBindings[i].type;
        writes[i].pBufferInfo = buffers[i];
        writes[i].pTexelBufferView = views[i];
    }
    vkUpdateDescriptorSets(device_.handle(), kBindingCount, writes, 0, nullptr);
    setStale_ = false;
}

void FrameResources::begin(VkCommandBuffer commands, const frame::FrameConstants& constants) {
    if (setStale_) writeSet();
    vkCmdUpdateBuffer(commands, constants_.handle(), 0, sizeof(constants), &constants);
    if (tableToCopy_ > 0) {
        const VkBufferCopy table{0, 0, std::exchange(tableToCopy_, 0)};
        vkCmdCopyBuffer(commands, tableUpload_.handle(), table_.buffer.handle(), 1, &table);
    }
    const VkBufferCopy whole{0, 0, picture_.bytes()};
    vkCmdCopyBuffer(commands, background_.handle(), picture_.handle(), 1, &whole);
    vkCmdFillBuffer(commands, counters_.handle(), 0, VK_WHOLE_SIZE, 0);
    const uint32_t list[frame::kTileListHeader] = {frame::kTileRow, 0, 1, 0};
    vkCmdUpdateBuffer(commands, tileList_.buffer.handle(), 0, sizeof(list), list);
    barrierToAll(commands);
    bind(commands);
}

void FrameResources::bind(VkCommandBuffer commands) const {
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_, 0, 1, &set_, 0, nullptr);
}

void FrameResources::dispatchTiles(VkCommandBuffer commands, TileRange tiles) const {
    if (tiles.count == 0)
        vkCmdDispatchIndirect(commands, tileList().handle(), 0);
    else
        dispatchAnyTiles(commands, tiles);
}

void FrameResources::dispatchAnyTiles(VkCommandBuffer commands, TileRange tiles) const {
    const uint32_t row = tiles.first / frame::kTileRow, column = tiles.first % frame::kTileRow;
    const uint32_t all = size_.tilesX() * size_.tilesY();
    if (tiles.count == 0)
        vkCmdDispatch(commands, frame::kTileRow, (all + frame::kTileRow - 1) / frame::kTileRow, 1);
    else if (tiles.count < frame::kTileRow)
        vkCmdDispatchBase(commands, column, row, 0, tiles.count, 1, 1);
    else
        vkCmdDispatchBase(commands, 0, row, 0, frame::kTileRow, tiles.count / frame::kTileRow, 1);
}

void FrameResources::recordListedTiles(VkCommandBuffer commands) const {
    barrierComputeToReadback(commands);
    const VkBufferCopy listed{kListedTilesWord * 4, offsetof(FrameCounts, listedTiles), 4};
    vkCmdCopyBuffer(commands, tileList_.buffer.handle(), counted_.handle(), 1, &listed);
    barrierTransferToHost(commands);
}

void FrameResources::recordReadback(VkCommandBuffer commands, const std::optional<PicturePixel>& cursor) const {
    const VkBufferCopy counters{0, offsetof(FrameCounts, counters), sizeof(frame::FrameCounters)};
    vkCmdCopyBuffer(commands, counters_.handle(), counted_.handle(), 1, &counters);
    const VkBufferCopy listed{kListedTilesWord * 4, offsetof(FrameCounts, listedTiles), 4};
    vkCmdCopyBuffer(commands, tileList_.buffer.handle(), counted_.handle(), 1, &listed);
    if (cursor) {
        const uint64_t tile = uint64_t{cursor->y / frame::kTileSize} * size_.tilesX() + cursor->x / frame::kTileSize;
        const VkBufferCopy start{tile * 4, offsetof(FrameCounts, cursor.tileStart), 4};
        vkCmdCopyBuffer(commands, tileStarts_.buffer.handle(), counted_.handle(), 1, &start);
        const uint64_t at = uint64_t{cursor->y} * size_.width + cursor->x;
        const VkBufferCopy hit[] = {{at * 4, offsetof(FrameCounts, cursor.depth), 4},
                                    {(size_.pixels() + at) * 4, offsetof(FrameCounts, cursor.normal), 4}};
        vkCmdCopyBuffer(commands, hits_.buffer.handle(), counted_.handle(), 2, hit);
    }
    barrierTransferToHost(commands);
}

FrameCounts FrameResources::counts() const {
    FrameCounts counts;
    std::memcpy(&counts, counted_.mapped(), sizeof counts);
    return counts;
}

Result<ComputePipeline> FrameResources::pipeline(std::span<const uint32_t> spirv, std::span<const uint32_t> constants) {
    ++pipelinesMade_;
    return ComputePipeline::create(device_, layout_, spirv, constants);
}

Result<void> PipelineVariants::choose(FrameResources& resources, const PassConstants& c,
                                      std::initializer_list<uint32_t> more) {
    std::vector<uint32_t> values{
        c.access == PageAccess::TexelBuffer,
        c.poolChunks,
        c.chunkShift,
        uint32_t(c.colour) + uint32_t(c.colour && c.images) + uint32_t(c.colour && c.images && c.channels),
        c.countSteps,
        c.falseColour,
        c.seams};
    values.insert(values.end(), more.begin(), more.end());
    ComputePipeline& variant = variants_[values];
    if (variant.handle() == VK_NULL_HANDLE) {
        VCP_TRY_ASSIGN(variant, resources.pipeline(spirv_, values));
    }
    current_ = variant.handle();
    return {};
}

}  // namespace vcp
