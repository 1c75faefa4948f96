// The panels over the picture: toolbar, status bar, panel, toasts, welcome page, file list, keys, scale bar, measured
// lines, progress; laid out with Dear ImGui. A click acts on the session at once.
//
// interface.cpp has the bars and toasts, interface_panel.cpp the panel, interface_compare.cpp its section that
// compares, interface_pages.cpp what covers the picture for a while, interface_overlays.cpp what is drawn over it. Used
// between InterfacePainter::begin and end, in the same thread.
#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "viewer/window/controls.h"
#include "viewer/window/file_list.h"
#include "viewer/window/view_session.h"

namespace vcp {

/// What the panels need of the window.
struct InterfaceHost {
    std::function<void(const std::string&)> copyText;
    std::function<std::string()> pasteText;
    std::function<void(std::vector<std::string>)> open;
    /// Numbers of the recent files' thumbnails in Look::pictures, by what the files are remembered as.
    std::map<std::string, size_t> thumbnails;
};

class Interface {
public:
    Interface(ViewSession& session, InterfaceHost host) : session_(&session), host_(std::move(host)) {}

    /// Lays everything out and tells the viewer what it covers.
    void layOut(glm::ivec2 framebuffer, const Look& look);

    /// Pages over the picture, which take what is typed.
    void toggleHelp();
    void openFileList();
    [[nodiscard]] bool takesText() const { return page_ != Page::None; }
    /// Closes the page. Precondition: takesText().
    void closePage() { page_ = Page::None, isTypedMarked_ = false; }
    void type(uint32_t codepoint);
    void eraseTyped();
    /// Types what was copied, as one line.
    void pasteTyped();
    /// Marks all that is typed: what is typed next replaces it.
    void markTyped() { isTypedMarked_ = !typed_.empty(); }
    /// Opens what is first in the file list; of an annotation, goes on from the title to the text, and ends there.
    void enterTyped();
    /// Opens a page to write what an annotation says.
    void openPoint(size_t index);
    /// Does so for the annotation at a pixel, where there is one.
    void openPointAt(glm::dvec2 pixel);

    /// Copies the camera, or, with text on the clipboard, goes to the camera it describes.
    void copyCamera();
    void pasteCamera();
    void copyMeasurement();
    /// Saves the picture as chosen in the panel.
    void savePicture();
    void saveTurntable();
    void savePath();
    /// Compares the first two datasets; asks for a file where there is one; ends the comparison that is shown.
    void toggleComparison();

private:
    enum class Page { None, Help, Files, Point };
    struct Tool {
        const char *icon, *label;
        Tip tip;
        bool isOn;
        bool hasLabel;  ///< its label is shown where there is room
        std::function<void()> act;
    };

    void layOutToolbar();
    [[nodiscard]] std::vector<Tool> tools();
    void layOutTool(const Tool& tool, bool withLabel);
    void layOutOpenMenu();
    void layOutStatus();
    [[nodiscard]] std::string stateText() const;
    void layOutToasts();

    void layOutPanel();
    void layOutView();
    void layOutBookmarks();
    void layOutLight();
    void layOutSurroundings();
    void layOutCut();
    void layOutMeasuring();
    void layOutMeasuredLine(size_t number);
    void layOutPoints();
    void layOutCompare();
    void layOutCompared();
    void layOutComparisonChoice();
    void layOutDeviation(const Deviation& deviation);
    void drawDistances(const Deviation& deviation, double range) const;
    [[nodiscard]] bool canCompare() const;
    [[nodiscard]] std::vector<uint32_t> scansShownFirst() const;
    /// Opens the file list for what a dataset is compared with.
    void chooseCompared(uint32_t dataset);
    void layOutLayers();
    void layOutDataset(uint32_t dataset);
    void layOutSave();
    void layOutDetails();
    void layOutLimits();
    void layOutColourError();

    /// A card over the dimmed window, with a field that shows what is typed, and what `layOutRest` adds.
    void layOutPage(const char* title, const char* hint, float width, float height, void (Interface::*layOutRest)());
    void layOutHelp();
    void layOutKeys();
    void layOutFiles();
    void layOutPoint();
    void layOutPointRest();
    /// Keeps what was typed so far.
    void writePoint();
    void layOutFolder();
    void enter(const FileList::Entry& entry);
    void layOutWelcome();
    void layOutRecent(float width, size_t columns);
    void layOutOpening();
    void layOutSaving(const ViewSession::SavingProgress& saving);
    /// Begins a card in the middle of the window, at most so many units wide and high; 0: as high as its contents.
    bool beginCard(const char* name, float width, float height);
    /// Begins a small card in the lower right corner of the picture. Returns false, and begins nothing, where there is
    /// no room for it.
    bool beginNote(const char* name);
    /// Ends either, and what was set for it.
    void endCard();

    void drawAnnotations() const;
    [[nodiscard]] AnnotatedView annotatedView() const;
    void drawSectionHandles() const;
    void drawPages() const;
    void drawFeedback() const;
    /// Draws text on a plate.
    void plateAt(glm::vec2 at, const std::string& line) const;

    void openDemo();
    void actionButton(const char* label, ViewerAction action, const Tip& tip, float width = 0);
    [[nodiscard]] PictureChoice pictureChosen() const;
    [[nodiscard]] bool annotatesPictures() const;
    [[nodiscard]] float units(float n) const { return look_->units(n); }

    ViewSession* session_;
    InterfaceHost host_;
    const Look* look_ = nullptr;
    glm::vec2 size_{0};
    float toolbarHeight_ = 0, statusHeight_ = 0, panelWidth_ = 0;
    Page page_ = Page::None;
    std::string typed_;
    bool isTypedMarked_ = false;
    size_t point_ = 0;         // that is written
    bool writesText_ = false;  // and not its title
    FileList files_;
    bool comparesFile_ = false;     // what is chosen there is compared, not opened
    uint32_t comparesDataset_ = 0;  // with that dataset
    int compared_[2] = {0, 1};      // chosen in the panel
    float rangeDragged_ = 0;        // of a comparison, as a power of ten of the largest distance
    bool isDraggingRange_ = false;
    bool wasCompared_ = false;   // when the panel was laid out last
    bool showsDetails_ = false;  // opened by the status bar
    int pictureSize_ = 0;        // index in kPictureSizes
    PictureChoice picture_;
    std::optional<bool> annotatesPictures_;  // none: where something is measured or annotated
    int sequencePictures_ = 120;
    const bool hasEncoder_ = hasVideoEncoder();
};

}  // namespace vcp
