#include "mesostructure/remesh/certified_cells.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <unordered_map>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/base/surface_edges.h"
#include "mesostructure/remesh/height_bends.h"
#include "mesostructure/remesh/height_deviation.h"
#include "mesostructure/remesh/piece_maker.h"

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3, glm::dvec4;

constexpr uint64_t kMostPatches = uint64_t{1} << 22;
// Where there would be more, patches are no smaller where the map is steep.
constexpr uint64_t kMostSmallPatches = uint64_t{3} << 19;
// Patches are wider where there are more than so many.
constexpr double kManyPatches = 1 << 17;
constexpr int kLog2Narrowest = 4, kLog2Widest = 8;  // texels of a patch's edge
constexpr int kLog2FinestCells = 4;                 // finest cells of a texel's edge, at most
// Texels of a cell's edge, of the level that its heights are from: with one, a view needs up to 15 % more vertices,
// with two it needs no more than with the map's own heights.
constexpr int kLog2TexelsOfACell = 1;
constexpr int kLog2MostCells = 9;  // of a patch's edge; two more bits are there for rounding
// What is known of a kind of patches is forgotten where it is more than so many combinations of steps, and one for
// each.
constexpr size_t kMostKnown = 64;
// Cells are not halved where no edge of a triangle is longer; where a view would have more cells, they are less narrow,
// and less is certified.
constexpr double kNarrowestPixels = 0.125, kLeastNarrowPixels = 1;
constexpr double kMostCells = 1 << 23;
// What is done when the surface is cut, and when all but the kinds of patches is known: parts of the time.
constexpr double kCuttingPart = 0.7, kKindsPart = 0.8;
// What was read of a map in a file is let go after so many corners or kinds of patches.
constexpr size_t kLetGo = 1024;
constexpr double kNothing = std::numeric_limits<double>::infinity();

float roundedUp(double x) { return std::nextafter(float(x), std::numeric_limits<float>::infinity()); }

/// Returns log2 of the texels along a patch's edge.
int patchEdge(const RemeshSurface& surface) {
    const dvec2 texels = surface.heights->texels();
    double area = 0;
    for (const auto& uvs : surface.uvs) {
        const dvec2 a = (dvec2(uvs[1]) - dvec2(uvs[0])) * texels, b = (dvec2(uvs[2]) - dvec2(uvs[0])) * texels;
        area += 0.5 * std::abs(a.x * b.y - a.y * b.x);
    }
    int edge = kLog2Narrowest;
    while (edge < kLog2Widest && area > kManyPatches * 0.5 * std::exp2(2 * edge)) ++edge;
    return edge;
}

}  // namespace

/// What a thread measures with.
struct CertifiedCells::Scratch {
    RemeshMesh<double> mesh;
    std::vector<std::array<HeightCorner, 3>> over;  ///< its triangles, over the map
    bool mayJump = false;                           ///< corners may be higher than the patch's own map
};

/// A camera, and the corners of the patches in its eye space.
struct CertifiedCells::View {
    const RemeshCamera& camera;
    double cell;       ///< pixels
    dvec4 picture;     ///< what is seen: left, lower, right, upper
    double steepest;   ///< of the slopes that are seen, sqrt(1 + x^2 + y^2)
    double narrowest;  ///< pixels: triangles' edges of cells that are not halved
    std::vector<dvec3> positions, directions;
};

Result<CertifiedCells> CertifiedCells::create(const RemeshSurface& surface,
                                              const std::function<bool(double part)>& progress) {
    double most = 0;
    const auto told = [&](double part) {
        most = std::max(most, part);
        return !progress || progress(most);
    };
    // Where there would be too many small patches, cutting begins anew.
    const auto toldOfCutting = [&](double part) { return told(kCuttingPart * part); };
    CertifiedCells made;
    const int edge = patchEdge(surface);
    made.finest_ = std::min(kLog2FinestCells, kLog2MostCells - edge);
    made.coarsest_ = edge + made.finest_;
    const HeightBends bends(*surface.heights);
    auto cut = cutSurface(surface, {.mostTexels = std::exp2(edge),
                                    .bends = &bends,
                                    .mostTriangles = kMostSmallPatches,
                                    .progress = toldOfCutting});
    if (!cut && cut.error().code == ErrorCode::Limit)
        cut = cutSurface(surface,
                         {.mostTexels = std::exp2(edge), .mostTriangles = kMostPatches, .progress = toldOfCutting});
    VCP_TRY_ASSIGN(made.patches_, std::move(cut));
    if (!told(kCuttingPart)) return Error::cancelled();
    const dvec2 texels = surface.heights->texels() * std::exp2(made.finest_);
    for (const auto& uvs : made.patches_.uvs) {
        std::array<dvec2, 3> at;
        for (size_t k = 0; k < 3; ++k) at[k] = glm::floor(dvec2(uvs[k]) * texels + 0.5);
        // Multiples of the widest cell may be left out of all corners.
        const double widest = std::exp2(made.coarsest_);
        const dvec2 from = glm::floor(glm::min(at[0], glm::min(at[1], at[2])) / widest) * widest;
        auto& grid = made.grids_.emplace_back();
        for (size_t k = 0; k < 3; ++k) grid[k] = glm::ivec2(at[k] - from);
    }
    made.addEdges(), made.measureCorners();
    if (!told(kKindsPart)) return Error::cancelled();
    made.addKinds();
    made.patches_.heights->letGo();
    if (!told(1)) return Error::cancelled();
    return made;
}

void CertifiedCells::addEdges() {
    const std::vector<uint32_t> opposite = oppositeEdges(patches_.triangles, patches_.positions.size());
    for (uint32_t i = 0; i < patches_.triangles.size(); ++i) {
        auto& own = edges_.emplace_back();
        for (uint32_t k = 0; k < 3; ++k) {
            const glm::ivec2 off = glm::abs(grids_[i][(k + 1) % 3] - grids_[i][k]);
            const int parts = std::max({off.x, off.y, 1});
            const uint32_t beside = opposite[3 * i + k];
            if (beside < 3 * i + k) {
                // Along a seam the two sides may have different texels.
                own[k] = edges_[beside / 3][beside % 3];
                neighbours_[own[k]][1] = i, edgeParts_[own[k]] = std::min(edgeParts_[own[k]], parts);
            } else {
                own[k] = uint32_t(neighbours_.size());
                neighbours_.push_back({i, i}), edgeParts_.push_back(parts);
            }
        }
    }
    edgeSteps_.assign(neighbours_.size(), coarsest_);
}

void CertifiedCells::measureCorners() {
    for (size_t i = 0; i < patches_.positions.size(); ++i) {
        double most = 0;
        float single = 0;
        for (uint32_t k = patches_.firstPlace[i]; k < patches_.firstPlace[i + 1]; ++k) {
            most = std::max(most, patches_.heights->height(0, dvec2(patches_.places[k])));
            single = std::max(single, patches_.heights->height(0, patches_.places[k]));
        }
        heights_.push_back(most), singleHeights_.push_back(single);
        if (i % kLetGo == 0) patches_.heights->letGo();
    }
}

void CertifiedCells::addKinds() {
    // What patches of a kind have in common, corner by corner.
    struct Corner {
        glm::vec2 at;  // in the tile of the first
        glm::ivec2 grid;
        glm::vec3 direction;
        std::array<uint32_t, 2> height;  // a double's
    };
    static_assert(sizeof(Corner) == 36);
    using Key = std::array<uint32_t, 3 * sizeof(Corner) / sizeof(uint32_t)>;
    const auto hashOf = [](const Key& key) {
        uint64_t hash = 0;
        for (const uint32_t word : key) hash = (std::rotl(hash, 23) ^ word) * 0x9e3779b97f4a7c15u;
        return size_t(hash ^ hash >> 32);
    };
    std::unordered_map<Key, uint32_t, decltype(hashOf)> numbers(0, hashOf);
    kindOf_.resize(patches_.triangles.size());
    for (uint32_t i = 0; i < kindOf_.size(); ++i) {
        const auto& uvs = patches_.uvs[i];
        const glm::vec2 tile = glm::floor(glm::min(uvs[0], glm::min(uvs[1], uvs[2])));
        std::array<Corner, 3> corners;
        bool mayJump = tile.y != 0 && patches_.heights->rows() != 1;
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t corner = patches_.triangles[i][k];
            corners[k] = {uvs[k] - tile, grids_[i][k], patches_.directions[corner],
                          std::bit_cast<std::array<uint32_t, 2>>(heights_[corner])};
            mayJump = mayJump || patches_.firstPlace[corner + 1] - patches_.firstPlace[corner] > 1;
        }
        kindOf_[i] = uint32_t(kinds_.size());
        // What is beyond a seam is not in the key.
        if (!mayJump) kindOf_[i] = numbers.try_emplace(std::bit_cast<Key>(corners), kindOf_[i]).first->second;
        if (kindOf_[i] == kinds_.size()) kinds_.emplace_back().mayJump = mayJump;
        kinds_[kindOf_[i]].patches.push_back(i);
    }
    for (const auto& [a, b] : neighbours_) isJump_.push_back(kinds_[kindOf_[a]].mayJump || kinds_[kindOf_[b]].mayJump);
}

int CertifiedCells::levelOf(int step) const {
    return std::clamp(step - finest_ - kLog2TexelsOfACell, 0, patches_.heights->used() - 1);
}

template <class StepOf>
PatchCells CertifiedCells::cellsOf(size_t patch, const StepOf& stepOf) const {
    PatchCells cells{.step = coarsest_};
    for (int k = 0; k < 3; ++k) {
        const uint32_t edge = edges_[patch][size_t(k)];
        const int step = stepOf(edge);
        cells.step = std::min(cells.step, step);
        cells.parts[k] = std::max(edgeParts_[edge] >> step, 1);
        cells.levels[k] = cells.parts[k] == 1 || isJump_[edge] ? 0 : levelOf(step);
    }
    cells.levels.w = kinds_[kindOf_[patch]].mayJump ? 0 : levelOf(cells.step);
    return cells;
}

PatchCells CertifiedCells::evenly(size_t patch, int step) const {
    return cellsOf(patch, [&](uint32_t) { return step; });
}

PatchCells CertifiedCells::cells(size_t patch) const {
    return cellsOf(patch, [&](uint32_t edge) { return edgeSteps_[edge]; });
}

std::array<glm::ivec3, 3> CertifiedCells::corners(size_t patch, int step) const {
    std::array<glm::ivec3, 3> at;
    // Halves go up at every step, so that an edge of n finest cells has n / 2^step cells, rounded down, at least.
    for (size_t k = 0; k < 3; ++k) at[k] = glm::ivec3((grids_[patch][k] + (1 << step >> 1)) >> step, 0);
    return at;
}

/// Returns between which heights a patch lies: those of the texels about it, and all where the map may jump.
std::pair<double, double> CertifiedCells::rangeOf(size_t patch) {
    Kind& kind = kinds_[kindOf_[patch]];
    if (kind.lowest > kind.highest) {
        const HeightLevel& map = patches_.heights->levels().front();
        dvec2 low(kNothing), high(-kNothing);
        for (const glm::vec2 uv : patches_.uvs[patch]) {
            low = glm::min(low, dvec2(uv) * patches_.heights->texels());
            high = glm::max(high, dvec2(uv) * patches_.heights->texels());
        }
        const glm::ivec2 first(glm::floor(low)), last(glm::ceil(high));
        uint16_t lowest = 65535, highest = 0;
        for (int j = first.y; j <= last.y && !kind.mayJump; ++j)
            for (int i = first.x; i <= last.x; ++i) {
                const size_t at = size_t(wrapped(i, map.size.x)) + size_t(map.size.x) * size_t(wrapped(j, map.size.y));
                lowest = std::min(lowest, map.texels[at]), highest = std::max(highest, map.texels[at]);
            }
        kind.lowest = kind.mayJump ? 0 : lowest / 65535.0, kind.highest = kind.mayJump ? 1 : highest / 65535.0;
    }
    return {kind.lowest, kind.highest};
}

CertifiedCells::Seen CertifiedCells::seenIn(const View& view, size_t patch) {
    const RemeshCamera& camera = view.camera;
    std::array<dvec3, 3> directions;
    std::array<dvec3, 6> hull;
    double longest = 0;
    for (size_t k = 0; k < 3; ++k) {
        const uint32_t corner = patches_.triangles[patch][k];
        directions[k] = view.directions[corner], hull[k] = view.positions[corner];
        hull[k + 3] = hull[k] + directions[k];
        longest = std::max(longest, glm::length(directions[k]));
    }
    if (isOutsideView(camera, view.picture, hull)) return {};
    const auto [lowest, highest] = rangeOf(patch);
    for (size_t k = 0; k < 3; ++k) {
        hull[k] = view.positions[patches_.triangles[patch][k]] + lowest * directions[k];
        hull[k + 3] = hull[k] + (highest - lowest) * directions[k];
    }
    Seen seen{.is = true, .lowest = lowest, .highest = highest};
    choosePixelStep(view, patch, seen);
    if (camera.isParallel) {
        for (const dvec3& d : directions)
            seen.perHeight = std::max(seen.perHeight, camera.focal * glm::length(dvec2(d)));
        seen.perUnit = camera.focal;
        return seen;
    }
    dvec3 low(kNothing), high(-kNothing);
    for (const dvec3& p : hull) low = glm::min(low, p), high = glm::max(high, p);
    const dvec4 s = view.picture;
    dvec2 leftLow(s.x, s.y), rightHigh(s.z, s.w);
    if (low.z > 0) {
        dvec2 least(kNothing), most(-kNothing);
        for (const dvec3& p : hull) least = glm::min(least, dvec2(p) / p.z), most = glm::max(most, dvec2(p) / p.z);
        leftLow = glm::clamp(least, leftLow, rightHigh), rightHigh = glm::clamp(most, leftLow, rightHigh);
    }
    // Two points of one place lie at depths from low.z on; and what is seen is no nearer than the box about the patch.
    seen.depth = low.z;
    const double away = glm::length(glm::max(glm::max(low, -high), dvec3(0))),
                 least = std::max(away / view.steepest, camera.nearest);
    if (least > seen.depth) seen.depth = least, seen.nearer = longest;
    seen.tangents = dvec4(leftLow, rightHigh);
    for (const double x : {leftLow.x, rightHigh.x})
        for (const double y : {leftLow.y, rightHigh.y}) {
            const dvec2 t(x, y);
            for (const dvec3& d : directions)
                seen.perHeight = std::max(seen.perHeight, camera.focal * glm::length(dvec2(d) - t * d.z));
            seen.perUnit = std::max(seen.perUnit, camera.focal * std::sqrt(1 + glm::dot(t, t)));
        }
    return seen;
}

double CertifiedCells::pixels(const Seen& seen, double height, double across, const Reach& reach) const {
    const double depth = seen.nearer > 0 ? seen.depth - seen.nearer * height - across - reach.length : seen.depth;
    return depth > 0 ? (seen.perHeight * height + seen.perUnit * across + reach.pixels) / depth : kNothing;
}

void CertifiedCells::choosePixelStep(const View& view, size_t patch, Seen& seen) const {
    dvec3 middle(0);
    double density = 0;
    for (const uint32_t corner : patches_.triangles[patch]) {
        middle += (view.positions[corner] + 0.5 * view.directions[corner]) / 3.0;
        density = std::max(density, double(patches_.densities[corner]));
    }
    const double depth = view.camera.isParallel ? 1 : std::max(middle.z, view.camera.nearest);
    const double texels = depth / view.camera.focal * density;  // of a pixel
    seen.pixel = finest_ + int(std::floor(std::log2(std::clamp(view.cell * texels, 1e-6, 1e6))));
    seen.pixel = std::clamp(seen.pixel, 0, coarsest_);
}

void CertifiedCells::sweepOver(size_t patch, const PatchCells& cells, Scratch& scratch) const {
    // The sweep moves places as it moves directions; where these lie in the place of those, they come out as they are.
    RemeshPiece<double> piece;
    scratch.mayJump = false;
    const auto corners = this->corners(patch, cells.step);
    for (size_t k = 0; k < 3; ++k) {
        const uint32_t corner = patches_.triangles[patch][k];
        auto& to = piece.corners[k];
        to.position = dvec3(patches_.directions[corner]), to.direction = dvec3(0);
        to.grid = corners[k], to.uv = dvec2(patches_.uvs[patch][k]);
        to.density = 0, to.height = heights_[corner], to.weight = 1;
        scratch.mayJump = scratch.mayJump || patches_.firstPlace[corner + 1] - patches_.firstPlace[corner] > 1;
        if (const uint32_t seam = patches_.seams[patch][k]; seam != RemeshSurface::kNoSeam)
            piece.seams[k] = {true, dvec2(patches_.seamUvs[seam][0]), dvec2(patches_.seamUvs[seam][1])};
    }
    piece.parts = cells.parts, piece.levels = cells.levels;
    scratch.mesh.clear(), scratch.over.clear();
    const RemeshMath<double>::RemeshView flat{{1, 1, 1, 1}, 0, RemeshMath<double>::kRemeshMap};
    PieceSweep<double> sweep(patches_, {}, flat, scratch.mesh);
    sweep.sweep(piece);
    for (size_t i = 0; i < scratch.mesh.indices.size(); i += 3) {
        auto& at = scratch.over.emplace_back();
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t number = scratch.mesh.indices[i + k];
            at[k] = {scratch.mesh.vertices[number].uv, sweep.heights()[number]};
        }
    }
}

void CertifiedCells::measure(Kind& kind, Known& known, double enough, Scratch& scratch) const {
    sweepOver(kind.patches.front(), known.cells, scratch);
    double across = 0, jump = 0;
    std::array<double, 4> reach{};
    DeviationSearch search{.enough = enough};
    const dvec2 texels = patches_.heights->texels();
    for (size_t i = 0; i < scratch.over.size(); ++i) {
        auto& at = scratch.over[i];
        const auto [least, most] = std::minmax({at[0].height, at[1].height, at[2].height});
        double apart = 0;
        for (size_t k = 0; k < 3; ++k) {
            const auto cornerOf = [&](size_t c) { return scratch.mesh.vertices[scratch.mesh.indices[3 * i + c % 3]]; };
            apart = std::max(apart, glm::distance(cornerOf(k).position, cornerOf(k + 1).position));
            const dvec2 edge = (at[(k + 1) % 3].at - at[k].at) * texels;
            const std::array<double, 4> along{edge.x, edge.y, edge.x + edge.y, edge.x - edge.y};
            for (size_t n = 0; n < 4; ++n) reach[n] = std::max(reach[n], std::abs(along[n]));
        }
        across = std::max(across, 0.25 * (most - least) * apart);
        if (scratch.mayJump)
            for (HeightCorner& corner : at) {
                const double own = patches_.heights->height(0, corner.at);
                jump = std::max(jump, corner.height - own), corner.height = own;
            }
        // Of steps that are too wide most are so at the middle of a triangle already.
        const dvec2 middle = (at[0].at + at[1].at + at[2].at) / 3.0;
        search.known = std::max(search.known, std::abs(patches_.heights->height(0, middle) -
                                                       (at[0].height + at[1].height + at[2].height) / 3));
        ++search.looked;
    }
    for (size_t i = 0; i < scratch.over.size() && !(search.known > enough); ++i)
        search.known = heightDeviation(*patches_.heights, scratch.over[i], search);
    const double height = search.known;
    known.isWhole = !(height > enough), kind.looked += search.looked;
    // Rounded up, so that what is kept in single precision is no less.
    known.height = roundedUp(height), known.jump = roundedUp(jump), known.across = roundedUp(across);
    for (size_t n = 0; n < 4; ++n) known.reach[n] = roundedUp(reach[n]);
}

void CertifiedCells::measureBeyond(Kind& kind, Known& known, double enough, Scratch& scratch) const {
    sweepOver(kind.patches.front(), known.cells, scratch);
    double beyond = 0;
    for (auto& at : scratch.over) {
        // Corners of a coarser level's heights are not on the map: no nearer does it come to them than to their place.
        if (known.cells.levels != glm::ivec4(0))
            for (const HeightCorner& corner : at)
                beyond = std::max(beyond, std::abs(corner.height - patches_.heights->height(0, corner.at)));
        // How far heights are from the middle of the corners' says how far they are beyond them.
        const auto [least, most] = std::minmax({at[0].height, at[1].height, at[2].height});
        const double middle = 0.5 * (least + most), half = 0.5 * (most - least);
        for (HeightCorner& corner : at) corner.height = middle;
        DeviationSearch search{.known = half + beyond, .enough = half + enough};
        beyond = std::max(beyond, heightDeviation(*patches_.heights, at, search) - half);
        kind.looked += search.looked;
        if (beyond > enough) break;
    }
    known.isBeyondWhole = !(beyond > enough), known.beyond = roundedUp(beyond);
}

CertifiedCells::Known& CertifiedCells::known(size_t patch, const Seen& seen, const PatchCells& cells, double allowed,
                                             Scratch& scratch) {
    Kind& kind = kinds_[kindOf_[patch]];
    auto& all = kind.known;
    auto found = std::ranges::find(all, cells, &Known::cells);
    const bool isNew = found == all.end();
    if (isNew) {
        if (all.size() >= kMostKnown + kind.patches.size()) all.clear();
        all.push_back({.cells = cells}), found = all.end() - 1;
    }
    // Above so much the error is more than is allowed, whatever else there is.
    const double enough = seen.perHeight > 0 ? 1.01 * allowed * seen.depth / seen.perHeight : kNothing;
    if (isNew || (!found->isWhole && !(double(found->height) > enough))) measure(kind, *found, enough, scratch);
    return *found;
}

CertifiedCells::Reach CertifiedCells::reachOf(const View& view, size_t patch, const Seen& seen,
                                              const Known& known) const {
    const auto& uvs = patches_.uvs[patch];
    const dvec2 texels = patches_.heights->texels(), a = (dvec2(uvs[1]) - dvec2(uvs[0])) * texels,
                b = (dvec2(uvs[2]) - dvec2(uvs[0])) * texels;
    const double area = a.x * b.y - a.y * b.x;
    if (!(std::abs(area) > 1e-9 * (glm::dot(a, a) + glm::dot(b, b)))) return {kNothing, kNothing};
    // Where what is lowest and what is highest goes along an edge of a triangle.
    const auto alongOf = [&](dvec2 edge, double height) {
        const auto at = [&](size_t k) {
            const uint32_t corner = patches_.triangles[patch][k];
            return view.positions[corner] + height * view.directions[corner];
        };
        const double x = (edge.x * b.y - edge.y * b.x) / area, y = (a.x * edge.y - a.y * edge.x) / area;
        return x * (at(1) - at(0)) + y * (at(2) - at(0));
    };
    const auto [x, y, sum, difference] = known.reach;
    Reach reach;
    for (const dvec2 edge : {dvec2(x, std::min(y, sum - x)), dvec2(std::min(x, sum - y), y),
                             dvec2(x, -std::min(y, difference - x)), dvec2(std::min(x, difference - y), -y)})
        for (const double height : {seen.lowest, seen.highest}) {
            const dvec3 along = alongOf(edge, height);
            reach.length = std::max(reach.length, glm::length(along));
            if (view.camera.isParallel) reach.pixels = std::max(reach.pixels, glm::length(dvec2(along)));
            for (const double left : {seen.tangents.x, seen.tangents.z})
                for (const double low : {seen.tangents.y, seen.tangents.w})
                    if (!view.camera.isParallel)
                        reach.pixels = std::max(reach.pixels, glm::length(dvec2(along) - dvec2(left, low) * along.z));
        }
    reach.pixels *= view.camera.focal;
    return reach;
}

double CertifiedCells::errorOf(const View& view, size_t patch, const Seen& seen, const PatchCells& cells,
                               double allowed, Scratch& scratch) {
    Known& of = known(patch, seen, cells, allowed, scratch);
    const double across = double(of.across);
    if (of.isWhole) {
        const double error = pixels(seen, double(of.height) + double(of.jump), across, {});
        if (error <= allowed) return error;
    }
    const Reach reach = reachOf(view, patch, seen, of);
    const double left = allowed - pixels(seen, 0, across, reach);
    if (!(left >= 0)) return kNothing;
    const double enough = seen.perHeight > 0 ? 1.01 * left * seen.depth / seen.perHeight : kNothing;
    if (!of.isBeyondWhole && !(double(of.beyond) > enough)) measureBeyond(kinds_[kindOf_[patch]], of, enough, scratch);
    if (!of.isBeyondWhole) return kNothing;
    const double error = pixels(seen, double(of.beyond), across, reach);
    return error <= allowed ? error : kNothing;
}

bool CertifiedCells::keeps(const View& view, size_t patch, const Seen& seen, const PatchCells& cells, double allowed,
                           Scratch& scratch) {
    if (errorOf(view, patch, seen, cells, allowed, scratch) <= allowed) return true;
    // Cells that are too wide to take a jump for a wall leave it as it is: narrow ones keep it where it is.
    const Known& of = known(patch, seen, cells, allowed, scratch);
    if (cells.step > seen.pixel || !of.isWhole || !(pixels(seen, double(of.jump), 0, {}) > 0.5 * allowed) ||
        pixels(seen, double(of.height), double(of.across), {}) > allowed)
        return false;
    const float finest = std::exp2(-float(finest_));
    const Known narrowest{.cells = cells, .reach = {finest, finest, 2 * finest, finest}};
    return pixels(seen, 0, 0, reachOf(view, patch, seen, narrowest)) > 0.75 * allowed;
}

int CertifiedCells::wantedStep(const View& view, size_t patch, Seen& seen, double allowed, Scratch& scratch) {
    for (int step = coarsest_; step >= 0; --step) {
        const PatchCells cells = evenly(patch, step);
        seen.canKeep = keeps(view, patch, seen, cells, allowed, scratch);
        if (seen.canKeep) return step;
        const Reach reach = reachOf(view, patch, seen, known(patch, seen, cells, allowed, scratch));
        if (pixels(seen, 0, 0, reach) < view.narrowest) break;
    }
    return std::min(seen.pixel, finest_);
}

/// Makes a patch's edges finer by a step: first those that are coarser than its cells.
void CertifiedCells::refine(size_t patch, std::vector<uint32_t>& open) {
    const int step = cells(patch).step;
    const auto& own = edges_[patch];
    const bool isEven = std::ranges::all_of(own, [&](uint32_t edge) { return edgeSteps_[edge] == step; });
    if (isEven && step == 0) return;
    for (const uint32_t edge : own) {
        if (!isEven && edgeSteps_[edge] == step) continue;
        --edgeSteps_[edge];
        for (const uint32_t beside : neighbours_[edge])
            if (seen_[beside].canKeep) open.push_back(beside);
    }
}

bool CertifiedCells::wantSteps(View& view, const RemeshOptions& options) {
    seen_.resize(patches_.triangles.size()), wanted_.resize(seen_.size());
    const auto want = [&](size_t first, size_t last) {
        if (first % kLetGo == 0) patches_.heights->letGo();
        Scratch scratch;
        for (size_t number = first; number < last; ++number) {
            Kind& kind = kinds_[number];
            if (kind.wantedIn == choice_.number) continue;
            for (const uint32_t i : kind.patches) {
                seen_[i] = seenIn(view, i);
                if (seen_[i].is) wanted_[i] = wantedStep(view, i, seen_[i], choice_.errorPixels, scratch);
            }
            kind.wantedIn = choice_.number;
        }
    };
    for (;; choice_.narrowest *= 2, choice_.number = ++choices_) {
        view.narrowest = choice_.narrowest;
        if (!options.shareOut)
            want(0, kinds_.size());
        else if (!options.shareOut(kinds_.size(), want))
            return false;
        if (view.narrowest >= kLeastNarrowPixels || cellsWanted() <= kMostCells) return true;
    }
}

double CertifiedCells::cellsWanted() const {
    double sum = 0;
    for (size_t i = 0; i < seen_.size(); ++i) {
        const glm::dvec2 a = grids_[i][1] - grids_[i][0], b = grids_[i][2] - grids_[i][0];
        if (seen_[i].is) sum += 0.5 * std::abs(a.x * b.y - a.y * b.x) * std::exp2(-2 * wanted_[i]);
    }
    return sum;
}

void CertifiedCells::chooseEdges(const View& view) {
    const double allowed = choice_.errorPixels;
    std::ranges::fill(edgeSteps_, coarsest_);
    std::vector<uint32_t> open;
    Scratch scratch;
    for (uint32_t i = 0; i < seen_.size(); ++i) {
        if (!seen_[i].is) continue;
        for (const uint32_t edge : edges_[i]) edgeSteps_[edge] = std::min(edgeSteps_[edge], wanted_[i]);
        if (seen_[i].canKeep) open.push_back(i);
    }
    // What a patch wants it may have; but its cells are as fine as the finest of its edges, and these as coarse as
    // another patch made them.
    for (size_t steps = 0; !open.empty(); ++steps) {
        if (steps % kLetGo == 0) patches_.heights->letGo();
        const uint32_t patch = open.back();
        open.pop_back();
        if (!keeps(view, patch, seen_[patch], cells(patch), allowed, scratch)) refine(patch, open);
    }
    for (uint32_t i = 0; i < seen_.size(); ++i) {
        if (i % kLetGo == 0) patches_.heights->letGo();
        if (!seen_[i].is) continue;
        const double error = errorOf(view, i, seen_[i], cells(i), allowed, scratch);
        if (error <= allowed)
            choice_.boundPixels = std::max(choice_.boundPixels, error);
        else
            ++choice_.uncertified;
    }
}

Result<void> CertifiedCells::choose(const RemeshCamera& camera, const RemeshOptions& options, RemeshCounts& counts) {
    const bool isSame =
        choice_.camera == camera && choice_.errorPixels == options.errorPixels && choice_.cell == options.cell;
    if (!isSame || choice_.number == 0)
        choice_ = {.camera = camera,
                   .errorPixels = options.errorPixels,
                   .cell = options.cell,
                   .narrowest = kNarrowestPixels,
                   .number = ++choices_};
    const auto lookedAt = [&] {
        uint64_t sum = 0;
        for (const Kind& kind : kinds_) sum += kind.looked;
        return sum;
    };
    if (!choice_.isMade) {
        const dvec4 s = camera.picture.value_or(camera.seen);
        const dvec2 farthest = glm::max(glm::abs(dvec2(s.x, s.y)), glm::abs(dvec2(s.z, s.w)));
        View view{camera, options.cell, s, std::sqrt(1 + glm::dot(farthest, farthest)), kNarrowestPixels, {}, {}};
        const auto turned = [&](dvec3 v) {
            return dvec3(glm::dot(v, camera.right), glm::dot(v, camera.up), glm::dot(v, camera.forward));
        };
        const dvec3 from = patches_.origin - camera.eye;
        for (const glm::vec3& p : patches_.positions) view.positions.push_back(turned(from + dvec3(p)));
        for (const glm::vec3& d : patches_.directions) view.directions.push_back(turned(dvec3(d)));
        const uint64_t before = lookedAt();
        if (!wantSteps(view, options)) return Error::cancelled();
        chooseEdges(view);
        choice_.isMade = true;
        if (const uint64_t looked = lookedAt() - before; looked > 0) {
            counts.looked += looked;
            patches_.heights->letGo();
        }
    }
    counts.boundPixels = std::max(counts.boundPixels, choice_.boundPixels);
    counts.uncertified += choice_.uncertified;
    return {};
}

template <class Real>
Result<void> remesh(CertifiedCells& cells, const RemeshCamera& camera, const RemeshOptions& options,
                    RemeshMesh<Real>& mesh, uint64_t mostVertices) {
    VCP_TRY(checkRemeshing(options));
    RemeshOptions ofMap = options;
    ofMap.access = HeightAccess::Map, ofMap.bounds = false;
    VCP_TRY(cells.choose(camera, options, mesh.counts));
    PieceSweep<Real> sweep(cells.patches(), ofMap, remeshViewOf<Real>(camera, ofMap), mesh);
    PieceMaker<Real> maker(cells.patches(), camera, ofMap, mesh.counts, &cells);
    return maker.run([&](const RemeshPiece<Real>& piece) -> Result<void> {
        sweep.sweep(piece);
        if (mesh.vertices.size() > mostVertices) return tooManyVertices(mostVertices);
        return {};
    });
}

template Result<void> remesh(CertifiedCells&, const RemeshCamera&, const RemeshOptions&, RemeshMesh<float>&, uint64_t);
template Result<void> remesh(CertifiedCells&, const RemeshCamera&, const RemeshOptions&, RemeshMesh<double>&, uint64_t);

}  // namespace vcp::meso
