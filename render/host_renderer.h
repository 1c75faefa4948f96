// Draws pictures on the processor, without Vulkan: no instance, driver or pipeline is touched. Pages are chosen, read
// and kept as for a device (residency.h), in plain memory; rays, light and colours are those of the shaders, cast and
// shaded tile by tile on all processors (host_drawing.h, which also says what is not drawn).
#pragma once

#include <memory>
#include <optional>

#include "render/host_drawing.h"
#include "render/picture_renderer.h"
#include "render/residencies.h"

namespace vcp {

/// The processor, as `vcp devices` lists it.
DeviceInfo hostDevice();

class HostRenderer final : public PictureRenderer {
public:
    /// Errors: Usage (the budget is too small), Unsupported (validation layers are Vulkan's).
    static Result<std::unique_ptr<HostRenderer>> create(const RendererOptions& options);

    [[nodiscard]] const DeviceInfo& device() const override { return info_; }
    Result<void> open(std::vector<PlacedDataset> datasets, std::span<const MesoSurface> surfaces) override;
    Result<void> setSurfaces(std::span<const MesoSurface> surfaces) override;
    Result<UpdateResult> update(const FrameRequest& request) override;
    void waitForPage(std::chrono::milliseconds timeout) override { vcp::waitForPage(datasets_, timeout); }
    Result<FrameStats> render(const FrameRequest& request, const std::function<bool()>& cancel = {}) override;
    Result<uint32_t> refine(const std::function<bool()>& cancel = {}) override;
    Result<Picture> readPicture() override;
    Result<std::vector<float>> readDepth() override;
    Result<std::vector<glm::vec3>> readNormals() override;
    Result<std::vector<uint32_t>> readWork() override;
    Result<std::vector<uint32_t>> readIterations() override;
    [[nodiscard]] std::vector<std::string> validationMessages() const override { return {}; }

private:
    explicit HostRenderer(const RendererOptions& options) : options_(options), info_(hostDevice()) {}
    /// Replaces the surfaces, without regard to the budget. Errors: as of prepareOnHost.
    Result<void> takeSurfaces(std::span<const MesoSurface> surfaces);
    /// Returns the datasets as render() draws them.
    [[nodiscard]] std::vector<HostDataset> drawn(const FrameRequest& request) const;

    const RendererOptions options_;
    const DeviceInfo info_;
    std::vector<PlacedResidency> datasets_;
    std::vector<MesoSurface> surfaces_;
    std::vector<PreparedSurface> prepared_;  // of surfaces_
    bool surfacesChanged_ = false;           // since the last update
    std::vector<double> errorPixels_;        // of each dataset's last update
    std::optional<HostPicture> picture_;     // the last one; its colours may be of fewer samples than light_
    FrameRequest request_;                   // of that picture
    std::vector<uint64_t> cuts_;             // numbers of those that it shows
    SampledLight light_;                     // none before the second sample
};

}  // namespace vcp
