// Viewer: one dataset, one camera, one picture, driven by a host: a window (window.h), a widget, a test.
//
// The host hands in what happens, asks what to do, and does it:
//
//   viewer->resize(size); viewer->press(...); viewer->move(...); viewer->key(...);
//   next = viewer->update(now);          // never waits; takes in pages, chooses the resolution
//   if (next.draw) { viewer->draw(); viewer->renderer().present(...); }
//   wait for events, at most next.waitSeconds
//
// Nothing is drawn unless the picture would differ: the camera, the size, the light, or the pages it is made
// of have changed. While the camera moves and a frame is slow, frames are drawn at a part of the resolution;
// once it rests, at all of it. Pages load in the background meanwhile and the picture refines.
//
// Pixels are of the framebuffer, origin at the upper left. Time is what the host says it is: seconds, never
// going back. One thread; several viewers may exist. Nothing here knows of a window system.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "octree/result.h"
#include "render/renderer.h"
#include "viewer/orbit_camera.h"

namespace vcp {

enum class MouseButton { Left, Middle, Right };

/// What keys do; which key does it is the host's to say.
enum class ViewerAction {
    Fit,               ///< all of the dataset into the picture, from the same side
    Reset,             ///< the camera the dataset opened with
    ToggleLight,       ///< the light follows the camera, or stays where it is in the world
    ToggleShadows,
    ToggleOcclusion,   ///< ambient occlusion; left out while the camera moves
    ToggleSection,     ///< cuts through the middle, away from the viewer, with caps; or removes all section planes
    NextShading,       ///< lit, unlit, clay, normals, steps, cells, fetches, level, error
    ToggleProjection,  ///< perspective or orthographic, same size at the point of interest
    ViewFront,
    ViewRight,
    ViewTop,
    ViewIsometric,
};

struct ViewerOptions {
    RendererOptions renderer;
    double errorPixels = 0.5;
    Shading shading;
    std::vector<SectionPlane> sections;
    bool sectionCaps = false;
    PaperMarch march;  ///< of datasets of the method `paper`
    /// While the camera moves, frames that would take longer are drawn smaller. 0: never.
    double movingFrameMs = 66;
};

/// What the host is to do next.
struct NextStep {
    bool draw = false;
    /// Come back after this time even if nothing happens; infinity: nothing is going on.
    double waitSeconds = std::numeric_limits<double>::infinity();
};

/// What the status line says.
struct ViewerStatus {
    std::string name;
    uint64_t triangles = 0;
    uint32_t levels = 0;
    UpdateResult update;
    FrameStats frame;      ///< of the last draw()
    int reduction = 1;     ///< the last picture has 1/reduction of the width and height
    std::string device;
    bool software = false;
    uint64_t budgetBytes = 0;
    std::string problem;   ///< the last thing that went wrong, in one line; empty when nothing has
};

/// The status in one line, the problem first.
std::string statusLine(const ViewerStatus& status);

class Viewer {
public:
    /// Errors: those of Renderer::create.
    static Result<std::unique_ptr<Viewer>> create(const ViewerOptions& options);

    /// Shows a dataset from `camera`, which also is where Reset goes. `name` is for the status line.
    /// Errors: those of Renderer::open.
    Result<void> open(std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source,
                      const OrbitCamera& camera, std::string name);

    /// Either side 0: minimized, nothing is drawn.
    void resize(glm::ivec2 size);

    /// Left: orbit about the point under the cursor, with shift: pan. Middle and right: pan.
    void press(MouseButton button, glm::dvec2 pixel, bool shift);
    void move(glm::dvec2 pixel);
    void release(MouseButton button);
    /// Zooms in on the point under the cursor by `steps` notches of a wheel; out when negative. With shift: moves the
    /// section planes, deeper into what they keep.
    void scroll(glm::dvec2 pixel, double steps, bool shift = false);
    void act(ViewerAction action);

    /// Errors: those of Renderer::update; problems of single pages go to the status instead.
    Result<NextStep> update(double now);
    /// Draws what the last update chose.
    Result<void> draw();

    /// World position of what the last picture shows at a pixel.
    std::optional<glm::dvec3> pointAt(glm::dvec2 pixel);

    [[nodiscard]] const OrbitCamera& camera() const { return camera_; }
    void setCamera(const OrbitCamera& camera) { camera_ = camera; }
    [[nodiscard]] const ViewerStatus& status() const { return status_; }
    [[nodiscard]] uint64_t framesDrawn() const { return framesDrawn_; }
    /// For present() and the pictures.
    [[nodiscard]] Renderer& renderer() { return *renderer_; }

private:
    enum class Drag { None, Orbit, Pan };

    Viewer(const ViewerOptions& options, std::unique_ptr<Renderer> renderer);
    [[nodiscard]] bool hasSize() const { return size_.x > 0 && size_.y > 0; }
    [[nodiscard]] bool isMoving(double now) const;
    [[nodiscard]] int reductionAt(double now) const;
    [[nodiscard]] FrameRequest requestWith(int reduction) const;
    [[nodiscard]] bool refinementIsDue(double now) const;
    [[nodiscard]] NextStep nextStep(double now) const;
    glm::dvec3 pointOfInterest(glm::dvec2 pixel);
    void toggleLight();
    void toggleProjection();
    void toggleSection();
    void moveSections(double steps);
    void look(View view);

    ViewerOptions options_;
    std::unique_ptr<Renderer> renderer_;
    std::shared_ptr<const Dataset> dataset_;
    Box bounds_;
    OrbitCamera camera_, home_;
    Shading shading_;
    std::vector<SectionPlane> sections_;
    bool sectionCaps_ = false;
    glm::ivec2 size_{0};

    Drag drag_ = Drag::None;
    MouseButton dragButton_ = MouseButton::Left;
    glm::dvec2 cursor_{0};
    glm::dvec3 pivot_{0};

    FrameRequest request_;                ///< of the last update
    int requestReduction_ = 1;
    std::optional<FrameRequest> drawn_;   ///< of the last draw
    OrbitCamera seen_;                    ///< the camera of the last update
    double movedAt_ = -std::numeric_limits<double>::infinity();
    double drawnAt_ = -std::numeric_limits<double>::infinity();
    double now_ = 0;
    double fullFrameMs_ = 0;
    bool pagesChanged_ = false;
    uint64_t framesDrawn_ = 0;
    ViewerStatus status_;
};

}  // namespace vcp
