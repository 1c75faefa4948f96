// Measures by samples, both ways, how far the surface of a level of a dataset and a mesh are apart (`vcp verify
// --against`).
//
//   mesh to surface   samples: vertices, points on edges, points inside triangles, by area; of triangles that
//                     have area, for the others show nothing. The distance to
//                     the surface of the level is bounded from above: by short rays through the
//                     sample in eight and more directions, which start with no wall tolerance, and by the
//                     exact distance to the triangles of hard leaves, each cut off at its leaf's walls.
//   surface to mesh   samples: hits of random rays through the leaves of the level, every leaf alike.
//                     The distance to the mesh is exact (MeshBvh). Of the same hits, the angle between
//                     the surface's normal and that of the nearest triangle's plane; and, where both have
//                     colour, how they differ at the two points (colour_difference.h): what is finer than the
//                     surface keeps counts in full, as it would where a pixel shows but that point.
// Both measurements are seeded: the numbers are the same whatever the number of threads.
#pragma once

#include <cstdint>
#include <functional>

#include "builder/measure/mesh_bvh.h"
#include "builder/measure/mesh_paint.h"
#include "builder/measure/ray_classes.h"
#include "octree/image/image_set.h"
#include "octree/reference_caster.h"

namespace vcp {

struct SurfaceDistanceOptions {
    uint64_t samples = 200'000;  ///< points of the mesh, and visits of leaves
    uint64_t seed = 1;
    unsigned threads = 0;         ///< 0: one a processor
    uint32_t level = UINT32_MAX;  ///< the level whose surface is measured; the finest if there is none of that number
    const MeshPaint* paint = nullptr;  ///< the mesh's colours; null: they are not measured
    const ImageSet* images = nullptr;  ///< all images of the file; null: its colours are those of vertices and slabs
    /// Called from one thread at a time with the fraction done; false cancels. May be empty.
    std::function<bool(double)> progress;
};

/// How far the colours of slab leaves are from the mesh's, as ΔE, beside what their pages say (colourErrorOf).
struct SlabColours {
    uint64_t samples = 0;
    double rms = 0;           ///< root of the mean square, with what is finer than their octants
    double p95 = 0, max = 0;  ///< the largest that pages say of theirs
};

struct SurfaceDistance {
    Quantiles meshToSurface;       ///< world units
    Quantiles surfaceToMesh;       ///< world units
    Quantiles normalDegrees;       ///< between the surface's normals and the mesh's, 0 to 90
    Quantiles colourDifference;    ///< of the surface and the mesh; zeros where either has no colour
    uint64_t colourSamples = 0;    ///< hits whose colours were compared
    SlabColours slabColours;       ///< of those on slab leaves
    glm::dvec3 worstOfMesh{0};     ///< the sample with the largest distance to the surface
    glm::dvec3 worstOfSurface{0};  ///< the hit with the largest distance to the mesh
    uint64_t samples = 0;          ///< samples measured, both ways together
    double cell = 0;               ///< cell of the level, world units
    double certifiedErrorMax = 0;  ///< certified error of the level, world units
};

/// Measures one level of `cache`, all of whose pages must be loaded. Errors: Usage (a page is not loaded), InvalidInput
/// (the mesh has no triangle with area), Cancelled.
Result<SurfaceDistance> measureSurfaceDistance(const PageCache& cache, const MeshBvh& mesh,
                                               const SurfaceDistanceOptions& options = {});

}  // namespace vcp
