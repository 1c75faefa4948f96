#include "render/meso_surface.h"

namespace vcp {

double shadowLift(const meso::MarchArrays& arrays, double tileEdge) {
    const meso::f32::MesoRecord& r = arrays.record;
    const meso::MarchConstants& c = arrays.constants;
    const bool isExact =
        c.walk == meso::f32::kMesoPyramid || c.surface == meso::f32::kMesoHeights || c.surface == meso::f32::kMesoField;
    if (r.fine.x > 0 && (isExact || c.walk == meso::f32::kMesoRelief))
        return (isExact ? 0.25 : 1.5) * tileEdge / r.fine.x;
    // A displacement map is 0 within the solid, and filtered with what lies around; and one that tells hits by their
    // density takes what goes by within a point of the solid for a hit (docs/benchmarks/meso.md, leak and acne).
    const bool isOfDensity = c.walk == meso::f32::kMesoGdm && c.surface == meso::f32::kMesoDensity;
    return (isOfDensity ? 3 : c.walk >= meso::f32::kMesoGdm ? 1.5 : 0.5) * tileEdge * double(r.cell.x);
}

}  // namespace vcp
