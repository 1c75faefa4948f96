// The residencies of the datasets in one picture: they share a pool and loader threads
// (render/pages/scene_residency.h).
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "render/pages/scene_residency.h"
#include "render/picture_renderer.h"

namespace vcp {

struct PlacedResidency {
    std::shared_ptr<Residency> residency;  ///< with the scene's, as long as one of its datasets is kept
    Similarity placement;
};

/// The images of datasets, one for each, null where it has none, and the most bytes that they may take.
struct DatasetImages {
    std::vector<std::shared_ptr<const ImagePieces>> pieces;
    std::vector<uint64_t> mostBytes;

    [[nodiscard]] uint64_t bytes() const;
};

/// Reads the tables of the images of datasets; without colour, of none. Together the images may take `mostBytes`, each
/// dataset's its share by what there is of them, and no more than that. Errors: as of PageSource::images.
Result<DatasetImages> findImages(std::span<const PlacedDataset> datasets, bool withColour, uint64_t mostBytes);
/// Bytes that the images of datasets may take.
uint64_t imageBytes(std::span<const PlacedResidency> datasets);

/// Refuses budgets that are too small for any page. Errors: Usage.
Result<void> checkBudget(uint64_t budgetBytes);

/// Returns what a budget leaves for pages beside surfaces with mesostructure and images. Errors: Limit (too little).
Result<uint64_t> budgetOfPages(uint64_t budgetBytes, uint64_t otherBytes);
/// Returns the most bytes that images may take: half of a budget, as long as pages keep the least one.
uint64_t budgetOfImages(uint64_t budgetBytes);
/// Returns what images leave of the memory for pages on their way: at least half.
uint64_t ramOfPages(uint64_t ramBytes, uint64_t imageBytes);

/// Makes the datasets' residencies, whose one pool comes from `memory`, within options.budgetBytes and ramBytes.
/// `images`: none, or of each dataset; what they may take counts as RAM. Errors: as of SceneResidency::create.
Result<std::vector<PlacedResidency>> openResidencies(const PageMemorySource& memory, const RendererOptions& options,
                                                     std::vector<PlacedDataset> datasets, DatasetImages images = {});

/// Returns what the datasets share; null without any.
SceneResidency* sceneOf(std::span<const PlacedResidency> datasets);

/// Waits until a page was read, there is nothing to read, or the time is over.
void waitForPage(std::span<const PlacedResidency> datasets, std::chrono::milliseconds timeout);

/// A dataset in a picture.
struct PictureDataset {
    const Dataset& dataset;
    Similarity placement;
};

/// A box along the world's axes.
struct WorldBox {
    glm::dvec3 low, high;
};

/// Returns how far occlusion reaches in a picture of several datasets, and of what is in boxes, where nothing else is
/// asked for: a tenth of the diagonal of the box about all of them; world units.
double occlusionRadiusAmong(std::span<const PictureDataset> shown, std::span<const WorldBox> others = {});

/// A dataset that a view shows.
struct ShownResidency {
    Residency* residency;
    Similarity placement;
    double* errorPixels;  ///< gets the error of what is drawn
};

/// Updates what a view shows of one scene, and adds up the results; nothing where it shows nothing. With rays of light,
/// each dataset is asked anew what they hit when what is drawn of another has changed. Errors: as of
/// SceneResidency::update.
Result<std::optional<UpdateResult>> updateShown(std::span<const ShownResidency> shown, const FrameRequest& request,
                                                ViewNumber number = 0);

/// What the rays of a frame hit of a dataset.
struct SeenPages {
    Residency* residency;
    PagesHit hit;
    SelectionView view;
    uint64_t pagesNumber;  ///< of what was drawn (Residency::pagesNumber)
};

/// Tells residencies which pages the rays of one frame hit. Rays of light begin where the camera's rays hit, whatever
/// they hit then: what they hit counts once those ask for nothing finer in any of them.
void seeAll(std::vector<SeenPages> seen, ViewNumber number = 0);

/// Whether a picture shows channels of a dataset's materials.
bool showsChannels(const Residency& residency, const FrameRequest& request);

}  // namespace vcp
