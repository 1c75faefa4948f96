// Simplifies the outline of what a mask leaves of a triangle.
//
// Points are taken away one after the other: those whose absence moves the line least, while no point of the line that
// was there at first is farther from it than a tolerance; or those that span the least area with their neighbours
// (Visvalingam and Whyatt 1993). A point goes only where no other point is in that triangle: lines that do not cross or
// touch never come to. Points on the triangle's edges stay, and a line that comes back to the edge that it left does
// not fall into it, since what lies beyond has its ends as corners.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/mask/mask_outline.h"

namespace vcp {

class OutlineSimplifier {
public:
    /// `loops` do not cross or touch. `texels`: of the triangle's corners, finite.
    OutlineSimplifier(const std::vector<MaskLoop>& loops, const std::array<glm::dvec2, 3>& texels);

    /// Takes away what moves no point of the first line by more than so many texels.
    void keepWithin(double tolerance);
    /// Takes away what spans less than so many square texels; where a loop is small, less than `leastPart` of it.
    void keepAreas(double area, double leastPart);
    /// Takes away loops that surround less than so many square texels, but those that end on the triangle's edges.
    void keepLoops(double area);

    /// Returns into how many triangles the loops are cut.
    [[nodiscard]] size_t triangles() const;
    [[nodiscard]] std::vector<MaskLoop> loops() const;

private:
    struct Point {
        MaskLoop::Point own;
        glm::dvec2 at;
        uint32_t before, after;  // in the loop, of those that are left
        uint32_t loop;
        uint32_t changes;  // of its neighbours
        bool isLeft;
    };
    struct Loop {
        uint32_t first, count;  // points of the first line
        uint32_t left;
        double area;  // of the first line, in square texels; negative: a hole
        bool isInside;
    };
    /// Points by where they are, in squares of weights.
    struct Grid {
        int shift = 0;
        uint32_t edge = 1;
        std::vector<uint32_t> starts, points;
    };

    template <class CostOf>
    void takeAway(CostOf costOf);
    void remove(uint32_t point);
    [[nodiscard]] std::optional<double> movedBy(uint32_t point, double most) const;
    [[nodiscard]] double areaOf(uint32_t point) const;
    [[nodiscard]] bool mayGo(uint32_t point) const;
    [[nodiscard]] bool isEmpty(uint32_t a, uint32_t b, uint32_t c) const;
    void fillGrid();

    std::vector<Point> points_;
    std::vector<Loop> loops_;
    Grid grid_;
};

}  // namespace vcp
