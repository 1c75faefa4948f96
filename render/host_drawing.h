// Draws datasets and surfaces with mesostructure with the processor (render/host/), whoever holds their pages:
// HostRenderer in plain memory, and Renderer, on a software device, in memory that the processor sees.
//
// Remeshed surfaces, the march of the method `paper`, the false colours that count a shader's work, and seams between
// levels are not drawn (docs/rays.md): each is refused as Unsupported, and never left out.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>

#include "render/host/host_picture.h"
#include "render/meso_look.h"
#include "render/pages/residency.h"
#include "render/picture_renderer.h"

namespace vcp {

/// A dataset as a view shows it. Precondition: the processor sees its pages (PageMemory::bytesOf).
struct HostDataset {
    Residency& residency;
    Similarity placement;
    uint32_t number = 0;     ///< among those that are open
    double errorPixels = 0;  ///< of the view's last update
    ViewNumber view = 0;
};

/// Refuses what the host does not draw of a dataset. `name`: its file's. Errors: Unsupported.
Result<void> checkHostDraws(const Dataset& dataset, const std::string& name);

/// A surface with mesostructure as the host draws it. Refers to the one that it was made of.
struct PreparedSurface {
    const MesoSurface* surface;
    MesoLook look;                                       ///< without words
    std::shared_ptr<const std::vector<uint64_t>> words;  ///< the look's; surfaces of one look share them
    /// The light over its base, as it was drawn last, and the surroundings that it is of.
    std::vector<uint64_t> baseLight = {};
    std::optional<std::array<glm::vec4, 16>> baseLightOf = {};
};
/// Prepares surfaces. Errors: Unsupported, where one is remeshed.
Result<std::vector<PreparedSurface>> prepareOnHost(std::span<const MesoSurface> surfaces);
/// Bytes of their assets, shells and looks; what several share is counted once.
uint64_t bytesOf(std::span<const PreparedSurface> surfaces);

/// Draws the cuts of datasets and the surfaces, the nearest at each pixel, and tells the residencies what the rays of a
/// first sample hit. The surfaces keep the light over their bases. `cancel` is asked by several threads. Preconditions:
/// checkHostDraws. Errors: Cancelled, Limit.
Result<HostPicture> drawOnHost(std::span<const HostDataset> datasets, std::span<PreparedSurface> surfaces,
                               const FrameRequest& request, const std::function<bool()>& cancel);

/// Returns the numbers of the cuts that drawOnHost would draw now: pictures of the same ones are the same.
std::vector<uint64_t> cutNumbers(std::span<const HostDataset> datasets);

/// Returns the statistics of a picture, without times.
FrameStats hostStats(std::span<const HostDataset> datasets, std::span<const PreparedSurface> surfaces,
                     const HostPicture& picture);

}  // namespace vcp
