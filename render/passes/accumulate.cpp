#include "render/passes/accumulate.h"

#include "render/accumulate_spirv.h"

namespace vcp {

Result<void> SampleSums::resize(Device& device, PictureSize size) {
    if (size == size_) return {};
    constexpr uint64_t kBytesPerPixel = 16;
    const uint64_t bytes = size.pixels() * kBytesPerPixel, most = device.limits().maxStorageBufferRange;
    if (bytes > most)
        return Error{.code = ErrorCode::Limit,
                     .message = "'" + device.info().name + "' can add samples to pictures of at most " +
                                std::to_string(most / kBytesPerPixel) + " pixels"};
    *this = {};
    VCP_TRY_ASSIGN(buffer_, device.createBuffer(bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::Local));
    size_ = size;
    return {};
}

AccumulatePass::AccumulatePass() : pipelines_(kAccumulateSpirv) {}

Result<void> AccumulatePass::prepare(FrameResources& resources, const PassConstants& constants) {
    PassConstants plain = constants;
    plain.colour = plain.countSteps = plain.falseColour = plain.seams = false;
    return pipelines_.choose(resources, plain);
}

void AccumulatePass::record(VkCommandBuffer commands, const FrameResources& resources, uint32_t rows) const {
    barrierToAll(commands);
    resources.bind(commands);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.current());
    vkCmdDispatch(commands, (resources.size().width + 7) / 8, (rows + 7) / 8, 1);
    barrierComputeToReadback(commands);
}

}  // namespace vcp
