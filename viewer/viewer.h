// Viewer: one dataset, one camera, one picture, driven by a host: a window (window.h), a widget, a test.
//
// The host hands in what happens, asks what to do, and does it:
//
//   viewer->resize(size); viewer->press(...); viewer->move(...); viewer->key(...);
//   next = viewer->update(now);          // never waits long; takes in pages, chooses the resolution
//   if (next.draw && viewer->draw()) viewer->renderer().present(...);
//   wait for events, at most next.waitSeconds
//
// A camera that is sent somewhere (act, moveTo, centreOn) goes there smoothly, and stops where it is as soon as the
// next press, scroll or key wants something else. In fly mode a drag turns the head and fly() moves the eye.
//
// Nothing is drawn unless the picture would differ: the camera, the size, the light, or the pages it is made
// of have changed. While the camera moves and a frame is slow, frames are drawn at a part of the resolution;
// once it rests, at all of it. Pages load in the background meanwhile and the picture refines. When all is there and
// nothing moves, each draw() adds a part of a further sample (Renderer::refineAhead) until the picture has
// options.samples: any change begins with a whole picture of one sample again.
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

#include "octree/io/result.h"
#include "render/view/renderer.h"
#include "viewer/camera/orbit_camera.h"
#include "viewer/moving_size.h"
#include "viewer/scene/meso_scene.h"
#include "viewer/section_handle.h"
#include "viewer/surface_motion.h"

namespace vcp {

enum class MouseButton { Left, Middle, Right };
struct Modifiers {
    bool shift = false, control = false;
};

/// What keys do; the host decides which key does it.
enum class ViewerAction {
    Fit,          ///< fits all of the dataset into the picture, from the same side
    Reset,        ///< goes to the camera the dataset opened with
    ToggleLight,  ///< lets the light follow the camera, or stay where it is in the world
    ToggleShadows,
    ToggleOcclusion,   ///< ambient occlusion; left out of moving pictures where it takes long
    ToggleSection,     ///< cuts through the middle, away from the viewer, with caps; or removes all section planes
    NextShading,       ///< lit, unlit, clay, normals, steps, cells, fetches, level, error, wireframe
    ToggleProjection,  ///< perspective or orthographic, same size at the point of interest
    ToggleColour,      ///< the dataset's colours, or clay
    ToggleUpAxis,      ///< y or z
    ToggleFly,
    ViewFront,
    ViewRight,
    ViewTop,
    ViewIsometric,
    TogglePlay,  ///< surfaces that go along paths go on, or stay where they are
};

struct ViewerOptions {
    RendererOptions renderer;
    double errorPixels = 0.5;
    double colourError = kUsualColourError;  ///< ΔE
    Shading shading;
    std::vector<SectionPlane> sections;
    Caps sectionCaps = Caps::None;
    PaperMarch march;  ///< march through datasets of the method `paper`
    /// While the camera moves, frames that would take longer are drawn smaller. 0: never, and without occlusion.
    double movingFrameMs = 50;
    double moveSeconds = 0.3;  ///< time that a smooth move takes; 0: at once
    uint32_t samples = 1;      ///< of a picture at rest (samplesOf in render/pixel_samples.h)
    /// An update measures the heights of remeshed surfaces for so long; the next one goes on. Nothing is drawn until
    /// all are measured.
    double measuringMs = 60;
    /// draw() returns when the frame is handed to the GPU (Renderer::renderAhead), for hosts that only show pictures.
    /// The status then tells of the newest frame that has ended. Such a host calls waitForFrame() before it draws.
    bool framesAhead = false;
};

/// What the host should do next.
struct NextStep {
    bool draw = false;
    /// Time after which to come back even if nothing happens; infinity: nothing is going on.
    double waitSeconds = std::numeric_limits<double>::infinity();
};

/// What the status line shows.
struct ViewerStatus {
    std::string name;
    uint64_t triangles = 0;
    uint32_t levels = 0;
    UpdateResult update;
    Detail detail = Detail::Loading;
    FrameStats frame;         ///< statistics of the last draw(), or of the newest frame that has ended (framesAhead)
    double measuredPart = 1;  ///< of the heights that the next picture is made of, 0 to 1; 1: all is measured
    double drawnPart = 1;     ///< of the picture that is being drawn, 0 to 1; 1: none is
    int reduction = 1;        ///< the last picture has 1/reduction of the width and height
    uint32_t samples = 0;     ///< whole samples of the last picture
    std::string device;
    bool software = false;
    uint64_t budgetBytes = 0;
    std::string without;  ///< requested, but not drawn, in a few words; empty: nothing
    std::string problem;  ///< the last error, in one line; empty when there was none
};

/// Returns a text such as "0.46" or "510".
std::string formatPixels(double pixels);

/// Returns "within 0.5 px, 12 patches may be farther off" of a frame's remeshed surfaces; empty where nothing is
/// certified.
std::string remeshedText(const FrameStats& stats);

/// Returns the status in one line of at most so many characters: less important parts are left out.
std::string statusLine(const ViewerStatus& status, size_t most = std::numeric_limits<size_t>::max());

class Viewer {
public:
    /// Makes a viewer with a renderer of its own. Errors: those of Renderer::create.
    static Result<std::unique_ptr<Viewer>> create(const ViewerOptions& options);
    /// Makes a viewer on a view that shares its device with others (Renderer::addView).
    static std::unique_ptr<Viewer> on(std::unique_ptr<Renderer> view, const ViewerOptions& options);

    /// Shows a dataset from `camera`, which also is where Reset goes. `name` is for the status line.
    /// Errors: those of Renderer::open.
    Result<void> open(std::shared_ptr<const Dataset> dataset, std::shared_ptr<const PageSource> source,
                      const OrbitCamera& camera, std::string name);

    /// Shows several datasets where they are placed, and surfaces with mesostructure. Errors: Usage, where there is
    /// neither; those of Renderer::open and setSurfaces.
    Result<void> open(std::vector<PlacedDataset> datasets, const MesoScene& surfaces, const OrbitCamera& camera,
                      std::string name);

    /// Does the same where a view that shares the device has opened it all; sources and arrays are not used.
    void show(const std::vector<PlacedDataset>& datasets, const MesoScene& surfaces, const OrbitCamera& camera,
              std::string name);

    /// Lets the camera be moved about `bounds` where nothing is open: for a host that shows something itself until
    /// open().
    void foresee(const Box& bounds, const OrbitCamera& camera);

    /// Sets the picture's size. Either side 0: minimized, nothing is drawn.
    void resize(glm::ivec2 size);

    /// Left: orbits about the point under the cursor, with shift: pans, with control: turns the light. Middle and
    /// right: pan. While flying, left turns the head. Left on the handle of a section moves or turns the plane.
    void press(MouseButton button, glm::dvec2 pixel, Modifiers modifiers = {});
    void move(glm::dvec2 pixel);
    void release(MouseButton button);
    /// Puts a section plane that is being dragged back where it was gripped. Returns false where none is.
    bool cancelSectionDrag();
    /// Zooms in on the point under the cursor by `steps` notches of a wheel; out when negative. With shift: moves the
    /// section planes, deeper into what they keep.
    void scroll(glm::dvec2 pixel, double steps, bool shift = false);
    void act(ViewerAction action);

    /// Moves the camera there smoothly. Without a dataset it does nothing.
    void moveTo(const OrbitCamera& camera);
    /// Moves what is under the cursor to the middle of the picture, smoothly. Does nothing where nothing is hit.
    void centreOn(glm::dvec2 pixel);
    /// While flying: sets the direction in camera axes (right, up, forward), each from -1 to 1, until the next call.
    void fly(glm::dvec3 direction) { flyDirection_ = direction; }
    [[nodiscard]] bool isFlying() const { return isFlying_; }
    /// The speed of flying: at 1 the dataset's diagonal takes 4 seconds.
    [[nodiscard]] double flySpeed() const { return flySpeed_; }

    /// Takes in pages and says what to do next. Errors: those of Renderer::update; problems of pages go to the status.
    Result<NextStep> update(double now);
    /// Ends the measuring of heights for the picture of now, which is not drawn then. Returns false where nothing is
    /// measured.
    bool cancelMeasuring();
    /// Draws what the last update chose: a picture, or a part of a sample of the last one. Returns whether there is
    /// something new to present: a picture or a whole sample.
    Result<bool> draw();
    /// Whether nothing is missing and nothing moves, so that the picture is drawn as it is to stay.
    [[nodiscard]] bool isAtRest() const;
    /// Whether the last picture is still to have further samples.
    [[nodiscard]] bool wantsSamples() const;
    /// Waits until a frame that is drawn now would not wait itself for those in flight, where it is drawn ahead.
    /// Returns whether it waited: then the host looks for input and calls update() again, so that the frame shows the
    /// newest.
    Result<bool> waitForFrame();

    /// Returns what the last picture shows at a pixel.
    std::optional<PixelHit> hitAt(glm::dvec2 pixel);
    /// Returns the world position of what is shown there.
    std::optional<glm::dvec3> pointAt(glm::dvec2 pixel);

    /// The point of the plane itself where the last picture shows a section's cap under the cursor; else nothing.
    std::optional<glm::dvec3> capAt(glm::dvec2 pixel);

    [[nodiscard]] const OrbitCamera& camera() const { return camera_; }
    /// Sets the camera at once.
    void setCamera(const OrbitCamera& camera) {
        camera_ = camera;
        move_.reset();
    }
    [[nodiscard]] const Box& bounds() const { return bounds_; }
    /// Whether anything was opened.
    [[nodiscard]] bool isOpen() const { return isOpen_; }
    /// The first dataset; null without any.
    [[nodiscard]] const std::shared_ptr<const Dataset>& dataset() const { return dataset_; }
    /// Whether some dataset's materials have channels (Shading::channels).
    [[nodiscard]] bool hasChannels() const { return hasChannels_; }
    /// Whether some dataset's pages say how far off their colours are.
    [[nodiscard]] bool hasColourErrors() const { return hasColourErrors_; }
    /// Returns why an action shows nothing on what is open; empty where it shows something.
    [[nodiscard]] std::string whyWithout(ViewerAction action) const;
    [[nodiscard]] glm::ivec2 size() const { return size_; }
    /// Sets what panels of the host cover: Fit and the standard views keep clear of it from now on.
    void setCovered(const PictureMargins& covered) { covered_ = covered; }
    [[nodiscard]] const PictureMargins& covered() const { return covered_; }

    /// How things look, for panels to show and to change.
    [[nodiscard]] const Shading& shading() const { return shading_; }
    void setShading(const Shading& shading) { shading_ = shading; }
    [[nodiscard]] const std::vector<SectionPlane>& sections() const { return sections_; }
    void setSections(std::vector<SectionPlane> planes);
    [[nodiscard]] Caps sectionCaps() const { return sectionCaps_; }
    void setSectionCaps(Caps caps) { sectionCaps_ = caps; }
    /// The numbers of the datasets that are not shown, in the order of open(); empty after it.
    [[nodiscard]] const std::vector<uint32_t>& hidden() const { return hidden_; }
    void setHidden(std::vector<uint32_t> datasets) { hidden_ = std::move(datasets); }
    /// Looks of datasets that are not shown as they are.
    [[nodiscard]] const std::vector<DatasetLook>& looks() const { return looks_; }
    void setLooks(std::vector<DatasetLook> looks) { looks_ = std::move(looks); }
    /// The look of one of them, and another one for it.
    [[nodiscard]] DatasetLook lookOf(uint32_t dataset) const;
    void setLook(const DatasetLook& look);
    /// Surfaces that go along paths; while they do, frames are drawn as while the camera moves.
    [[nodiscard]] const SurfaceMotion& motion() const { return motion_; }
    /// Lets section planes be gripped from now on; for a host that draws the handles. `scale`: as for sectionHandle();
    /// 0: not any more.
    void showSectionHandles(double scale) { handleScale_ = scale; }
    /// Returns the handles to draw over the picture.
    [[nodiscard]] std::vector<SectionHandle> sectionHandles() const;
    /// Returns the part of a handle that is dragged, else the one under the cursor at the last move().
    [[nodiscard]] SectionGrab sectionGrab() const;
    [[nodiscard]] double errorPixels() const { return options_.errorPixels; }
    void setErrorPixels(double pixels) { options_.errorPixels = pixels; }
    [[nodiscard]] double colourError() const { return options_.colourError; }
    void setColourError(double deltaE) { options_.colourError = deltaE; }
    [[nodiscard]] uint32_t samples() const { return options_.samples; }
    /// Samples that the picture of now comes to: one, where it shows numbers.
    [[nodiscard]] uint32_t mostSamples() const;
    /// Sets how many samples pictures have at rest, 1 to kMostSamples; a picture with more keeps them.
    void setSamples(uint32_t samples) { options_.samples = samples; }
    /// Sets the budget of the page pool, from now on. Errors: those of Renderer::setBudgets.
    Result<void> setBudget(uint64_t bytes);
    [[nodiscard]] const ViewerStatus& status() const { return status_; }
    void dismissProblem() { status_.problem.clear(); }
    [[nodiscard]] uint64_t framesDrawn() const { return framesDrawn_; }
    /// Returns a request for what the window shows, at full quality and of another size, for pictures.
    [[nodiscard]] FrameRequest pictureOf(glm::ivec2 size) const;
    /// The renderer, for present() and the pictures.
    [[nodiscard]] Renderer& renderer() { return *renderer_; }

private:
    enum class Drag { None, Orbit, Pan, Light, Head, Section };
    struct Move {
        OrbitCamera from, to;
        double beganAt;  ///< time of the update that saw it first; not a number until then
    };

    Viewer(const ViewerOptions& options, std::unique_ptr<Renderer> renderer);
    [[nodiscard]] bool hasSize() const { return size_.x > 0 && size_.y > 0; }
    [[nodiscard]] bool isMoving(double now) const;
    int reductionAt(double now);
    [[nodiscard]] FrameRequest requestWith(int reduction) const;
    [[nodiscard]] bool refinementIsDue(double now) const;
    [[nodiscard]] NextStep nextStep(double now);
    Result<NextStep> measuredFirst(NextStep next);
    Result<bool> drawSample();
    /// Whether the frame that was begun is still what is to be drawn.
    [[nodiscard]] bool goesOnDrawing() const;
    void finishDraw();
    [[nodiscard]] bool isCheaper() const;
    void takeStats(const DoneFrame& done);
    glm::dvec3 pointOfInterest(glm::dvec2 pixel);
    void toggleLight();
    void toggleProjection();
    void toggleSection();
    void moveSections(double steps);
    void turnLight(glm::dvec2 by);
    bool gripSection(glm::dvec2 pixel);
    void dragSection(glm::dvec2 pixel);
    void look(View view);
    void advanceCamera(double now);
    void advanceMotion(double now);
    [[nodiscard]] bool isFlown() const { return isFlying_ && flyDirection_ != glm::dvec3(0); }
    /// Whether something goes on by itself.
    [[nodiscard]] bool isUnderWay() const { return move_ || isFlown() || motion_.isPlaying(); }

    ViewerOptions options_;
    std::unique_ptr<Renderer> renderer_;
    std::shared_ptr<const Dataset> dataset_;
    bool isOpen_ = false;
    bool hasBounds_ = false;  // of what is open or foreseen: the camera may be moved
    bool isPaper_ = false;    // all datasets are of the method `paper`
    bool hasChannels_ = false, hasColourErrors_ = false;
    Box bounds_;
    OrbitCamera camera_, home_;
    Shading shading_;
    std::vector<SectionPlane> sections_;
    std::vector<glm::dvec3> sectionAnchors_;  // for the planes' handles, as the planes were turned last; may be fewer
    double handleScale_ = 0;
    std::optional<SectionDrag> sectionDrag_;
    Caps sectionCaps_ = Caps::None;
    SurfaceMotion motion_;
    std::vector<uint32_t> hidden_;
    std::vector<DatasetLook> looks_;
    glm::ivec2 size_{0};
    PictureMargins covered_;

    Drag drag_ = Drag::None;
    MouseButton dragButton_ = MouseButton::Left;
    glm::dvec2 cursor_{0};
    glm::dvec3 pivot_{0};
    std::optional<Move> move_;
    bool isFlying_ = false;
    glm::dvec3 flyDirection_{0};
    double flySpeed_ = 1;

    FrameRequest request_;  ///< request of the last update
    int requestReduction_ = 1;
    std::optional<FrameRequest> drawn_;    ///< request of the last draw
    std::optional<FrameRequest> givenUp_;  ///< a request that is not drawn, for its heights are not to be measured
    FrameRequest begun_;                   ///< request of the frame that is drawn step by step
    OrbitCamera seen_;                     ///< the camera of the last update
    double movedAt_ = -std::numeric_limits<double>::infinity();
    double drawnAt_ = -std::numeric_limits<double>::infinity();
    double now_ = 0;
    MovingSize movingSize_;
    MovingOcclusion movingOcclusion_;
    bool pagesChanged_ = false;
    bool hasSettled_ = false;              // since a scene was opened
    bool addsSample_ = false;              // the next draw does
    uint32_t mostSamples_ = kMostSamples;  // that the device can add to a picture of this size
    uint64_t framesDrawn_ = 0;
    ViewerStatus status_;
};

}  // namespace vcp
