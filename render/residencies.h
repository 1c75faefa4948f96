// The residencies of the datasets in one picture: they share budgets and loader threads.
#pragma once

#include <chrono>
#include <memory>
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

/// Adds the result of another dataset in the same picture.
void add(UpdateResult& all, const UpdateResult& one);

}  // namespace vcp
