#include "viewer/text_strip.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <imgui.h>

namespace vcp {

namespace {

constexpr float kFontPixels = 13;
constexpr int kFirstGlyph = 32, kLastGlyph = 126;
constexpr int kBackground = 0x18;  // grey level
constexpr int kInk = 0xe8;

struct Glyph {
    int left = 0, top = 0, width = 0, height = 0;
    int advance = 0;
    std::vector<uint8_t> coverage;
};

}  // namespace

struct TextStrip::Font {
    int height = 0;
    int margin = 0;
    std::array<Glyph, kLastGlyph - kFirstGlyph + 1> glyphs;

    [[nodiscard]] const Glyph& glyph(char c) const {
        const int code = static_cast<unsigned char>(c);
        return glyphs[static_cast<size_t>((code < kFirstGlyph || code > kLastGlyph ? '?' : code) - kFirstGlyph)];
    }
};

TextStrip::TextStrip(float scale) : font_(std::make_unique<Font>()) {
    // The built-in font is a bitmap: only whole multiples of its size are sharp.
    const float whole = std::clamp(std::round(scale), 1.0f, 8.0f);
    ImFontAtlas atlas;
    ImFontConfig config;
    config.SizePixels = kFontPixels * whole;
    config.OversampleH = config.OversampleV = 1;
    config.PixelSnapH = true;
    const ImFont* font = atlas.AddFontDefault(&config);
    unsigned char* alpha = nullptr;
    int width = 0, height = 0;
    atlas.GetTexDataAsAlpha8(&alpha, &width, &height);

    font_->margin = static_cast<int>(4 * whole);
    font_->height = static_cast<int>(kFontPixels * whole) + font_->margin;
    for (int code = kFirstGlyph; code <= kLastGlyph; ++code) {
        const ImFontGlyph* from = font->FindGlyph(static_cast<ImWchar>(code));
        if (!from) continue;
        Glyph& to = font_->glyphs[static_cast<size_t>(code - kFirstGlyph)];
        const int u = static_cast<int>(std::lround(from->U0 * static_cast<float>(width)));
        const int v = static_cast<int>(std::lround(from->V0 * static_cast<float>(height)));
        to.left = static_cast<int>(std::lround(from->X0));
        to.top = static_cast<int>(std::lround(from->Y0));
        to.width = static_cast<int>(std::lround(from->U1 * static_cast<float>(width))) - u;
        to.height = static_cast<int>(std::lround(from->V1 * static_cast<float>(height))) - v;
        to.advance = static_cast<int>(std::lround(from->AdvanceX));
        for (int y = 0; y < to.height; ++y)
            for (int x = 0; x < to.width; ++x) to.coverage.push_back(alpha[(v + y) * width + u + x]);
    }
}

TextStrip::~TextStrip() = default;
TextStrip::TextStrip(TextStrip&&) noexcept = default;
TextStrip& TextStrip::operator=(TextStrip&&) noexcept = default;

int TextStrip::height() const { return font_->height; }

int TextStrip::widthOf(std::string_view text) const {
    int width = 2 * font_->margin;
    for (const char c : text) width += font_->glyph(c).advance;
    return width;
}

Strip TextStrip::draw(std::string_view text, int width) const {
    const auto grey = [](int level) { return 0xff000000u | static_cast<uint32_t>(level) * 0x010101u; };
    Strip strip{width, font_->height, {}};
    strip.pixels.assign(static_cast<size_t>(width) * static_cast<size_t>(strip.height), grey(kBackground));
    int pen = font_->margin;
    for (const char c : text) {
        const Glyph& glyph = font_->glyph(c);
        for (int y = 0; y < glyph.height; ++y) {
            const int row = font_->margin / 2 + glyph.top + y;
            if (row < 0 || row >= strip.height) continue;
            for (int x = 0; x < glyph.width; ++x) {
                const int column = pen + glyph.left + x;
                if (column < 0 || column >= width) continue;
                const int coverage = glyph.coverage[static_cast<size_t>(y * glyph.width + x)];
                strip.pixels[static_cast<size_t>(row) * static_cast<size_t>(width) + static_cast<size_t>(column)] =
                    grey(kBackground + (kInk - kBackground) * coverage / 255);
            }
        }
        pen += glyph.advance;
    }
    return strip;
}

}  // namespace vcp
