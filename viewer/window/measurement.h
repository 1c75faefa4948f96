// Points picked on a surface and what follows from them: distances, polylines, angles; as text, CSV and JSON.
//
// World coordinates in double precision, 17 significant digits in files: what is read back is what was measured.
// Every point knows the certified error of the level it was picked on, or what is known of the method of a surface with
// mesostructure; a length is off by at most the errors of the points at both ends of each of its segments. Plain data,
// no threads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/io/result.h"
#include "viewer/annotation/annotations.h"
#include "viewer/annotation/length_unit.h"

namespace vcp {

struct MeasuredPoint {
    glm::dvec3 position{0};              ///< world
    double error = 0;                    ///< world units
    std::optional<uint32_t> level = {};  ///< level on which it was picked; none on mesostructure
};

using MeasuredLine = std::vector<MeasuredPoint>;

/// Returns the length from point `i` to the next. Precondition: there is a next one.
double segmentLength(const MeasuredLine& line, size_t i);
double segmentError(const MeasuredLine& line, size_t i);
/// Returns the length of all segments; 0 for a single point.
double lineLength(const MeasuredLine& line);
double lineError(const MeasuredLine& line);
/// Returns the angle between the segments that meet at point `i`, degrees in [0, 180]. Precondition: the point is
/// neither the first nor the last, and its neighbours are elsewhere.
double angleAt(const MeasuredLine& line, size_t i);

class Measurement {
public:
    /// Adds a point to the end of the current line.
    void add(const MeasuredPoint& point);
    /// Lets the next point begin a line.
    void finishLine() { lineIsOpen_ = false; }
    /// Removes the last point.
    void takeBack();
    void clear() { *this = {}; }

    [[nodiscard]] const std::vector<MeasuredLine>& lines() const { return lines_; }  ///< none is empty
    [[nodiscard]] bool empty() const { return lines_.empty(); }

private:
    std::vector<MeasuredLine> lines_;
    bool lineIsOpen_ = false;
};

/// A line as a panel lists it: what is measured, and its value to the digits that the error leaves.
struct MeasuredText {
    std::string what;   ///< "Point 1 +-0.00058", "Distance 1 to 2", "Angle at 2", "Length"
    std::string value;  ///< coordinates, a length with its error, an angle
};
/// `unit`, here and below: the world's, which lengths are written in (writtenUnit); coordinates stay as they are.
std::vector<MeasuredText> measuredTexts(const MeasuredLine& line, const std::optional<LengthUnit>& unit = {});

/// Returns the text for a person: coordinates to the digits that the error leaves.
std::string measurementText(const Measurement& measurement, const std::optional<LengthUnit>& unit = {});

/// Returns a row for each point: line, point, x, y, z, error, level, segment, segment_error, total, angle_degrees;
/// empty where there is none. Lines and points count from 1; segment and total end at the point.
std::string measurementCsv(const Measurement& measurement);

/// Returns {"lines":[{"points":[{"position":[x,y,z],"error":e,"level":n}],"segments":[..],"length":l,"length_error":e,
/// "angles_degrees":[..]}]}, indented; with "unit" where it is known. All numbers are in the world's unit.
std::string measurementJson(const Measurement& measurement, const std::optional<LengthUnit>& unit = {});

/// What a file of measurementJson() holds.
struct ReadMeasurement {
    Measurement measurement;
    std::optional<LengthUnit> unit;
};
/// Reads such a text; figures that follow from the points are passed over. `name` stands for the file in errors. May be
/// hostile. Errors: InvalidInput.
Result<ReadMeasurement> measurementFromJson(const std::string& text, const std::string& name);
/// Does so with a file of at most 16 MiB. Errors: also Io, Limit.
Result<ReadMeasurement> readMeasurement(const std::filesystem::path& path);

/// Returns the lines as they are drawn over pictures, each segment with its length.
std::vector<AnnotatedLine> annotatedLines(const Measurement& measurement, const std::optional<LengthUnit>& unit);

}  // namespace vcp
