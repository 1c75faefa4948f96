#include "viewer/export/mesh_export.h"

#include <fmt/format.h>

namespace vcp {

namespace {

std::span<const std::byte> bytesOf(const std::string& text) { return std::as_bytes(std::span(text)); }

class MeshFile final : public MeshSink {
public:
    MeshFile(OutputFile file, MeshFormat& format, const MeshExportOptions& options, double rounding)
        : file_(std::move(file)), format_(format), options_(options), rounding_(rounding) {}

    Result<void> begin() { return write(format_.header(0, 0, options_.notes)); }

    Result<void> addVertices(std::span<const SurfaceVertex> vertices) override { return addAll(vertices); }
    Result<void> endVertices(const SurfaceTotals& totals) override {
        isTooCoarse_ = options_.mostError > 0 && totals.certified + rounding_ > options_.mostError;
        return isTooCoarse_ ? Result<void>(Error::cancelled()) : check(totals);
    }
    Result<void> addTriangles(std::span<const std::array<uint64_t, 3>> triangles) override { return addAll(triangles); }
    Result<void> addFacets(std::span<const Facet> facets) { return addAll(facets); }

    Result<void> end(const SurfaceTotals& totals, const Notes& notes) {
        VCP_TRY(file_.write(0, bytesOf(format_.header(totals.vertices, totals.triangles, notes))));
        return file_.commit();
    }
    [[nodiscard]] uint64_t bytes() const { return bytes_; }
    [[nodiscard]] bool isTooCoarse() const { return isTooCoarse_; }

private:
    template <class Element>
    Result<void> addAll(std::span<const Element> elements) {
        text_.clear();
        for (const Element& element : elements) format_.add(element, text_);
        return write(text_);
    }

    Result<void> write(const std::string& text) {
        bytes_ += text.size();
        return file_.append(bytesOf(text));
    }

    [[nodiscard]] Result<void> check(const SurfaceTotals& totals) const {
        if (totals.triangles == 0)
            return Error{.code = ErrorCode::InvalidInput, .message = "nothing of the surface lies in the box"};
        if (const auto problem = format_.problemWith(totals.vertices, totals.triangles))
            return Error{.code = ErrorCode::Limit,
                         .message = *problem + "; export it in boxes, or a coarser level",
                         .file = file_.path().string()};
        return {};
    }

    OutputFile file_;
    MeshFormat& format_;
    const MeshExportOptions& options_;
    double rounding_;
    bool isTooCoarse_ = false;
    std::string text_;
    uint64_t bytes_ = 0;
};

}  // namespace

Result<MeshExportFigures> exportMesh(const ByteReader& reader, const SurfaceCut& cut,
                                     const MeshExportOptions& options) {
    const PositionFormat positions = positionsFor(options.kind, boundsOf(cut.dataset().header), cut.step());
    const auto format = meshFormat(
        options.kind, {.hasColour = options.stream.colour && cut.dataset().hasColour(), .positions = positions});
    VCP_TRY_ASSIGN(auto output, OutputFile::create(options.output, options.kind, options.rules));
    MeshFile file(std::move(output), *format, options, positions.rounding);
    VCP_TRY(file.begin());
    const auto totals = format->takesFacets()
                            ? streamFacets(reader, cut, options.stream, true,
                                           [&](std::span<const Facet> facets) { return file.addFacets(facets); })
                            : streamMesh(reader, cut, options.stream, file);
    MeshExportFigures figures{.rounding = positions.rounding, .isDouble = positions.isDouble};
    // The count of vertices of facets is known only at the end.
    const auto checked = format->takesFacets() && totals ? file.endVertices(*totals) : Result<void>();
    figures.isTooCoarse = file.isTooCoarse();
    if (figures.isTooCoarse) return figures;
    if (!totals) return totals.error();
    VCP_TRY(checked);
    figures.totals = *totals;
    figures.certified = totals->certified + positions.rounding;
    Notes notes = options.notes;
    notes.insert(notes.begin(), {"certified_distance", fmt::format("{:.6g}", figures.certified)});
    VCP_TRY(file.end(*totals, notes));
    figures.fileBytes = file.bytes();
    return figures;
}

}  // namespace vcp
