#include "render/passes/feedback.h"

#include <bit>
#include <cmath>
#include <cstring>

#include "render/feedback_spirv.h"

namespace vcp {

namespace {

constexpr uint64_t kRayWords = uint64_t{frame::kFeedbackRays} * frame::kFeedbackRayWords;
constexpr uint32_t kGroupSize = 64;
static_assert(frame::kFeedbackRays == frame::kFeedbackWidth * frame::kFeedbackHeight &&
              frame::kFeedbackRays % kGroupSize == 0);

}  // namespace

FeedbackPass::FeedbackPass() : pipelines_(kFeedbackSpirv) {}

Result<void> FeedbackTarget::reserve(Device& device, uint64_t words) {
    if (buffer_.bytes() >= words * 4) return {};
    const uint64_t bytes = std::bit_ceil(words) * 4;
    constexpr VkBufferUsageFlags kUsage =
        VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    VCP_TRY_ASSIGN(auto buffer, device.createBuffer(bytes, kUsage, MemoryUse::Local));
    if (buffer.mapped() == nullptr) {
        VCP_TRY_ASSIGN(readback_, device.createBuffer(bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Readback));
    }
    buffer_ = std::move(buffer);
    return {};
}

uint64_t FeedbackTarget::words() const { return kRayWords + 3 * pages_.size(); }

uint32_t FeedbackTarget::firstHitMark() const { return uint32_t(kRayWords + pages_.size()); }

Result<void> FeedbackTarget::prepare(Device& device, FrameResources& resources,
                                     std::span<const frame::TableRecord> table) {
    pages_.resize(table.size());
    for (size_t i = 0; i < table.size(); ++i) pages_[i] = {table[i].colours.entry, table[i].colours.asked};
    VCP_TRY(reserve(device, words()));
    resources.setFeedback(&buffer_);
    return {};
}

Result<void> FeedbackPass::prepare(FrameResources& resources, const PassConstants& constants) {
    PassConstants plain = constants;
    plain.colour = plain.countSteps = plain.falseColour = plain.seams = false;
    return pipelines_.choose(resources, plain);
}

glm::vec2 FeedbackPass::jitter() const {
    // The two-dimensional golden ratio fills the square evenly, whatever the number of frames (Roberts 2018).
    const double n = double(passes_ % 4096);
    return {std::fmod(0.5 + 0.7548776662466927 * n, 1.0), std::fmod(0.5 + 0.5698402909980532 * n, 1.0)};
}

void FeedbackTarget::clear(VkCommandBuffer commands) const {
    vkCmdFillBuffer(commands, buffer_.handle(), 0, VK_WHOLE_SIZE, 0);
}

void FeedbackPass::record(VkCommandBuffer commands) {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.current());
    vkCmdDispatch(commands, frame::kFeedbackRays / kGroupSize, 1, 1);
    ++passes_;
}

void FeedbackTarget::recordReadback(VkCommandBuffer commands) const {
    barrierComputeToReadback(commands);
    if (buffer_.mapped() != nullptr) return;
    const VkBufferCopy whole{0, 0, words() * 4};
    vkCmdCopyBuffer(commands, buffer_.handle(), readback_.handle(), 1, &whole);
    barrierTransferToHost(commands);
}

std::vector<uint32_t> FeedbackTarget::readWords() const {
    std::vector<uint32_t> read(words());
    std::memcpy(read.data(), buffer_.mapped() != nullptr ? buffer_.mapped() : readback_.mapped(), read.size() * 4);
    return read;
}

PagesHit FeedbackTarget::pagesHit() const {
    const std::vector<uint32_t> words = readWords();
    const auto pagesBy = [&](uint32_t kind) {
        std::vector<uint64_t> hit;
        for (size_t record = 0; record < pages_.size(); ++record) {
            if (words[firstHitMark() + 2 * record + kind] == 0) continue;
            const auto [page, asked] = pages_[record];
            hit.push_back(page);
            if (asked != page) hit.push_back(asked);
        }
        return hit;
    };
    return {pagesBy(frame::kHitByCamera), pagesBy(frame::kHitByLight)};
}

RayFeedback FeedbackTarget::read() const {
    const std::vector<uint32_t> words = readWords();
    RayFeedback feedback;
    for (uint32_t ray = 0; ray < frame::kFeedbackRays; ++ray) {
        const uint32_t* w = &words[uint64_t{ray} * frame::kFeedbackRayWords];
        if (w[3] == 0 || w[3] > pages_.size()) continue;
        feedback.hits.push_back({pages_[w[3] - 1].page, glm::ivec3(w[0], w[1], w[2]), ray});
    }
    for (size_t record = 0; record < pages_.size(); ++record)
        if (words[kRayWords + record] != 0)
            feedback.passed.push_back(
                {pages_[record].page, double(words[kRayWords + record]) / double(frame::kNearnessOne)});
    return feedback;
}

}  // namespace vcp
