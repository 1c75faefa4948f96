#include "render/frame_setup.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <set>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include "render/false_colours.h"
#include "render/pixel_samples.h"

namespace vcp {

static_assert(kMostSections == frame::kMaxSections && kMostLights == frame::kMaxLights);

namespace {

/// Encodes a colour for the screen with a plain power, as in shade.comp.
glm::vec4 encoded(glm::vec3 linear) { return glm::vec4(glm::pow(glm::max(linear, 0.0f), glm::vec3(1 / 2.2f)), 0); }

/// The directions of the picture's corner and of a step of a pixel.
struct PicturePlane {
    glm::dvec3 corner, stepX, stepY;
};
PicturePlane picturePlane(const CameraBasis& basis, const FrameRequest& request) {
    const PictureTile tile = wholePicture(request);
    const glm::dvec2 corner = upperLeft(request);
    PicturePlane plane;
    plane.stepX = basis.right * (2 * basis.halfWidth / tile.fullWidth);
    plane.stepY = basis.up * (-2 * basis.halfHeight / tile.fullHeight);
    plane.corner =
        basis.up * basis.halfHeight - basis.right * basis.halfWidth + plane.stepX * corner.x + plane.stepY * corner.y;
    return plane;
}

CameraBasis basisOf(const FrameRequest& request) {
    const PictureTile tile = wholePicture(request);
    return cameraBasis(request.camera, tile.fullWidth, tile.fullHeight);
}

/// Splits the eye, in finest cells from the root's corner, into a lattice point and a small rest where it is
/// near enough for the lattice; from farther away single precision is finer than any pixel.
void setOrigin(frame::FrameConstants& c, glm::dvec3 eye, double rootCells) {
    const double latticePerCell = double(c.latticePerCell);
    c.originLattice = glm::ivec4(0);
    if (glm::all(glm::greaterThan(eye, glm::dvec3(-0.5 * rootCells))) &&
        glm::all(glm::lessThan(eye, glm::dvec3(1.5 * rootCells)))) {
        const glm::dvec3 lattice = glm::floor(eye * latticePerCell);
        c.originLattice = glm::ivec4(glm::ivec3(lattice), 0);
        eye -= lattice / latticePerCell;
    }
    c.origin += toVec4(eye);
}

void setSections(frame::FrameConstants& c, const FrameRequest& request, const FileHeader& header) {
    const glm::dvec3 corner(header.origin[0], header.origin[1], header.origin[2]);
    const glm::dvec3 origin = corner + header.cell / double(c.latticePerCell) * glm::dvec3(c.originLattice);
    for (const SectionPlane& plane : request.sections) {
        const double length = glm::length(plane.normal);
        const double off = (glm::dot(plane.normal, origin) - plane.offset) / (length * header.cell);
        c.sections[c.sectionCount++] = glm::vec4(glm::vec3(plane.normal / length), float(off));
    }
}

// Rays of light begin so many pixels above the surface, in addition to the error of the picture.
constexpr double kLiftPixels = 0.5;

void setLight(frame::FrameConstants& c, const FrameRequest& request, const FileHeader& header, const CameraBasis& basis,
              double errorPixels) {
    const double pixel = 2 * basis.halfHeight / wholePicture(request).fullHeight;
    const bool perspective = request.camera.projection == Projection::Perspective;
    const double diagonal = glm::distance(glm::dvec3(header.boundsMin[0], header.boundsMin[1], header.boundsMin[2]),
                                          glm::dvec3(header.boundsMax[0], header.boundsMax[1], header.boundsMax[2]));
    const Shading& s = request.shading;
    const double radius = s.occlusionRadius > 0 ? s.occlusionRadius : 0.1 * diagonal;
    const double lift = kLiftPixels + (std::isfinite(errorPixels) ? errorPixels : 0);
    (perspective ? c.pixelEdgePerDepth : c.pixelEdge) = float(perspective ? pixel : pixel / header.cell);
    c.occlusionReach = float(radius / header.cell);
    c.lightLift = float(lift);
    if (!hasLight(s)) return;
    c.occlusionRays = s.occlusionRays;
    c.hasShadows = castsShadows(s) ? 1 : 0;
}

/// Returns the error of a picture, in pixels, as rays of light need it: at least what is tolerated, or what the
/// coarsest page errs by where that is less. So they begin at the same points whatever is drawn of what rays do not
/// hit.
double errorToLift(const Dataset& dataset, const FrameRequest& request, double errorPixels) {
    if (dataset.pages.empty()) return errorPixels;
    const double coarsest = shownError(dataset, dataset.pages[0], selectionView(request));
    return std::max(errorPixels, std::min(request.errorPixels, coarsest));
}

}  // namespace

LightDirections lightDirections(const FrameRequest& request, const CameraBasis& basis) {
    const DirectedLight light{request.shading.lightFollowsCamera, request.shading.lightDirection};
    return {towardsLight(light, basis), light.followsCamera ? basis.up : glm::normalize(request.camera.up)};
}

glm::dvec3 towardsLight(const DirectedLight& light, const CameraBasis& basis) {
    const glm::dvec3 own = glm::normalize(glm::dvec3(light.direction));
    return light.followsCamera ? basis.right * own.x + basis.up * own.y - basis.forward * own.z : own;
}

bool hasLight(const Shading& shading) {
    return (shading.mode == ShadingMode::Lit || shading.mode == ShadingMode::Clay) &&
           (castsShadows(shading) || shading.occlusionRays > 0);
}

bool castsShadows(const Shading& shading) {
    const std::vector<DirectedLight> lights = lightsOf(shading);
    return shading.shadows && areLightsOn(shading) &&
           std::any_of(lights.begin(), lights.end(), [](const DirectedLight& light) { return light.strength > 0; });
}

uint32_t shadingMode(ShadingMode mode) {
    switch (mode) {
        case ShadingMode::Lit:
            return frame::kShadeLit;
        case ShadingMode::Clay:
            return frame::kShadeClay;
        case ShadingMode::Unlit:
            return frame::kShadeUnlit;
        case ShadingMode::Normals:
            return frame::kShadeNormals;
        case ShadingMode::Steps:
            return frame::kShadeSteps;
        case ShadingMode::Cells:
            return frame::kShadeCells;
        case ShadingMode::Fetches:
            return frame::kShadeFetches;
        case ShadingMode::Level:
            return frame::kShadeLevel;
        case ShadingMode::Error:
            return frame::kShadeError;
        case ShadingMode::Wireframe:
            return frame::kShadeWireframe;
    }
    return frame::kShadeLit;
}

uint32_t hitPlanes(const FrameRequest& request, bool colour) {
    return 2 + (colour ? 1 : 0) + (hasLight(request.shading) || hasHitNumbers(request.shading.mode) ? 1 : 0);
}

frame::FrameConstants frameConstants(const FrameRequest& request, const Dataset* dataset, uint32_t stripes, bool colour,
                                     double errorPixels, const Similarity& placement) {
    frame::FrameConstants c{};
    const FileHeader header = dataset != nullptr ? dataset->header : FileHeader{.cell = 1, .levels = 1, .log2Cells = 5};
    const CameraBasis basis = basisOf(request);
    const PicturePlane plane = picturePlane(basis, request);
    if (request.camera.projection == Projection::Perspective) {
        c.direction = toVec4(basis.forward + plane.corner);
        c.directionX = toVec4(plane.stepX);
        c.directionY = toVec4(plane.stepY);
    } else {
        c.direction = toVec4(basis.forward);
        c.origin = toVec4(plane.corner / header.cell);
        c.originX = toVec4(plane.stepX / header.cell);
        c.originY = toVec4(plane.stepY / header.cell);
    }
    const int latticeBits = int(frame::kLatticeBits) - int(header.log2Cells) - int(header.levels - 1);
    c.latticePerCell = std::ldexp(1.0f, latticeBits);
    c.cellPerLattice = std::ldexp(1.0f, -latticeBits);
    const glm::dvec3 corner(header.origin[0], header.origin[1], header.origin[2]);
    setOrigin(c, (request.camera.eye - corner) / header.cell,
              std::ldexp(1.0, int(header.log2Cells + header.levels) - 1));

    c.sampleNumber = request.sample;
    c.width = request.width;
    c.height = request.height;
    c.tilesX = (request.width + frame::kTileSize - 1) / frame::kTileSize;
    c.tilesY = (request.height + frame::kTileSize - 1) / frame::kTileSize;
    c.log2Cells = header.log2Cells;
    c.finestLevel = header.levels - 1;
    c.stripes = stripes;
    c.shadingMode = shadingMode(request.shading.mode);
    const LightDirections directions = lightDirections(request, basis);
    const float on = areLightsOn(request.shading) ? 1.0f : 0.0f;
    c.lightDirection = glm::vec4(glm::vec3(directions.light), on * request.shading.lightStrength);
    c.opacity = request.shading.opacity;
    c.lightCount = 1;
    for (const DirectedLight& light : request.shading.moreLights)
        c.moreLights[c.lightCount++ - 1] = glm::vec4(glm::vec3(towardsLight(light, basis)), on * light.strength);
    c.upDirection = toVec4(directions.sky);
    c.clay = encoded(request.shading.clay);
    c.cap = encoded(request.shading.cap);
    c.lightPlane = hitPlanes(request, colour) - 1;
    c.paperEpsilon = request.march.epsilon;
    c.worldPerCell = float(header.cell * placement.scale);
    const glm::dquat& q = placement.rotation;
    c.rotation = glm::vec4(glm::dvec4(q.x, q.y, q.z, q.w));
    if (request.shading.environment) {
        c.hasEnvironment = 1;
        const auto rows = environmentRows(*request.shading.environment, q);
        std::copy(rows.begin(), rows.end(), c.environment);
    }
    setSections(c, request, header);
    setLight(c, request, header, basis, dataset != nullptr ? errorToLift(*dataset, request, errorPixels) : 0);
    return c;
}

PictureTile wholePicture(const FrameRequest& request) {
    return request.tile.value_or(PictureTile{0, 0, request.width, request.height});
}

glm::dvec2 upperLeft(const FrameRequest& request) {
    const PictureTile tile = wholePicture(request);
    return glm::dvec2(tile.x, tile.y) + sampleOffset(request.sample);
}

std::vector<SectionCut> sectionCuts(std::span<const SectionPlane> planes) {
    std::vector<SectionCut> cuts;
    for (const SectionPlane& plane : planes) {
        const double length = glm::length(plane.normal);
        cuts.emplace_back(plane.normal / length, plane.offset / length);
    }
    return cuts;
}

PictureRays pictureRays(const FrameRequest& request) {
    const PictureTile whole = wholePicture(request);
    PictureRays rays = pictureRays(request.camera, whole.fullWidth, whole.fullHeight);
    const glm::dvec2 corner = upperLeft(request);
    rays.origin = rays.originAt(corner.x, corner.y);
    rays.direction = rays.directionAt(corner.x, corner.y);
    rays.size = {int(request.width), int(request.height)};
    rays.sections = sectionCuts(request.sections);
    return rays;
}

PixelHit pixelHit(const FrameRequest& request, PicturePixel pixel, double depth, glm::vec3 normal) {
    const PictureTile whole = wholePicture(request);
    const glm::dvec2 at = upperLeft(request) + glm::dvec2(pixel.x, pixel.y) + 0.5;
    const CameraRay ray = cameraRay(request.camera, whole.fullWidth, whole.fullHeight, at.x, at.y);
    return {.depth = depth, .position = ray.origin + ray.direction * depth, .normal = normal};
}

Caps capsOf(const FrameRequest& request, const Dataset& dataset) {
    if (request.sections.empty()) return Caps::None;
    return request.sectionCaps == Caps::Closed && !dataset.hasOpenParts() ? Caps::All : request.sectionCaps;
}

SectionKind sectionKind(const FrameRequest& request, Caps caps) {
    if (request.sections.empty()) return SectionKind::None;
    return caps == Caps::None     ? SectionKind::Open
           : caps == Caps::Closed ? SectionKind::ClosedCapped
                                  : SectionKind::Capped;
}

std::vector<uint32_t> backgroundRows(const FrameRequest& request) {
    const Shading& shading = request.shading;
    std::vector<uint32_t> rows(request.height);
    if (shading.transparent) return rows;
    const glm::vec4 top = encoded(shading.backgroundTop), bottom = encoded(shading.backgroundBottom);
    const PictureTile whole = wholePicture(request);
    for (uint32_t y = 0; y < request.height; ++y) {
        const glm::vec4 colour = glm::mix(top, bottom, (float(whole.y + y) + 0.5f) / float(whole.fullHeight));
        rows[y] = 0xff000000u;
        for (int i = 0; i < 3; ++i) rows[y] |= uint32_t(std::lround(glm::clamp(colour[i], 0.0f, 1.0f) * 255)) << 8 * i;
    }
    return rows;
}

namespace {

/// A number for what is cast beside the camera's place: planes that cut, and rays of light.
uint64_t numberOfRays(const FrameRequest& request) {
    uint64_t number = 0;
    const auto add = [&](auto value) {
        number = (std::rotl(number, 23) ^ std::hash<decltype(value)>{}(value)) * 0x9e3779b97f4a7c15;
    };
    const auto addPoint = [&](const auto& p) { add(p.x), add(p.y), add(p.z); };
    for (const SectionPlane& plane : request.sections) addPoint(plane.normal), add(plane.offset);
    if (!request.sections.empty()) add(request.sectionCaps);
    const Shading& shading = request.shading;
    if (!hasLight(shading)) return number;
    add(castsShadows(shading)), add(shading.occlusionRays), add(shading.occlusionRadius);
    add(shading.lightFollowsCamera), addPoint(shading.lightDirection);
    for (const DirectedLight& light : shading.moreLights) add(light.followsCamera), addPoint(light.direction);
    // What is hidden is in no ray's way.
    const std::set<uint32_t> hidden(request.hidden.begin(), request.hidden.end());
    for (const uint32_t dataset : hidden) add(dataset);
    return number;
}

}  // namespace

SelectionView selectionView(const FrameRequest& request) {
    const CameraBasis basis = basisOf(request);
    const PictureTile whole = wholePicture(request);
    SelectionView view;
    view.eye = request.camera.eye;
    view.orthographic = request.camera.projection == Projection::Orthographic;
    view.pixelsPerUnit = whole.fullHeight / (2 * basis.halfHeight);
    view.errorPixels = request.errorPixels;
    view.colourError = request.colourError;
    view.paperReach = double(request.march.reach);
    view.pixels = double(request.width) * request.height;
    view.rays = numberOfRays(request);
    // The picture's edges are tangents, or world units where the projection is orthographic.
    const auto across = [&](double x) { return basis.halfWidth * (2 * x / whole.fullWidth - 1); };
    const auto upward = [&](double y) { return basis.halfHeight * (1 - 2 * y / whole.fullHeight); };
    const double left = across(whole.x), right = across(double(whole.x) + request.width);
    const double upper = upward(whole.y), lower = upward(double(whole.y) + request.height);
    const auto plane = [&](glm::dvec3 inward, double off) {
        return view.orthographic ? glm::dvec4(inward, off) : glm::dvec4(inward + basis.forward * off, 0);
    };
    view.planes = {plane(basis.right, -left), plane(-basis.right, right), plane(basis.up, -lower),
                   plane(-basis.up, upper)};
    return view;
}

Result<void> checkRequest(const FrameRequest& request) {
    const auto usage = [](const char* what) { return Error{.code = ErrorCode::Usage, .message = what}; };
    const Camera& camera = request.camera;
    if (request.width < 1 || request.height < 1 || request.width > 16384 || request.height > 16384)
        return usage("a picture is 1 to 16384 pixels wide and high");
    const PictureTile whole = wholePicture(request);
    constexpr uint32_t kLargestWhole = 1 << 20;
    if (whole.fullWidth < 1 || whole.fullHeight < 1 || whole.fullWidth > kLargestWhole ||
        whole.fullHeight > kLargestWhole || uint64_t{whole.x} + request.width > whole.fullWidth ||
        uint64_t{whole.y} + request.height > whole.fullHeight)
        return usage("a tile must lie within its picture, and that be at most 2^20 pixels wide and high");
    if (request.sample >= kMostSamples) return usage("a pixel has at most 64 samples");
    if (!(request.errorPixels >= 0)) return usage("the tolerated error in pixels must not be negative");
    if (!(request.colourError >= 0)) return usage("the tolerated colour error must not be negative");
    const auto finite = [](glm::dvec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); };
    if (!finite(camera.eye) || !finite(camera.forward) || !finite(camera.up))
        return usage("the camera has coordinates that are not numbers");
    if (!(request.march.epsilon > 0) || !std::isfinite(request.march.epsilon)) return usage("epsilon must be above 0");
    if (request.sections.size() > kMostSections) return usage("at most 6 section planes at once");
    for (const SectionPlane& plane : request.sections)
        if (!finite(plane.normal) || !std::isfinite(plane.offset) || !(glm::length(plane.normal) > 0))
            return usage("a section plane's normal is zero or not a number");
    for (const DatasetLook& look : request.looks)
        if (!(look.opacity >= 0 && look.opacity <= 1)) return usage("a dataset's opacity is not from 0 to 1");
    if (request.shading.moreLights.size() >= kMostLights) return usage("at most 4 lights at once");
    for (const DirectedLight& light : lightsOf(request.shading))
        if (!finite(light.direction) || !(glm::length(light.direction) > 0) || !(light.strength >= 0) ||
            light.strength > kStrongestLight)
            return usage("a light's direction is zero or not a number, or its strength is not from 0 to 10");
    if (const auto& environment = request.shading.environment)
        if (!(std::abs(glm::length(environment->up) - 1) < 1e-3) || !std::isfinite(environment->turn) ||
            !(environment->strength >= 0) || environment->strength > kStrongestEnvironment)
            return usage(
                "an environment's axis is not a unit vector, its turn not a number, or its strength not from "
                "0 to 10");
    if (request.shading.occlusionRays > kMostOcclusionRays) return usage("at most 64 occlusion rays a pixel");
    if (!(request.shading.occlusionRadius >= 0) || !std::isfinite(request.shading.occlusionRadius))
        return usage("the occlusion radius must not be negative");
    const double sine = glm::length(glm::cross(camera.forward, camera.up));
    if (!(sine > 1e-9 * glm::length(camera.forward) * glm::length(camera.up)))
        return usage("the camera's forward and up directions are parallel or zero");
    if (camera.projection == Projection::Perspective && !(camera.verticalFov > 0 && camera.verticalFov < 3.1))
        return usage("the camera's field of view must be above 0 and below 3.1 radians");
    if (camera.projection == Projection::Orthographic && !(camera.orthographicHeight > 0))
        return usage("the camera's height must be above 0");
    return {};
}

}  // namespace vcp
