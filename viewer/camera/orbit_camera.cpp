#include "viewer/camera/orbit_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <sstream>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>

#include "viewer/camera/json_lines.h"
#include "viewer/camera/text_file.h"

namespace vcp {

namespace {

using Json = nlohmann::json;

// The eye keeps this far from the poles of the orbit.
constexpr double kPoleMargin = 1e-3;

// Room around a fitted box, as a part of the picture.
constexpr double kFitMargin = 1.04;

glm::dvec2 tangents(double fovY, glm::ivec2 size) {
    const double y = std::tan(0.5 * fovY);
    return {y * size.x / std::max(size.y, 1), y};
}

/// Converts a pixel to [-1, 1] on both axes, y up.
glm::dvec2 normalised(glm::dvec2 pixel, glm::ivec2 size) {
    const glm::dvec2 extent = glm::max(glm::dvec2(size), glm::dvec2(1));
    return {2 * pixel.x / extent.x - 1, 1 - 2 * pixel.y / extent.y};
}

/// The part of a picture that is not covered, where the picture is [-1, 1] on both axes, y up.
struct FreePart {
    glm::dvec2 middle{0}, extent{1};  // half its width and height
};

FreePart freePart(glm::ivec2 size, const PictureMargins& covered) {
    const glm::dvec2 all = glm::max(glm::dvec2(size), glm::dvec2(1));
    const glm::dvec2 low(covered.left, covered.bottom), high(covered.right, covered.top);
    const glm::dvec2 left = all - low - high;
    if (left.x < 0.5 * all.x || left.y < 0.5 * all.y) return {};
    return {(low - high) / all, left / all};
}

std::array<glm::dvec3, 8> cornersOf(const Box& box) {
    std::array<glm::dvec3, 8> corners;
    for (int i = 0; i < 8; ++i)
        corners[i] = {i & 1 ? box.high.x : box.low.x, i & 2 ? box.high.y : box.low.y, i & 4 ? box.high.z : box.low.z};
    return corners;
}

// Up to this part of the shorter other side a box is flat; a scan is tall from this many times the longer one.
constexpr double kFlat = 0.25, kTall = 1.5;
// Map coordinates are so many diagonals from the origin, and heights at most such a part of that.
constexpr double kFarDiagonals = 10, kHeightPart = 0.1;

bool isFlatAlongZ(const Box& box) {
    const glm::dvec3 extent = box.high - box.low;
    const double shorter = std::min(extent.x, extent.y);
    return shorter > 0 && extent.z <= kFlat * shorter;
}

bool isOnMap(const Box& box) {
    const glm::dvec3 away = glm::abs(box.centre());
    const double nearer = std::min(away.x, away.y);
    return nearer > kFarDiagonals * box.diagonal() && away.z < kHeightPart * nearer;
}

bool finite(glm::dvec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

glm::dvec3 directionOf(UpAxis up) { return up == UpAxis::Y ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1); }

std::optional<UpAxis> upOf(const Box& box) {
    if (isOnMap(box) || isFlatAlongZ(box)) return UpAxis::Z;
    const glm::dvec3 extent = box.high - box.low;
    if (extent.z > 0 && extent.z >= kTall * std::max(extent.x, extent.y)) return UpAxis::Z;
    if (extent.y > 0 && extent.y >= kTall * std::max(extent.x, extent.z)) return UpAxis::Y;
    return std::nullopt;
}

glm::dquat facing(glm::dvec3 forward, glm::dvec3 up) {
    const glm::dvec3 back = -glm::normalize(forward);
    const glm::dvec3 right = glm::normalize(glm::cross(up, back));
    return glm::normalize(glm::quat_cast(glm::dmat3(right, glm::cross(back, right), back)));
}

Box placedBox(const Box& box, const Similarity& placement) {
    Box placed{placement.toWorld(box.low), placement.toWorld(box.low)};
    for (int corner = 1; corner < 8; ++corner) {
        const glm::dvec3 at((corner & 1) != 0 ? box.high.x : box.low.x, (corner & 2) != 0 ? box.high.y : box.low.y,
                            (corner & 4) != 0 ? box.high.z : box.low.z);
        placed.low = glm::min(placed.low, placement.toWorld(at));
        placed.high = glm::max(placed.high, placement.toWorld(at));
    }
    return placed;
}

double Box::diagonal() const { return glm::length(high - low); }

double OrbitCamera::viewHeight() const { return 2 * focusDistance * std::tan(0.5 * fovY); }

double OrbitCamera::depthOf(glm::dvec3 point) const { return glm::dot(point - position, forwardVector()); }

Camera OrbitCamera::current() const {
    Camera camera;
    camera.eye = position;
    camera.forward = forwardVector();
    camera.up = upVector();
    camera.projection = projection;
    camera.verticalFov = fovY;
    camera.orthographicHeight = viewHeight();
    return camera;
}

CameraRay OrbitCamera::rayThrough(glm::dvec2 pixel, glm::ivec2 size) const {
    const glm::dvec2 at = normalised(pixel, size) * tangents(fovY, size);
    if (projection == Projection::Perspective) return {position, glm::normalize(orientation * glm::dvec3(at, -1))};
    return {position + orientation * glm::dvec3(at * focusDistance, 0), forwardVector()};
}

std::optional<glm::dvec2> OrbitCamera::pixelOf(glm::dvec3 point, glm::ivec2 size) const {
    const glm::dvec3 local = glm::conjugate(orientation) * (point - position);
    const double scale = projection == Projection::Perspective ? -local.z : focusDistance;
    if (scale <= 0) return std::nullopt;
    const glm::dvec2 at = glm::dvec2(local) / (scale * tangents(fovY, size));
    return glm::dvec2{0.5 * (at.x + 1) * size.x, 0.5 * (1 - at.y) * size.y};
}

void OrbitCamera::orbit(glm::dvec3 pivot, double yaw, double pitch) {
    const glm::dvec3 axis = directionOf(up);
    const double elevation = std::asin(std::clamp(glm::dot(forwardVector(), axis), -1.0, 1.0));
    // A top view starts at the pole itself; it may leave the pole, but not pass it.
    const double limit = std::max(0.5 * std::numbers::pi - kPoleMargin, std::abs(elevation));
    pitch = std::clamp(elevation + pitch, -limit, limit) - elevation;
    const glm::dquat turn = glm::angleAxis(yaw, axis) * glm::angleAxis(pitch, rightVector());
    position = pivot + turn * (position - pivot);
    orientation = glm::normalize(turn * orientation);
}

void OrbitCamera::turnHead(double yaw, double pitch) { orbit(position, yaw, pitch); }

void OrbitCamera::centreOn(glm::dvec3 point) { position = point - forwardVector() * focusDistance; }

void OrbitCamera::standUp(UpAxis axis) {
    up = axis;
    const glm::dvec3 upward = directionOf(axis), ahead = forwardVector();
    const bool isAlong = glm::length(glm::cross(ahead, upward)) < kPoleMargin;
    orientation = facing(ahead, isAlong ? upVector() : upward);
}

OrbitCamera between(const OrbitCamera& from, const OrbitCamera& to, double part) {
    if (part <= 0) return from;
    if (part >= 1) return to;
    OrbitCamera camera = to;
    camera.orientation = glm::normalize(glm::slerp(from.orientation, to.orientation, part));
    camera.fovY = glm::mix(from.fovY, to.fovY, part);
    camera.focusDistance = from.focusDistance * std::pow(to.focusDistance / from.focusDistance, part);
    camera.position = glm::mix(from.focus(), to.focus(), part) - camera.forwardVector() * camera.focusDistance;
    return camera;
}

void OrbitCamera::pan(glm::dvec2 from, glm::dvec2 to, double depth, glm::ivec2 size) {
    const double scale = projection == Projection::Perspective ? depth : focusDistance;
    const glm::dvec2 move = (normalised(from, size) - normalised(to, size)) * tangents(fovY, size) * scale;
    position += orientation * glm::dvec3(move, 0);
}

void OrbitCamera::zoomAbout(glm::dvec3 point, double factor) {
    const glm::dvec3 moved = point + (position - point) * factor;
    const double magnitude = std::max({1e-300, glm::length(point), glm::length(position)});
    const double nearest = 1e-12 * magnitude;
    const double depth = depthOf(point) * factor;
    if (projection == Projection::Orthographic) {
        if (focusDistance * factor < nearest) return;
        // The eye moves only sideways: an orthographic eye that came closer would cut the scene.
        position += (moved - position) - forwardVector() * glm::dot(moved - position, forwardVector());
        focusDistance *= factor;
        return;
    }
    if (std::abs(depth) < nearest) return;
    position = moved;
    focusDistance = depth > 0 ? depth : focusDistance * factor;
}

void OrbitCamera::fit(const Box& box, glm::ivec2 size, const PictureMargins& covered) {
    const glm::dvec3 centre = box.centre();
    const FreePart free = freePart(size, covered);
    const glm::dvec2 picture = tangents(fovY, size), tangent = picture * free.extent / kFitMargin;
    const glm::dvec2 middle = picture * free.middle;  // sideways, a unit ahead
    double distance = 0;
    double flat = 0;
    for (const glm::dvec3& corner : cornersOf(box)) {
        const glm::dvec3 local = glm::conjugate(orientation) * (corner - centre);
        // For points nearer than the middle of the box, the offset from the axis appears larger.
        const glm::dvec2 off = glm::abs(glm::dvec2(local) + middle * local.z) / tangent;
        distance = std::max(distance, std::max(off.x, off.y) + local.z);
        flat = std::max({flat, std::abs(local.x) / tangent.x, std::abs(local.y) / tangent.y});
    }
    const double radius = std::max(0.5 * box.diagonal(), 1e-12 * std::max(1e-300, glm::length(centre)));
    focusDistance = std::max(projection == Projection::Orthographic ? flat : distance, radius * 1e-3);
    // An orthographic eye is outside the box, whatever the height of the picture.
    const double back = projection == Projection::Orthographic ? std::max(focusDistance, 2 * radius) : focusDistance;
    position = centre - forwardVector() * back - orientation * glm::dvec3(middle * focusDistance, 0);
}

void OrbitCamera::fitAround(const Box& box, glm::ivec2 size, int count) {
    fit(box, size);
    const double nearest = focusDistance;
    for (int i = 1; i < count; ++i) {
        OrbitCamera turned = *this;
        turned.orbit(box.centre(), 2 * std::numbers::pi * i / count, 0);
        turned.fit(box, size);
        focusDistance = std::max(focusDistance, turned.focusDistance);
    }
    position -= forwardVector() * (focusDistance - nearest);
}

void OrbitCamera::look(View view, const Box& box, glm::ivec2 size, const PictureMargins& covered) {
    // With y up the front faces +z; with z up it faces -y. The other views follow from front and up.
    const glm::dvec3 upward = directionOf(up);
    const glm::dvec3 front = up == UpAxis::Y ? glm::dvec3(0, 0, 1) : glm::dvec3(0, -1, 0);
    const glm::dvec3 right = glm::cross(upward, front);
    switch (view) {
        case View::Fit:
            orientation = facing(up == UpAxis::Z && isFlatAlongZ(box) ? -(front + upward) : -front, upward);
            break;
        case View::Front:
            orientation = facing(-front, upward);
            break;
        case View::Back:
            orientation = facing(front, upward);
            break;
        case View::Left:
            orientation = facing(right, upward);
            break;
        case View::Right:
            orientation = facing(-right, upward);
            break;
        case View::Top:
            orientation = facing(-upward, -front);
            break;
        case View::Bottom:
            orientation = facing(upward, front);
            break;
        case View::Isometric:
            orientation = facing(-(front + right + upward), upward);
            break;
    }
    fit(box, size, covered);
}

void OrbitCamera::look(const ViewAngles& from, const Box& box, glm::ivec2 size, const PictureMargins& covered) {
    const glm::dvec3 upward = directionOf(up), right(1, 0, 0), away = glm::cross(upward, right);
    const glm::dvec2 angles = glm::radians(glm::dvec2(from.azimuth, from.elevation));
    const glm::dvec3 eye =
        std::cos(angles.y) * (std::cos(angles.x) * right + std::sin(angles.x) * away) + std::sin(angles.y) * upward;
    orientation = facing(-eye, upward);
    fit(box, size, covered);
    fovY = 2 * std::atan(std::tan(0.5 * fovY) / from.magnification);
}

namespace {

struct NamedView {
    std::string_view name;
    View view;
};
constexpr NamedView kViews[] = {{"fit", View::Fit},       {"front", View::Front},  {"back", View::Back},
                                {"left", View::Left},     {"right", View::Right},  {"top", View::Top},
                                {"bottom", View::Bottom}, {"iso", View::Isometric}};

}  // namespace

std::optional<View> viewNamed(std::string_view name) {
    for (const NamedView& known : kViews)
        if (known.name == name) return known.view;
    return std::nullopt;
}

std::string viewNames() {
    std::string names;
    for (const NamedView& known : kViews) names += (names.empty() ? "" : ", ") + std::string(known.name);
    return names;
}

std::string cameraToJson(const OrbitCamera& camera) {
    const auto triple = [](glm::dvec3 v) { return Json::array({v.x, v.y, v.z}); };
    nlohmann::ordered_json json;
    json["position"] = triple(camera.position);
    json["target"] = triple(camera.focus());
    json["up"] = triple(camera.upVector());
    json["up_axis"] = camera.up == UpAxis::Y ? "y" : "z";
    json["fov_degrees"] = camera.fovY * 180 / std::numbers::pi;
    json["projection"] = camera.projection == Projection::Perspective ? "perspective" : "orthographic";
    return json.dump();
}

namespace {

/// Takes fields of a camera object and remembers the first that is wrong.
class CameraFields {
public:
    CameraFields(const Json& json, const std::string& name) : json_(json), name_(name) {}

    glm::dvec3 triple(const char* field, std::optional<glm::dvec3> otherwise) {
        if (!json_.contains(field)) return absent(field, otherwise);
        const Json& value = json_[field];
        bool good = value.is_array() && value.size() == 3;
        for (size_t i = 0; good && i < 3; ++i) good = value[i].is_number();
        if (!good) return wrong(field, "must be three numbers"), glm::dvec3(0);
        const glm::dvec3 v(value[0].get<double>(), value[1].get<double>(), value[2].get<double>());
        if (!finite(v)) wrong(field, "must be finite");
        return v;
    }

    double number(const char* field, double otherwise) {
        if (!json_.contains(field)) return otherwise;
        if (!json_[field].is_number()) return wrong(field, "must be a number"), otherwise;
        return json_[field].get<double>();
    }

    /// Returns the index of a word among those allowed.
    size_t word(const char* field, std::initializer_list<const char*> allowed) {
        if (!json_.contains(field)) return 0;
        size_t index = 0;
        std::string list;
        for (const char* each : allowed) {
            if (json_[field] == each) return index;
            list += (index++ ? " or \"" : "\"") + std::string(each) + "\"";
        }
        wrong(field, "must be " + list);
        return 0;
    }

    void wrong(const std::string& field, const std::string& what) {
        if (!error_)
            error_ =
                Error{.code = ErrorCode::InvalidInput, .message = what, .file = name_, .element = "\"" + field + "\""};
    }

    [[nodiscard]] const std::optional<Error>& error() const { return error_; }

private:
    glm::dvec3 absent(const char* field, std::optional<glm::dvec3> otherwise) {
        if (!otherwise) wrong(field, "is missing from the camera");
        return otherwise.value_or(glm::dvec3(0));
    }

    const Json& json_;
    const std::string& name_;
    std::optional<Error> error_;
};

Error notJson(std::string_view text, size_t byte, const std::string& name) {
    const size_t at = std::min(byte > 0 ? byte - 1 : 0, text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + std::ptrdiff_t(at), '\n');
    return {ErrorCode::InvalidInput, "not a camera: the JSON breaks off or goes wrong here", name,
            "line " + std::to_string(line), at};
}

}  // namespace

Result<OrbitCamera> cameraFromJson(std::string_view text, const std::string& name) {
    Json json;
    try {
        json = Json::parse(text);
    } catch (const Json::parse_error& e) {
        return notJson(text, e.byte, name);
    } catch (const Json::exception&) {
        // The text has a number beyond the range of a double.
        return Error{
            .code = ErrorCode::InvalidInput, .message = "not a camera: a number is out of range", .file = name};
    }
    if (!json.is_object())
        return Error{.code = ErrorCode::InvalidInput, .message = "not a camera: must be a JSON object", .file = name};

    CameraFields fields(json, name);
    OrbitCamera camera;
    camera.up = fields.word("up_axis", {"y", "z"}) == 0 ? UpAxis::Y : UpAxis::Z;
    camera.projection = fields.word("projection", {"perspective", "orthographic"}) == 0 ? Projection::Perspective
                                                                                        : Projection::Orthographic;
    camera.position = fields.triple("position", std::nullopt);
    const glm::dvec3 target = fields.triple("target", std::nullopt);
    const glm::dvec3 up = fields.triple("up", directionOf(camera.up));
    const double degrees = fields.number("fov_degrees", 45);
    if (!(degrees > 0.001 && degrees < 177)) fields.wrong("fov_degrees", "must be between 0.001 and 177");
    if (fields.error()) return *fields.error();

    const glm::dvec3 view = target - camera.position;
    camera.fovY = degrees * std::numbers::pi / 180;
    camera.focusDistance = glm::length(view);
    if (!(camera.focusDistance > 0) || !std::isfinite(camera.focusDistance))
        fields.wrong("target", "must be away from the position");
    else if (!(glm::length(glm::cross(up, view)) > 1e-9 * glm::length(up) * camera.focusDistance))
        fields.wrong("up", "must not be zero or along the view");
    if (fields.error()) return *fields.error();
    camera.orientation = facing(view, up);
    return camera;
}

Result<OrbitCamera> readCamera(const std::filesystem::path& path) {
    constexpr size_t kLimit = 1 << 20;
    VCP_TRY_ASSIGN(const auto text, readText(path, kLimit, "a camera file",
                                             "cannot be opened; views are " + viewNames() + " or a JSON file"));
    auto camera = cameraFromJson(text, path.string());
    if (camera) return camera;
    Error error = camera.error();
    // A field stands in quotes; a text that is no camera has no line.
    if (error.element.starts_with('"'))
        error.element = fmt::format(
            "line {}: {}", LinesOf(text)("/" + error.element.substr(1, error.element.size() - 2)), error.element);
    return error;
}

}  // namespace vcp
