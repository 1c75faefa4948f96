// What a build can continue from: the files that pass between its stages, and what the journal says about them.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "builder/build.h"
#include "builder/ingest.h"
#include "builder/level/closed_parts.h"
#include "builder/level/level_step.h"
#include "builder/level/vertex_step.h"
#include "builder/spill/page_spool.h"
#include "builder/spill/record_bins.h"

namespace vcp {

/// Returns the settings that a file's bytes depend on, and the version of files, as one line without its end.
std::string settingsText(const BuildOptions& options);

/// Returns what must be the same for a build to continue from an interrupted one.
std::string buildFingerprint(const BuildOptions& options);

nlohmann::json jsonOf(const SoupMeasures& measures);
/// Returns what jsonOf wrote; nothing where `object` has not all of it.
std::optional<SoupMeasures> measuresFrom(const nlohmann::json& object);
nlohmann::json jsonOf(const std::vector<SideFile>& files);

/// What the journal's lines say together.
struct Recorded {
    /// Lengths of the files of bins, and of each level's pages and surfaces, and of images, in bytes and entries.
    struct Files {
        std::map<std::string, uint64_t> bins;
        std::vector<std::pair<uint64_t, uint64_t>> spools, surfaces, images;
    };

    std::string stage;  ///< "": nothing is recorded; "read", "levels"
    std::string build;  ///< fingerprint
    SoupMeasures measures;
    std::vector<SideFile> sideFiles;  ///< as they were before they were read
    Files files;
    std::vector<uint64_t> partition;            ///< with "levels": where the deepest level's bins begin
    std::vector<std::vector<uint64_t>> parted;  ///< with "levels": FinestPages::parted()
    uint32_t levelsLess = 0;                    ///< with "levels": as chooseFrame takes it
    uint64_t pages = 0;                         ///< with "levels": pages that hold the mesh, where they were counted
    int pass = 0;
    size_t bin = 0;
};

/// Reads `journal`, or null when there is none. The result is complete, of the right types and consistent, whoever
/// wrote the journal. Errors: InvalidInput, naming `file`.
Result<Recorded> recordedFrom(const nlohmann::json& journal, const std::filesystem::path& file);

/// The files of a build at one moment; those that are not needed are null. Used by one thread.
struct WorkFiles {
    std::unique_ptr<Soup> soup;
    std::unique_ptr<RecordBins<LatticeTriangle>> current, next;  ///< bins of this pass and of the pass after it
    std::unique_ptr<RecordBins<WaitingTriangle>> waiting;
    std::unique_ptr<RecordBins<VertexImage>>
        vertices;  ///< what bins of the finest level know of each other's triangles
    std::unique_ptr<PartNotes> parts;
    std::unique_ptr<RecordBins<TexturedTriangle>> textures;  ///< of the finest level's triangles that have images
    std::deque<PageSpool> images;                            ///< one, or none where the file keeps no images
    std::deque<PageSpool> spools;                            ///< finished pages of each level, coarse first
    std::deque<PageSpool> surfaces;  ///< the surface in them, where levels are made from that (slab_pages.h)
    size_t neededSurfaces = 0;       ///< how many of them, coarse first, are still needed

    /// Makes all of them durable. Returns the fields to record. Errors: Io.
    Result<nlohmann::json> sync();
    /// Reopens the files as they were recorded, each cut to its recorded length. Removes whatever else an
    /// interrupted build left in `space`. Errors: Io; InvalidInput (a file is not recorded, shorter than recorded,
    /// or damaged).
    Result<void> reopen(const Recorded& recorded, TempSpace& space);
};

}  // namespace vcp
