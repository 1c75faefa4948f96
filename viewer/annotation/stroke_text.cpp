#include "viewer/annotation/stroke_text.h"

#include <algorithm>

#include <glm/common.hpp>

#include "viewer/annotation/pixels.h"

namespace vcp {

namespace {

// A letter's strokes: points of two characters, x from 0 to 4 and y from 0 to 6, or a and b below the line; a blank
// begins the next stroke. Capitals are 6 high, small letters 4.
struct Letter {
    char name;
    const char* strokes;
};
constexpr Letter kLetters[] = {
    {'0', "010516364541301001"},
    {'1', "142620 1030"},
    {'2', "05163645440040"},
    {'3', "0516364544334241301001 1333"},
    {'4', "30360242"},
    {'5', "460603334241301001"},
    {'6', "4536160501103041423303"},
    {'7', "064610"},
    {'8', "13040516364544331302011030414233"},
    {'9', "0110304145361605041343"},
    {'+', "0343 2125"},
    {'-', "0343"},
    {'.', "2020"},
    {',', "201a"},
    {'%', "0046 0616150506 3141403031"},
    {'(', "36242230"},
    {')', "16242210"},
    {'/', "0046"},
    {':', "2424 2121"},
    {'a', "4440 4130100103143443"},
    {'b', "0600 0110304143341403"},
    {'c', "4334140301103041"},
    {'d', "4640 4130100103143443"},
    {'e', "02424334140301103041"},
    {'f', "36261510 0434"},
    {'g', "444a3b1b0a 4130100103143443"},
    {'h', "0600 0314344340"},
    {'i', "142420 1030 2626"},
    {'j', "242b1b 2626"},
    {'k', "0600 0134 1240"},
    {'l', "1626 2620 1030"},
    {'m', "0004 03142320 23344340"},
    {'n', "0004 0314344340"},
    {'o', "103041433414030110"},
    {'p', "040b 0314344341301001"},
    {'q', "444b 4334140301103041"},
    {'r', "0400 03143443"},
    {'s', "43341403123241301001"},
    {'t', "1611203041 0434"},
    {'u', "0401103041 4440"},
    {'v', "042044"},
    {'w', "0410233044"},
    {'x', "0440 0044"},
    {'y', "0420 441b"},
    {'z', "04440040"},
};
constexpr double kCapital = 6, kAdvance = 6;

glm::dvec2 pointOf(const char* stroke) {
    const char y = stroke[1];
    return {double(stroke[0] - '0'), y >= 'a' ? double('a' - 1 - y) : double(y - '0')};
}

}  // namespace

double textWidth(std::string_view text, double height) { return double(text.size()) * kAdvance * height / kCapital; }

void drawText(Picture& picture, std::string_view text, glm::dvec2 at, double height, glm::dvec3 srgb) {
    const double unit = height / kCapital;
    for (const char name : text) {
        const char letter = name >= 'A' && name <= 'Z' ? char(name - 'A' + 'a') : name;
        const auto* found = std::ranges::find(kLetters, letter, &Letter::name);
        if (found != std::end(kLetters)) {
            const auto place = [&](const char* p) { return at + unit * pointOf(p) * glm::dvec2(1, -1); };
            for (const char* p = found->strokes; *p != '\0' && p[2] != '\0';) {
                if (p[2] == ' ') {
                    p += 3;
                    continue;
                }
                const bool isDot = p[0] == p[2] && p[1] == p[3];
                drawLine(picture, place(p), place(p + 2), (isDot ? 1.5 : 1) * std::max(0.9 * unit, 1.0), srgb);
                p += 2;
            }
        }
        at.x += kAdvance * unit;
    }
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
