// What the window of `vcp view` shows and does, without the window: a Viewer, what is being opened into it, what is
// measured, what is remembered. window.h turns events into calls, interface.h draws the panels.
//
// Errors of files end nothing: they stand in problem() until the next thing is opened or they are dismissed.
// One thread; times as in viewer.h.
#pragma once

#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "viewer/annotation/annotations.h"
#include "viewer/finest_pick.h"
#include "viewer/picture/picture_sequence.h"
#include "viewer/scene/render_settings.h"
#include "viewer/scene/scene_opening.h"
#include "viewer/viewer.h"
#include "viewer/window/comparison.h"
#include "viewer/window/cut_drawing.h"
#include "viewer/window/measurement.h"
#include "viewer/window/mesh_preview.h"
#include "viewer/window/user_settings.h"

namespace vcp {

/// The settings that were given for this run: what is remembered does not replace them.
struct GivenSettings {
    bool shadows = false, occlusion = false, errorPixels = false, budget = false;
};
/// Uses remembered values for settings that were not given.
void applyRemembered(RenderSettings& render, const UserSettings& user, const GivenSettings& given);

struct SessionOptions {
    std::vector<std::string> inputs;  ///< what the window opens first
    BuildOptions build;               ///< of meshes; inputs, output and progress are ignored
    RenderSettings render;
    uint32_t samples = kMostSamples;  ///< of what is shown, at rest; what is saved has kUsualSamples at most
    UserSettings user;                ///< the remembered settings; `render` takes precedence over them
    /// Makes, for each opening, the function that is told its progress (SceneOpening). May be empty.
    std::function<std::function<bool(const BuildProgress&)>()> makeProgress;
};

/// Pictures to be saved: the switches of the panel.
struct PictureChoice {
    glm::ivec2 size{1920, 1080};  ///< up to 16384 each
    bool transparent = false;     ///< no background
    bool depth = false;           ///< also the distance along each ray, as .pfm
    bool annotated = false;       ///< with annotations()
    bool video = false;           ///< sequences are videos, opaque and without depth
};

class ViewSession {
public:
    /// `surface`: the window's; without one nothing may be presented. Errors: those of Renderer::create.
    static Result<std::unique_ptr<ViewSession>> create(const SessionOptions& options,
                                                       std::optional<SurfaceSource> surface);
    ~ViewSession();

    [[nodiscard]] Viewer& viewer() { return *viewer_; }
    [[nodiscard]] const Viewer& viewer() const { return *viewer_; }
    /// Returns the remembered settings, with what was changed since.
    [[nodiscard]] const UserSettings& user() const { return user_; }
    /// Returns what was changed by hand, to be saved when the window closes.
    [[nodiscard]] const SettingsChanges& changes();
    void togglePanel();
    /// Chooses the theme; the background goes with it where none was chosen by hand.
    void setTheme(ThemeChoice theme);
    /// Takes what the desktop asks for; nothing: it does not say.
    void followDesktop(std::optional<bool> isDark);
    /// Whether the window is dark.
    [[nodiscard]] bool isDark() const;
    /// Keeps a size that was set by hand, not by the window system.
    void keepWindowSize(glm::ivec2 size) { changes_.windowSize = size; }

    /// Opens instead of what is shown, as soon as it is built and its directory read. Cancels what was being opened. Of
    /// several .vcp files and addresses those that cannot be opened are reported, and the others shown.
    void open(std::vector<std::string> inputs);
    /// Returns what is being opened; null when nothing is.
    [[nodiscard]] SceneOpening* opening() { return opening_.get(); }
    /// Returns what was read of the mesh that is being opened; null where nothing was, or a dataset is shown meanwhile.
    [[nodiscard]] MeshPreview* preview() { return opening_ && preview_.isShown() ? &preview_ : nullptr; }

    /// Does Viewer::update, and takes in what was opened or picked meanwhile.
    Result<NextStep> update(double now);

    /// Does Viewer::act, by hand; reports an action that shows nothing.
    void act(ViewerAction action);

    /// Returns the last error, in one line; empty: there is none.
    [[nodiscard]] std::string problem() const;
    void say(std::string problem) { problem_ = std::move(problem); }
    void dismissProblem();
    /// Returns a word about what was done ("copied"); it goes at the next press of a key or button, and after some
    /// seconds.
    [[nodiscard]] const std::string& note() const { return note_; }
    void note(std::string text);

    /// Shows the edges of triangles and leaves, or again what was shown before.
    void toggleWireframe();

    /// What is shown, part by part.
    struct Layer {
        std::string name;
        uint64_t triangles = 0;  ///< 0: a surface with mesostructure
    };
    [[nodiscard]] const std::vector<Layer>& layers() const { return layers_; }

    /// Keeps a thumbnail of what is shown, for the welcome page. Waits for the picture. Does nothing where nothing is
    /// shown; where it cannot be kept, there is none.
    void keepThumbnail();

    void keepBookmark(int number);
    void goToBookmark(int number);
    /// Returns the bookmarks of what is shown; null without any.
    [[nodiscard]] const std::map<int, OrbitCamera>* bookmarks() const;
    /// Goes to a camera in JSON, as cameraToJson writes it.
    void pasteCamera(const std::string& json);

    /// What a click on the picture does, but for turning it.
    enum class Clicks { Nothing, Measure, Annotate };
    [[nodiscard]] Clicks clicks() const { return clicks_; }
    void setClicks(Clicks clicks) { clicks_ = clicks; }
    /// Switches it on, or off again.
    void toggleClicks(Clicks clicks) { clicks_ = clicks_ == clicks ? Clicks::Nothing : clicks; }
    /// Picks on the finest level, which may have to be read first, and measures or annotates there.
    void clickAt(glm::dvec2 pixel);

    /// Annotations of what is shown: of its scene file, as far as they were not changed by hand, as is remembered.
    [[nodiscard]] const std::vector<Annotation>& points() const { return points_; }
    void changePoint(size_t index, std::string title, std::string text);
    void removePoint(size_t index);
    /// Returns the point that a click has made since the last call, to be named; nothing without one.
    std::optional<size_t> takeNewPoint() { return std::exchange(newPoint_, std::nullopt); }
    /// Goes to where a point is seen in the middle, from the same direction and distance.
    void goToPoint(size_t index);
    /// Writes scene-1.json into the working folder, or the next free number: what is shown, camera, light, sections and
    /// annotations; and reports it.
    void saveScene();

    /// Lights what is shown by surroundings: one of kEnvironmentNames or a picture; empty: by the light alone again. An
    /// error is shown.
    void surround(const std::string& source);
    /// Returns what the surroundings are; empty: there are none.
    [[nodiscard]] std::string surroundings() const {
        return viewer_->shading().environment ? environment_ : std::string();
    }
    /// Returns the last picture that was one of them; empty: none.
    [[nodiscard]] const std::string& surroundingsFile() const { return environmentFile_; }

    /// Overlays of streaming; nothing is asked of the renderer for them while they are off.
    bool showsPages = false;
    [[nodiscard]] bool showsFeedback() const { return showsFeedback_; }
    void showFeedback(bool show);
    [[nodiscard]] Measurement& measurement() { return measurement_; }
    /// Whether anything is measured that exportMeasurement() has not written.
    [[nodiscard]] bool hasUnwrittenMeasurement() const {
        return !measurement_.empty() && measurementCsv(measurement_) != writtenMeasurement_;
    }
    [[nodiscard]] bool isPicking() const { return pick_.valid(); }
    /// Returns the unit of what is shown, for lengths.
    [[nodiscard]] const std::optional<LengthUnit>& unit() const { return options_.render.unit; }
    /// Returns what is written over the picture: what its colours mean, the scale bar, what is measured.
    [[nodiscard]] Annotations annotations() const;
    /// Writes measurement-1.csv and .json into the working folder, or the next free number, and reports it.
    void exportMeasurement();

    /// Saves what is shown into the working folder, tile by tile between frames of the window: one picture at a time;
    /// later choices do not affect it. picture-1.png, or the next free number, and picture-1-depth.pfm.
    void savePicture(const PictureChoice& choice);
    /// Saves pictures once around the middle of all, about the up axis, from the current view:
    /// turntable-1/picture-0001.png and so on, in a new folder, or the video turntable-1.mp4.
    void saveTurntable(const PictureChoice& choice, int pictures);
    /// Saves pictures from the first bookmark to the last, through all (cameraPath): path-1/picture-0001.png and so on.
    /// Reports where there are fewer than two bookmarks.
    void savePath(const PictureChoice& choice, int pictures);
    /// Saves the lines in which the section plane cuts what is shown, as a drawing: cut-1.svg (or .dxf, as `extension`
    /// says) in the working folder, or the next free number. Reports where there is no plane, or not one scan alone.
    void saveCut(const std::string& extension);

    /// Colours a dataset by its distance from another one, or from a file: a .vcp, or a mesh. The other one is hidden
    /// meanwhile. Does nothing while something is saved or compared. A problem is reported, and changes nothing.
    void compare(uint32_t dataset, uint32_t with);
    void compareWithFile(uint32_t dataset, const std::string& file);
    /// What compare() asks besides: a switch of the panel.
    Comparison::Choice comparisonChoice;
    /// What is compared: the figures, and the colours that are shown.
    struct ShownComparison {
        uint32_t dataset = 0;
        std::shared_ptr<const Comparison::Measured> measured;
        double range = 1;  ///< the distance at both ends of the colours, world units
    };
    /// Returns the comparison that is shown; null without one.
    [[nodiscard]] const ShownComparison* comparison() const { return compared_ ? &compared_->shown : nullptr; }
    /// Colours what is compared anew, with another distance, above 0, at both ends of the colours.
    void setComparisonRange(double range);
    /// Shows the dataset as it was before, in its own colours.
    void endComparison();
    /// Writes deviation-1.json and .csv into the working folder, or the next free number, and reports it.
    void exportComparison();

    struct SavingProgress {
        std::string name;  ///< name of the file or folder; empty: surfaces are compared
        double fraction;   ///< 0 to 1
        size_t finished, pictures;
    };
    /// Returns the progress; nothing where nothing is being saved or compared.
    [[nodiscard]] std::optional<SavingProgress> saving() const;
    /// Stops saving or comparing. Finished pictures of a sequence stay; a half-written one does not.
    void cancelSaving();

private:
    /// What a person may change in the viewer, and what is remembered.
    struct Looks {
        bool shadows, occlusion;
        double errorPixels;
        uint64_t budgetBytes;
        glm::vec3 backgroundTop, backgroundBottom;
    };

    using Picked = Result<std::optional<SceneHit>>;

    ViewSession(const SessionOptions& options, std::unique_ptr<Viewer> viewer);
    [[nodiscard]] Looks looks() const;
    void noteChanges();
    void takeUp(UpAxis up);
    void useThemesBackground();
    void takeOpened();
    void takePreview(double now);
    [[nodiscard]] bool isPreviewMoved() const { return framed_ && viewer_->camera().current() != *framed_; }
    void annotate(glm::dvec3 position);
    void keepPoints();
    Result<void> show(OpenedScene open, const std::vector<std::string>& inputs);
    Result<void> openInViewer(const OpenedScene& open, const OrbitCamera& camera, std::string name);
    void takeSurroundings(const EnvironmentChoice& choice);
    void takePicked();
    void endPick();
    void saveSequence(const PictureChoice& choice, const std::string& name, const std::vector<OrbitCamera>& cameras);
    void beginSaving(const PictureChoice& choice, std::filesystem::path name, PictureFiles files,
                     const std::vector<OrbitCamera>& cameras, bool isFolder);
    void goOnSaving();
    void takeCut();
    void beginComparing(uint32_t dataset, std::optional<uint32_t> with, Comparison::Subject other);
    void takeCompared();
    Result<void> showCompared(Comparison::Coloured coloured);
    Result<void> replaceDatasets(std::vector<PlacedDataset> datasets);
    [[nodiscard]] std::string endSaving();

    SessionOptions options_;
    UserSettings user_;
    std::optional<bool> desktopIsDark_;
    SettingsChanges changes_;
    std::unique_ptr<Viewer> viewer_;
    Looks seenLooks_;  // as of the last update
    std::unique_ptr<SceneOpening> opening_;
    MeshPreview preview_;
    std::optional<Camera> framed_;  // how the preview was framed last; a person may have moved the camera since
    std::string shown_;             // rememberedName of what is shown; empty: nothing
    ShadingMode unwired_ = ShadingMode::Lit;  // the mode before the wireframe
    bool wasShown_ = false, showsFeedback_ = false, hasSceneLight_ = false;
    std::string environment_, environmentFile_;  // the last surroundings, and the last that were a picture
    std::string problem_, note_;
    double notedAt_;  // time of the update that saw the note first; not a number until then
    std::vector<Layer> layers_;
    OpenedScene open_;       // what is shown, but for a comparison
    OrbitCamera home_;       // the camera that it opened with
    LegendSubject subject_;  // all that is open, in the order of Viewer::hidden()
    Measurement measurement_;
    std::string writtenMeasurement_;  // as a table
    Clicks clicks_ = Clicks::Nothing, pickedFor_ = Clicks::Nothing;
    SceneFile scene_;  // what is shown, as a scene that can be saved
    std::vector<Annotation> points_;
    std::optional<size_t> newPoint_;
    std::shared_ptr<ScenePick> finest_;
    std::future<Picked> pick_;
    struct Saving {
        std::filesystem::path name;  // name of the file, or of a sequence's folder
        std::unique_ptr<Renderer> view;
        std::unique_ptr<PictureSequence> pictures;  // drawn by that view
        bool isFolder = false;                      // of numbered pictures
        int turnsBefore = 2;  // updates without a tile: the window lays its progress out, then shows it
    };
    std::optional<Saving> saving_;
    std::unique_ptr<CutDrawing> cut_;
    std::vector<CutDrawing::Subject> scans_;  // what is shown, without a plane
    std::unique_ptr<Comparison> comparing_;
    uint32_t comparesDataset_ = 0;          // that comparing_ is of
    std::optional<uint32_t> comparesWith_;  // the dataset that it is compared with, which is hidden then
    struct Compared {
        ShownComparison shown;
        // What was shown before, for the way back.
        ShadingMode mode = ShadingMode::Lit;
        std::vector<uint32_t> hidden;
        DatasetLook look;
    };
    std::optional<Compared> compared_;
};

}  // namespace vcp
