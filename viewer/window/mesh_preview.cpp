#include "viewer/window/mesh_preview.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include <imgui.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "render/frame_setup.h"
#include "render/host/hit_light.h"
#include "viewer/annotation/projector.h"

namespace vcp {

namespace {

constexpr double kSecondsBetweenLooks = 0.25;
constexpr uint32_t kWhite = ~0u;

}  // namespace

/// How a sample is seen: where its points are in the picture, and in which light. Points are relative to its origin.
class MeshPreview::Sight {
public:
    Sight(const FrameRequest& request, glm::dvec3 origin)
        : projector_(request.camera, {request.width, request.height}),
          origin_(origin),
          isPerspective_(request.camera.projection == Projection::Perspective),
          clay_(f32::colourOfLight(request.shading.clay)) {
        const CameraBasis basis = cameraBasis(request.camera, request.width, request.height);
        const LightDirections directions = lightDirections(request, basis);
        forward_ = basis.forward;
        eye_ = request.camera.eye - origin;
        light_ = directions.light;
        sky_ = directions.sky;
    }

    /// Returns the pixel of a point before the eye, unless it is so far aside that pixels lose their meaning.
    [[nodiscard]] std::optional<glm::vec2> pixel(glm::vec3 point) const {
        constexpr double kFarAside = 1 << 20;
        const auto pixel = projector_.point(origin_ + glm::dvec3(point));
        if (!pixel || std::abs(pixel->x) > kFarAside || std::abs(pixel->y) > kFarAside) return std::nullopt;
        return glm::vec2(*pixel);
    }
    [[nodiscard]] float depth(glm::vec3 point) const { return glm::dot(point - eye_, forward_); }
    /// Returns the colour that the screen shows at `point` of a plane: of the side that the eye sees. What is white is
    /// clay, as meshes without colours are.
    [[nodiscard]] ImU32 lit(uint32_t colour, glm::vec3 normal, glm::vec3 point) const {
        const glm::vec3 ray = isPerspective_ ? point - eye_ : forward_;
        const glm::vec3 n = glm::dot(normal, ray) > 0 ? -normal : normal;
        const float light = f32::encodedLight(n, sky_, f32::sunlightOf(n, light_, 1), 1);
        const glm::vec3 own = glm::vec3(colour & 0xffu, colour >> 8 & 0xffu, colour >> 16 & 0xffu) / 255.0f;
        const glm::vec3 shown = glm::clamp(255.0f * light * (colour == kWhite ? clay_ : own), 0.0f, 255.0f);
        return IM_COL32(int(shown.x), int(shown.y), int(shown.z), 255);
    }
    /// Returns the colour of what faces the eye.
    [[nodiscard]] ImU32 litFully() const { return lit(kWhite, -forward_, eye_ + forward_); }

private:
    Projector projector_;
    glm::dvec3 origin_;
    glm::vec3 forward_, eye_, light_, sky_;
    bool isPerspective_;
    glm::vec3 clay_;  // encoded for the screen
};

void MeshPreview::addTriangle(const MeshSample::Triangle& t, const Sight& sight) {
    const glm::vec3 across = glm::cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]);
    const float twice = glm::length(across);
    if (!(twice > 0)) return;
    const glm::vec3 normal = across / twice, middle = (t.corner[0] + t.corner[1] + t.corner[2]) / 3.0f;
    const bool standsForOthers = read_.trianglesEach > 1;
    Patch patch{.depth = sight.depth(middle),
                .colour = sight.lit(t.colour, normal, middle),
                .corners = standsForOthers ? 4u : 3u,
                .pixel = {}};
    std::array<glm::vec3, 4> corners{t.corner[0], t.corner[1], t.corner[2]};
    if (standsForOthers) {
        // Squares of twice the area overlap, so that few gaps are seen between them.
        const float half = std::sqrt(0.25f * float(read_.trianglesEach) * twice);
        const glm::vec3 u = half * glm::normalize(t.corner[1] - t.corner[0]), v = glm::cross(normal, u);
        corners = {middle - u - v, middle + u - v, middle + u + v, middle - u + v};
    }
    for (uint32_t i = 0; i < patch.corners; ++i) {
        const auto pixel = sight.pixel(corners[i]);
        if (!pixel) return;
        patch.pixel[i] = *pixel;
    }
    patches_.push_back(patch);
}

void MeshPreview::addDot(glm::vec3 vertex, float radius, uint32_t colour, const Sight& sight) {
    const auto pixel = sight.pixel(vertex);
    if (!pixel) return;
    const glm::vec2 a(radius, radius), b(radius, -radius);
    patches_.push_back({sight.depth(vertex), colour, 4, {*pixel - a, *pixel + b, *pixel + a, *pixel - b}});
}

bool MeshPreview::update(const MeshSample& sample, double now) {
    const uint64_t version = sample.version();
    if (version == version_ || (isShown() && now < takenAt_ + kSecondsBetweenLooks)) return false;
    read_ = sample.snapshot();
    version_ = version;
    takenAt_ = now;
    return true;
}

void MeshPreview::draw(ImDrawList& list, const FrameRequest& request, float dot) {
    if (drawnVersion_ != version_ || drawn_ != request) {
        const Sight sight(request, read_.origin);
        patches_.clear();
        const uint32_t colour = sight.litFully();
        for (const glm::vec3& vertex : read_.vertices) addDot(vertex, 0.5f * dot, colour, sight);
        const auto dots = ptrdiff_t(patches_.size());
        for (const MeshSample::Triangle& t : read_.triangles) addTriangle(t, sight);
        std::sort(patches_.begin() + dots, patches_.end(),
                  [](const Patch& a, const Patch& b) { return a.depth > b.depth; });
        drawnVersion_ = version_;
        drawn_ = request;
    }
    const ImVec2 plain = ImGui::GetFontTexUvWhitePixel();
    // A list's indices have 16 bits: no more is reserved at once than they reach.
    constexpr size_t kAtOnce = 8192;
    for (size_t begin = 0; begin < patches_.size(); begin += kAtOnce) {
        const auto part = std::span(patches_).subspan(begin, std::min(kAtOnce, patches_.size() - begin));
        list.PrimReserve(int(6 * part.size()), int(4 * part.size()));
        for (const Patch& patch : part) {
            const uint32_t first = list._VtxCurrentIdx;
            // A triangle's fourth corner is its third, and its second half nothing.
            for (const uint32_t i : {0, 1, 2, 0, 2, 3}) list.PrimWriteIdx(ImDrawIdx(first + i));
            for (uint32_t i = 0; i < 4; ++i) {
                const glm::vec2 p = patch.pixel[std::min(i, patch.corners - 1)];
                list.PrimWriteVtx({p.x, p.y}, plain, patch.colour);
            }
        }
    }
}

}  // namespace vcp
