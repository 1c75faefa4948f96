// The residencies of the datasets in one picture: they share budgets and loader threads.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "render/pages/residency.h"
#include "render/picture_renderer.h"

namespace vcp {

struct PlacedResidency {
    std::unique_ptr<Residency> residency;
    Similarity placement;
};

/// Refuses budgets that are too small for any page. Errors: Usage.
Result<void> checkBudget(uint64_t budgetBytes);

/// Makes the datasets' residencies, whose pools come from `memory`; options.budgetBytes and ramBytes are shared out
/// among them. Errors: as of Residency::create; Limit, where they share too little memory.
Result<std::vector<PlacedResidency>> openResidencies(const PageMemorySource& memory, const RendererOptions& options,
                                                     std::vector<PlacedDataset> datasets);

/// Returns the largest pool that the dataset can use, as far as is known.
uint64_t largestPoolBytes(const Dataset& dataset, bool withColour);

/// Waits until one of them has read a page, none has anything to do, or the time is over.
void waitForPage(std::span<const PlacedResidency> datasets, std::chrono::milliseconds timeout);

/// A dataset in a picture.
struct PictureDataset {
    const Dataset& dataset;
    Similarity placement;
};

/// Returns how far occlusion reaches in a picture of several datasets where nothing else is asked for: a tenth of the
/// diagonal of the box about all of them; world units.
double occlusionRadiusAmong(std::span<const PictureDataset> shown);

/// A dataset that a view shows.
struct ShownResidency {
    Residency* residency;
    Similarity placement;
    double* errorPixels;  ///< gets the error of what is drawn
};

/// Updates what a view shows, and adds up the results; nothing where it shows nothing. With rays of light, each dataset
/// is asked anew what they hit when what is drawn of another has changed. Errors: as of Residency::update.
Result<std::optional<UpdateResult>> updateShown(std::span<const ShownResidency> shown, const FrameRequest& request,
                                                ViewNumber number = 0);

/// What the rays of a frame hit of a dataset.
struct SeenPages {
    Residency* residency;
    PagesHit hit;
    SelectionView view;
    uint64_t cutNumber;
};

/// Tells residencies which pages the rays of one frame hit. Rays of light begin where the camera's rays hit, whatever
/// they hit then: what they hit counts once those ask for nothing finer in any of them.
void seeAll(std::vector<SeenPages> seen, ViewNumber number = 0);

/// Adds the result of another dataset in the same picture.
void add(UpdateResult& all, const UpdateResult& one);

}  // namespace vcp
