#include "viewer/window/measurement.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "viewer/camera/text_file.h"

namespace vcp {

namespace {

using Json = nlohmann::ordered_json;

/// Returns the digits after the point that an error leaves: one beyond its own first digit.
int digitsFor(double error) {
    if (!(error > 0)) return 9;
    return int(std::clamp(1 - std::floor(std::log10(error)), 0.0, 15.0));
}

std::string rounded(double value, double error) { return fmt::format("{:.{}f}", value, digitsFor(error)); }

bool hasAngle(const MeasuredLine& line, size_t i) {
    return i > 0 && i + 1 < line.size() && line[i].position != line[i - 1].position &&
           line[i].position != line[i + 1].position;
}

/// Returns a length with its error, to the digits that the error leaves.
std::string lengthWithError(double length, double error, const std::optional<LengthUnit>& unit) {
    const WrittenUnit written = writtenUnit(length, unit);
    return fmt::format("{} +-{:.2g}{}{}", rounded(length * written.factor, error * written.factor),
                       error * written.factor, written.name.empty() ? "" : " ", written.name);
}

std::string textOf(const MeasuredLine& line, size_t number, const std::optional<LengthUnit>& unit) {
    std::string text;
    for (size_t i = 0; i < line.size(); ++i) {
        const MeasuredPoint& p = line[i];
        text += fmt::format("{}.{}  {}  {}  {}  +-{:.2g}", number, i + 1, rounded(p.position.x, p.error),
                            rounded(p.position.y, p.error), rounded(p.position.z, p.error), p.error);
        if (p.level) text += fmt::format(" (level {})", *p.level);
        if (i > 0)
            text += "\n     distance " + lengthWithError(segmentLength(line, i - 1), segmentError(line, i - 1), unit);
        if (hasAngle(line, i)) text += fmt::format("\n     angle {:.2f} degrees", angleAt(line, i));
        text += '\n';
    }
    if (line.size() > 2)
        text += fmt::format("{}  length {}\n", number, lengthWithError(lineLength(line), lineError(line), unit));
    return text;
}

Json toJson(const MeasuredLine& line) {
    Json json;
    json["points"] = Json::array();
    Json segments = Json::array(), angles = Json::array();
    for (size_t i = 0; i < line.size(); ++i) {
        const MeasuredPoint& p = line[i];
        Json point = {{"position", {p.position.x, p.position.y, p.position.z}}, {"error", p.error}};
        if (p.level) point["level"] = *p.level;
        json["points"].push_back(std::move(point));
        if (i + 1 < line.size()) segments.push_back(segmentLength(line, i));
        if (i > 0 && i + 1 < line.size()) angles.push_back(hasAngle(line, i) ? Json(angleAt(line, i)) : Json(nullptr));
    }
    json["segments"] = segments;
    json["length"] = lineLength(line);
    json["length_error"] = lineError(line);
    json["angles_degrees"] = angles;
    return json;
}

}  // namespace

double segmentLength(const MeasuredLine& line, size_t i) {
    return glm::distance(line[i].position, line[i + 1].position);
}
double segmentError(const MeasuredLine& line, size_t i) { return line[i].error + line[i + 1].error; }

double lineLength(const MeasuredLine& line) {
    double length = 0;
    for (size_t i = 0; i + 1 < line.size(); ++i) length += segmentLength(line, i);
    return length;
}

double lineError(const MeasuredLine& line) {
    double error = 0;
    for (size_t i = 0; i + 1 < line.size(); ++i) error += segmentError(line, i);
    return error;
}

double angleAt(const MeasuredLine& line, size_t i) {
    const glm::dvec3 a = line[i - 1].position - line[i].position, b = line[i + 1].position - line[i].position;
    // This form is well-conditioned at all angles, unlike the arc cosine.
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 180 / std::numbers::pi;
}

void Measurement::add(const MeasuredPoint& point) {
    if (!lineIsOpen_) lines_.emplace_back();
    lineIsOpen_ = true;
    lines_.back().push_back(point);
}

void Measurement::takeBack() {
    if (lines_.empty()) return;
    lines_.back().pop_back();
    lineIsOpen_ = !lines_.back().empty();
    if (lines_.back().empty()) lines_.pop_back();
}

std::vector<MeasuredText> measuredTexts(const MeasuredLine& line, const std::optional<LengthUnit>& unit) {
    std::vector<MeasuredText> texts;
    for (size_t i = 0; i < line.size(); ++i) {
        const MeasuredPoint& p = line[i];
        texts.push_back({fmt::format("Point {} +-{:.2g}", i + 1, p.error),
                         fmt::format("{}  {}  {}", rounded(p.position.x, p.error), rounded(p.position.y, p.error),
                                     rounded(p.position.z, p.error))});
        if (i > 0)
            texts.push_back({fmt::format("Distance {} to {}", i, i + 1),
                             lengthWithError(segmentLength(line, i - 1), segmentError(line, i - 1), unit)});
        if (hasAngle(line, i))
            texts.push_back({fmt::format("Angle at {}", i + 1), fmt::format("{:.2f}°", angleAt(line, i))});
    }
    if (line.size() > 2) texts.push_back({"Length", lengthWithError(lineLength(line), lineError(line), unit)});
    return texts;
}

std::string measurementText(const Measurement& measurement, const std::optional<LengthUnit>& unit) {
    std::string text;
    for (size_t i = 0; i < measurement.lines().size(); ++i) text += textOf(measurement.lines()[i], i + 1, unit);
    return text;
}

std::string measurementCsv(const Measurement& measurement) {
    std::string csv = "line,point,x,y,z,error,level,segment,segment_error,total,angle_degrees\n";
    for (size_t n = 0; n < measurement.lines().size(); ++n) {
        const MeasuredLine& line = measurement.lines()[n];
        double total = 0;
        for (size_t i = 0; i < line.size(); ++i) {
            const MeasuredPoint& p = line[i];
            csv += fmt::format("{},{},{:.17g},{:.17g},{:.17g},{:.9g},{},", n + 1, i + 1, p.position.x, p.position.y,
                               p.position.z, p.error, p.level ? fmt::to_string(*p.level) : "");
            if (i > 0) {
                total += segmentLength(line, i - 1);
                csv += fmt::format("{:.17g},{:.9g},{:.17g},", segmentLength(line, i - 1), segmentError(line, i - 1),
                                   total);
            } else {
                csv += ",,,";
            }
            if (hasAngle(line, i)) csv += fmt::format("{:.17g}", angleAt(line, i));
            csv += '\n';
        }
    }
    return csv;
}

namespace {

constexpr size_t kLargestFile = 16 << 20;
constexpr int kDeepest = 8;

/// Says where a text stops being JSON, or nests deeper than measurements do.
class MeasurementCheck : public nlohmann::detail::json_sax_acceptor<nlohmann::json> {
public:
    bool start_object(size_t) { return ++depth_ <= kDeepest; }
    bool start_array(size_t) { return ++depth_ <= kDeepest; }
    bool end_object() { return --depth_, true; }
    bool end_array() { return --depth_, true; }

private:
    int depth_ = 0;
};

std::optional<MeasuredPoint> pointFrom(const nlohmann::json& json) {
    if (!json.is_object() || !json.contains("position")) return std::nullopt;
    const nlohmann::json& position = json["position"];
    if (!position.is_array() || position.size() != 3) return std::nullopt;
    MeasuredPoint point;
    for (size_t axis = 0; axis < 3; ++axis) {
        if (!position[axis].is_number() || !std::isfinite(position[axis].get<double>())) return std::nullopt;
        point.position[int(axis)] = position[axis].get<double>();
    }
    const auto error = json.find("error"), level = json.find("level");
    if (error != json.end() && error->is_number()) point.error = error->get<double>();
    if (level != json.end() && level->is_number_unsigned()) point.level = level->get<uint32_t>();
    return point;
}

}  // namespace

Result<ReadMeasurement> measurementFromJson(const std::string& text, const std::string& name) {
    const auto wrong = [&](const std::string& what) {
        return Error{.code = ErrorCode::InvalidInput, .message = what, .file = name};
    };
    MeasurementCheck check;
    const auto json = nlohmann::json::sax_parse(text, &check) ? nlohmann::json::parse(text, nullptr, false)
                                                              : nlohmann::json(nlohmann::json::value_t::discarded);
    if (json.is_discarded()) return wrong("not a measurement: the JSON breaks off or goes wrong");
    if (!json.is_object() || !json.contains("lines") || !json["lines"].is_array())
        return wrong("not a measurement: \"lines\" is missing");
    ReadMeasurement read;
    if (json.contains("unit")) {
        if (json["unit"].is_string()) read.unit = unitNamed(json["unit"].get<std::string>());
        if (!read.unit) return wrong("\"unit\" is none of um, mm, cm, m, km, in, ft");
    }
    for (size_t i = 0; i < json["lines"].size(); ++i) {
        const auto& line = json["lines"][i];
        if (!line.is_object() || !line.contains("points") || !line["points"].is_array())
            return wrong(fmt::format("line {} has no \"points\"", i + 1));
        for (size_t k = 0; k < line["points"].size(); ++k) {
            const auto point = pointFrom(line["points"][k]);
            if (!point)
                return wrong(fmt::format("point {} of line {} has no \"position\" of three numbers", k + 1, i + 1));
            read.measurement.add(*point);
        }
        read.measurement.finishLine();
    }
    return read;
}

Result<ReadMeasurement> readMeasurement(const std::filesystem::path& path) {
    VCP_TRY_ASSIGN(const auto text, readText(path, kLargestFile, "a measurement"));
    return measurementFromJson(text, path.string());
}

std::vector<AnnotatedLine> annotatedLines(const Measurement& measurement, const std::optional<LengthUnit>& unit) {
    std::vector<AnnotatedLine> lines;
    for (const MeasuredLine& line : measurement.lines()) {
        AnnotatedLine& annotated = lines.emplace_back();
        for (const MeasuredPoint& point : line) annotated.points.push_back(point.position);
        for (size_t i = 0; i + 1 < line.size(); ++i)
            annotated.lengths.push_back(lengthText(segmentLength(line, i), unit));
    }
    return lines;
}

std::string measurementJson(const Measurement& measurement, const std::optional<LengthUnit>& unit) {
    Json json;
    if (unit) json["unit"] = unit->name;
    json["lines"] = Json::array();
    for (const MeasuredLine& line : measurement.lines()) json["lines"].push_back(toJson(line));
    return json.dump(2) + '\n';
}

}  // namespace vcp
