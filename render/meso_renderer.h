// Mesostructure on a device of its own: pictures of surfaces, and lists of rays. Beside the renderer of octrees; what that
// one drew can be given as picture and depths, and the surfaces compose with it.
//
//   auto renderer = MesoRenderer::create({});
//   renderer->setSurfaces(surfaces);              // uploads
//   renderer->render(request);                    // draws and waits
//   renderer->readPicture();
//
// One thread at a time.
#pragma once

#include "mesostructure/method.h"
#include "render/passes/meso_surface.h"
#include "render/picture.h"

namespace vcp {

struct MesoRendererOptions {
    std::string device = {};  ///< as RendererOptions::device
    bool validation = false;
};

/// A picture that the surfaces are drawn over, and its depths: world units along the unit ray, infinity where nothing is.
struct MesoBehind {
    Picture picture;
    std::vector<float> depths;
};

struct MesoRequest {
    MesoLook look;
    uint32_t width = 640, height = 480;
    glm::vec3 backgroundTop{0.93f, 0.95f, 0.97f}, backgroundBottom{0.78f, 0.81f, 0.85f};  ///< encoded
    const MesoBehind* behind = nullptr;  ///< of the same size; null: the background
};

struct MesoFrameStats {
    double msFrame = 0;        ///< of the queue, where it has timestamps, else of the call
    uint64_t unresolved = 0;   ///< rays that used up their iterations in some piece
    uint64_t farHits = 0;      ///< of pixels and surfaces, that were not marched for (MesoLook::errorPixels)
    uint32_t pipelines = 0;    ///< made since create()
    uint64_t assetBytes = 0;   ///< of assets and shells on the device
};

struct MesoMarched {
    std::vector<meso::MarchResult> results;
    std::vector<double> nsPerRay;  ///< of each repetition
};

class MesoRenderer {
public:
    /// Errors: Device.
    static Result<std::unique_ptr<MesoRenderer>> create(const MesoRendererOptions& options);
    ~MesoRenderer();
    MesoRenderer(const MesoRenderer&) = delete;
    MesoRenderer& operator=(const MesoRenderer&) = delete;

    [[nodiscard]] const DeviceInfo& device() const;

    /// All rays, once to warm up and then `repetitions` times. Errors: those of packMesoArrays; Device; Limit.
    Result<MesoMarched> march(const meso::Method& method, std::span<const meso::MarchRay> rays, int repetitions);

    /// Replaces what is drawn. Errors: Device, Limit.
    Result<void> setSurfaces(std::span<const MesoSurface> surfaces);
    /// Errors: Usage (a size of 0 or above 16384, or another than what is behind); Device, Limit.
    Result<MesoFrameStats> render(const MesoRequest& request);

    /// Of the last render(). Errors: Usage, where there was none; Device.
    Result<Picture> readPicture();
    /// World units along the unit ray, of surfaces and of what is behind; infinity where no hit.
    Result<std::vector<float>> readDepth();
    Result<std::vector<glm::vec3>> readNormals();       ///< unit; 0 where no surface
    Result<std::vector<uint32_t>> readIterations();     ///< of each pixel's ray, in all pieces that it passed

    [[nodiscard]] std::vector<std::string> validationMessages() const;

private:
    struct State;
    explicit MesoRenderer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace vcp
