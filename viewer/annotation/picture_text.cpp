#include "viewer/annotation/picture_text.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <ft2build.h>
#include FT_FREETYPE_H
#include <glm/common.hpp>

#include "viewer/annotation/fonts.h"
#include "viewer/annotation/pixels.h"

namespace vcp {

namespace {

constexpr double kCapitalPart = 0.727;  // height of Inter's, in its size
constexpr uint32_t kNotUtf8 = 0xfffd;
constexpr FT_Int32 kAsDesigned = FT_LOAD_NO_HINTING | FT_LOAD_NO_BITMAP;

/// The typeface, for one thread.
class Face {
public:
    Face() {
        if (FT_Init_FreeType(&library_) != 0) library_ = nullptr;
        const FT_Open_Args font{.flags = FT_OPEN_MEMORY,
                                .memory_base = kInterRegular,
                                .memory_size = FT_Long(sizeof(kInterRegular)),
                                .pathname = nullptr,
                                .stream = nullptr,
                                .driver = nullptr,
                                .num_params = 0,
                                .params = nullptr};
        if (!library_ || FT_Open_Face(library_, &font, 0, &face_) != 0) face_ = nullptr;
    }
    ~Face() {
        if (face_) FT_Done_Face(face_);
        if (library_) FT_Done_FreeType(library_);
    }
    Face(const Face&) = delete;
    Face& operator=(const Face&) = delete;

    /// Returns the letter's glyph at a size in pixels, drawn where `right` is the part of a pixel that it stands beside
    /// a whole one; null where there is no memory for it. Valid until the next call.
    FT_GlyphSlot glyph(uint32_t character, double size, double right, bool isDrawn) {
        constexpr double kParts = 64;  // of a pixel
        if (!face_ || FT_Set_Char_Size(face_, 0, FT_F26Dot6(std::lround(kParts * size)), 72, 72) != 0) return nullptr;
        FT_Vector aside{FT_Pos(std::lround(kParts * right)), 0};
        FT_Set_Transform(face_, nullptr, &aside);
        const FT_Int32 how = isDrawn ? kAsDesigned | FT_LOAD_RENDER : kAsDesigned;
        return FT_Load_Char(face_, character, how) == 0 ? face_->glyph : nullptr;
    }

private:
    FT_Library library_ = nullptr;
    FT_Face face_ = nullptr;
};

Face& face() {
    static thread_local Face face;
    return face;
}

/// Takes the first character from a text in UTF-8.
uint32_t takeCharacter(std::string_view& text) {
    const auto first = uint8_t(text.front());
    const size_t length = first < 0x80 ? 1 : first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : first >= 0xc0 ? 2 : 0;
    uint32_t character = length == 1 ? first : first & (0x7fu >> length);
    for (size_t i = 1; i < length; ++i) {
        const bool goesOn = i < text.size() && (uint8_t(text[i]) & 0xc0) == 0x80;
        if (!goesOn) {
            text.remove_prefix(i);
            return kNotUtf8;
        }
        character = character << 6 | (uint8_t(text[i]) & 0x3f);
    }
    text.remove_prefix(std::max<size_t>(length, 1));
    return length == 0 ? kNotUtf8 : character;
}

void blendGlyph(Picture& picture, const FT_GlyphSlot& glyph, glm::ivec2 at, glm::dvec3 srgb) {
    const FT_Bitmap& bitmap = glyph->bitmap;
    const glm::ivec2 corner = at + glm::ivec2(glyph->bitmap_left, -glyph->bitmap_top);
    const glm::ivec2 low = glm::max(corner, 0);
    const glm::ivec2 high = glm::min(corner + glm::ivec2(int(bitmap.width), int(bitmap.rows)),
                                     glm::ivec2(int(picture.width), int(picture.height)));
    for (int y = low.y; y < high.y; ++y)
        for (int x = low.x; x < high.x; ++x) {
            const uint8_t part = bitmap.buffer[(y - corner.y) * bitmap.pitch + x - corner.x];
            if (part > 0) blend(picture, {x, y}, srgb, float(part) / 255);
        }
}

/// Calls visit(glyph, x) for each letter, x from 0 on. Returns where the text ends.
template <class Visit>
double visitLetters(std::string_view text, double height, bool isDrawn, double from, const Visit& visit) {
    double x = from;
    while (!text.empty()) {
        const uint32_t character = takeCharacter(text);
        const FT_GlyphSlot glyph = face().glyph(character, height / kCapitalPart, x - std::floor(x), isDrawn);
        if (!glyph) continue;
        visit(glyph, x);
        x += double(glyph->linearHoriAdvance) / 65536;
    }
    return x;
}

}  // namespace

double textWidth(std::string_view text, double height) {
    return visitLetters(text, height, false, 0, [](const FT_GlyphSlot&, double) {});
}

void drawText(Picture& picture, std::string_view text, glm::dvec2 at, double height, glm::dvec3 srgb) {
    // Letters that stand on a row of pixels are sharp.
    const int line = int(std::lround(at.y));
    visitLetters(text, height, true, at.x, [&](const FT_GlyphSlot& glyph, double x) {
        blendGlyph(picture, glyph, {int(std::floor(x)), line}, srgb);
    });
}

void drawLine(Picture& picture, glm::dvec2 from, glm::dvec2 to, double width, glm::dvec3 srgb) {
    visitLine({from, to}, width, {int(picture.width), int(picture.height)},
              [&](glm::ivec2 pixel, float part) { blend(picture, pixel, srgb, part); });
}

void fillRectangle(Picture& picture, glm::ivec2 low, glm::ivec2 high, glm::dvec3 srgb, float opacity) {
    low = glm::max(low, 0);
    high = glm::min(high, glm::ivec2(int(picture.width), int(picture.height)));
    for (int y = low.y; y < high.y; ++y)
        for (int x = low.x; x < high.x; ++x) blend(picture, {x, y}, srgb, opacity);
}

}  // namespace vcp
