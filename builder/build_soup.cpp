#include <atomic>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "builder/builder.h"
#include "builder/deal.h"
#include "builder/estimate.h"
#include "builder/image_store.h"
#include "builder/page_plan.h"

namespace vcp {

namespace {

// Images come on top of the other shares of the time, by what is expected of them and of the mesh.
constexpr double kSecondsOfTriangle = 10e-6;

}  // namespace

void Builder::warnOfWideCells() {
    if (auto warning = wideCellWarning(options_, measures_)) report_.warnings.push_back(std::move(*warning));
}

Result<void> Builder::read() {
    if (!progress("reading", 0)) return cancelled();
    files_.soup = std::make_unique<Soup>(space_, memory_.bufferBytes);
    const auto report = [this](double fraction, uint64_t triangles) {
        measures_.triangles = triangles;
        return progress("reading", kReadingShare * fraction);
    };
    VCP_TRY_ASSIGN(const auto tally, arena_.execute([&] {
        return readInputs(options_, space_, memory_.vertexBytes, *files_.soup, report, report_.warnings,
                          report_.sideFiles);
    }));
    VCP_TRY_ASSIGN(measures_, measuresOf(tally, options_));
    VCP_TRY(checkOutput(options_.output, OutputKind::Dataset, rules()));
    releaseMemory();
    // Images are not kept, so a soup that needs them is dealt before its checkpoint. What was read is not lost
    // where there is too little room for the rest.
    const auto checked = checkSpace();
    const auto kept = files_.soup->materials.empty() ? checkpoint("read", 0, !checked) : Result<void>();
    if (checked) return kept;
    Error error = checked.error();
    if (kept && journal_.active()) error.code = ErrorCode::Io;
    return error;
}

Result<void> Builder::checkSpace() const {
    const uint64_t images = mayKeepImages() ? expectedImageBytes(files_.soup->materials) : 0;
    const uint64_t soup = files_.soup->floats.raw().bytes() + files_.soup->doubles.raw().bytes();
    const uint64_t temp = expectedTempBytes(measures_.triangles, soup, images, memory_.tempBytes),
                   there = space_.diskBytes();
    return checkBuildSpace({space_.folder().path(), temp > there ? temp - there : 0, "temporary folder"},
                           options_.output, expectedFileBytes(measures_.triangles) + images);
}

void Builder::setUpLevels() {
    for (uint32_t level = 0; level < plan_.frame.levels; ++level) {
        files_.spools.emplace_back(space_, level);
        if (plan_.hasSlabs) files_.surfaces.emplace_back(space_, level, "surface");
    }
    files_.neededSurfaces = files_.surfaces.size();
    files_.parts = std::make_unique<PartNotes>(space_, memory_.bufferBytes / 16);
}

Result<void> Builder::choosePlan() {
    const SoupShare all{.soup = *files_.soup};
    const PagePlanning planning{
        .options = options_,
        .measures = measures_,
        .soups = {&all, 1},
        .memory = memory_,
        .mayKeepImages = mayKeepImages(),
        .progress = [&](double part) { return progress("sorting", kReadingShare + kDealingShare / 2 * part); }};
    VCP_TRY_ASSIGN(auto chosen, arena_.execute([&] { return planPagesOf(planning); }));
    plan_ = std::move(chosen.levels);
    levelsLess_ = chosen.levelsLess;
    finestPages_ = chosen.pages;
    return planForPages();
}

Result<void> Builder::planForPages() {
    VCP_TRY_ASSIGN(memory_, planPages(memory_, finestPages_, plan_.finest.bins()));
    plan_.pageBytes = memory_.pageBytes;
    return {};
}

Result<std::vector<PlacedMaterial>> Builder::keepImages() {
    std::vector<PlacedMaterial> placed;
    if (!mayKeepImages()) return placed;
    openImages(1);
    const double images = expectedImageSeconds(expectedImageBytes(files_.soup->materials));
    imagesShare_ = images / (images + kSecondsOfTriangle * double(measures_.triangles));
    const auto report = [&](double part) {
        imagesDone_ = imagesShare_ * part;
        return progress("images", kReadingShare + kDealingShare / 2);
    };
    // Nothing else takes the memory of pages yet.
    VCP_TRY_ASSIGN(placed, storeImages(files_.soup->materials, options_, memory_.pageBytes, space_,
                                       files_.images.front(), report_.warnings, report));
    imagesDone_ = imagesShare_;
    releaseMemory();
    if (!placed.empty()) openTextures();
    return placed;
}

void Builder::openImages(size_t count) {
    for (size_t i = 0; i < count; ++i) files_.images.emplace_back(space_, uint32_t(i), "image");
}

void Builder::openTextures() {
    files_.textures = std::make_unique<RecordBins<TexturedTriangle>>(space_, "textures", plan_.finest.bins(),
                                                                     memory_.bufferBytes / 4);
}

Result<void> Builder::dealSoup() {
    std::optional<MaterialColours> colours;
    if (colourUse().materials) colours.emplace(files_.soup->materials, memory_.vertexBytes);
    VCP_TRY_ASSIGN(const auto placed, arena_.execute([&] { return keepImages(); }));
    const LatticeSnapper snapper(plan_.frame, colours ? &*colours : nullptr, colourUse().vertices, plan_.pages, placed);
    const double begins = kReadingShare + kDealingShare / 2;
    std::atomic<uint64_t> tiny = 0;
    const SoupShare all{.soup = *files_.soup};
    const Dealing dealing{{&all, 1},
                          snapper,
                          plan_.gridOf(pass_ - 1),
                          files_.textures.get(),
                          plan_.pages,
                          plan_.marginCells(),
                          tiny,
                          [&](double part) { return progress("sorting", begins + kDealingShare / 2 * part); }};
    openPass();
    VCP_TRY(arena_.execute([&] { return dealTriangles(dealing, plan_.finest, *files_.current); }));
    if (auto warning = tinyWarning(tiny, measures_.triangles, plan_.frame)) report_.warnings.push_back(*warning);
    if (colours)
        report_.warnings.insert(report_.warnings.end(), colours->warnings().begin(), colours->warnings().end());
    return {};
}

Result<void> Builder::deal() {
    VCP_TRY(choosePlan());
    setUpLevels();
    pass_ = plan_.levels();
    VCP_TRY(dealSoup());
    auto soup = std::move(files_.soup);
    VCP_TRY(checkpoint("levels", 0, journal_.active()));
    soup->floats.raw().remove();
    soup->doubles.raw().remove();
    releaseMemory();
    return {};
}

}  // namespace vcp
