// From a scan to displacement: a base of few triangles, and maps of what the scan is over it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include "builder/measure/quantile.h"
#include "octree/dataset_reader.h"
#include "octree/io/byte_reader.h"
#include "octree/io/result.h"
#include "viewer/bake/bake_maps.h"

namespace vcp {

struct BakeOptions {
    std::filesystem::path base = {};  ///< a mesh; empty: the scan's own surface is decimated
    size_t triangles = 10'000;        ///< of a base that is decimated
    int texels = 1024;                ///< an edge of the maps
    bool newMap = false;              ///< texture coordinates of the base are not used
    double reach = 0;                 ///< world units, as BakeMapsOptions; 0: chosen (see BakeFigures)
    bool withColour = true;
    bool measured = false;  ///< distances between scan and displaced base; both are held in memory
    /// Triangles of a scan that is decimated at once; a larger one is made coarser first (coarsened_scan.h), as is one
    /// that does not fit the memory by 800 bytes a triangle.
    uint64_t mostDecimated = 20'000'000;
    uint64_t memoryBytes = uint64_t{4} << 30;
    /// Takes what is done and the part of the whole; returning false cancels. May be empty.
    std::function<bool(std::string_view stage, double fraction)> progress = {};
};

struct BakeFigures {
    uint64_t scanTriangles = 0, baseTriangles = 0;
    uint64_t scanVertices = 0;     ///< where the scan is decimated
    uint64_t coarseTriangles = 0;  ///< that a scan was made coarser to before it was decimated; 0: it was not
    /// Triangles without which a decimated base is made, of the scan or its own: a third one on an edge, or at a corner
    /// whose normals cancel.
    uint64_t leftOut = 0;
    bool isAtlas = false;  ///< else the base's own texture coordinates are used
    /// For a decimated base half as much again as the scan is away from it, for another a fiftieth of the diagonal.
    double reach = 0;
    double offset = 0, range = 0;  ///< of the heights, world units
    BakedShares shares;
    double unlike = 0, unlikeAtFirst = 0;             ///< of a decimated base, as DecimatedBase has them
    uint64_t bytes = 0;                               ///< of all files
    uint64_t baseBytes = 0, heightBytes = 0;          ///< of base.obj and heights.meso, which the scene needs
    std::optional<Quantiles> scanToBase, baseToScan;  ///< where measured: sizes of distances, world units
};

/// Bakes, and writes the files of bake_files.h into `folder`. `dataset`: its directory is known as a whole. Errors:
/// Unsupported (the paper's method); those of the readers of meshes, givenMap, makeAtlas, coarsenScan, decimated,
/// bakeMaps and writeBaked; Limit (the memory, for the base or for measuring); Cancelled.
Result<BakeFigures> bake(const std::shared_ptr<const ByteReader>& reader, const Dataset& dataset,
                         const std::filesystem::path& folder, const BakeOptions& options);

}  // namespace vcp
