// Caps of sections: where a ray enters what section planes leave, the plane it enters by hides the rest, if the point
// is inside of the solid, or next to the line in which an open surface is cut (render/shaders/trace.comp).
#pragma once

#include "render/host/host_scene.h"
#include "render/host/page_marks.h"
#include "render/host/picture_rays.h"
#include "render/host/tile_hits.h"

namespace vcp {

/// Makes hits of a tile's rays on caps, in the place of what castTile found behind. Of such a hit, TileHits::leaf is
/// that of a wall behind the cap. `caps`: not None. `marks`, where given, gets the pages that the rays hit or begin in
/// that tell whether a point is inside. Any thread.
void castCaps(const HostScene& scene, const PictureRays& rays, Caps caps, TileHits& hits, PageMarks* marks = nullptr);

}  // namespace vcp
