#include "render/meso_marcher.h"

#include <chrono>
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

    /// Returns the time of what is recorded, by the queue's clock, or where it has none, the time of the call.
    Result<double> milliseconds(const MesoRaysPass& pass) {
        const auto start = std::chrono::steady_clock::now();
        VCP_TRY(device->submitAndWait([&](VkCommandBuffer commands) {
            timer.reset(commands);
            timer.mark(commands, 0);
            pass.record(commands);
            timer.mark(commands, 1);
        }));
        if (!timer.hasClock())
            return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        VCP_TRY_ASSIGN(const auto ms, timer.read());
        return ms.front();
    }
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
            VCP_TRY_ASSIGN(const auto ms, state_->milliseconds(passes[i]));
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
