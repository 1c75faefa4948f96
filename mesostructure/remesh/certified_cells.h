// Cells whose error on the screen is certified: for each view the coarsest that keep what is allowed.
//
// The cells of remesher.h are the screen's, and what lies between their corners is not known before they are made. Here
// cells are the map's, 2^s texels wide: what they leave out does not depend on the view. The surface is cut once into
// patches of some 16 texels' edge, by halving what is longer. A view gives each patch a step s, each edge between two
// patches the finer of their steps, and sweeps a patch with cells as fine as its finest edge. Patches are swept as
// pieces are (mesostructure/shared/remesh_sweep.h), with the map's cells in the place of the grid's; points of a patch
// along an edge with fewer parts than its cells lie at the ends of those parts, so that nothing gapes.
//
// The certificate. A point of the base has place p, direction d and the map's height h; there the mesh has the mean of
// its corners' h_i d_i. The two differ by (h - mean of h_i) d less the covariance of h_i and d_i, which is at most a
// quarter of the range of h_i times that of d_i. The first difference is known exactly (height_deviation.h), triangle
// by triangle; both are kept for a patch and its steps, and a view turns them into pixels: along the directions of the
// patch, over all depths that it may have. So every point of the picture of the mesh is within so many pixels of the
// displaced surface's at the same place of the base, and the other way round.
//
// Where the map is steep, that asks for more than can be seen: the surface is near in the picture, but of another
// place. A triangle's corners lie on the surface, and between them the map has all heights from the lowest of theirs to
// the highest, as the triangle has: each point of one is as high as some point of the other over the same triangle of
// the base. So they are no farther apart than that is wide, along its edges in the picture, and by how much the map
// goes beyond the corners' heights, or the corners are off the map where they have the heights of a coarser level. The
// less of the two certificates counts.
//
// Points within a patch and along its edges have heights of the level with two texels to a cell's edge, its corners
// those of the map. Where the map may jump, all have those of the map.
//
// Patches are smaller where the map is steep (height_bends.h), down to parts of a texel: their edges end where they
// cross the lines between texels, so that within a patch nothing bends sharply.
//
// Where the map jumps along an edge, the surface has a wall there between the heights of both sides; the mesh goes down
// from the higher ones within its first cells, which the second certificate covers.
//
// Where the map repeats, patches repeat: those with the same texels and directions are measured once (`kinds_`).
//
// What is not certified: the rounding of single precision; what is nearer to the eye than the patch's own size; and
// where the map jumps along an edge and cells of a sixteenth of a texel are wider than what is allowed: there slopes
// stand for the wall, within cells beside the edge that are at most options.cell pixels wide.
// RemeshCounts::uncertified counts the patches of the last two. One thread at a time calls.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mesostructure/remesh/remesher.h"

namespace vcp::meso {

/// How a patch is swept.
struct PatchCells {
    int step = 0;         ///< its cells are 2^step of the finest ones wide
    glm::ivec3 parts{1};  ///< of its edges, at most as many as they have cells
    /// Levels that heights are from: along its edges, and within. An edge's depends on the edge alone.
    glm::ivec4 levels{0};

    bool operator==(const PatchCells&) const = default;
};

class CertifiedCells {
public:
    /// Cuts a surface into patches. `progress`: takes the part that is done, from 0 to 1; false cancels. Errors: Limit
    /// (more than 2^22 patches); Cancelled.
    static Result<CertifiedCells> create(const RemeshSurface& surface,
                                         const std::function<bool(double part)>& progress = {});

    /// Chooses the cells of a view: errors of at most options.errorPixels on the screen, where the finest cells can,
    /// and beside a jump of the map at most options.cell pixels wide. Fills in boundPixels, looked and uncertified.
    /// What was measured until options.shareOut cancels stays known, and the next call for the same view goes on there;
    /// one for the view that was chosen last finds its cells. Errors: Cancelled.
    Result<void> choose(const RemeshCamera& camera, const RemeshOptions& options, RemeshCounts& counts);

    /// The height of a corner of the patches: the most of those that it has in the map, in either precision.
    template <class Real>
    [[nodiscard]] Real height(uint32_t corner) const {
        if constexpr (sizeof(Real) == sizeof(float))
            return singleHeights_[corner];
        else
            return heights_[corner];
    }
    /// The surface, each triangle a patch.
    [[nodiscard]] const RemeshSurface& patches() const { return patches_; }
    [[nodiscard]] PatchCells cells(size_t patch) const;
    /// Returns where a patch's corners lie among cells of a step.
    [[nodiscard]] std::array<glm::ivec3, 3> corners(size_t patch, int step) const;

private:
    /// By how much a patch with some cells is off.
    struct Known {
        PatchCells cells;
        float height = 0;     ///< most that heights differ, in parts of the range, were it not for jumps
        float jump = 0;       ///< most by which a corner of a triangle is higher than the patch's own map
        float across = 0;     ///< most of the covariance, world units
        bool isWhole = true;  ///< false: heights differ by more than that
        /// Most that an edge of a triangle is long along x, y, x + y and x - y; texels.
        std::array<float, 4> reach{};
        float beyond = 0;            ///< most that heights are beyond those of a triangle's corners
        bool isBeyondWhole = false;  ///< false: they may be beyond by more than that
    };
    /// What the edges of a patch's triangles are in a view.
    struct Reach {
        double pixels = 0;  ///< at depth 1
        double length = 0;  ///< world units
    };
    /// Patches with the same texels and directions: one is measured for all.
    struct Kind {
        std::vector<uint32_t> patches;
        std::vector<Known> known;
        uint64_t looked = 0;             ///< texels, ever
        uint32_t wantedIn = 0;           ///< the last choice in which its patches' steps were wanted
        double lowest = 1, highest = 0;  ///< heights are between these; where lowest is above, not known yet
        bool mayJump = false;            ///< along its edges
    };
    /// The view that cells are chosen for, and how far that is.
    struct Choice {
        RemeshCamera camera;
        double errorPixels = 0, cell = 0;
        double narrowest = 0;  ///< as in View
        uint32_t number = 0;   ///< of the steps that are wanted: Kind::wantedIn
        bool isMade = false;
        double boundPixels = 0;  ///< as in RemeshCounts, and the next
        uint64_t uncertified = 0;
    };
    /// What a view makes of errors: pixels are (perHeight height + perUnit across) / (depth - nearer |error|).
    struct Seen {
        bool is = false;
        bool canKeep = false;            ///< what is allowed, with even cells
        int pixel = 0;                   ///< step of cells of options.cell pixels
        double lowest = 0, highest = 1;  ///< heights are between these
        double perHeight = 0, perUnit = 0, depth = 1, nearer = 0;
        glm::dvec4 tangents{0};  ///< of what is seen: left, lower, right, upper
    };
    struct View;
    struct Scratch;

    void addEdges();
    void addKinds();
    void measureCorners();
    [[nodiscard]] std::pair<double, double> rangeOf(size_t patch);
    [[nodiscard]] Seen seenIn(const View& view, size_t patch);
    [[nodiscard]] double pixels(const Seen& seen, double height, double across, const Reach& reach) const;
    /// Returns the level that points of cells of a step have their heights from.
    [[nodiscard]] int levelOf(int step) const;
    /// Returns a patch's cells where its edges have some steps.
    template <class StepOf>
    [[nodiscard]] PatchCells cellsOf(size_t patch, const StepOf& stepOf) const;
    [[nodiscard]] PatchCells evenly(size_t patch, int step) const;
    void choosePixelStep(const View& view, size_t patch, Seen& seen) const;
    /// Returns the coarsest step that keeps what is allowed, and sets whether one does; else that of a pixel.
    int wantedStep(const View& view, size_t patch, Seen& seen, double allowed, Scratch& scratch);
    /// Returns what is known of how heights differ, exactly where that is at most `allowed` pixels.
    Known& known(size_t patch, const Seen& seen, const PatchCells& cells, double allowed, Scratch& scratch);
    void sweepOver(size_t patch, const PatchCells& cells, Scratch& scratch) const;
    void measure(Kind& kind, Known& known, double enough, Scratch& scratch) const;
    void measureBeyond(Kind& kind, Known& known, double enough, Scratch& scratch) const;
    [[nodiscard]] Reach reachOf(const View& view, size_t patch, const Seen& seen, const Known& known) const;
    /// Returns the pixels that are certified of a patch with some cells; infinity, where it may be off by more than is
    /// allowed.
    double errorOf(const View& view, size_t patch, const Seen& seen, const PatchCells& cells, double allowed,
                   Scratch& scratch);
    /// Whether what is allowed is kept, but for a jump that no cells take away.
    bool keeps(const View& view, size_t patch, const Seen& seen, const PatchCells& cells, double allowed,
               Scratch& scratch);
    void refine(size_t patch, std::vector<uint32_t>& open);
    /// Finds the steps that patches want. Returns false where it was cancelled.
    bool wantSteps(View& view, const RemeshOptions& options);
    [[nodiscard]] double cellsWanted() const;
    /// Chooses steps of edges that keep what patches may leave out, and finds what is certified then.
    void chooseEdges(const View& view);

    RemeshSurface patches_;
    int finest_ = 0;                                   ///< the finest cells are 1 / 2^finest texels wide
    int coarsest_ = 0;                                 ///< step of cells as wide as a patch
    std::vector<std::array<glm::ivec2, 3>> grids_;     ///< of each patch's corners among the finest cells
    std::vector<std::array<uint32_t, 3>> edges_;       ///< of each patch, from corner k to the next
    std::vector<std::array<uint32_t, 2>> neighbours_;  ///< of each edge: one or two patches
    std::vector<int> edgeParts_, edgeSteps_;           ///< of each edge, parts among the finest cells
    std::vector<bool> isJump_;                         ///< of each edge, whether a patch beside it may jump
    std::vector<double> heights_;                      ///< of the corners
    std::vector<float> singleHeights_;
    std::vector<Kind> kinds_;
    std::vector<uint32_t> kindOf_;  ///< of each patch
    std::vector<Seen> seen_;
    std::vector<int> wanted_;  ///< steps, of each patch that is seen
    Choice choice_;
    uint32_t choices_ = 0;
};

/// Adds the surface's triangles with cells of the map to a mesh. Errors: as remesh().
template <class Real>
Result<void> remesh(CertifiedCells& cells, const RemeshCamera& camera, const RemeshOptions& options,
                    RemeshMesh<Real>& mesh, uint64_t mostVertices = uint64_t{1} << 26);

extern template Result<void> remesh(CertifiedCells&, const RemeshCamera&, const RemeshOptions&, RemeshMesh<float>&,
                                    uint64_t);
extern template Result<void> remesh(CertifiedCells&, const RemeshCamera&, const RemeshOptions&, RemeshMesh<double>&,
                                    uint64_t);

}  // namespace vcp::meso
