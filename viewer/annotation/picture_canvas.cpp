#include "viewer/annotation/picture_canvas.h"

#include <utility>

#include <glm/common.hpp>

#include "viewer/annotation/picture_text.h"

namespace vcp {

namespace {

constexpr double kCapitalUnits = 9;                    // height, in units
constexpr double kLineHeight = 1.5, kBaseline = 1.15;  // in heights of capitals
constexpr float kPlateOpacity = 0.92f;

struct Inks {
    glm::vec3 text, halo, mark, plate;
};
constexpr Inks kDark{glm::vec3(0.925f, 0.933f, 0.945f), glm::vec3(0), glm::vec3(0.302f, 0.639f, 1),
                     glm::vec3(0.141f, 0.153f, 0.176f)};
constexpr Inks kLight{glm::vec3(0.106f, 0.122f, 0.149f), glm::vec3(1), glm::vec3(0.043f, 0.4f, 0.839f), glm::vec3(1)};

class PictureCanvas : public AnnotationCanvas {
public:
    PictureCanvas(Picture& rows, uint32_t firstRow, bool isDark, double unit)
        : rows_(rows), origin_(0, firstRow), inks_(isDark ? kDark : kLight), capitals_(kCapitalUnits * unit) {}

    void line(glm::dvec2 from, glm::dvec2 to, double width, AnnotationInk ink) override {
        drawLine(rows_, from - origin_, to - origin_, width, colourOf(ink));
    }
    void disc(glm::dvec2 middle, double radius, AnnotationInk ink) override { line(middle, middle, 2 * radius, ink); }
    void rectangle(glm::ivec2 low, glm::ivec2 high, glm::vec3 colour) override { fill(low, high, colour, 1); }
    void plate(glm::dvec2 low, glm::dvec2 high) override {
        fill(glm::ivec2(glm::floor(low)), glm::ivec2(glm::ceil(high)), inks_.plate, kPlateOpacity);
    }
    void text(glm::dvec2 at, const std::string& text) override {
        drawText(rows_, text, at - origin_ + glm::dvec2(0, kBaseline * capitals_), capitals_, inks_.text);
    }
    [[nodiscard]] glm::dvec2 textSize(const std::string& text) const override {
        return {textWidth(text, capitals_), kLineHeight * capitals_};
    }

private:
    [[nodiscard]] glm::vec3 colourOf(AnnotationInk ink) const {
        switch (ink) {
            case AnnotationInk::Text:
                return inks_.text;
            case AnnotationInk::Halo:
                return inks_.halo;
            case AnnotationInk::Mark:
                return inks_.mark;
            case AnnotationInk::Plate:
                return inks_.plate;
        }
        return inks_.text;
    }
    void fill(glm::ivec2 low, glm::ivec2 high, glm::vec3 colour, float opacity) {
        const glm::ivec2 origin(origin_);
        fillRectangle(rows_, low - origin, high - origin, colour, opacity);
    }

    Picture& rows_;
    glm::dvec2 origin_;
    const Inks& inks_;
    double capitals_;
};

}  // namespace

void paintAnnotations(const Annotations& annotations, const AnnotatedView& view, bool isDark, Picture& rows,
                      uint32_t firstRow) {
    PictureCanvas canvas(rows, firstRow, isDark, view.unit);
    draw(annotations, view, canvas);
}

std::function<void(size_t picture, Picture& rows, uint32_t firstRow)> annotationPainter(
    Annotations annotations, std::vector<AnnotatedView> views, bool isDark) {
    return [annotations = std::move(annotations), views = std::move(views), isDark](size_t picture, Picture& rows,
                                                                                    uint32_t firstRow) {
        paintAnnotations(annotations, views[picture], isDark, rows, firstRow);
    };
}

}  // namespace vcp
