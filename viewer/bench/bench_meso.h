// vcp bench meso: run time and work against error of the mesostructure marchers, on the CPU or on a device, all with
// the same rays (docs/mesostructure.md).
//
// There are two truths, both in double: that of the shape (a formula's root, the bilinear height field, the mesh),
// which the classes and the errors are against; and that of the method's own data where they are samples (`solver_*`),
// which says what the solving alone costs. On the CPU rays go one by one in one thread, on a device all at once. Times
// are the processor's (of all threads of a software device; a GPU's are its queue's), taken in rounds over all methods
// after a warm-up, and each method's is divided by that of one peer in the same round. The median of these ratios is
// reliable even on a machine that does other things as well.
#pragma once

#include <array>
#include <cstdint>
#include <ctime>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mesostructure/asset_file.h"
#include "octree/io/result.h"
#include "render/picture_renderer.h"

namespace vcp {

struct BenchMesoOptions {
    /// Names of procedural height fields and solids, or asset files; empty: a set of eleven.
    std::vector<std::string> assets;
    std::vector<std::string> methods;   ///< empty: all that fit the asset
    std::vector<std::string> views;     ///< empty: all
    std::optional<std::string> device;  ///< march and remesh there, as RendererOptions::device; absent: on the CPU
    bool sweep = false;                 ///< each method at several values of its knob
    int rays = 2000;                    ///< a view
    int repetitions = 3;                ///< rounds over the methods
    bool published = false;             ///< compares with the papers' tables, each method at the knobs that these need
    bool factors = false;               ///< compares the factors of displacement maps
    bool shadows = false;               ///< compares shadows by displacement maps with the shape's
    bool light = false;                 ///< compares light from everywhere on a tile with a path tracer
    bool prisms = false;                ///< measures what maps from prisms to tile space distort
    bool bases = false;                 ///< measures view-dependent maps over bases that bend
    bool models = false;                ///< times frames of six models, on `device`, or by the host
    bool remesh = false;                ///< measures remeshing as well (bench_remesh.h)
    bool tessellation = false;          ///< beside the sweep, by the device's tessellator
    uint64_t checkRays = 0;             ///< rays of the conservative test for each asset; 0: not made
    /// Called with what is being done; false cancels. May be empty.
    std::function<bool(const std::string&, double fraction)> progress;
};

enum class MesoClass { Hit, Miss, Missed, False, WrongFeature, Unresolved };
inline constexpr std::array<std::string_view, 6> kMesoClassNames = {"hit",   "miss",          "missed",
                                                                    "false", "wrong_feature", "unresolved"};

/// The outcome of rays against one truth; fractions sum to 1. Errors are along the ray, in texels, for hits that are
/// not of a wrong feature (off by more than 2 texels).
struct MesoJudged {
    std::array<double, 6> fractions{};
    double p50 = 0, p95 = 0, p99 = 0, max = 0;
    bool hasNormals = false;              ///< false: the method gives none
    double normalP50 = 0, normalP95 = 0;  ///< degrees

    [[nodiscard]] double fraction(MesoClass c) const { return fractions[size_t(c)]; }
    /// The fraction that is missed, false, of a wrong feature or unresolved.
    [[nodiscard]] double wrong() const { return 1 - fraction(MesoClass::Hit) - fraction(MesoClass::Miss); }
};

struct BenchMesoRow {
    std::string asset, view, method, knob, device = "cpu";
    uint64_t rays = 0;
    double nsPerRay = 0;  ///< median of the rounds
    double ratioToPeer = 0, ratioLow = 0,
           ratioHigh = 0;  ///< time over mesoPeer's in the same round: median and quartiles
    MesoJudged shape;      ///< against the shape
    bool hasSolver = false;
    MesoJudged solver;  ///< against the method's own data
    double fetchesMean = 0, iterationsMean = 0, iterationsP95 = 0, surfaceTestsMean = 0;
    uint64_t surfaceTestsMost = 0;  ///< of one ray
    std::array<double, 4>
        iterationBins{};  ///< parts of the rays: up to 10, 34, 59 iterations, and more (the bins of the paper's Fig. 7)
    double divergence8 = 0;  ///< mean, over groups of 8 rays, of most over mean iterations
    uint64_t bytes = 0;
    double preprocessSeconds =
        0;  ///< time to build the method's arrays from the shape, even where an asset file holds them
};

/// The conservative test: rays from anywhere against what the map says at their cell.
struct MesoCheck {
    std::string asset, map;
    uint64_t rays = 0, oversteps = 0;
    double worstTexels = 0;
};

/// A ratio that a paper prints (Mehra and Kumar, Tables 1 to 3; Wang et al.; Risser et al., binary over secant
/// search), over its models from least to most, and ours: the mean over the views of an asset. Figure 7 has no numbers;
/// the rows' iterationBins are its bins.
struct MesoPublished {
    std::string what, asset, of;  ///< `of`: what ours is counted in
    double least = 0, most = 0;
    double ours = 0;
    double oursTime = 0;  ///< our ratio of times; 0: none

    /// Whether ours is within 25 % of what the paper's models span.
    [[nodiscard]] bool isNear() const { return ours >= 0.75 * least && ours <= 1.25 * most; }
};

/// What a method needs for a right picture of an asset: its cheapest knob with at most 0.1 % wrong rays over all views
/// together and p95 of the error within 0.25 texels in each. Given by fetches and by time, which may be at different
/// knobs.
struct MesoHeadline {
    std::string asset, method;
    std::string fetchesKnob, timeKnob;
    double fetches = 0;      ///< fetches of a ray, mean over the views
    double ratioToPeer = 0;  ///< mean over the views
};

/// What octant boxes take beside a rival that is as right: at the rival's cheapest knob with at most 0.1 % wrong rays
/// over all views and p95 within 0.25 texels in each, or where none gets there, at the knob with the fewest wrong rays;
/// boxes are at their cheapest knob that is no worse in either.
struct MesoGoal {
    std::string asset, rival, rivalKnob;
    bool rivalIsRight = false;
    double rivalWrong = 0, rivalP95 = 0;
    std::string oursKnob = {};
    double oursWrong = 0, oursP95 = 0;
    double time = 0, fetches = 0;  ///< ours over the rival's
    std::string rightKnob = {};    ///< our cheapest within 0.1 % and 0.25 texels; empty: none
    double rightTime = 0;          ///< of that knob, over the rival's
};

/// Says how well factors stand for a displacement map's distances, over all its entries.
struct MesoFactors {
    std::string asset, form;
    int rank = 0, clusters = 1;
    uint64_t bytes = 0;
    double rmsPoints = 0;   ///< root of the mean squared error, in points' distances
    double offByPoint = 0;  ///< part of the entries that are off by more than one
    double wrongHits = 0;   ///< part whose hit, told by half a point before the boundary, is wrong
};

/// What a method makes of the shape's own shadows, at places that face a light; parts are of all these places.
struct MesoShadows {
    std::string asset, method;
    double offsetPoints = 0;  ///< by which it is asked above the surface, in distances of the map's points (or samples)
    bool ownHits = false;     ///< from where the method sees the surface, or else from where it is
    uint64_t places = 0;
    double dark = 0;            ///< part that should be dark
    double leak = 0, acne = 0;  ///< part that should be dark and is lit, and the converse
};

/// Light from everywhere on a picture of one tile, at 45 degrees, or of a base surface, drawn by the host. `form`: as
/// if the surface were open (9 coefficients of the light, no shadow); by as many paths as the truth, of 16 coefficients
/// of the light; by the volume of transfer, which has them too, without and with the transfer of the base. Truth is the
/// path tracer's under the surroundings themselves, or the form that is named after "against".
struct MesoLight {
    std::string asset, sky, form;
    double relativeMse = 0;  ///< mean of (light - truth)^2 / (truth^2 + 0.01), over pixels and channels
    double flipMean = 0;     ///< of the pictures, on a surface of one grey
    double energy = 0;       ///< light over truth, summed
    uint64_t bytes = 0;      ///< of the volume
};

/// Distances of places in the tile, in texels.
struct MesoDistortion {
    double p50 = 0, p95 = 0;
};

/// What maps from the prisms over a torus make of rays: through random places of random prisms, in random directions.
/// There are three maps (mesostructure/prism_maps.h), compared with the curved one, and all with the smooth torus',
/// whose heights are parallel surfaces.
struct MesoPrisms {
    double turnDegrees = 0;       ///< that one prism turns round the tube
    double heightOverRadius = 0;  ///< the slab's height over the tube's radius
    uint64_t prisms = 0, cutColumns = 0, rays = 0;
    uint64_t between = 0;  ///< places between a bilinear side and its two triangles, which are not compared
    MesoDistortion straight, linear;
    MesoDistortion straightSmooth, linearSmooth, curvedSmooth;
    double printedWrong = 0;  ///< part of the rays whose exit by planes, as printed, is not where they leave the prism
};

/// What a method sees of a base that bends, in one picture from outside. Rays that come into the slab are judged,
/// against the smooth base, whose heights are parallel surfaces.
struct MesoBent {
    std::string asset, base, method, knob;
    double overRadius = 0;  ///< slab heights over the base's least radius
    uint64_t rays = 0;
    MesoJudged shape = {};         ///< texels are 1/128 tile
    double p50 = 0, p95 = 0;       ///< of the error of all that hit where they should, texels
    double iterations = 0;         ///< of a ray: questions to a map, or steps
    double fetches = 0;            ///< of a ray at most; 0: not known
    uint64_t bytes = 0;            ///< of the arrays
    double preprocessSeconds = 0;  ///< of the processor, all threads; 0: not known
    double timeOverGdm = 0;        ///< of a frame, median of the rounds
};

/// Frames of a model: a base with mesostructure, drawn in local light (one lamp, with shadows) or light from
/// everywhere.
struct MesoModel {
    std::string asset, base, method, light, device;
    uint64_t prisms = 0, pixels = 0;  ///< pixels that it covers
    uint64_t unresolved = 0;          ///< rays
    double msFrame = 0;               ///< median; of the processor, all threads, or of a GPU
    double nsPixel = 0, nsPrism = 0;
};

/// One view of a remeshed height field (bench_remesh.h).
struct RemeshRow {
    std::string asset, view, filter;
    double cell = 1;                   ///< pixels
    double p50 = 0, p95 = 0, max = 0;  ///< of the error, pixels
    double boundPixels = 0;            ///< what the error is certified to be within
    uint64_t uncertified = 0;          ///< patches of which that says nothing (RemeshCounts)
    double bias = 0;                   ///< mean height above the surface's, half quad edges
    double horizonLoss = 0;            ///< pixels that the horizon is lower, mean
    uint64_t vertices = 0, triangles = 0, bytes = 0;
    double ms = 0;            ///< of one frame's remeshing on the processor, one thread, median
    std::string device = {};  ///< that remeshes as well; empty: none
    double piecesMs = 0, sweepMs = 0, sweepProcessorMs = 0;  ///< as RemeshTimes
};

/// One view of a remeshed height field, drawn by a device: errors are those of its pixels (bench_remesh.h).
struct RemeshDrawnRow {
    std::string asset, view, way;
    double cell = 1;                   ///< pixels
    double p50 = 0, p95 = 0, max = 0;  ///< of the error, pixels
    uint64_t pixels = 0, vertices = 0, triangles = 0;
    double ms = 0, processorMs = 0;  ///< as RemeshDrawn
};

struct BenchMesoReport {
    std::vector<BenchMesoRow> rows;
    std::vector<RemeshRow> remeshed;
    std::vector<RemeshDrawnRow> remeshedPictures;
    std::vector<MesoCheck> checks;
    std::vector<MesoPublished> published;
    std::vector<MesoFactors> factors;
    std::vector<MesoShadows> shadows;
    std::vector<MesoLight> lights;
    std::vector<MesoPrisms> prisms;
    std::vector<MesoBent> bent;
    std::vector<MesoModel> models;
};

/// Names the method, at its default knob, that times are divided by: relief mapping, binary, 32 steps, for height
/// fields; the plain distance map for solids, which relief mapping cannot draw.
std::string_view mesoPeer(bool isHeightField);
std::vector<std::string> mesoMethodNames();
std::vector<std::string> mesoViewNames();

/// Runs the benchmark. Errors: Usage (no such asset, method or view), those of the builders, Cancelled.
Result<BenchMesoReport> benchMeso(const BenchMesoOptions& options);

/// Tests that all kinds of maps over a grid of 32 cells are conservative: `rays` rays from outside the surface, in
/// cells that are not occupied, each against the shape. Errors: the builders'.
Result<std::vector<MesoCheck>> checkMesoMaps(const std::string& asset, const meso::Shape& shape, double texel,
                                             uint64_t rays);

/// Compares factors of an asset's displacement map of 32 points along x. Errors: the builders'.
Result<std::vector<MesoFactors>> compareMesoFactors(const meso::Asset& asset, const meso::Shape& shape);

/// Compares shadows by an asset's displacement map of 32 points along x, asked from several heights above the surface,
/// and by octant boxes with the shape's own: places that `rays` rays see, each in one light. `progress` may be empty;
/// false cancels. Errors: the builders'; Cancelled.
Result<std::vector<MesoShadows>> compareMesoShadows(const meso::Asset& asset, const meso::Shape& shape, uint64_t rays,
                                                    const std::function<bool(double)>& progress);

/// Compares light from everywhere on an asset's tile, and on two base surfaces, under each of kEnvironmentNames; where
/// the asset holds no transfer, it is traced. `name`: as openMesoAsset. `progress` may be empty; false cancels. Errors:
/// traceTransfer's; Usage (nothing is seen).
Result<std::vector<MesoLight>> compareMesoLight(const std::string& name, const meso::Asset& asset,
                                                const meso::Shape& shape, const std::function<bool(double)>& progress);

/// Returns the processor's time of this process so far, all threads, in nanoseconds.
inline double processorNs() { return double(std::clock()) * 1e9 / CLOCKS_PER_SEC; }

/// Returns a renderer that shows one surface. `device`: as RendererOptions::device. Errors: the renderer's.
Result<std::unique_ptr<PictureRenderer>> rendererOf(const MesoSurface& surface, const std::string& device);

struct TimedFrame {
    FrameStats stats;
    double ns = 0;  ///< of the processor on software devices, else of the device
};
/// Draws a picture of what is there. Errors: the renderer's.
Result<TimedFrame> timedFrame(PictureRenderer& renderer, const FrameRequest& request);

struct MesoBentOptions {
    std::string device;                 ///< as RendererOptions::device
    int repetitions = 3;                ///< rounds over the methods
    uint32_t across = 160, down = 120;  ///< pixels of a picture
    int cells = 32;                     ///< points of the maps along x
    /// Called with what is being done; false cancels. May be empty.
    std::function<bool(const std::string& what, double part)> progress = {};
};

/// Draws a height field on a plane, cylinders, a sphere and tori by view-dependent maps of several curvatures, other
/// displacement maps and boxes. `name`: as openMesoAsset. Errors: those of the renderer and the builders; Cancelled.
Result<std::vector<MesoBent>> compareMesoBent(const std::string& name, const MesoBentOptions& options);

/// Measures what maps of prisms distort, on tori of several curvatures and numbers of triangles.
std::vector<MesoPrisms> compareMesoPrisms(uint64_t rays);

struct MesoModelOptions {
    std::string device;                 ///< as RendererOptions::device
    int repetitions = 3;                ///< rounds over the models
    uint32_t across = 640, down = 480;  ///< pixels of a picture
    int cells = 0;                      ///< along x, of all methods and of transfer; 0: as printed, or their own
    uint32_t paths = 256;               ///< a cell of transfer
    /// Called with what is being done; false cancels. May be empty.
    std::function<bool(const std::string& what, double part)> progress = {};
};

/// Times frames of the six models that Wang et al. 2004 print rates of, in rounds over all of them, and adds the ratios
/// beside the printed ones. Errors: those of the renderer and of traceTransfer; Cancelled.
Result<std::vector<MesoModel>> compareMesoModels(const MesoModelOptions& options,
                                                 std::vector<MesoPublished>& published);

/// Judges the rays whose truth is known; `texel` in tile units.
MesoJudged judgeMeso(const std::vector<meso::MarchResult>& results, const std::vector<meso::TruthHit>& truths,
                     double texel);
/// Writes the mean work, its bins and divergence into the row.
void countWork(const std::vector<meso::MarchResult>& results, BenchMesoRow& row);

/// Whether a method at that knob is in a ratio that publishedOf compares.
bool isOfPublished(std::string_view method, std::string_view knob);
/// Compares with the printed ratios of single methods, as far as the rows allow.
std::vector<MesoPublished> publishedOf(const std::vector<BenchMesoRow>& rows);

/// Returns the methods with a knob that qualifies, by asset in the order of the rows.
std::vector<MesoHeadline> headlinesOf(const std::vector<BenchMesoRow>& rows);

/// Compares octant boxes with displacement maps and slices, as far as there are rows of both.
std::vector<MesoGoal> goalsOf(const std::vector<BenchMesoRow>& rows);

std::string benchMesoJson(const BenchMesoReport& report);
std::string benchMesoCsv(const BenchMesoReport& report);
std::string benchMesoMarkdown(const BenchMesoReport& report);
/// Returns plots: file names without extension, and SVG.
std::vector<std::pair<std::string, std::string>> benchMesoPlots(const BenchMesoReport& report);

}  // namespace vcp
