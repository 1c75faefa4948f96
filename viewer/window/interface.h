// The panels over the picture: status line, problem line, panel, keyboard map, scale bar, measured lines, start screen
// and progress, laid out with Dear ImGui. A click acts on the session at once.
//
// Used between InterfacePainter::begin and end, in the same thread.
#pragma once

#include <functional>
#include <string>

#include <glm/vec2.hpp>

#include "viewer/window/view_session.h"

namespace vcp {

/// What the panels need of the window.
struct InterfaceHost {
    std::function<void(const std::string&)> copyText;
    std::function<std::string()> pasteText;
};

class Interface {
public:
    Interface(ViewSession& session, InterfaceHost host) : session_(&session), host_(std::move(host)) {}

    bool showsHelp = false;

    /// Lays everything out and tells the viewer what it covers. `scale`: pixels of the display per unit of the layout.
    void layOut(glm::ivec2 framebuffer, float scale);

    /// Copies the camera, or, with text on the clipboard, goes to the camera it describes.
    void copyCamera();
    void pasteCamera();
    void copyMeasurement();
    /// Saves the picture as chosen in the panel.
    void savePicture();
    void saveTurntable();
    void savePath();

private:
    void layOutStatus();
    void layOutMessages();
    void layOutPanel();
    void layOutViews();
    void layOutLooks();
    void layOutLimits();
    void layOutMeasuring();
    void layOutFiles();
    void layOutPicture();
    void layOutSaving(const ViewSession::SavingProgress& saving);
    [[nodiscard]] PictureChoice pictureChosen() const;
    void layOutHelp();
    void layOutStart();
    void layOutOpening();
    void drawScaleBar() const;
    void drawMeasured() const;
    void drawSectionHandles() const;
    void drawPages() const;
    void drawFeedback() const;
    void actionButton(const char* label, ViewerAction action);

    ViewSession* session_;
    InterfaceHost host_;
    glm::vec2 size_{0};
    float scale_ = 1;
    float statusHeight_ = 0, panelWidth_ = 0;
    int pictureSize_ = 0;  // index in kPictureSizes
    PictureChoice picture_;
    int sequencePictures_ = 120;
};

}  // namespace vcp
