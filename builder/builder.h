// What buildOctree (build.h) does, stage by stage. Its functions are defined where the stages are told of: build.cpp,
// build_journal.cpp, build_soup.cpp, build_levels.cpp.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "builder/bin_passes.h"
#include "builder/build.h"
#include "builder/checkpoint.h"
#include "builder/lattice_soup.h"
#include "builder/level_plan.h"
#include "builder/memory_plan.h"
#include "builder/progress_meter.h"
#include "builder/slab_pages.h"
#include "builder/spill/journal.h"
#include "builder/work_arena.h"
#include "octree/io/output_claim.h"
#include "octree/io/output_file.h"

namespace vcp {

// Shares of the whole time; what is left after reading, dealing and the vertices is shared by the levels.
inline constexpr double kReadingShare = 0.08, kDealingShare = 0.04, kVerticesShare = 0.06, kWritingShare = 0.02;

/// One build.
class Builder {
public:
    Builder(const BuildOptions& options, const MemoryPlan& plan, unsigned threads,
            const std::filesystem::path& tempFolder)
        : options_(options),
          memory_(plan),
          meter_(options.progress),
          space_(tempFolder, plan.tempBytes),
          arena_(threads) {}

    Result<BuildReport> run();

private:
    /// Whether the error is that a temporary file is damaged.
    bool isOfTempFiles(const Error& error) const;

    template <class Work>
    Result<void> caught(const Work& work);
    Result<void> stages();

    // Progress and time: build.cpp
    bool progress(const std::string& stage, double fraction);
    Error cancelled() const { return Error::cancelled(options_.output.string()); }
    /// Returns what the output may replace: no file that is read.
    [[nodiscard]] OutputRules rules() const;
    /// Checks that no input lies among the temporary files, which are removed by their names.
    [[nodiscard]] Result<void> checkTempFolder() const;

    // The journal: build_journal.cpp
    /// Reads what an interrupted build left, where it is to go on; else removes it.
    Result<void> openJournal();
    /// Makes what is done durable, and records it in the journal: everything up to bin `bin` of the pass. `always`:
    /// even if the last checkpoint was a moment ago.
    Result<void> checkpoint(const char* stage, size_t bin, bool always = false);
    /// Takes over what was read.
    Result<void> resumeMeasures();
    /// Continues the journal in the same file; what it says stays true. `done`: fraction of the whole.
    Result<void> reactivate(double done);
    /// Takes over the pages, the bins and what is done of their passes.
    Result<void> resumeBins();

    // Reading and dealing: build_soup.cpp
    void warnOfWideCells();
    Result<void> read();
    /// Checks the free space now: a disk that is too small would be noticed only after hours.
    Result<void> checkSpace() const;

    [[nodiscard]] ColourUse colourUse() const { return colourUseOf(options_, measures_); }
    [[nodiscard]] bool hasColour() const { return colourUse().any(); }
    void setUpLevels();
    /// Chooses the pages that hold the mesh, and the bins.
    Result<void> choosePlan();
    Result<void> planForPages();
    [[nodiscard]] bool mayKeepImages() const { return vcp::mayKeepImages(options_, measures_, files_.soup->materials); }
    /// Codes the images that the file is to keep. Returns what it has of each of the soup's materials; empty where that
    /// is nothing.
    Result<std::vector<PlacedMaterial>> keepImages();

    void openImages(size_t count);
    void openTextures();
    Result<void> dealSoup();
    Result<void> deal();

    // Levels, finest first: build_levels.cpp
    /// Whether the pass ends with a mesh in memory that the next one begins with: the vertices of a build of one bin.
    [[nodiscard]] bool keepsMesh() const { return pass_ == plan_.levels() && plan_.finest.bins() == 1; }
    /// Whether the pass fills the bins of the next one.
    [[nodiscard]] bool steps() const { return plan_.steps(pass_) && !keepsMesh(); }
    /// Makes the bins of a pass and of the pass after it.
    void openPass();
    /// Returns the settings of a level's pages in this pass.
    [[nodiscard]] LevelSettings settingsOf(int level);
    /// Returns the fraction of the whole at which a pass begins.
    [[nodiscard]] double passBegins(int pass) const;
    [[nodiscard]] double passEnds(int pass) const;
    [[nodiscard]] std::string stageOf(int pass) const;
    /// Returns in how many parts the pass is worked on, with checkpoints between them.
    [[nodiscard]] size_t binsOfPass();
    static size_t binsOf(const std::vector<Siblings>& parents);
    /// Returns the fraction of the whole that is done where the pass comes to a bin.
    [[nodiscard]] double fractionAt(size_t bin);
    [[nodiscard]] uint64_t trianglesBefore(size_t bin) const;
    /// Returns the pages below the pass's, which hold the mesh or have been made from those that do, by their parents.
    std::vector<Siblings> siblingsBelow();
    /// Returns what takes the surface in a level's pages; null where no level is made from it.
    [[nodiscard]] PageSpool* surfacesOf(int level);
    /// Makes the pages of a level from the surface in those below.
    Result<void> runSlabPass();
    Result<void> runPass();
    template <class HandOn, class At>
    Result<void> runBin(size_t bin, uint64_t first, uint64_t end, const HandOn& handOn, At&& at);
    /// Returns the mesh of a bin; in the first pass, what is thin is kept, and normals and parts are found.
    Result<LatticeMesh> loadMesh(size_t bin);
    /// Gives triangles of the finest level what was not known yet when they were handed on.
    Result<void> complete(std::vector<LatticeTriangle>& soup, size_t bin);
    /// Finds which parts of the mesh are closed, once all bins have noted theirs.
    Result<void> joinParts();
    Result<void> endPass();
    /// Returns memory to the system: the allocator keeps what the threads freed, more with every bin.
    static void releaseMemory();

    // Writing: build.cpp
    Result<void> write();
    void finishReport();

    const BuildOptions& options_;
    OutputClaim claim_;
    MemoryPlan memory_;
    ProgressMeter meter_;
    TempSpace space_;
    Journal journal_;
    Recorded done_;  ///< what an interrupted build recorded
    bool isResumed_ = false, partitionRecorded_ = false;
    double lastCheckpoint_ = 0;                ///< seconds
    double imagesShare_ = 0, imagesDone_ = 0;  ///< of the whole time
    WorkArena arena_;

    SoupMeasures measures_;
    LevelPlan plan_;
    uint32_t levelsLess_ = 0;   ///< as chooseFrame took it
    uint64_t finestPages_ = 0;  ///< that hold the mesh; 0 where these are so few that they were not counted
    BuildReport report_;
    WorkFiles files_;
    std::optional<MeshParts> meshParts_;  ///< once they are joined
    LatticeMesh mesh_;                    ///< what a pass hands to the next one, where it keepsMesh()
    int pass_ = 0;
    size_t firstBin_ = 0;  ///< where the pass that is resumed begins
};

}  // namespace vcp
