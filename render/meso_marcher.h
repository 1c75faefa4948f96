// Lists of rays through one mesostructure method, on a device of its own: for measuring, and for comparing with the reference.
// Pictures of surfaces are Renderer::setSurfaces.
//
// One thread at a time.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mesostructure/method.h"
#include "render/renderer.h"

namespace vcp {

struct MesoMarcherOptions {
    std::string device = {};  ///< as RendererOptions::device
    bool validation = false;
};

struct MesoMarched {
    std::vector<meso::MarchResult> results;
    std::vector<double> nsPerRay;  ///< of each repetition: of the queue's clock, or without one of the call's
};

class MesoMarcher {
public:
    /// Errors: Device.
    static Result<std::unique_ptr<MesoMarcher>> create(const MesoMarcherOptions& options);
    ~MesoMarcher();
    MesoMarcher(const MesoMarcher&) = delete;
    MesoMarcher& operator=(const MesoMarcher&) = delete;

    [[nodiscard]] const DeviceInfo& device() const;

    /// All rays, once to warm up and then `repetitions` times. Errors: those of packMesoArrays; Device; Limit.
    Result<MesoMarched> march(const meso::Method& method, std::span<const meso::MarchRay> rays, int repetitions);

    [[nodiscard]] std::vector<std::string> validationMessages() const;

private:
    struct State;
    explicit MesoMarcher(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace vcp
