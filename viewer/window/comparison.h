// A scan coloured by its distance from another surface: measured as `vcp compare` does (viewer/export), and built into
// a dataset of its own, which the window shows in the first one's place. In a thread of its own, so that the window
// goes on.
//
// Figures are of points of the first surface, evenly by area; colours are of its vertices. Both surfaces are held in
// memory: of a dataset that is too large for it, a coarser level is compared, and what is certified of that level says
// how far the figures may be off.
#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "builder/measure/indexed_mesh.h"
#include "octree/dataset_reader.h"
#include "render/similarity.h"
#include "viewer/annotation/legend.h"
#include "viewer/annotation/length_unit.h"
#include "viewer/export/deviation_report.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

/// Returns the finest level of which at most some `most` triangles would be held; the coarsest where all have more.
/// Precondition: the dataset's directory is known as a whole.
uint32_t finestHeldLevel(const Dataset& dataset, uint64_t most);

/// Returns what the colours of distances mean, from -range to range, world units. `from`: the second surface's name.
Legend distanceLegend(double range, const std::string& from, const std::optional<LengthUnit>& unit);

/// One thread calls; destroying it before it is done cancels and waits until that is noticed.
class Comparison {
public:
    struct Subject {
        std::string name;                          ///< for people
        std::shared_ptr<const ByteReader> reader;  ///< of a dataset; null: `file` is opened
        std::string file;                          ///< a .vcp, its address, or a mesh
        Similarity placement;
    };

    /// What is asked besides.
    struct Choice {
        /// Points farther than this part of the first surface's diagonal from the second have no counterpart.
        double within = std::numeric_limits<double>::infinity();
        bool both = false;  ///< the second is measured from the first as well
    };

    /// What was measured, in the world.
    struct Measured {
        IndexedMesh mesh;              ///< the first surface
        std::vector<float> distances;  ///< of its positions
        Deviation deviation;
        std::optional<Deviation> back;  ///< of the second surface from the first, where both were asked for
        ComparedSurfaces compared;      ///< with the usual range
        double diagonal = 0;            ///< of the first surface
    };

    struct Coloured {
        std::shared_ptr<const Measured> measured;
        double range = 1;  ///< the distance at both ends of the colours, world units
        OpenDataset open;  ///< has no name on the disk any more
    };

    /// Begins to measure `a` from `b`, and to colour `a` with the usual range.
    Comparison(Subject a, Subject b, const Choice& choice, SourceAccess access);
    /// Begins to colour what was measured with another range.
    Comparison(std::shared_ptr<const Measured> measured, double range);
    ~Comparison();
    Comparison(const Comparison&) = delete;
    Comparison& operator=(const Comparison&) = delete;

    [[nodiscard]] double fraction() const { return fraction_; }
    [[nodiscard]] bool isDone() const;
    /// Returns the result; call it once, when it is done. Errors: those of loadMesh, openReader, SurfaceCut::create,
    /// measureDeviation and buildOctree; Usage, where a file is a scene; Cancelled.
    Result<Coloured> take();

private:
    /// A part of the whole, for the progress.
    struct Stage {
        double from, to;
    };
    struct Held {
        IndexedMesh mesh;
        double certified = 0;
    };

    [[nodiscard]] std::function<bool(double)> progress(Stage stage);
    Result<Held> load(const Subject& subject, const SourceAccess& access, Stage stage);
    Result<std::shared_ptr<const Measured>> measure(const Subject& a, const Subject& b, const Choice& choice,
                                                    const SourceAccess& access);
    Result<Coloured> colour(std::shared_ptr<const Measured> measured, double range, Stage stage);

    std::atomic<double> fraction_ = 0;
    std::atomic<bool> cancelled_ = false;
    std::future<Result<Coloured>> coloured_;  // is destroyed first, which waits
};

}  // namespace vcp
