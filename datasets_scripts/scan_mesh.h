// ScanMesh: the statue tessellated into an exact number of triangles and streamed as a PLY or OBJ file.
//
// Every count follows from the part's grid before a vertex is computed, so the header comes first and
// nothing is kept: memory is one buffer, whatever the number of triangles.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "datasets_scripts/statue.h"
#include "octree/io/result.h"

namespace vcp::scan {

struct ScanOptions {
    uint64_t triangles = 500'000;  ///< kMinTriangles to kMaxTriangles
    uint64_t seed = 1;
    bool colour = false;  ///< uchar red, green, blue for each vertex
    bool utm = false;     ///< double positions, z up, at UTM coordinates (easting, northing, height)
};

constexpr uint64_t kMinTriangles = 10'000, kMaxTriangles = 1'000'000'000;

/// The grid of one part and where its vertices and triangles lie in the file.
struct GridPart {
    Part part;
    uint64_t columns = 0, rows = 0;  ///< vertices around and along, poles not counted
    uint64_t firstVertex = 0, vertices = 0;
    uint64_t firstTriangle = 0, triangles = 0;
};

class ScanMesh {
public:
    /// `options.triangles` must lie in its range.
    explicit ScanMesh(const ScanOptions& options);

    [[nodiscard]] const std::vector<GridPart>& parts() const { return parts_; }
    [[nodiscard]] uint64_t vertices() const { return vertices_; }
    [[nodiscard]] uint64_t triangles() const { return options_.triangles; }
    [[nodiscard]] std::string header() const;
    [[nodiscard]] uint64_t fileBytes() const;

    using Write = std::function<Result<void>(std::span<const std::byte>)>;

    /// Hands the whole file to `write`, at most kBufferBytes at a time, and returns its first error.
    [[nodiscard]] Result<void> writePly(const Write& write) const;
    /// Does so with an OBJ whose triangles have places in a picture, each part in a square of its own; no colour, no
    /// UTM. `materials`: the name of its MTL file, whose material is called scan.
    [[nodiscard]] Result<void> writeObj(const Write& write, const std::string& materials) const;

    static constexpr size_t kBufferBytes = 1 << 20;

private:
    [[nodiscard]] double edge() const;

    ScanOptions options_;
    std::vector<GridPart> parts_;
    uint64_t vertices_ = 0;
};

}  // namespace vcp::scan
