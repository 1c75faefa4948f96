// Marches lists of rays through one mesostructure method, on a device of its own: for measuring, and for comparing with
// the reference. Renderer::setSurfaces draws pictures of surfaces.
//
// One thread at a time.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mesostructure/method.h"
#include "render/vulkan/device_info.h"

namespace vcp {

struct MesoMarcherOptions {
    std::string device = {};  ///< as RendererOptions::device
    bool validation = false;
};

struct MesoMarched {
    std::vector<meso::MarchResult> results;
    std::vector<double> nsPerRay;  ///< for each round: the queue's time, or the call's where the queue has no clock; on
                                   ///< a software device the time of the processor, of all threads
};

class MesoMarcher {
public:
    /// Errors: Device.
    static Result<std::unique_ptr<MesoMarcher>> create(const MesoMarcherOptions& options);
    ~MesoMarcher();
    MesoMarcher(const MesoMarcher&) = delete;
    MesoMarcher& operator=(const MesoMarcher&) = delete;

    [[nodiscard]] const DeviceInfo& device() const;

    /// Marches all rays by each method: one round over the methods to warm up and then `rounds` rounds, so that what
    /// else the machine does falls on all alike. Errors: those of Method::arrays(); Device; Limit.
    Result<std::vector<MesoMarched>> march(std::span<const meso::Method* const> methods,
                                           std::span<const meso::MarchRay> rays, int rounds);

    [[nodiscard]] std::vector<std::string> validationMessages() const;

private:
    struct State;
    explicit MesoMarcher(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace vcp
