// What is written over a picture: legends, a scale bar, measured lines with their lengths, titles at points. One layout
// for the window, which draws it with its own fonts, and for pictures in files (picture_canvas.h).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "render/camera.h"
#include "viewer/annotation/legend.h"
#include "viewer/annotation/length_unit.h"

namespace vcp {

/// Measured points, with a line from each to the next.
struct AnnotatedLine {
    std::vector<glm::dvec3> points;    ///< world
    std::vector<std::string> lengths;  ///< written beside each line; one less than points
};

/// What a person wrote at a point.
struct Annotation {
    glm::dvec3 position{0};  ///< world
    std::string title;       ///< one line, UTF-8
    std::string text = {};   ///< one line; panels show it, pictures do not

    bool operator==(const Annotation&) const = default;
};

struct Annotations {
    std::vector<Legend> legends;  ///< from below upwards
    bool hasScaleBar = false;
    std::vector<AnnotatedLine> lines;
    std::vector<Annotation> points = {};
    std::optional<LengthUnit> unit;  ///< the world's, for the scale bar
};

/// Where annotations are drawn.
struct AnnotatedView {
    Camera camera;
    double viewHeight = 1;       ///< height of what the picture shows in the middle, world units
    glm::uvec2 size{1};          ///< of the picture, in pixels
    glm::dvec2 low{0}, high{1};  ///< corners of the part of it that nothing covers, in pixels
    double unit = 1;             ///< pixels that sizes of the layout are multiplied with
};

/// Returns the view of a picture of which nothing is covered; annotations grow with the picture.
AnnotatedView annotatedPicture(const Camera& camera, double viewHeight, glm::uvec2 size);

/// The colours that a canvas has names for.
enum class AnnotationInk { Text, Halo, Mark, Plate };

/// What annotations are drawn on, in pixels of the whole picture.
class AnnotationCanvas {
public:
    virtual ~AnnotationCanvas() = default;
    virtual void line(glm::dvec2 from, glm::dvec2 to, double width, AnnotationInk ink) = 0;
    virtual void disc(glm::dvec2 middle, double radius, AnnotationInk ink) = 0;
    /// Fills whole pixels.
    virtual void rectangle(glm::ivec2 low, glm::ivec2 high, glm::vec3 colour) = 0;
    /// Fills what text stands on: pictures may be as light or dark as the text.
    virtual void plate(glm::dvec2 low, glm::dvec2 high) = 0;
    /// Writes text with its upper left corner there.
    virtual void text(glm::dvec2 at, const std::string& text) = 0;
    [[nodiscard]] virtual glm::dvec2 textSize(const std::string& text) const = 0;
};

/// Returns the point of `points` that is marked within reach of a pixel, the last one drawn first; nothing without any.
std::optional<size_t> annotationAt(const std::vector<Annotation>& points, const AnnotatedView& view, glm::dvec2 pixel);

/// Draws all of it. What has no room is left out.
void draw(const Annotations& annotations, const AnnotatedView& view, AnnotationCanvas& canvas);

/// Writes a line of text on a plate, with the text's upper left corner there.
void writeOnPlate(AnnotationCanvas& canvas, glm::dvec2 at, const std::string& text, double unit);

}  // namespace vcp
