#include "builder/ingest.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <set>

#include <fmt/format.h>
#include <oneapi/tbb/task_group.h>
#include <xxhash.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/lattice/lattice_mesh.h"
#include "builder/mesh/open_mesh.h"
#include "builder/mesh_sample.h"
#include "builder/vertex_join.h"
#include "octree/surface/leaf_math.h"
#include "octree/vcp_file.h"

namespace vcp {

namespace {

// The default cell holds about ten triangles, and its edge is twice as long as theirs: then most leaves are cells, and
// a triangle is stored in the fewest bytes (docs/surface.md).
constexpr double kTriangleAreaPerCellArea = 0.105;

// Where triangles are longer in the mean than so many cells, each would be in more leaves than it takes to store it.
constexpr double kMostMeanEdgeCells = 2;

// Extent limit: positions are 31-bit lattice coordinates.
constexpr double kMaxExtentCells = double(1u << 20) - 4;

// Beyond this, areas overflow a double.
constexpr double kMaxExtent = 1e150;

constexpr uint32_t kLog2Cells = 5;

std::string nameOf(const BuildOptions& options) {
    return options.inputs.empty() ? "" : options.inputs.front().string();
}

Error badInput(const BuildOptions& options, std::string message) {
    return {.code = ErrorCode::InvalidInput, .message = std::move(message), .file = nameOf(options)};
}

/// Measures triangles and packs them into the soup. Other threads of the calling arena code the blocks meanwhile.
class SoupWriter {
public:
    /// `sample` is given each triangle; null: there is none.
    SoupWriter(Soup& soup, MeshSample* sample) : soup_(soup), sample_(sample), bin_(soup.firstBin) {}
    ~SoupWriter() {
        // Nobody asks any more what became of the last batches.
        try {
            coding_.wait();
        } catch (...) {
        }
    }
    SoupWriter(const SoupWriter&) = delete;
    SoupWriter& operator=(const SoupWriter&) = delete;

    Result<void> add(const WorldTriangle<double>& t) {
        SoupMeasures& measures = tally_.counted;
        ++measures.triangles;
        const glm::dvec3 &a = t.corner[0], &b = t.corner[1], &c = t.corner[2];
        measures.boundsMin = glm::min(measures.boundsMin, glm::min(a, glm::min(b, c)));
        measures.boundsMax = glm::max(measures.boundsMax, glm::max(a, glm::max(b, c)));
        const double twice = glm::length(glm::cross(b - a, c - a));
        if (twice == 0) {
            ++measures.degenerateTriangles;
            return {};
        }
        if (sample_ != nullptr) sample_->addTriangle(t);
        const double longest = longestEdge(a, b, c);
        if (std::isfinite(twice) && std::isfinite(longest)) {
            tally_.area.add(twice / 2);
            tally_.length.add(longest);
        } else {
            tally_.isTooLarge = true;
        }
        return store(t);
    }

    /// Hands all triangles on, and waits until they are in the soup.
    Result<void> flush() {
        handOn();
        return wait();
    }

    [[nodiscard]] uint64_t triangles() const { return tally_.counted.triangles; }
    [[nodiscard]] const SoupTally& tally() const { return tally_; }

private:
    Result<void> store(const WorldTriangle<double>& t) {
        WorldTriangle<float> f;
        bool exact = true;
        for (int i = 0; i < 3; ++i) {
            f.corner[i] = glm::vec3(t.corner[i]);
            exact &= glm::dvec3(f.corner[i]) == t.corner[i];
        }
        if (exact) {
            std::copy_n(t.colour, 3, f.colour);
            std::copy_n(t.uv, 3, f.uv);
            std::copy_n(t.normal, 3, f.normal);
            f.material = t.material;
            floats_.push_back(f);
        } else {
            doubles_.push_back(t);
        }
        if (floats_.size() + doubles_.size() < kBatch) return {};
        handOn();
        return batches_ < kMostBatches ? Result<void>() : wait();
    }

    void handOn() {
        ++batches_;
        coding_.run([this, bin = bin_, floats = std::move(floats_), doubles = std::move(doubles_)] {
            auto done = soup_.doubles.append(bin, doubles);
            if (done) done = soup_.floats.append(bin, floats);
            const bool areShared = soup_.floats.raw().bins() > 1;
            const uint64_t content = areShared ? contentOf(bin, floats) + contentOf(bin, doubles) : 0;
            const std::scoped_lock lock(mutex_);
            tally_.content += content;
            if (coded_) coded_ = std::move(done);
        });
        bin_ = bin_ < soup_.lastBin ? bin_ + 1 : soup_.firstBin;
        floats_.clear();
        doubles_.clear();
        floats_.reserve(kBatch);
    }

    template <class Real>
    static uint64_t contentOf(size_t bin, const std::vector<WorldTriangle<Real>>& triangles) {
        return XXH3_64bits_withSeed(triangles.data(), triangles.size() * sizeof(WorldTriangle<Real>), bin);
    }

    Result<void> wait() {
        coding_.wait();
        batches_ = 0;
        return coded_;
    }

    static constexpr size_t kBatch = 4096, kMostBatches = 8;

    Soup& soup_;
    MeshSample* sample_;
    size_t bin_;  ///< of the next batch
    SoupTally tally_;
    std::vector<WorldTriangle<float>> floats_;
    std::vector<WorldTriangle<double>> doubles_;

    tbb::task_group coding_;
    size_t batches_ = 0;  ///< handed on since the last wait
    std::mutex mutex_;
    Result<void> coded_;  ///< of all batches so far
};

}  // namespace

SoupTally::SoupTally() {
    counted.boundsMin = glm::dvec3(std::numeric_limits<double>::infinity());
    counted.boundsMax = -counted.boundsMin;
}

void SoupTally::add(const SoupTally& other) {
    const SoupMeasures& more = other.counted;
    counted.boundsMin = glm::min(counted.boundsMin, more.boundsMin);
    counted.boundsMax = glm::max(counted.boundsMax, more.boundsMax);
    counted.triangles += more.triangles;
    counted.degenerateTriangles += more.degenerateTriangles;
    counted.cutTriangles += more.cutTriangles;
    counted.vertices += more.vertices;
    counted.hasVertexColours |= more.hasVertexColours;
    counted.hasMaterials |= more.hasMaterials;
    area.add(other.area);
    length.add(other.length);
    isTooLarge |= other.isTooLarge;
    content += other.content;
}

Result<SoupTally> readInputs(const BuildOptions& options, TempSpace& space, uint64_t vertexBytes, Soup& soup,
                             const std::function<bool(double, uint64_t)>& progress, std::vector<std::string>& warnings,
                             std::vector<SideFile>& sideFiles) {
    uint64_t totalBytes = 0, doneBytes = 0, vertices = 0, cutTriangles = 0;
    bool hasVertexColours = false;
    const bool isPainted = options.colour == ColourChoice::Auto || options.colour == ColourChoice::Texture;
    std::set<std::filesystem::path> named;
    for (const auto& path : options.inputs) {
        std::error_code ignored;
        if (const auto size = std::filesystem::file_size(path, ignored); !ignored) totalBytes += size;
    }
    SoupWriter writer(soup, options.sample.get());
    MeshChunk chunk;
    for (const auto& path : options.inputs) {
        VCP_TRY_ASSIGN(auto stream, openMesh(path, meshOptionsOf(options)));
        const auto materialBase = uint32_t(soup.materials.size());
        MaskCutter cutter(vertexBytes / 4);
        const auto take = [&](const WorldTriangle<double>& t) {
            if (isPainted) return writer.add(t);
            WorldTriangle<double> plain = t;
            plain.material = 0;
            std::fill_n(plain.uv, 3, glm::vec2(0));
            return writer.add(plain);
        };
        const bool hasMasks = options.masks && std::ranges::any_of(stream->materials(), mayCut);
        if (hasMasks) {
            const double fraction = totalBytes > 0 ? std::min(double(doneBytes) / double(totalBytes), 1.0) : 0;
            const auto goesOn = [&] { return progress(fraction, writer.triangles()); };
            VCP_TRY_ASSIGN(const double detail, maskDetailOf(path, options, goesOn));
            cutter.setDetail(detail);
        }
        VertexJoin join(space, vertexBytes, [&](const WorldTriangle<double>& t) {
            if (!hasMasks || t.material <= materialBase) return take(t);
            return cutByMask(cutter, stream->materials(), t.material - materialBase - 1, t, take);
        });
        for (;;) {
            VCP_TRY_ASSIGN(auto more, stream->next(chunk));
            if (!more) break;
            hasVertexColours |= !chunk.colours.empty();
            if (options.sample) options.sample->addVertices(chunk.positions);
            if (options.vertexNormals == VertexNormals::Computed) {
                chunk.normals.clear();
                chunk.cornerNormals.clear();
            }
            VCP_TRY(join.add(chunk, materialBase));
            const uint64_t bytes = doneBytes + stream->bytesRead();
            // A pipe does not say how many bytes will come.
            const double fraction = totalBytes > 0 ? std::min(double(bytes) / double(totalBytes), 1.0) : 0;
            if (!progress(fraction, writer.triangles())) return Error::cancelled();
        }
        doneBytes += stream->bytesRead();
        if (isPainted) {
            for (const Material& material : stream->materials()) {
                soup.materials.push_back(material);
                if (!options.channels) soup.materials.back().channels = {};
                soup.materials.back().isCutOut = hasMasks && material.mask.image.exists();
            }
        }
        warnings.insert(warnings.end(), stream->warnings().begin(), stream->warnings().end());
        for (const SideFile& each : stream->sideFiles())
            if (named.insert(each.path).second) sideFiles.push_back(each);
        VCP_TRY(join.finish(path.string()));
        warnings.insert(warnings.end(), cutter.warnings().begin(), cutter.warnings().end());
        cutTriangles += cutter.cutTriangles();
        vertices += join.vertices();
    }
    VCP_TRY(writer.flush());
    VCP_TRY(soup.floats.raw().flush());
    VCP_TRY(soup.doubles.raw().flush());

    SoupTally tally = writer.tally();
    tally.counted.vertices = vertices;
    tally.counted.cutTriangles = cutTriangles;
    tally.counted.hasVertexColours = hasVertexColours;
    tally.counted.hasMaterials =
        std::any_of(soup.materials.begin(), soup.materials.end(),
                    [](const Material& material) { return material.factor != kWhite || material.hasImages(); });
    return tally;
}

Result<SoupMeasures> measuresOf(const SoupTally& tally, const BuildOptions& options) {
    SoupMeasures m = tally.counted;
    m.area = tally.area.value();
    m.length = tally.length.value();
    if (m.triangles == 0)
        return badInput(options, m.cutTriangles > 0 ? "has no triangles but those that masks cut out; keep them whole"
                                                    : "has no triangles");
    if (tally.isTooLarge || !(glm::length(m.boundsMax - m.boundsMin) < kMaxExtent) || !std::isfinite(m.area))
        return badInput(options, "its coordinates are too large to measure lengths; scale the mesh down");
    if (m.triangles == m.degenerateTriangles || m.area == 0)
        return badInput(options, fmt::format("none of its {} triangles has an area", m.triangles));
    if (options.colour == ColourChoice::Vertex && !m.hasVertexColours)
        return badInput(options, "has no vertex colours; choose another colour to keep");
    if (options.colour == ColourChoice::Texture && !m.hasMaterials)
        return badInput(options, "has no materials with a colour or a texture; choose another colour to keep");
    return m;
}

Result<double> maskDetailOf(const std::filesystem::path& path, const BuildOptions& options,
                            const std::function<bool()>& progress) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(path, ignored)) return 0.0;
    MeshOpenOptions open = meshOptionsOf(options);
    open.materials = false;
    VCP_TRY_ASSIGN(const auto stream, openMesh(path, open));
    MaskDetail detail;
    MeshChunk chunk;
    for (;;) {
        VCP_TRY_ASSIGN(const bool more, stream->next(chunk));
        if (!more) return detail.length();
        detail.add(chunk.positions);
        if (!progress()) return Error::cancelled();
    }
}

MeshOpenOptions meshOptionsOf(const BuildOptions& options) {
    MeshOpenOptions open;
    open.format = options.format;
    open.allowOutside = options.allowOutside;
    open.materials = options.masks || options.colour == ColourChoice::Auto || options.colour == ColourChoice::Texture;
    return open;
}

namespace {

double longestOf(const SoupMeasures& m) {
    const glm::dvec3 extent = m.boundsMax - m.boundsMin;
    return std::max(extent.x, std::max(extent.y, extent.z));
}

/// Returns the smallest cell for which doubles so far from zero have digits left.
double resolvedCell(const SoupMeasures& m) {
    return std::max(glm::length(m.boundsMin), glm::length(m.boundsMax)) * std::numeric_limits<double>::epsilon() * 1e4;
}

/// Returns the smallest cell that a grid around the mesh can have.
double leastCell(const SoupMeasures& m) { return std::max(longestOf(m) / kMaxExtentCells, resolvedCell(m)); }

/// Returns the cell that suits the mesh's triangles.
double suitableCell(const SoupMeasures& m) {
    const auto useful = double(m.triangles - m.degenerateTriangles);
    return std::max(std::sqrt(m.area / (useful * kTriangleAreaPerCellArea)), m.length / useful / kMostMeanEdgeCells);
}

}  // namespace

std::optional<std::string> wideCellWarning(const BuildOptions& options, const SoupMeasures& m) {
    if (options.cell > 0 || suitableCell(m) >= leastCell(m)) return std::nullopt;
    return fmt::format(
        "cells are {:.3g} long where the triangles ask for {:.3g}, since the mesh reaches {:.3g} far: leave out what "
        "lies far away, or move the mesh to the origin, for sharper close-ups",
        leastCell(m), suitableCell(m), std::max({longestOf(m), glm::length(m.boundsMin), glm::length(m.boundsMax)}));
}

uint32_t mostLevelsBelow(const GridFrame& frame, const SoupMeasures& m) {
    const double least = leastCell(m);
    uint32_t count = 0;
    while (frame.levels + count < kMaxLevels && frame.withLevelsBelow(count + 1).cell >= least) ++count;
    return count;
}

Result<GridFrame> chooseFrame(const BuildOptions& options, const SoupMeasures& m, uint32_t levelsLess) {
    GridFrame frame;
    frame.log2Cells = kLog2Cells;
    const double longest = longestOf(m);
    frame.cell = options.cell > 0 ? options.cell : std::ldexp(std::max(suitableCell(m), leastCell(m)), int(levelsLess));
    if (longest / frame.cell > kMaxExtentCells)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format(
                "a cell of {:g} divides the mesh's {:g} into more than 2^20 cells; let the cell edge be {:g} or larger",
                frame.cell, longest, longest / kMaxExtentCells),
            .file = nameOf(options)};
    if (longest * kLatticePerCell < frame.cell)
        return badInput(options,
                        fmt::format("all of it is smaller than 1/{} cell; use a smaller cell edge", kLatticePerCell));
    frame.origin = options.origin.value_or(m.boundsMin - glm::dvec3(frame.cell));
    const glm::dvec3 before = m.boundsMin - frame.origin, across = m.boundsMax - frame.origin;
    if (options.origin && std::min({before.x, before.y, before.z}) < frame.cell)
        return badInput(options, fmt::format("it begins at {:.9g} {:.9g} {:.9g}, which is not a cell behind the origin "
                                             "that is asked for; let that be smaller",
                                             m.boundsMin.x, m.boundsMin.y, m.boundsMin.z));
    const double cellsAcross =
        (options.origin ? std::max({across.x, across.y, across.z}) / frame.cell : longest / frame.cell + 1) + 1;
    if (cellsAcross > kMaxExtentCells + 2)
        return badInput(options, fmt::format("it ends more than 2^20 cells of {:g} behind the origin that is asked for",
                                             frame.cell));
    while (std::ldexp(1.0, int(frame.log2Cells + frame.levels - 1)) < cellsAcross) ++frame.levels;
    // The one page that holds all has slabs of half its cells. The one above it has slabs of its cells, a fourth as
    // many: that is what a first picture waits for.
    if (hasSlabs(options) && frame.levels > 1) ++frame.levels;
    return frame;
}

Result<double> chooseError(const BuildOptions& options, const SoupMeasures& measures, const GridFrame& frame) {
    double error = options.error;
    if (options.errorIsRelative) error *= glm::length(measures.boundsMax - measures.boundsMin);
    // Rounding to the lattice is part of the error; below a few steps nothing could be certified.
    const double least = 8 * kLatticeRounding * frame.cell;
    if (error <= 0) return least;
    if (error < least)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format(
                         "an error of {:g} needs a finer cell than {:g}; let the cell edge be {:g} or smaller", error,
                         frame.cell, error / (8 * kLatticeRounding))};
    return error;
}

}  // namespace vcp
