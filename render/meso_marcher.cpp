#include "render/meso_marcher.h"

#include <ctime>

#include <fmt/format.h>

#include "render/passes/meso_rays.h"
#include "render/vulkan/pass_timer.h"

namespace vcp {

namespace {

constexpr uint64_t kMostRays = 65535 * 64;  // rays of one dispatch, on every device

}  // namespace

struct MesoMarcher::State {
    std::unique_ptr<Instance> instance;
    std::unique_ptr<Device> device;
    std::unique_ptr<MesoResources> resources;
    PassTimer timer;
};

MesoMarcher::MesoMarcher(std::unique_ptr<State> state) : state_(std::move(state)) {}
MesoMarcher::~MesoMarcher() = default;

Result<std::unique_ptr<MesoMarcher>> MesoMarcher::create(const MesoMarcherOptions& options) {
    auto state = std::make_unique<State>();
    VCP_TRY_ASSIGN(auto instance, Instance::create(options.validation, {}));
    state->instance = std::move(instance);
    VCP_TRY_ASSIGN(auto device, Device::create(*state->instance, options.device, VK_NULL_HANDLE, false));
    state->device = std::move(device);
    VCP_TRY_ASSIGN(state->resources, MesoResources::create(*state->device));
    VCP_TRY_ASSIGN(state->timer, PassTimer::create(*state->device, 2));
    return std::unique_ptr<MesoMarcher>(new MesoMarcher(std::move(state)));
}

const DeviceInfo& MesoMarcher::device() const { return state_->device->info(); }

Result<std::vector<MesoMarched>> MesoMarcher::march(std::span<const meso::Method* const> methods,
                                                    std::span<const meso::MarchRay> rays, int rounds) {
    std::vector<MesoMarched> marched(methods.size());
    if (rays.empty()) return marched;
    if (rays.size() > kMostRays)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("{} rays; at most {} at once", rays.size(), kMostRays)};
    std::vector<MesoRaysPass> passes;
    for (const meso::Method* method : methods) {
        VCP_TRY_ASSIGN(const auto arrays, method->arrays());
        VCP_TRY(passes.emplace_back(*state_->device, *state_->resources).prepare(arrays, rays));
    }
    for (int round = 0; round <= rounds; ++round)
        for (size_t i = 0; i < passes.size(); ++i) {
            const std::clock_t start = std::clock();
            VCP_TRY_ASSIGN(const auto ms, state_->timer.timed(*state_->device, [&](VkCommandBuffer commands) {
                passes[i].record(commands);
            }));
            const double processorMs = double(std::clock() - start) * 1e3 / CLOCKS_PER_SEC;
            if (round > 0)
                marched[i].nsPerRay.push_back((device().software ? processorMs : ms) * 1e6 / double(rays.size()));
        }
    for (size_t i = 0; i < passes.size(); ++i) {
        VCP_TRY_ASSIGN(marched[i].results, passes[i].read());
    }
    return marched;
}

std::vector<std::string> MesoMarcher::validationMessages() const { return state_->instance->log().messages(); }

}  // namespace vcp
