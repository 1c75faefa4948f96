// Writes the lines in which a plane cuts a dataset's surface as a drawing: SVG, or DXF of release 12.
//
//   SVG   one path a line; y downwards, from the drawing's upper left corner; where the unit is known, in its true size
//   DXF   one POLYLINE a line, in the plane's own coordinates (axesOf), $INSUNITS
//
// Both begin with comments: the notes, the plane, and which points of the world the drawing's axes are.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "octree/io/output_file.h"
#include "viewer/annotation/length_unit.h"
#include "viewer/export/mesh_format.h"
#include "viewer/export/section_lines.h"
#include "viewer/export/surface_stream.h"

namespace vcp {

struct SectionExportOptions {
    std::filesystem::path output;
    OutputKind kind = OutputKind::Svg;  ///< Svg or Dxf
    OutputRules rules = {};
    Notes notes = {};
    CutPlane plane = {};
    std::optional<LengthUnit> unit = {};
    StreamOptions stream = {};
};

struct SectionFigures {
    uint64_t lines = 0, closedLines = 0, points = 0;
    double length = 0;     ///< of all lines, world units
    double certified = 0;  ///< bound on the distance between the surface that is cut and the mesh, world units
    uint64_t fileBytes = 0;
};

/// Exports. Blocks. `cut`: made with the same plane. Errors: those of streamFacets and OutputFile; InvalidInput, where
/// the plane cuts nothing.
Result<SectionFigures> exportSection(const ByteReader& reader, const SurfaceCut& cut,
                                     const SectionExportOptions& options);

}  // namespace vcp
