#include "render/passes/meso_resources.h"

#include <fmt/format.h>

#include "render/passes/descriptor_types.h"
#include "render/vulkan/check.h"

namespace vcp {

namespace {

constexpr VkDescriptorType kMesoBindings[] = {kUniform, kTexels, kTexels,  kTexels,  kStorage, kStorage,
                                              kStorage, kTexels, kStorage, kStorage, kTexels,  kStorage};
constexpr uint32_t kMesoBindingCount = std::size(kMesoBindings);

}  // namespace

Result<std::unique_ptr<MesoResources>> MesoResources::create(Device& device) {
    std::unique_ptr<MesoResources> made(new MesoResources(device));
    VCP_TRY(made->createLayout());
    return made;
}

Result<void> MesoResources::createLayout() {
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (uint32_t i = 0; i < kMesoBindingCount; ++i)
        bindings.push_back({i, kMesoBindings[i], 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
    VkDescriptorSetLayoutCreateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    set.bindingCount = kMesoBindingCount;
    set.pBindings = bindings.data();
    VCP_VK(vkCreateDescriptorSetLayout, device_.handle(), &set, nullptr, &setLayout_);
    VkPipelineLayoutCreateInfo layout{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    layout.setLayoutCount = 1;
    layout.pSetLayouts = &setLayout_;
    const VkPushConstantRange ray{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(frame::MesoLightRay)};
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &ray;
    VCP_VK(vkCreatePipelineLayout, device_.handle(), &layout, nullptr, &layout_);
    return {};
}

MesoResources::~MesoResources() {
    vkDestroyPipelineLayout(device_.handle(), layout_, nullptr);
    vkDestroyDescriptorSetLayout(device_.handle(), setLayout_, nullptr);
}

Result<MesoTexels> MesoResources::words(std::span<const uint32_t> words) {
    if (words.size() > device_.limits().maxTexelBufferElements)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a mesostructure of {} words; this device reads {} at most", words.size(),
                                            device_.limits().maxTexelBufferElements)};
    MesoTexels made;
    const std::span bytes = std::as_bytes(words);
    VCP_TRY_ASSIGN(auto buffer, device_.createFilled({&bytes, 1}, VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT));
    made.buffer = std::move(buffer);
    VCP_TRY_ASSIGN(made.view, device_.createTexelView(made.buffer, VK_FORMAT_R32_UINT, words.size_bytes()));
    VCP_TRY_ASSIGN(made.quads, device_.createTexelView(made.buffer, VK_FORMAT_R32G32B32A32_UINT, words.size_bytes()));
    return made;
}

Result<void> MesoResources::checkTexels(uint64_t count, const char* what) const {
    if (count > device_.limits().maxTexelBufferElements)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("{} texels of {}; this device reads {} at most", count, what,
                                            device_.limits().maxTexelBufferElements)};
    return {};
}

Result<MesoTexels> MesoResources::texels(std::span<const std::byte> bytes, uint32_t texelBytes, VkFormat format,
                                         const char* what) {
    VCP_TRY(checkTexels(bytes.size() / texelBytes, what));
    MesoTexels made;
    VCP_TRY_ASSIGN(auto buffer, device_.createFilled({&bytes, 1}, VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT));
    made.buffer = std::move(buffer);
    VCP_TRY_ASSIGN(made.view, device_.createTexelView(made.buffer, format, bytes.size()));
    return made;
}

Result<MesoTexels> MesoResources::vectors(std::span<const glm::vec4> vectors) {
    return texels(std::as_bytes(vectors), sizeof(glm::vec4), VK_FORMAT_R32G32B32A32_SFLOAT, "rays or of a shell");
}

Result<MesoTexels> MesoResources::halfs(std::span<const uint64_t> halfs) {
    return texels(std::as_bytes(halfs), sizeof(uint64_t), VK_FORMAT_R16G16B16A16_SFLOAT, "textures");
}

Result<MesoTexels> MesoResources::emptyHalfs(uint64_t texels) {
    VCP_TRY(checkTexels(texels, "light over a base"));
    MesoTexels made;
    VCP_TRY_ASSIGN(made.buffer,
                   device_.createBuffer(texels * sizeof(uint64_t),
                                        VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                        MemoryUse::Local));
    VCP_TRY_ASSIGN(made.view,
                   device_.createTexelView(made.buffer, VK_FORMAT_R16G16B16A16_SFLOAT, texels * sizeof(uint64_t)));
    return made;
}

Result<Buffer> MesoResources::storage(uint64_t bytes) const {
    if (bytes > device_.limits().maxStorageBufferRange)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format("{} bytes of hits; this device has {} at most: a smaller picture, or fewer rays",
                                   bytes, device_.limits().maxStorageBufferRange)};
    return device_.createBuffer(
        bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
        MemoryUse::Local);
}

Result<MesoSet> allocateSet(VkDevice device, VkDescriptorSetLayout layout,
                            std::span<const VkDescriptorPoolSize> sizes) {
    VkDescriptorPoolCreateInfo pool{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    pool.maxSets = 1;
    pool.poolSizeCount = uint32_t(sizes.size());
    pool.pPoolSizes = sizes.data();
    VkDescriptorPool made = VK_NULL_HANDLE;
    VCP_VK(vkCreateDescriptorPool, device, &pool, nullptr, &made);
    MesoSet owner(device, made);
    VkDescriptorSetAllocateInfo allocation{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
    allocation.descriptorPool = made;
    allocation.descriptorSetCount = 1;
    allocation.pSetLayouts = &layout;
    VCP_VK(vkAllocateDescriptorSets, device, &allocation, &owner.set);
    return owner;
}

Result<MesoSet> MesoResources::makeSet(const Bound& bound) const {
    const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 1}, {kTexels, 5}, {kStorage, 6}};
    VCP_TRY_ASSIGN(auto owner, allocateSet(device_.handle(), setLayout_, sizes));

    const auto orInput = [&](const MesoTexels* texels) {
        return (texels != nullptr ? texels : bound.input)->view.handle();
    };
    const VkBufferView views[kMesoBindingCount] = {
        VK_NULL_HANDLE,
        orInput(bound.words),
        bound.words != nullptr ? bound.words->quads.handle() : bound.heights->view(),
        bound.input->view.handle(),
        VK_NULL_HANDLE,
        VK_NULL_HANDLE,
        VK_NULL_HANDLE,
        orInput(bound.look),
        VK_NULL_HANDLE,
        VK_NULL_HANDLE,
        orInput(bound.baseLight),
        VK_NULL_HANDLE};
    const auto orUnused = [&](const Buffer* buffer) { return buffer != nullptr ? buffer : bound.counters; };
    const Buffer* const buffers[kMesoBindingCount] = {
        bound.constants,
        nullptr,
        nullptr,
        nullptr,
        bound.hits,
        bound.picture,
        bound.counters,
        nullptr,
        orUnused(bound.sceneLight),
        orUnused(bound.depths),
        nullptr,
        orUnused(bound.heights != nullptr ? &bound.heights->marks() : nullptr)};
    VkDescriptorBufferInfo infos[kMesoBindingCount] = {};
    VkWriteDescriptorSet writes[kMesoBindingCount];
    for (uint32_t i = 0; i < kMesoBindingCount; ++i) {
        if (buffers[i] != nullptr) infos[i] = {buffers[i]->handle(), 0, VK_WHOLE_SIZE};
        writes[i] = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        writes[i].dstSet = owner.set;
        writes[i].dstBinding = i;
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = kMesoBindings[i];
        writes[i].pBufferInfo = &infos[i];
        writes[i].pTexelBufferView = &views[i];
    }
    vkUpdateDescriptorSets(device_.handle(), kMesoBindingCount, writes, 0, nullptr);
    return owner;
}

Result<VkPipeline> MesoResources::pipeline(std::span<const uint32_t> spirv, const std::vector<uint32_t>& constants) {
    const auto key = std::pair(spirv.data(), constants);
    if (const auto found = pipelines_.find(key); found != pipelines_.end()) return found->second.handle();
    VCP_TRY_ASSIGN(auto made, ComputePipeline::create(device_, layout_, spirv, constants));
    return pipelines_.emplace(key, std::move(made)).first->second.handle();
}

}  // namespace vcp
