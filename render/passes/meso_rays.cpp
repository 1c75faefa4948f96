#include "render/passes/meso_rays.h"

#include <bit>

#include "render/meso_rays_spirv.h"
#include "render/passes/readback.h"

namespace vcp {

namespace {

constexpr uint32_t kResultWords = 8, kGroup = 64;

}  // namespace

Result<void> MesoRaysPass::prepare(const meso::MarchArrays& arrays, std::span<const meso::MarchRay> rays) {
    std::vector<glm::vec4> texels;
    for (const meso::MarchRay& given : rays) {
        const meso::f32::MesoRay ray = meso::rayInTile(given, arrays);
        texels.push_back(glm::vec4(ray.o, ray.tMax));
        texels.push_back(glm::vec4(ray.d, ray.atTop ? 1 : 0));
        texels.push_back(glm::vec4(ray.bend, 0, 0, 0));
    }
    count_ = uint32_t(rays.size());
    VCP_TRY_ASSIGN(words_, resources_.words(arrays.words));
    VCP_TRY_ASSIGN(rays_, resources_.vectors(texels));
    VCP_TRY_ASSIGN(results_, resources_.storage(uint64_t{kResultWords} * 4 * count_));
    VCP_TRY_ASSIGN(none_, resources_.storage(16));
    VCP_TRY_ASSIGN(
        auto constants,
        device_.createBuffer(sizeof values_, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                             MemoryUse::Local));
    constants_ = std::move(constants);
    values_.record = arrays.record;
    values_.view.width = count_;
    VCP_TRY_ASSIGN(set_, resources_.makeSet({&constants_, &words_, &rays_, &results_, &none_, &none_}));
    VCP_TRY_ASSIGN(pipeline_, resources_.pipeline(kMesoRaysSpirv, wordsOf(arrays.constants)));
    return {};
}

void MesoRaysPass::record(VkCommandBuffer commands) const {
    vkCmdUpdateBuffer(commands, constants_.handle(), 0, sizeof values_, &values_);
    barrierToAll(commands);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_);
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, resources_.layout(), 0, 1, &set_.set, 0, nullptr);
    vkCmdDispatch(commands, (count_ + kGroup - 1) / kGroup, 1, 1);
    barrierComputeToReadback(commands);
}

Result<std::vector<meso::MarchResult>> MesoRaysPass::read() {
    VCP_TRY_ASSIGN(const auto words, readWords(device_, results_, 0, uint64_t{kResultWords} * count_));
    std::vector<meso::MarchResult> results(count_);
    for (uint32_t i = 0; i < count_; ++i) {
        const uint32_t* w = words.data() + size_t{kResultWords} * i;
        const auto real = [&](int k) { return std::bit_cast<float>(w[k]); };
        results[i] = {
            static_cast<meso::MarchState>(w[0]), double(real(1)), {real(2), real(3), real(4)}, w[5], w[6], w[7]};
    }
    return results;
}

}  // namespace vcp
