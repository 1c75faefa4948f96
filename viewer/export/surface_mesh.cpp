#include "viewer/export/surface_mesh.h"

#include <limits>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "builder/stream/colour_encoding.h"
#include "viewer/export/diverging_colours.h"

namespace vcp {

namespace {

constexpr uint64_t kMost = std::numeric_limits<int32_t>::max();

class MeshInMemory final : public MeshSink {
public:
    MeshInMemory(IndexedMesh& mesh, const std::string& name) : mesh_(mesh), name_(name) {}

    Result<void> addVertices(std::span<const SurfaceVertex> vertices) override {
        VCP_TRY(check(mesh_.positions.size() + vertices.size()));
        for (const SurfaceVertex& v : vertices) mesh_.positions.push_back(v.at);
        return {};
    }
    Result<void> endVertices(const SurfaceTotals& totals) override { return check(totals.triangles); }
    Result<void> addTriangles(std::span<const std::array<uint64_t, 3>> triangles) override {
        for (const auto& t : triangles) mesh_.triangles.push_back({uint32_t(t[0]), uint32_t(t[1]), uint32_t(t[2])});
        return {};
    }

private:
    [[nodiscard]] Result<void> check(uint64_t count) const {
        if (count <= kMost) return {};
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("has more than {} vertices or triangles, the most that are held in memory "
                                            "here; choose a coarser level",
                                            kMost),
                     .file = name_};
    }

    IndexedMesh& mesh_;
    const std::string& name_;
};

}  // namespace

Result<LoadedSurface> loadSurface(const ByteReader& reader, const SurfaceCut& cut, const StreamOptions& options) {
    LoadedSurface surface;
    surface.level = cut.level();
    MeshInMemory sink(surface.mesh, cut.name());
    VCP_TRY_ASSIGN(const auto totals, streamMesh(reader, cut, options, sink));
    surface.certified = totals.certified;
    return surface;
}

Result<void> writeDistances(const IndexedMesh& mesh, std::span<const float> distances, double range,
                            const std::filesystem::path& output, const OutputRules& rules, const Notes& notes) {
    const Box bounds = Box::of(mesh.positions);
    constexpr double kSteps = 1 << 22;
    const PositionFormat positions =
        positionsFor(OutputKind::Ply, bounds, glm::distance(bounds.low, bounds.high) / kSteps);
    const auto format = meshFormat(OutputKind::Ply, {.hasColour = true, .positions = positions, .hasDistance = true});
    if (const auto problem = format->problemWith(mesh.positions.size(), mesh.triangles.size()))
        return Error{.code = ErrorCode::Limit, .message = *problem, .file = output.string()};
    VCP_TRY_ASSIGN(auto file, OutputFile::create(output, OutputKind::Ply, rules));
    std::string bytes = format->header(mesh.positions.size(), mesh.triangles.size(), notes);
    const auto writeWhen = [&](size_t most) -> Result<void> {
        if (bytes.size() < most) return {};
        VCP_TRY(file.append(std::as_bytes(std::span(bytes))));
        bytes.clear();
        return {};
    };
    constexpr size_t kPiece = 1 << 20;
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        const glm::dvec3 c = divergingColour(double(distances[v]) / range);
        format->add(SurfaceVertex{.at = mesh.positions[v],
                                  .colour = packRgba({toByte(c.x), toByte(c.y), toByte(c.z), 255}),
                                  .distance = distances[v]},
                    bytes);
        VCP_TRY(writeWhen(kPiece));
    }
    for (const auto& t : mesh.triangles) {
        format->add(std::array<uint64_t, 3>{t[0], t[1], t[2]}, bytes);
        VCP_TRY(writeWhen(kPiece));
    }
    VCP_TRY(writeWhen(0));
    return file.commit();
}

}  // namespace vcp
