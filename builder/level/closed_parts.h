// Which parts of a mesh are closed. A part is what shared vertices hold together. It is closed where each of its edges
// has an even number of triangles: a surface that goes on everywhere.
//
// A bin has all triangles around its own vertices. So it counts the edges whose lower end it owns, and joins what it
// sees. What reaches into other bins stays undecided until all bins are done: then the triangles that bins share join
// it. The result depends on the mesh alone.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "builder/lattice/collapsed_triangles.h"
#include "builder/lattice/lattice_mesh.h"
#include "builder/spill/record_bins.h"

namespace vcp {

struct PartCounts {
    uint64_t parts = 0, closed = 0;
    uint64_t openEdges = 0;  ///< edges with an odd number of triangles
};

/// The parts of a whole mesh.
struct MeshParts {
    PartCounts counts;
    std::vector<bool> isOpen;     ///< of those that no bin could decide
    std::vector<uint64_t> first;  ///< number of the first of these of each of the notes that were joined

    /// Returns kClosedPart or kOpenPart for a part as a bin called it. `notes`: which of those joined are the bin's.
    [[nodiscard]] uint32_t decided(uint32_t part, size_t notes = 0) const {
        if (part < kFirstUndecidedPart) return part;
        return isOpen[first[notes] + part - kFirstUndecidedPart] ? kOpenPart : kClosedPart;
    }
};

/// A note of a bin about its parts.
struct PartRecord {
    enum class Kind : uint32_t {
        Shared,  ///< `part` has a triangle of other bins, too, whose lowest vertex is at `at`
        Open,    ///< `part` has an open edge
        Counts,  ///< a bin has `part` undecided parts and, besides, at.x parts, at.y closed ones; and at.z open edges
    };
    Kind kind;
    uint32_t part;  ///< number among all that are undecided in these notes
    glm::i32vec3 at;
};

/// What bins note about their parts, on a temporary file. One thread calls; the calling arena's threads do the work.
class PartNotes {
public:
    PartNotes(TempSpace& space, uint64_t bufferBytes);

    /// Finds the parts of a bin and sets `mesh.parts`; bins come in any order. `mesh`: all triangles at the
    /// vertices that the bin `owns`. `changed`: what keepCollapsed returned for it. Errors: Io.
    Result<void> add(LatticeMesh& mesh, std::span<const Corners> changed,
                     const std::function<bool(glm::i32vec3)>& owns);
    /// Returns the parts of the mesh that all bins together are, whose notes lie in one or several places. Errors: Io;
    /// InvalidInput (damaged).
    static Result<MeshParts> join(std::span<PartNotes* const> all);

    [[nodiscard]] RawBins& raw() { return notes_.raw(); }

private:
    Result<void> readFirst(MeshParts& parts, uint64_t& undecided);

    RecordBins<PartRecord> notes_;
    std::optional<uint64_t> undecided_;  ///< parts so far; none: not read from the notes of an interrupted build yet
};

}  // namespace vcp
