#include "viewer/export/section_export.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp {

namespace {

/// A line in the drawing's plane.
struct FlatLine {
    std::vector<glm::dvec2> points;
    bool isClosed;
};

struct Drawing {
    std::vector<FlatLine> lines;
    glm::dvec2 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
};

Drawing drawingOf(const std::vector<Polyline>& lines, const PlaneAxes& axes) {
    Drawing drawing;
    for (const Polyline& line : lines) {
        FlatLine& flat = drawing.lines.emplace_back();
        flat.isClosed = line.isClosed;
        for (const glm::dvec3& p : line.points) {
            flat.points.push_back(axes.of(p));
            drawing.low = glm::min(drawing.low, flat.points.back());
            drawing.high = glm::max(drawing.high, flat.points.back());
        }
    }
    return drawing;
}

std::string textOf(glm::dvec3 p) { return fmt::format("{:.17g} {:.17g} {:.17g}", p.x, p.y, p.z); }

/// Returns lines that say what the drawing is.
std::vector<std::string> commentsOf(const SectionExportOptions& options, const PlaneAxes& axes, double certified) {
    std::vector<std::string> lines = {fmt::format("certified_distance {:.6g}", certified)};
    for (const auto& [word, about] : options.notes) lines.push_back(word + " " + about);
    const CutPlane& plane = options.plane;
    lines.push_back(fmt::format("plane {} . x = {:.17g}", textOf(plane.normal), plane.offset));
    lines.push_back("origin " + textOf(axes.origin));
    lines.push_back("x_axis " + textOf(axes.x));
    lines.push_back("y_axis " + textOf(axes.y));
    for (std::string& line : lines)
        std::ranges::replace_if(
            line, [](unsigned char c) { return c < ' '; }, '?');
    return lines;
}

std::string svgOf(const Drawing& drawing, const std::vector<std::string>& comments,
                  const std::optional<LengthUnit>& unit) {
    const glm::dvec2 extent = drawing.high - drawing.low;
    const double border = 0.02 * std::max(extent.x, extent.y);
    const glm::dvec2 size = extent + 2 * border;
    std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
    for (std::string line : comments) {
        // A comment of XML has no "--".
        for (size_t at; (at = line.find("--")) != std::string::npos;) line.replace(at, 2, "- ");
        text += "<!-- " + line + " -->\n";
    }
    text += fmt::format("<!-- corner {:.17g} {:.17g}: the drawing's upper left corner, along x_axis and y_axis -->\n",
                        drawing.low.x - border, drawing.high.y + border);
    text += "<svg xmlns=\"http://www.w3.org/2000/svg\"";
    if (unit)
        text += fmt::format(" width=\"{:.9g}mm\" height=\"{:.9g}mm\"", size.x * unit->millimetres,
                            size.y * unit->millimetres);
    text += fmt::format(" viewBox=\"0 0 {:.9g} {:.9g}\">\n", size.x, size.y);
    text += fmt::format("<g fill=\"none\" stroke=\"#000\" stroke-width=\"{:.3g}\" stroke-linejoin=\"round\">\n",
                        std::max(size.x, size.y) / 1000);
    for (const FlatLine& line : drawing.lines) {
        text += "<path d=\"M";
        for (const glm::dvec2& p : line.points)
            fmt::format_to(std::back_inserter(text), " {:.9g} {:.9g}", p.x - drawing.low.x + border,
                           drawing.high.y + border - p.y);
        text += line.isClosed ? " Z\"/>\n" : "\"/>\n";
    }
    return text + "</g>\n</svg>\n";
}

/// Appends a group of a DXF: its code, and what it holds.
template <class Value>
void addGroup(std::string& text, int code, const Value& value) {
    fmt::format_to(std::back_inserter(text), "{:>3}\n{}\n", code, value);
}

void addPoint(std::string& text, glm::dvec2 p) {
    addGroup(text, 10, p.x);
    addGroup(text, 20, p.y);
    addGroup(text, 30, "0.0");
}

std::string dxfOf(const Drawing& drawing, const std::vector<std::string>& comments,
                  const std::optional<LengthUnit>& unit) {
    constexpr const char* kLayer = "SECTION";
    std::string text;
    for (const std::string& line : comments) addGroup(text, 999, line);
    addGroup(text, 0, "SECTION");
    addGroup(text, 2, "HEADER");
    addGroup(text, 9, "$ACADVER");
    addGroup(text, 1, "AC1009");
    addGroup(text, 9, "$INSUNITS");
    addGroup(text, 70, unit ? unit->dxf : 0);
    addGroup(text, 9, "$EXTMIN");
    addPoint(text, drawing.low);
    addGroup(text, 9, "$EXTMAX");
    addPoint(text, drawing.high);
    addGroup(text, 0, "ENDSEC");
    addGroup(text, 0, "SECTION");
    addGroup(text, 2, "ENTITIES");
    for (const FlatLine& line : drawing.lines) {
        addGroup(text, 0, "POLYLINE");
        addGroup(text, 8, kLayer);
        addGroup(text, 66, 1);
        addGroup(text, 70, int(line.isClosed));
        addPoint(text, {0, 0});
        for (const glm::dvec2& p : line.points) {
            addGroup(text, 0, "VERTEX");
            addGroup(text, 8, kLayer);
            addPoint(text, p);
        }
        addGroup(text, 0, "SEQEND");
        addGroup(text, 8, kLayer);
    }
    addGroup(text, 0, "ENDSEC");
    addGroup(text, 0, "EOF");
    return text;
}

}  // namespace

Result<SectionFigures> exportSection(const ByteReader& reader, const SurfaceCut& cut,
                                     const SectionExportOptions& options) {
    VCP_TRY(checkOutput(options.output, options.kind, options.rules));
    SectionLines section(options.plane);
    VCP_TRY_ASSIGN(const auto totals,
                   streamFacets(reader, cut, options.stream, false, [&](std::span<const Facet> facets) {
                       section.add(facets);
                       return Result<void>();
                   }));
    const std::vector<Polyline> lines = section.join();
    if (lines.empty())
        return Error{
            .code = ErrorCode::InvalidInput, .message = "the plane cuts nothing of the surface", .file = cut.name()};
    SectionFigures figures{.lines = lines.size(), .certified = totals.certified};
    for (const Polyline& line : lines) {
        figures.closedLines += line.isClosed ? 1 : 0;
        figures.points += line.points.size();
        figures.length += lengthOf(line);
    }
    const PlaneAxes axes = axesOf(options.plane);
    const Drawing drawing = drawingOf(lines, axes);
    const std::vector<std::string> comments = commentsOf(options, axes, totals.certified);
    const std::string text = options.kind == OutputKind::Dxf ? dxfOf(drawing, comments, options.unit)
                                                             : svgOf(drawing, comments, options.unit);
    figures.fileBytes = text.size();
    VCP_TRY(writeFile(options.output, options.kind, std::string_view(text), options.rules));
    return figures;
}

}  // namespace vcp
