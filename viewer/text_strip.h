// A line of text as pixels: the status line of the window, drawn on the CPU so that it costs the GPU one
// small copy and no pipeline. The glyphs are Dear ImGui's built-in font (ASCII; anything else shows as "?").
//
// One thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

namespace vcp {

/// Rows of RGBA8 pixels (R in the lowest byte), top row first, opaque.
struct Strip {
    int width = 0, height = 0;
    std::vector<uint32_t> pixels;
};

class TextStrip {
public:
    /// `scale` 1 is a 13 pixel font; a high-density display asks for 2. Clamped to [1, 8].
    explicit TextStrip(float scale);
    ~TextStrip();
    TextStrip(TextStrip&&) noexcept;
    TextStrip& operator=(TextStrip&&) noexcept;

    /// Height of every strip, in pixels.
    [[nodiscard]] int height() const;

    /// Light text on dark, exactly `width` >= 1 pixels wide; what does not fit is cut off at the end.
    [[nodiscard]] Strip draw(std::string_view text, int width) const;

    /// Pixels that `text` takes.
    [[nodiscard]] int widthOf(std::string_view text) const;

private:
    struct Font;
    std::unique_ptr<Font> font_;
};

}  // namespace vcp
