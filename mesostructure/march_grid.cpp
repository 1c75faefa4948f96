// Walks over a grid: each way to skip empty cells with each surface in the occupied ones.
#include <glm/geometric.hpp>

#include "mesostructure/cell_solve.h"
#include "mesostructure/grid_walk.h"

namespace vcp::meso {

namespace {

using glm::ivec3, glm::vec3;

/// What is known of a cell: occupied, or what may be skipped: `further` empty cells towards the ray, and a length from
/// where it is.
struct Space {
    bool occupied = false;
    ivec3 further{0};
    float length = 0;
    uint32_t marks = 0;  ///< small cells of an occupied cell, as set by markSmallCells; 0: none
};

struct SkipNothing {
    const Occupancy& occupancy;
    [[nodiscard]] const TileGrid& grid() const { return occupancy.grid; }
    [[nodiscard]] uint64_t bytes() const { return (occupancy.cells.size() + 7) / 8; }
    [[nodiscard]] int direction(vec3) const { return 0; }
    Space at(int, ivec3 cell, uint32_t& fetches) const {
        ++fetches;
        return {occupancy.cells[occupancy.grid.index(cell)] != 0};
    }
};

struct SkipDistances {
    explicit SkipDistances(const DistanceMap& of) : map(of), borders(of.cones) {}
    const DistanceMap& map;
    ConeBorders borders;
    [[nodiscard]] const TileGrid& grid() const { return map.grid; }
    [[nodiscard]] uint64_t bytes() const { return map.bytes(); }
    [[nodiscard]] int direction(vec3 d) const { return coneOf(borders, d); }
    Space at(int cone, ivec3 cell, uint32_t& fetches) const {
        ++fetches;
        const uint8_t step = map.steps[map.slot(cone, cell)];
        return {step == kOccupied, ivec3(0), float(step) * map.unit};
    }
};

struct SkipCompressed {
    explicit SkipCompressed(const CompressedMap& of) : map(of), borders(of.cones) {}
    const CompressedMap& map;
    ConeBorders borders;
    [[nodiscard]] const TileGrid& grid() const { return map.grid; }
    [[nodiscard]] uint64_t bytes() const { return map.bytes(); }
    [[nodiscard]] int direction(vec3 d) const { return coneOf(borders, d); }
    Space at(int cone, ivec3 cell, uint32_t& fetches) const {
        const CompressedMap::Found found = map.lookUp(cone, cell);
        fetches += uint32_t(found.fetches);
        return {found.occupied, ivec3(0), found.length};
    }
};

struct SkipBoxes {
    const OctantBoxes& boxes;
    [[nodiscard]] const TileGrid& grid() const { return boxes.grid; }
    [[nodiscard]] uint64_t bytes() const { return boxes.bytes(); }
    [[nodiscard]] int direction(vec3 d) const { return octantOf(d); }
    Space at(int octant, ivec3 cell, uint32_t& fetches) const {
        ++fetches;
        const uint16_t box = boxes.boxes[size_t(octant) * boxes.grid.count() + boxes.grid.index(cell)];
        if ((box & 0x8000) != 0) return {.occupied = true, .marks = box & 0x7fffu};
        return {false, ivec3(box & 31, box >> 5 & 31, box >> 10 & 31)};
    }
};

/// What a surface remembers of a ray from cell to cell.
struct Side {
    bool outside = false;
    bool inRun = true;  ///< all cells since the ray's start were occupied
};

/// The interval of a ray in a cell.
struct Piece {
    const GridWalk& walk;
    const TileGrid& grid;
    float from, to;
    uint32_t marks;  ///< as Space::marks
};

struct CellSurface {
    static constexpr bool kFillsBottom = false;
    [[nodiscard]] uint64_t bytes() const { return 0; }
    [[nodiscard]] bool meet(const Piece& piece, Side& side, MarchResult& result) const {
        if (side.inRun && !piece.walk.startsAtTop) return false;
        result.t = piece.from;
        return true;
    }
};

struct PatchSurface {
    static constexpr bool kFillsBottom = false;
    const PatchSet& set;
    [[nodiscard]] uint64_t bytes() const { return set.bytes(); }
    [[nodiscard]] bool meet(const Piece& piece, Side&, MarchResult& result) const {
        ++result.fetches;
        const auto patches = set.of(piece.grid.index(piece.walk.cell));
        if (patches.empty()) return false;
        ++result.fetches;
        const vec3 o = piece.walk.at(piece.from) - vec3(piece.walk.cell);
        const Patch* nearest = nullptr;
        float best = kFar;
        for (const Patch& patch : patches) {
            // A patch is read in groups of four words: ten coefficients, two linear forms.
            result.fetches += 5;
            ++result.surfaceTests;
            const float s = crossPatch(patch, o, piece.walk.d, piece.to - piece.from);
            if (s >= 0 && s < best) best = s, nearest = &patch;
        }
        if (nearest == nullptr) return false;
        result.t = piece.from + best;
        vec3 normal = patchGradient(*nearest, o + best * piece.walk.d) / vec3(piece.grid.cell);
        if (glm::dot(normal, piece.walk.d * vec3(piece.grid.cell)) > 0) normal = -normal;
        result.normal = glm::normalize(normal);
        return true;
    }
};

/// Meets the small cells of finer data within a cell of the grid, from wall to wall; where `marks` say so, only those
/// that the surface passes. `Axes`: 2 or 3.
template <int Axes, class Solve>
bool eachSmallCell(const Piece& piece, ivec3 ratio, uint32_t marks, Side& side, MarchResult& result,
                   const Solve& solve) {
    const vec3 scale(ratio);
    // The ray starts at the piece's start, where numbers are small.
    const vec3 o = (piece.walk.at(piece.from) - vec3(piece.walk.cell)) * scale, d = piece.walk.d * scale;
    const float span = piece.to - piece.from;
    ivec3 at = glm::clamp(ivec3(glm::floor(o)), ivec3(0), ratio - 1);
    for (float s = 0;;) {
        float end = kFar;
        int axisOut = -1;
        for (int axis = 0; axis < Axes; ++axis) {
            if (piece.walk.sign[axis] == 0) continue;
            const float wall = (float(at[axis] + (piece.walk.sign[axis] > 0)) - o[axis]) / d[axis];
            if (wall < end) end = wall, axisOut = axis;
        }
        end = std::max(s, std::min(end, span));
        if (marks == 0 || (marks >> (at.x + 2 * at.y + 4 * at.z) & 1) != 0) {
            ++result.surfaceTests;
            const CellHit<float> found = solve(at, o - vec3(at), d, s, end, side.outside);
            if (found.hit) {
                result.t = piece.from + found.t;
                return true;
            }
            side.outside = found.outside;
        }
        if (axisOut < 0 || end >= span) return false;
        at[axisOut] += piece.walk.sign[axisOut];
        if (at[axisOut] < 0 || at[axisOut] >= ratio[axisOut]) return false;
        s = end;
    }
}

struct HeightSurface {
    /// No height is below the slab's bottom, however a ray's end there rounds.
    static constexpr bool kFillsBottom = true;
    const HeightMap& map;
    ivec3 ratio;  ///< texels a cell; 1 along z
    [[nodiscard]] uint64_t bytes() const { return map.texels.size() * 2; }
    [[nodiscard]] bool meet(const Piece& piece, Side& side, MarchResult& result) const {
        const ivec3 first = piece.walk.cell * ratio;
        const float unit = float(map.range / 65535), cellZ = float(piece.grid.cell.z),
                    bottom = float(piece.walk.cell.z) * cellZ;
        return eachSmallCell<2>(
            piece, ratio, 0, side, result, [&](ivec3 at, vec3 o, vec3 d, float from, float to, bool outside) {
                ++result.fetches;
                const int x = first.x + at.x, y = first.y + at.y;
                const auto height = [&](int i, int j) { return float(map.texel(x + i, y + j)) * unit - bottom; };
                const BilinearCell<float> cell{height(0, 0), height(1, 0), height(0, 1), height(1, 1)};
                o.z = (o.z + float(at.z)) * cellZ, d.z *= cellZ;
                const CellHit<float> found = cell.firstEntry(o, d, from, to, outside);
                if (found.hit) {
                    const vec3 p = o + found.t * d;
                    const float dx = glm::mix(cell.h10 - cell.h00, cell.h11 - cell.h01, p.y),
                                dy = glm::mix(cell.h01 - cell.h00, cell.h11 - cell.h10, p.x);
                    result.normal = glm::normalize(
                        vec3(-dx * float(ratio.x / piece.grid.cell.x), -dy * float(ratio.y / piece.grid.cell.y), 1));
                }
                return found;
            });
    }
};

struct FieldSurface {
    static constexpr bool kFillsBottom = false;
    const SampledField& field;
    ivec3 ratio;  ///< samples a cell
    [[nodiscard]] uint64_t bytes() const { return field.bytes(); }
    [[nodiscard]] bool meet(const Piece& piece, Side& side, MarchResult& result) const {
        const ivec3 first = piece.walk.cell * ratio;
        const uint32_t marks = ratio == ivec3(2) && (piece.marks & OctantBoxes::kSmallCells) != 0 ? piece.marks : 0;
        return eachSmallCell<3>(
            piece, ratio, marks, side, result,
            [&](ivec3 at, vec3 o, vec3 d, float from, float to, bool outside) -> CellHit<float> {
                result.fetches += 2;
                TrilinearCell<float> cell;
                for (int corner = 0; corner < 8; ++corner)
                    cell.value[corner] =
                        float(field.step(first + at + ivec3(corner & 1, corner >> 1 & 1, corner >> 2)));
                const int which = cell.side();
                if (which > 0) return {false, 0, true};
                if (which < 0 && !outside) return {false, 0, false};
                const CellHit<float> found = cell.firstEntry(o, d, from, to, outside);
                if (found.hit) result.normal = glm::normalize(cell.gradient(o + found.t * d) / vec3(field.grid.cell));
                return found;
            });
    }
};

template <class Skip, class Found>
class GridMarcher final : public Marcher {
public:
    GridMarcher(Skip skip, Found surface) : skip_(skip), surface_(surface) {}

    MarchResult march(const MarchRay& ray) const override {
        const TileGrid& grid = skip_.grid();
        GridWalk walk(ray, grid);
        const int direction = skip_.direction(walk.d * vec3(grid.cell));
        MarchResult result;
        Side side{walk.startsAtTop};
        while (walk.cell.z >= 0 && walk.cell.z < grid.cells.z && walk.t <= walk.tMax) {
            if (result.iterations++ == kMostIterations) {
                result.state = MarchState::Unresolved;
                return result;
            }
            const Space space = skip_.at(direction, walk.cell, result.fetches);
            int axisOut = 0;
            const float exit = walk.exit(space.further, axisOut);
            if (space.occupied) {
                const float entry = walk.entry(), end = std::max(entry, std::min(exit, walk.tMax));
                if (surface_.meet({walk, grid, entry, end, space.marks}, side, result)) {
                    result.state = MarchState::Hit;
                    return result;
                }
            } else {
                side.inRun = false;
                if (space.length > 0 && walk.t + space.length > exit) {
                    walk.jump(walk.t + space.length);
                    continue;
                }
            }
            if (exit >= kFar) break;
            walk.leave(space.occupied ? ivec3(0) : space.further, exit, axisOut);
        }
        if (Found::kFillsBottom && walk.cell.z < 0 && walk.sign.z < 0 && side.outside && walk.t <= walk.tMax) {
            result.state = MarchState::Hit;
            result.t = walk.t, result.normal = {0, 0, 1};
        }
        return result;
    }
    uint64_t bytes() const override { return skip_.bytes() + surface_.bytes(); }
    bool isConservative() const override { return true; }

private:
    Skip skip_;
    Found surface_;
};

template <class Skip>
Result<std::unique_ptr<Marcher>> withSurface(Skip skip, const Surface& surface) {
    const auto fail = [](std::string message) {
        return Error{.code = ErrorCode::Usage, .message = std::move(message)};
    };
    const auto make = [&](auto found) {
        return std::unique_ptr<Marcher>(std::make_unique<GridMarcher<Skip, decltype(found)>>(skip, found));
    };
    const ivec3 cells = skip.grid().cells;
    if ((surface.patches != nullptr) + (surface.heights != nullptr) + (surface.field != nullptr) > 1)
        return fail("a walk has one surface");
    if (surface.patches != nullptr) {
        if (surface.patches->grid.cells != cells) return fail("the patches are of another grid");
        return make(PatchSurface{*surface.patches});
    }
    if (surface.heights != nullptr) {
        const glm::ivec2 texels = surface.heights->size;
        if (texels.x % cells.x != 0 || texels.y % cells.y != 0)
            return fail("the grid's cells must divide the height map's texels");
        return make(HeightSurface{*surface.heights, ivec3(texels.x / cells.x, texels.y / cells.y, 1)});
    }
    if (surface.field != nullptr) {
        const ivec3 samples = surface.field->grid.cells;
        if (samples % cells != ivec3(0)) return fail("the grid's cells must divide the field's");
        return make(FieldSurface{*surface.field, samples / cells});
    }
    return make(CellSurface{});
}

}  // namespace

Result<std::unique_ptr<Marcher>> gridMarcher(const Skipping& skipping, const Surface& surface) {
    if ((skipping.occupancy != nullptr) + (skipping.distances != nullptr) + (skipping.compressed != nullptr) +
            (skipping.boxes != nullptr) !=
        1)
        return Error{.code = ErrorCode::Usage, .message = "a walk skips in one way"};
    if (skipping.distances != nullptr) return withSurface(SkipDistances(*skipping.distances), surface);
    if (skipping.compressed != nullptr) return withSurface(SkipCompressed(*skipping.compressed), surface);
    if (skipping.boxes != nullptr) return withSurface(SkipBoxes{*skipping.boxes}, surface);
    return withSurface(SkipNothing{*skipping.occupancy}, surface);
}

}  // namespace vcp::meso
