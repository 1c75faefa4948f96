// Marchers of displacement maps and of slices.
#include "mesostructure/march_arrays.h"

namespace vcp::meso {

Result<std::unique_ptr<Marcher>> gdmMarcher(const GdmMap& map) {
    VCP_TRY_ASSIGN(auto arrays, gdmArrays(map));
    return arrayMarcher(std::move(arrays), map.bytes(), false);
}

std::unique_ptr<Marcher> slicesMarcher(const PropertyVolume& volume) {
    return arrayMarcher(slicesArrays(volume), volume.bytes(), false);
}

}  // namespace vcp::meso
