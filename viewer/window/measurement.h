// Points picked on a surface and what follows from them: distances, polylines, angles; as text, CSV and JSON.
//
// World coordinates in double precision, 17 significant digits in files: what is read back is what was measured.
// Every point knows the certified error of the level it was picked on; a length is off by at most the errors of the
// points at both ends of each of its segments. Plain data, no threads.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

namespace vcp {

struct MeasuredPoint {
    glm::dvec3 position{0};  ///< world
    double error = 0;        ///< certified, world units
    uint32_t level = 0;      ///< that it was picked on
};

using MeasuredLine = std::vector<MeasuredPoint>;

/// From point `i` to the next. Precondition: there is a next one.
double segmentLength(const MeasuredLine& line, size_t i);
double segmentError(const MeasuredLine& line, size_t i);
/// Of all segments; 0 for a single point.
double lineLength(const MeasuredLine& line);
double lineError(const MeasuredLine& line);
/// Between the segments that meet at point `i`, degrees in [0, 180]. Precondition: neither the first nor the last;
/// its neighbours are elsewhere.
double angleAt(const MeasuredLine& line, size_t i);

class Measurement {
public:
    /// To the end of the current line.
    void add(const MeasuredPoint& point);
    /// The next point begins a line.
    void finishLine() { lineIsOpen_ = false; }
    /// Takes the last point back.
    void takeBack();
    void clear() { *this = {}; }

    [[nodiscard]] const std::vector<MeasuredLine>& lines() const { return lines_; }  ///< none is empty
    [[nodiscard]] bool empty() const { return lines_.empty(); }

private:
    std::vector<MeasuredLine> lines_;
    bool lineIsOpen_ = false;
};

/// For a person: coordinates to the digits that the error leaves.
std::string measurementText(const Measurement& measurement);

/// A row a point: line, point, x, y, z, error, level, segment, segment_error, total, angle_degrees; empty where there
/// is none. Lines and points count from 1; segment and total end at the point.
std::string measurementCsv(const Measurement& measurement);

/// {"lines":[{"points":[{"position":[x,y,z],"error":e,"level":n}],"segments":[..],"length":l,"length_error":e,
/// "angles_degrees":[..]}]}, indented.
std::string measurementJson(const Measurement& measurement);

}  // namespace vcp
