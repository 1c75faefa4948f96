#include "viewer/key_map.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

namespace vcp {

namespace {

constexpr KeyHelp kKeyMap[] = {
    {KeyGroup::Mouse, "left drag", "orbit about the point under the cursor"},
    {KeyGroup::Mouse, "right drag, shift + left drag", "pan"},
    {KeyGroup::Mouse, "wheel", "zoom to the cursor"},
    {KeyGroup::Mouse, "double click", "centre on the point under the cursor"},
    {KeyGroup::Mouse, "ctrl + left drag", "turn the light"},
    {KeyGroup::View, "F", "fit all into the window"},
    {KeyGroup::View, "R, Home", "the view it opened with"},
    {KeyGroup::View, "1 3 7 9", "from the front, right, top, isometric"},
    {KeyGroup::View, "P", "perspective or orthographic"},
    {KeyGroup::View, "U", "the up axis: y or z"},
    {KeyGroup::View, "G", "fly: W A S D, E up, Q down, drag to look, wheel for speed; G or Esc ends it"},
    {KeyGroup::View, "Space", "what moves in a scene goes on, or stays"},
    {KeyGroup::View, "Ctrl+1 ... Ctrl+9", "keep this view as a bookmark"},
    {KeyGroup::View, "Shift+1 ... Shift+9", "go to a bookmark"},
    {KeyGroup::View, "Ctrl+C, Ctrl+V", "copy the camera as JSON, go to the copied one"},
    {KeyGroup::Look, "M", "shading mode"},
    {KeyGroup::Look, "W", "wireframe: edges of triangles and leaves, or as before"},
    {KeyGroup::Look, "C", "colours of the scan, or clay"},
    {KeyGroup::Look, "L", "the light follows the camera, or stays"},
    {KeyGroup::Look, "S", "shadows"},
    {KeyGroup::Look, "O", "ambient occlusion"},
    {KeyGroup::Measure, "X", "section through the middle; its arrow and shift + wheel move it, its ring turns it"},
    {KeyGroup::Look, "B", "the parts that are drawn, as boxes coloured by level"},
    {KeyGroup::Look, "I", "inset: where the picture still misses detail"},
    {KeyGroup::Measure, "D", "measure: click points; Enter ends a line, Backspace takes a point back"},
    {KeyGroup::Measure, "N", "annotate: click a point, write its title and its text"},
    {KeyGroup::Measure, "K", "compare: one surface's distance from another as colours, or its own again"},
    {KeyGroup::Measure, "Ctrl+E", "write what is measured: measurement-1.csv, .json"},
    {KeyGroup::Save, "Ctrl+S", "save the picture: picture-1.png, of the size chosen in the panel"},
    {KeyGroup::Save, "Ctrl+T", "save a turntable: turntable-1/picture-0001.png and so on, as chosen in the panel"},
    {KeyGroup::Save, "Ctrl+B", "save a path through the bookmarks: path-1/picture-0001.png and so on"},
    {KeyGroup::Window, "Ctrl+O", "open a file"},
    {KeyGroup::Window, "Tab", "the panel"},
    {KeyGroup::Window, "F1", "this list"},
    {KeyGroup::Window, "Esc", "ends what is going on, else the program (twice, where a measurement is not written)"},
    {KeyGroup::Window, "Ctrl+Q", "quit"},
};

/// Returns the direction in camera axes, as for Viewer::fly(); 0 for other keys.
glm::dvec3 flyDirectionOf(uint32_t key) {
    switch (key) {
        case 'W':
            return {0, 0, 1};
        case 'S':
            return {0, 0, -1};
        case 'A':
            return {-1, 0, 0};
        case 'D':
            return {1, 0, 0};
        case 'E':
            return {0, 1, 0};
        case 'Q':
            return {0, -1, 0};
        default:
            return {0, 0, 0};
    }
}

}  // namespace

const char* nameOf(KeyGroup group) {
    static constexpr const char* kNames[] = {"Mouse", "View", "Light and looks", "Cut and measure", "Save", "Window"};
    return kNames[size_t(group)];
}

std::span<const KeyHelp> keyMap() { return kKeyMap; }

std::optional<ViewerAction> actionOf(uint32_t key) {
    switch (key) {
        case 'F':
            return ViewerAction::Fit;
        case 'R':
            return ViewerAction::Reset;
        case 'L':
            return ViewerAction::ToggleLight;
        case 'S':
            return ViewerAction::ToggleShadows;
        case 'O':
            return ViewerAction::ToggleOcclusion;
        case 'X':
            return ViewerAction::ToggleSection;
        case 'M':
            return ViewerAction::NextShading;
        case 'C':
            return ViewerAction::ToggleColour;
        case 'P':
            return ViewerAction::ToggleProjection;
        case 'U':
            return ViewerAction::ToggleUpAxis;
        case 'G':
            return ViewerAction::ToggleFly;
        case ' ':
            return ViewerAction::TogglePlay;
        case '1':
            return ViewerAction::ViewFront;
        case '3':
            return ViewerAction::ViewRight;
        case '7':
            return ViewerAction::ViewTop;
        case '9':
            return ViewerAction::ViewIsometric;
        default:
            return std::nullopt;
    }
}

bool holdFlyKey(glm::dvec3& held, uint32_t key, bool isPressed) {
    const glm::dvec3 way = flyDirectionOf(key);
    for (int axis = 0; axis < 3; ++axis)
        if (way[axis] != 0 && (isPressed || held[axis] == way[axis])) held[axis] = isPressed ? way[axis] : 0;
    return way != glm::dvec3(0);
}

std::string keyMapText() {
    size_t width = 0;
    for (const KeyHelp& each : kKeyMap) width = std::max(width, std::string_view(each.keys).size());
    std::string text;
    for (const KeyHelp& each : kKeyMap) text += fmt::format("{:<{}}  {}\n", each.keys, width, each.does);
    return text;
}

}  // namespace vcp
