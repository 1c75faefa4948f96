// The first stages of a build in parts (build_parts.h): inputs are read, pages and bins are chosen, triangles are
// dealt.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "builder/parts/part_steps.h"

namespace vcp {

/// Who reads an input, and which parts of `deal` its triangles go to: those that lie where it lies among the bytes of
/// all inputs, from `firstPart` to `lastPart`. So of many inputs a part has the triangles of few, and of one large one
/// each has its share.
struct InputShare {
    unsigned reader, firstPart, lastPart;
};
/// `bytes`: of each input, in order.
std::vector<InputShare> inputShares(const std::vector<uint64_t>& bytes, unsigned parts);

/// Reads a part's inputs. Errors: runPart's, as of those below.
Result<void> runRead(const PartSetting& setting, unsigned number, NewPart& made);
/// Chooses the pages and the bins, and codes the images that the file keeps.
Result<void> runCount(const PartSetting& setting, NewPart& made);
/// Deals a part's triangles into bins.
Result<void> runDeal(const PartContext& context, unsigned number, NewPart& made);

/// Returns what there is to say of the inputs, once all is dealt. Errors: those of openPart.
Result<std::vector<std::string>> warningsOf(const PartContext& context);

}  // namespace vcp
