#include "mesostructure/shell.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "octree/surface/area_split.h"

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3;

constexpr size_t kMostPieces = size_t{1} << 24;  // numbers of pieces are stored as floats
constexpr double kLongest = 3;                   // longest direction at an edge, in heights
constexpr double kLeastVolume = 0.02;            // of a piece, of that over a flat triangle; else columns are cut
constexpr double kLeastReach = 1.0 / 64;         // of a column, of the shell's height
constexpr int kMostRounds = 16;                  // in which columns are cut, each round for what the last one changed

constexpr double kLeastSmooth = 0.866;  // cosine of 30 degrees: where the base turns by more, it has an edge

using Piece = ShellPiece;

dvec3 faceNormal(const BaseSurface& surface, size_t triangle) {
    const auto& t = surface.triangles[triangle];
    const dvec3 a = surface.positions[t[0]], n = glm::cross(surface.positions[t[1]] - a, surface.positions[t[2]] - a);
    const double length = glm::length(n);
    return length > 0 ? n / length : dvec3(0);
}

/// Which edges of which triangles have a neighbour that continues the same map, whole tiles apart.
class Joins {
public:
    Joins(const BaseSurface& surface, dvec2 tile) : tile_(tile) {
        for (size_t i = 0; i < surface.triangles.size(); ++i)
            for (int k = 0; k < 3; ++k) {
                const Edge edge = edgeOf(surface, i, k);
                // An edge with more than a few triangles is no surface: the others are cut.
                if (auto& uses = uses_[edge.corners]; uses.size() < 16) uses.push_back(edge.map);
            }
    }
    /// Whether the edge from corner k to the next is joined.
    [[nodiscard]] bool isJoined(const BaseSurface& surface, size_t triangle, int k) const {
        const Edge edge = edgeOf(surface, triangle, k);
        const auto& uses = uses_.at(edge.corners);
        return std::ranges::count_if(
                   uses, [&](const Map& map) { return isWhole(map[0] - edge.map[0], map[1] - edge.map[1]); }) > 1;
    }

private:
    using Map = std::array<dvec2, 2>;
    struct Edge {
        std::pair<uint32_t, uint32_t> corners;
        Map map;
    };
    static Edge edgeOf(const BaseSurface& surface, size_t triangle, int k) {
        const auto& t = surface.triangles[triangle];
        const auto& map = surface.uvs[triangle];
        const int next = (k + 1) % 3;
        return t[k] < t[next] ? Edge{{t[k], t[next]}, {map[k], map[next]}} : Edge{{t[next], t[k]}, {map[next], map[k]}};
    }
    /// Whether two places are whole tiles apart; a millionth of a tile is not seen.
    bool isWhole(dvec2 a, dvec2 b) const {
        const dvec2 tiles = a / tile_, off = glm::abs(tiles - glm::round(tiles)), turned = glm::abs(a - b) / tile_;
        return std::max({off.x, off.y, turned.x, turned.y}) < 1e-6;
    }

    dvec2 tile_;
    std::map<std::pair<uint32_t, uint32_t>, std::vector<Map>> uses_;
};

class PieceMaker {
public:
    PieceMaker(const BaseSurface& surface, double height, dvec3 extent, double offset, Shell& shell)
        : surface_(surface),
          directions_(shellDirections(surface)),
          joins_(surface, extent),
          height_(height),
          tileHeight_(extent.z),
          offset_(offset),
          shell_(shell),
          reaches_(surface.positions.size(), 1) {}

    std::vector<Piece> all() {
        for (int round = 0; round < kMostRounds && cutColumns(); ++round) {
        }
        shell_.cut = uint64_t(std::ranges::count_if(reaches_, [](double reach) { return reach < 1; }));
        std::vector<Piece> pieces;
        for (size_t i = 0; i < surface_.triangles.size(); ++i) addPrism(i, pieces);
        return pieces;
    }

private:
    void addPrism(size_t triangle, std::vector<Piece>& pieces) {
        if (faceNormal(surface_, triangle) == dvec3(0)) {
            ++shell_.withoutArea;
            return;
        }
        const auto& t = surface_.triangles[triangle];
        const auto& map = surface_.uvs[triangle];
        const dvec2 a = map[1] - map[0], b = map[2] - map[0];
        const double area = a.x * b.y - a.y * b.x;
        shell_.withoutMap += std::abs(area) <= 1e-12 * (glm::dot(a, a) + glm::dot(b, b));
        shell_.mirrored += area < 0;
        const Prism prism = prismOf(triangle, 1);
        const std::array<int, 3>& order = prism.order;
        bool isTopCut = false;
        std::array<dvec3, 6> tile;  // as Prism::world
        for (int k = 0; k < 3; ++k) {
            const double reach = reaches_[t[order[k]]];
            isTopCut |= reach < 1;
            tile[k] = dvec3(map[order[k]], 0), tile[k + 3] = dvec3(map[order[k]], reach * tileHeight_);
        }
        // The sides, by the column that they are opposite to.
        std::array<bool, 3> isCut{};
        for (int k = 0; k < 3; ++k) {
            const int from = order[(k + 1) % 3], to = order[(k + 2) % 3];
            isCut[k] = !joins_.isJoined(surface_, triangle, (from + 1) % 3 == to ? from : to);
        }
        for (int piece = 0; piece < 3; ++piece) {
            Piece made;
            for (int k = 0; k < 4; ++k)
                made.corners[k] = prism.world[kCorners[piece][k]], made.tile[k] = tile[kCorners[piece][k]];
            made.bits = bitsOf(kCorners[piece], isCut) | uint32_t(piece) << f32::kShellPart;
            if (isTopCut && kCorners[piece][1] == 3) made.bits |= 1;  // the top is opposite to its first corner
            for (int k = 0; k < 3; ++k) made.columns[k] = t[order[k]];
            const double volume = prism.volume(piece);
            const double scale = glm::distance(made.corners[1], made.corners[0]) *
                                 glm::distance(made.corners[2], made.corners[0]) *
                                 glm::distance(made.corners[3], made.corners[0]);
            shell_.inverted += volume < 0;
            if (std::abs(volume) > 1e-12 * scale)
                pieces.push_back(made);
            else
                ++shell_.flat;
        }
    }

    /// The corners of the prism: base, then top; column i is corners i and i + 3.
    static constexpr int kCorners[3][4] = {{0, 1, 2, 5}, {0, 1, 4, 5}, {0, 3, 4, 5}};

    struct Prism {
        std::array<int, 3> order = {0, 1, 2};  ///< the triangle's corners, by number
        std::array<dvec3, 6> world;            ///< in this order
        bool isOdd = false;

        /// Returns six times the volume of a piece; below 0 where it is turned inside out.
        [[nodiscard]] double volume(int piece) const {
            const auto& c = kCorners[piece];
            const dvec3 from = world[c[0]];
            const double six = glm::dot(glm::cross(world[c[1]] - from, world[c[2]] - from), world[c[3]] - from);
            return isOdd != (piece == 1) ? -six : six;
        }
    };

    /// Returns the prism with a part of each column's reach.
    [[nodiscard]] Prism prismOf(size_t triangle, double part) const {
        const auto& t = surface_.triangles[triangle];
        Prism made;
        std::ranges::sort(made.order, {}, [&](int k) { return t[k]; });
        made.isOdd = (made.order[1] - made.order[0] + 3) % 3 != 1;
        for (int k = 0; k < 3; ++k) {
            const uint32_t corner = t[made.order[k]];
            made.world[k] = surface_.positions[corner] - shell_.origin;
            if (offset_ != 0) made.world[k] += offset_ * directions_[corner];
            made.world[k + 3] = made.world[k] + part * reaches_[corner] * height_ * directions_[corner];
        }
        return made;
    }

    /// Whether each piece of a prism with a part of its columns has some volume, the right way round.
    [[nodiscard]] bool isSound(size_t triangle, double part) const {
        const Prism prism = prismOf(triangle, part);
        const double base = glm::length(glm::cross(prism.world[1] - prism.world[0], prism.world[2] - prism.world[0]));
        for (int piece = 0; piece < 3; ++piece) {
            // A piece has one of the columns.
            const double reach = reaches_[surface_.triangles[triangle][prism.order[2 - piece]]];
            if (prism.volume(piece) < kLeastVolume * base * part * reach * height_) return false;
        }
        return true;
    }

    /// Cuts the columns of prisms that would be turned inside out; what cannot be helped stays. Returns whether any was
    /// cut.
    bool cutColumns() {
        bool any = false;
        std::vector<double> next = reaches_;
        for (size_t i = 0; i < surface_.triangles.size(); ++i) {
            if (isSound(i, 1) || faceNormal(surface_, i) == dvec3(0)) continue;
            double sound = 1;
            while (sound >= kLeastReach && !isSound(i, sound)) sound /= 2;
            if (sound < kLeastReach) continue;
            double turned = 2 * sound;
            for (int k = 0; k < 8; ++k) {
                const double middle = (sound + turned) / 2;
                (isSound(i, middle) ? sound : turned) = middle;
            }
            for (const uint32_t corner : surface_.triangles[i])
                if (const double reach = reaches_[corner] * sound; reach >= kLeastReach)
                    next[corner] = std::min(next[corner], reach), any = true;
        }
        reaches_ = std::move(next);
        return any;
    }

    static uint32_t bitsOf(const int (&corners)[4], const std::array<bool, 3>& isCut) {
        uint32_t bits = corners[2] < 3 ? Shell::kBase : 0;
        for (int face = 0; face < 4; ++face) {
            uint32_t columns = 0;
            for (int k = 0; k < 4; ++k)
                if (k != face) columns |= 1u << corners[k] % 3;
            // A side has two columns; the base, the top and faces within have three.
            for (int opposite = 0; opposite < 3; ++opposite)
                if (columns == (7u & ~(1u << opposite)) && isCut[opposite]) bits |= 1u << face;
        }
        return bits;
    }

    const BaseSurface& surface_;
    std::vector<dvec3> directions_;
    Joins joins_;
    double height_, tileHeight_, offset_;
    Shell& shell_;
    std::vector<double> reaches_;  // of the columns, parts of the height
};

/// Makes the tree over prisms, whose pieces follow each other: a prism a leaf.
class TreeMaker {
public:
    explicit TreeMaker(const std::vector<Piece>& pieces) {
        for (size_t first = 0, last = 0; first < pieces.size(); first = last) {
            Prism prism;
            prism.first = uint32_t(first);
            do prism.box.add({pieces[last].low(), pieces[last].high()});
            while (++last < pieces.size() && isSamePrism(pieces[last - 1], pieces[last]));
            prism.pieces = uint32_t(last - first);
            prisms_.push_back(prism);
        }
    }

    /// Returns the nodes; appends the pieces' numbers in the order in which leaves have them.
    std::vector<glm::vec4> nodes(std::vector<uint32_t>& order) {
        texels_.resize(Shell::kNodeTexels);
        make(0, prisms_, 0, order);
        return std::move(texels_);
    }

private:
    struct Prism {
        uint32_t first = 0, pieces = 0;
        Bounds box;
        [[nodiscard]] dvec3 middle() const { return 0.5 * (box.low + box.high); }
    };
    using Prisms = std::span<Prism>;

    /// Whether a piece belongs to the prism of the piece before it.
    static bool isSamePrism(const Piece& before, const Piece& piece) {
        const auto partOf = [](const Piece& of) { return of.bits >> f32::kShellPart & 3u; };
        return piece.columns == before.columns && partOf(piece) > partOf(before);
    }

    void make(size_t node, Prisms prisms, uint32_t depth, std::vector<uint32_t>& order) {
        Bounds box;
        for (const Prism& prism : prisms) box.add(prism.box);
        // Boxes are widened by more than single precision rounds.
        const dvec3 slack = 1e-6 * (glm::abs(box.low) + glm::abs(box.high)) + 1e-5 * (box.high - box.low);
        const bool isLeaf = prisms.size() == 1;
        const size_t children = texels_.size() / Shell::kNodeTexels;
        texels_[2 * node] = glm::vec4(box.low - slack, float(isLeaf ? order.size() : children));
        texels_[2 * node + 1] = glm::vec4(box.high + slack, float(isLeaf ? prisms[0].pieces : 0));
        if (isLeaf) {
            // The upper piece comes first, as most rays come to it first: what they hit there spares them the others.
            for (uint32_t i = prisms[0].pieces; i-- > 0;) order.push_back(prisms[0].first + i);
            return;
        }
        texels_.resize(texels_.size() + 2 * Shell::kNodeTexels);
        const size_t half = split(prisms, depth);
        make(children, prisms.first(half), depth + 1, order);
        make(children + 1, prisms.subspan(half), depth + 1, order);
    }

    /// Puts the prisms of the first side first. Returns how many these are.
    static size_t split(Prisms prisms, uint32_t depth) {
        // Halves keep the tree within the depth that casting has room for.
        const bool isDeep = depth + uint32_t(std::bit_width(prisms.size())) >= Shell::kDepth - 2;
        const AreaSplit plane = isDeep ? AreaSplit()
                                       : cheapestSplit(
                                             uint32_t(prisms.size()), [&](uint32_t i) { return prisms[i].middle(); },
                                             [&](uint32_t i) { return prisms[i].box; });
        size_t first = 0;
        if (plane.axis >= 0)
            first = size_t(std::partition(prisms.begin(), prisms.end(),
                                          [&](const Prism& p) { return p.middle()[plane.axis] < plane.position; }) -
                           prisms.begin());
        return first > 0 && first < prisms.size() ? first : halve(prisms);
    }

    /// Does so at the median along the longest axis.
    static size_t halve(Prisms prisms) {
        Bounds middles;
        for (const Prism& prism : prisms) middles.add(prism.middle());
        const dvec3 size = middles.high - middles.low;
        const int longest = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const size_t half = prisms.size() / 2;
        std::nth_element(prisms.begin(), prisms.begin() + std::ptrdiff_t(half), prisms.end(),
                         [&](const Prism& a, const Prism& b) { return a.middle()[longest] < b.middle()[longest]; });
        return half;
    }

    std::vector<Prism> prisms_;
    std::vector<glm::vec4> texels_;
};

void append(const Piece& piece, dvec3 extent, uint32_t moreBits, std::vector<glm::vec4>& texels) {
    const auto edges = [](const std::array<dvec3, 4>& c) { return glm::dmat3(c[1] - c[0], c[2] - c[0], c[3] - c[0]); };
    const glm::dmat3 weights = glm::inverse(edges(piece.corners)), map = edges(piece.tile) * weights;
    dvec3 q0 = piece.tile[0];
    for (int axis = 0; axis < 2; ++axis) q0[axis] -= extent[axis] * std::floor(q0[axis] / extent[axis]);
    // The rows are those of a matrix that is stored by columns.
    const glm::dmat3 r = glm::transpose(weights), t = glm::transpose(map);
    texels.push_back(glm::vec4(piece.corners[0], float(piece.bits | moreBits)));
    for (int row = 0; row < 3; ++row) texels.push_back(glm::vec4(r[row], q0[row]));
    for (int row = 0; row < 3; ++row) texels.push_back(glm::vec4(t[row], float(piece.columns[row])));
}

/// Returns the direction of each position, by which normals turn between the corners of the base, as shells have it.
std::vector<glm::vec4> gentleDirections(const BaseSurface& surface) {
    std::vector<dvec3> directions = shellDirections(surface);
    std::vector<bool> isSharp(directions.size());
    for (size_t i = 0; i < directions.size(); ++i) {
        isSharp[i] = directions[i] == dvec3(0);
        if (!isSharp[i]) directions[i] = glm::normalize(directions[i]);
    }
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        const dvec3 normal = faceNormal(surface, i);
        if (normal == dvec3(0)) continue;
        for (const uint32_t corner : surface.triangles[i])
            if (glm::dot(directions[corner], normal) < kLeastSmooth) isSharp[corner] = true;
    }
    std::vector<glm::vec4> texels;
    for (size_t i = 0; i < directions.size(); ++i)
        texels.push_back(isSharp[i] ? glm::vec4(0) : glm::vec4(directions[i], 1));
    return texels;
}

bool isSmooth(const std::vector<Piece>& pieces, const std::vector<glm::vec4>& directions, const Shell& shell) {
    const auto isGentle = [&](uint32_t column) { return directions[column].w > 0; };
    return shell.cut == 0 && shell.inverted == 0 &&
           std::ranges::all_of(pieces, [&](const Piece& p) { return std::ranges::all_of(p.columns, isGentle); });
}

bool isFinite(const BaseSurface& surface) {
    const auto good = [](double x) { return std::isfinite(x); };
    for (const dvec3 p : surface.positions)
        if (!good(p.x) || !good(p.y) || !good(p.z)) return false;
    for (const auto& map : surface.uvs)
        for (const dvec2 uv : map)
            if (!good(uv.x) || !good(uv.y)) return false;
    return true;
}

}  // namespace

std::vector<dvec3> shellDirections(const BaseSurface& surface) {
    std::vector<dvec3> sums(surface.positions.size(), dvec3(0));
    std::vector<double> least(surface.positions.size(), 1);
    const auto each = [&](const auto& use) {
        for (size_t i = 0; i < surface.triangles.size(); ++i) {
            const dvec3 normal = faceNormal(surface, i);
            if (normal != dvec3(0)) use(surface.triangles[i], normal);
        }
    };
    each([&](const std::array<uint32_t, 3>& t, dvec3 normal) {
        for (int k = 0; k < 3; ++k) {
            const dvec3 p = surface.positions[t[k]], a = glm::normalize(surface.positions[t[(k + 1) % 3]] - p),
                        b = glm::normalize(surface.positions[t[(k + 2) % 3]] - p);
            sums[t[k]] += normal * std::acos(std::clamp(glm::dot(a, b), -1.0, 1.0));
        }
    });
    for (dvec3& sum : sums)
        if (const double length = glm::length(sum); length > 1e-6)
            sum /= length;
        else
            sum = dvec3(0);
    each([&](const std::array<uint32_t, 3>& t, dvec3 normal) {
        for (const uint32_t corner : t) least[corner] = std::min(least[corner], glm::dot(sums[corner], normal));
    });
    for (size_t i = 0; i < sums.size(); ++i) sums[i] /= std::max(least[i], 1 / kLongest);
    return sums;
}

std::vector<ShellPiece> shellPieces(const BaseSurface& surface, double height, dvec3 extent, double offset,
                                    Shell& shell) {
    dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
    for (const auto& triangle : surface.triangles)
        for (const uint32_t corner : triangle)
            low = glm::min(low, surface.positions[corner]), high = glm::max(high, surface.positions[corner]);
    if (!surface.triangles.empty()) shell.origin = 0.5 * (low + high);
    return PieceMaker(surface, height, extent, offset, shell).all();
}

Result<Shell> buildShell(const BaseSurface& surface, double height, dvec3 extent, double offset) {
    const auto fail = [](ErrorCode code, const char* message) { return Error{.code = code, .message = message}; };
    if (!(height > 0) || !std::isfinite(height) || !(extent.z > 0))
        return fail(ErrorCode::Usage, "a shell's height must be above 0");
    if (!std::isfinite(offset)) return fail(ErrorCode::Usage, "a shell's offset must be finite");
    if (surface.uvs.size() != surface.triangles.size())
        return fail(ErrorCode::Usage, "a base surface needs texture coordinates for each triangle");
    if (3 * surface.triangles.size() > kMostPieces)
        return fail(ErrorCode::Limit, "a base surface has at most 5 592 405 triangles");
    if (!isFinite(surface)) return fail(ErrorCode::InvalidInput, "positions and texture coordinates must be finite");
    Shell shell;
    const std::vector<Piece> pieces = shellPieces(surface, height, extent, offset, shell);
    if (pieces.empty())
        return fail(ErrorCode::InvalidInput, shell.flat > 0
                                                 ? "all faces lie on their own backs: the surface has no outside"
                                                 : "no triangle has an area");
    std::vector<uint32_t> order;
    shell.texels = TreeMaker(pieces).nodes(order);
    shell.nodes = uint32_t(shell.texels.size() / Shell::kNodeTexels);
    shell.pieces = uint32_t(pieces.size());
    shell.low = shell.origin + dvec3(shell.texels[0]), shell.high = shell.origin + dvec3(shell.texels[1]);
    const std::vector<glm::vec4> directions = gentleDirections(surface);
    const uint32_t smooth = isSmooth(pieces, directions, shell) ? f32::kShellSmooth : 0;
    for (const uint32_t i : order) append(pieces[i], extent, smooth, shell.texels);
    shell.texels.insert(shell.texels.end(), directions.begin(), directions.end());
    for (const glm::vec4& texel : shell.texels)
        if (!std::isfinite(texel.x + texel.y + texel.z + texel.w))
            return fail(ErrorCode::InvalidInput,
                        "positions or texture coordinates are too large or too close together for single precision");
    return shell;
}

}  // namespace vcp::meso
