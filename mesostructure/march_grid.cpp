// Walks over a grid: each way to skip empty cells with each surface in the occupied ones.
#include "mesostructure/march_arrays.h"

namespace vcp::meso {

namespace {

const TileGrid& gridOf(const Skipping& skipping) {
    if (skipping.distances != nullptr) return skipping.distances->grid;
    if (skipping.compressed != nullptr) return skipping.compressed->grid;
    if (skipping.boxes != nullptr) return skipping.boxes->grid;
    return skipping.occupancy->grid;
}

uint64_t bytesOf(const Skipping& skipping) {
    if (skipping.distances != nullptr) return skipping.distances->bytes();
    if (skipping.compressed != nullptr) return skipping.compressed->bytes();
    if (skipping.boxes != nullptr)
        return skipping.boxes->bytes() + (skipping.guesses != nullptr ? skipping.guesses->bytes() : 0);
    return (skipping.occupancy->cells.size() + 7) / 8;
}

uint64_t bytesOf(const Surface& surface) {
    if (surface.patches != nullptr) return surface.patches->bytes();
    if (surface.heights != nullptr) return surface.heights->texels.size() * 2;
    return surface.field != nullptr ? surface.field->bytes() : 0;
}

Result<void> check(const Skipping& skipping, const Surface& surface) {
    const auto fail = [](const char* message) { return Error{.code = ErrorCode::Usage, .message = message}; };
    if ((skipping.occupancy != nullptr) + (skipping.distances != nullptr) + (skipping.compressed != nullptr) +
            (skipping.boxes != nullptr) !=
        1)
        return fail("a walk skips in one way");
    if ((surface.patches != nullptr) + (surface.heights != nullptr) + (surface.field != nullptr) > 1)
        return fail("a walk has one surface");
    const glm::ivec3 cells = gridOf(skipping).cells;
    if (skipping.guesses != nullptr && (skipping.boxes == nullptr || skipping.guesses->cells != cells))
        return fail("guesses are of the same cells as boxes");
    if (surface.patches != nullptr && surface.patches->grid.cells != cells)
        return fail("the patches are of another grid");
    if (surface.heights != nullptr && surface.heights->size % glm::ivec2(cells) != glm::ivec2(0))
        return fail("the grid's cells must divide the height map's texels");
    if (surface.field != nullptr && surface.field->grid.cells % cells != glm::ivec3(0))
        return fail("the grid's cells must divide the field's");
    return {};
}

}  // namespace

Result<std::unique_ptr<Marcher>> gridMarcher(const Skipping& skipping, const Surface& surface) {
    VCP_TRY(check(skipping, surface));
    VCP_TRY_ASSIGN(auto arrays, gridArrays(skipping, surface));
    return arrayMarcher(std::move(arrays), bytesOf(skipping) + bytesOf(surface), true);
}

}  // namespace vcp::meso
