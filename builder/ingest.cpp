#include "builder/ingest.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/mesh_stream.h"
#include "octree/leaf_math.h"
#include "octree/vcp_file.h"

namespace vcp {

namespace {

// The default cell makes about this many surface cells a triangle: cells as long as the mesh's edges. On
// scans finer cells buy no accuracy for their bytes, coarser ones make most leaves hard (docs/surface.md).
constexpr double kTriangleAreaPerCellArea = 0.42;

// Extent limit: positions are 31-bit lattice coordinates.
constexpr double kMaxExtentCells = double(1u << 20) - 4;

// Beyond this, areas overflow a double.
constexpr double kMaxExtent = 1e150;

constexpr uint32_t kLog2Cells = 5;

/// All inputs, joined, as read.
struct RawMesh {
    std::vector<glm::dvec3> positions;
    std::vector<uint32_t> colours;
    std::vector<std::array<uint32_t, 3>> triangles;
    bool hasColour = false;
};

Error badInput(const BuildOptions& options, std::string message) {
    return {.code = ErrorCode::InvalidInput, .message = std::move(message), .file = options.inputs.empty() ? "" : options.inputs.front().string()};
}

Result<void> readInput(const std::filesystem::path& path, RawMesh& mesh, const std::function<bool(uint64_t bytes)>& progress) {
    auto stream = openMesh(path);
    if (!stream) return stream.error();
    const uint64_t first = mesh.positions.size();
    MeshChunk chunk;
    for (;;) {
        auto more = (*stream)->next(chunk);
        if (!more) return more.error();
        if (!*more) break;
        if (mesh.positions.size() + chunk.positions.size() > std::numeric_limits<uint32_t>::max())
            return Error{.code = ErrorCode::Limit, .message = "more than 2^32 vertices", .file = path.string()};
        if (!chunk.colours.empty() && !mesh.hasColour) {
            mesh.hasColour = true;
            mesh.colours.resize(mesh.positions.size(), 0xffffffffu);  // earlier inputs had none: white
        }
        mesh.positions.insert(mesh.positions.end(), chunk.positions.begin(), chunk.positions.end());
        if (mesh.hasColour) {
            mesh.colours.insert(mesh.colours.end(), chunk.colours.begin(), chunk.colours.end());
            mesh.colours.resize(mesh.positions.size(), 0xffffffffu);
        }
        for (const auto& t : chunk.triangles)
            mesh.triangles.push_back({static_cast<uint32_t>(first + t[0]), static_cast<uint32_t>(first + t[1]), static_cast<uint32_t>(first + t[2])});
        if (!progress((*stream)->bytesRead())) return Error{.code = ErrorCode::Cancelled, .message = "cancelled"};
    }
    for (const auto& t : mesh.triangles)
        if (std::max({t[0], t[1], t[2]}) >= mesh.positions.size())
            return Error{.code = ErrorCode::InvalidInput, .message = "a triangle names a vertex that the file does not have", .file = path.string()};
    return {};
}

struct Measures {
    glm::dvec3 lower{std::numeric_limits<double>::infinity()}, upper{-std::numeric_limits<double>::infinity()};
    double area = 0;
    uint64_t degenerate = 0;
};

/// Bounds of the vertices that triangles use, area, and triangles without any.
Measures measure(const RawMesh& mesh) {
    Measures m;
    for (const auto& t : mesh.triangles) {
        const glm::dvec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
        m.lower = glm::min(m.lower, glm::min(a, glm::min(b, c)));
        m.upper = glm::max(m.upper, glm::max(a, glm::max(b, c)));
        const double twice = glm::length(glm::cross(b - a, c - a));
        m.area += twice / 2;
        if (twice == 0) ++m.degenerate;
    }
    return m;
}

Result<GridFrame> chooseFrame(const BuildOptions& options, const RawMesh& mesh, const Measures& m) {
    GridFrame frame;
    frame.log2Cells = kLog2Cells;
    const glm::dvec3 extent = m.upper - m.lower;
    const double longest = std::max(extent.x, std::max(extent.y, extent.z));
    const double useful = static_cast<double>(mesh.triangles.size() - m.degenerate);
    frame.cell = options.cell > 0 ? options.cell : std::sqrt(m.area / (useful * kTriangleAreaPerCellArea));
    // Doubles far from zero have few digits left for the cell.
    const double resolution = std::max(glm::length(m.lower), glm::length(m.upper)) * std::numeric_limits<double>::epsilon();
    if (options.cell <= 0) frame.cell = std::max(frame.cell, std::max(longest / kMaxExtentCells, resolution * 1e4));
    if (longest / frame.cell > kMaxExtentCells)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a cell of {:g} divides the mesh's {:g} into more than 2^20 cells; use --cell {:g} or larger", frame.cell, longest,
                                            longest / kMaxExtentCells)};
    const double cellsAcross = longest / frame.cell + 2;
    while (std::ldexp(1.0, static_cast<int>(frame.log2Cells + frame.levels - 1)) < cellsAcross) ++frame.levels;
    frame.origin = m.lower - glm::dvec3(frame.cell);
    return frame;
}

LatticeMesh snap(RawMesh&& raw, const GridFrame& frame) {
    LatticeMesh mesh;
    const double scale = double(kLatticePerCell) / frame.cell;
    mesh.positions.reserve(raw.positions.size());
    for (const glm::dvec3& p : raw.positions) {
        // Vertices that no triangle uses may lie anywhere; they are dropped by the page builder.
        const glm::dvec3 q = glm::clamp((p - frame.origin) * scale, glm::dvec3(0), glm::dvec3(2147483647.0));
        mesh.positions.emplace_back(std::lround(q.x), std::lround(q.y), std::lround(q.z));
    }
    mesh.colours = std::move(raw.colours);
    mesh.triangles = std::move(raw.triangles);
    mesh.stray.assign(mesh.positions.size(), static_cast<float>(kLatticeRounding));
    return mesh;
}

}  // namespace

Result<IngestedMesh> ingest(const BuildOptions& options, const std::function<bool(double, uint64_t)>& progress) {
    RawMesh raw;
    uint64_t totalBytes = 0, doneBytes = 0;
    for (const auto& path : options.inputs) {
        std::error_code ignored;
        if (const auto size = std::filesystem::file_size(path, ignored); !ignored) totalBytes += size;
    }
    for (const auto& path : options.inputs) {
        uint64_t here = 0;
        VCP_TRY(readInput(path, raw, [&](uint64_t bytes) {
            here = bytes;
            return progress(double(doneBytes + bytes) / double(std::max<uint64_t>(totalBytes, 1)), raw.triangles.size());
        }));
        doneBytes += here;
    }
    IngestedMesh out;
    out.triangles = raw.triangles.size();
    out.vertices = raw.positions.size();
    const Measures m = measure(raw);
    out.degenerateTriangles = m.degenerate;
    if (out.triangles == out.degenerateTriangles || m.area == 0)
        return badInput(options, out.triangles == 0 ? "has no triangles" : fmt::format("none of its {} triangles has an area", out.triangles));
    if (!std::isfinite(m.area) || !(glm::length(m.upper - m.lower) < kMaxExtent))
        return badInput(options, "its coordinates are too large to measure lengths; scale the mesh down");
    out.boundsMin = m.lower;
    out.boundsMax = m.upper;
    if (options.colour == ColourChoice::None) raw.colours.clear();
    if (options.colour == ColourChoice::Vertex && !raw.hasColour) return badInput(options, "has no vertex colours; leave out --colour vertex");
    auto frame = chooseFrame(options, raw, m);
    if (!frame) {
        Error error = frame.error();
        error.file = options.inputs.front().string();
        return error;
    }
    out.frame = *frame;
    out.mesh = snap(std::move(raw), out.frame);
    weld(out.mesh);
    splitLongEdges(out.mesh);
    if (out.mesh.triangles.empty()) return badInput(options, "all triangles are smaller than 1/2048 cell; use a smaller --cell");
    return out;
}

}  // namespace vcp
