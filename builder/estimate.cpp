#include "builder/estimate.h"

#include <sys/stat.h>
#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <thread>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/bin_passes.h"
#include "builder/build_sample.h"
#include "builder/image_store.h"
#include "builder/lattice/exact_sum.h"
#include "builder/memory_plan.h"
#include "builder/mesh/open_mesh.h"

namespace vcp {

namespace {

// Bytes of a triangle on the temporary disk (the soup while it is dealt, then the finest level's bins with what has
// been built of it) and in the file (2.4 to 3.2 for scans, 4.7 with colour), before anything is known of it.
constexpr double kTempBytesPerTriangle = 80, kFileBytesPerTriangle = 5;
// The same where there is ample memory, and nothing is coded.
constexpr double kPlainTempBytesPerTriangle = 170;
// The same, of what the soup takes where it is coded: 2.2 to 3.6 times as much.
constexpr double kTempBytesPerSoupByte = 3.6;
// What colours from images add in the file; a sample has none.
constexpr double kImageBytesPerTriangle = 2;
// What their places in images add where these are kept.
constexpr double kPlaceBytesPerTriangle = 2.5;
// Bytes of a triangle in memory where there is room for all, 120 to 195 for scans, and what comes with the first ones.
constexpr double kMemoryBytesPerTriangle = 200, kFirstMemoryBytes = 20e6;
// A machine may be slower by so much than the one that the time was measured on.
constexpr double kSlower = 4;

/// Measures one input's triangles as far as their vertices fit memory, and adds them to the sample.
class Measurer {
public:
    /// `maskBytes`: for masks; 0: triangles stay whole.
    Measurer(SoupMeasures& measures, BuildSample& sample, uint64_t maxVertices, uint64_t maskBytes)
        : measures_(measures), sample_(sample), maxVertices_(maxVertices), cutter_(maskBytes), cuts_(maskBytes > 0) {}

    void setMaskDetail(double length) { cutter_.setDetail(length); }

    void add(const MeshChunk& chunk, std::span<const Material> materials) {
        const size_t room = size_t(std::min<uint64_t>(chunk.positions.size(), maxVertices_ - positions_.size()));
        positions_.insert(positions_.end(), chunk.positions.begin(), chunk.positions.begin() + ptrdiff_t(room));
        if (!chunk.colours.empty()) {
            colours_.resize(positions_.size() - room, Rgba8(255));
            colours_.insert(colours_.end(), chunk.colours.begin(), chunk.colours.begin() + ptrdiff_t(room));
        }
        if (!chunk.normals.empty()) {
            normals_.resize(positions_.size() - room, kUnknownNormal);
            normals_.insert(normals_.end(), chunk.normals.begin(), chunk.normals.begin() + ptrdiff_t(room));
        }
        for (const glm::dvec3& p : chunk.positions) {
            measures_.boundsMin = glm::min(measures_.boundsMin, p);
            measures_.boundsMax = glm::max(measures_.boundsMax, p);
        }
        measures_.vertices += chunk.positions.size();
        measures_.hasVertexColours |= !chunk.colours.empty();
        measures_.hasMaterials |= !chunk.materials.empty();
        triangles_ += chunk.triangles.size();
        for (size_t k = 0; k < chunk.triangles.size(); ++k) {
            const auto& t = chunk.triangles[k];
            if (std::max({t[0], t[1], t[2]}) >= positions_.size()) continue;
            ++whole_;
            WorldTriangle<double> triangle{};
            for (size_t i = 0; i < 3; ++i) {
                triangle.corner[i] = positions_[t[i]];
                triangle.colour[i] = colourOf(t[i]);
                triangle.normal[i] = normalOf(chunk, k, i);
                if (!chunk.uvs.empty()) triangle.uv[i] = chunk.uvs[k][i];
            }
            const auto take = [&](const WorldTriangle<double>& part) {
                measure(part);
                return Result<void>();
            };
            if (cuts_ && !chunk.materials.empty())
                static_cast<void>(cutByMask(cutter_, materials, chunk.materials[k], triangle, take));
            else
                measure(triangle);
        }
    }
    [[nodiscard]] double area() const { return area_.value(); }
    [[nodiscard]] double length() const { return length_.value(); }
    [[nodiscard]] uint64_t measured() const { return measured_; }
    /// Triangles of the input, after cutting: about as many, where not all could be measured.
    [[nodiscard]] uint64_t triangles() const {
        if (whole_ == triangles_) return measured_;
        return whole_ > 0 ? uint64_t(double(measured_) / double(whole_) * double(triangles_)) : triangles_;
    }

private:
    void measure(const WorldTriangle<double>& t) {
        const glm::dvec3 &a = t.corner[0], &b = t.corner[1], &c = t.corner[2];
        const double twice = glm::length(glm::cross(b - a, c - a)), longest = longestEdge(a, b, c);
        ++measured_;
        if (!(twice > 0) || !std::isfinite(twice) || !std::isfinite(longest)) {
            ++measures_.degenerateTriangles;
            return;
        }
        area_.add(twice / 2);
        length_.add(longest);
        BuildSample::Triangle each{{a, b, c}, {t.colour[0], t.colour[1], t.colour[2]}};
        std::copy_n(t.normal, 3, each.normal);
        sample_.add(each);
    }
    [[nodiscard]] Rgba8 colourOf(uint64_t vertex) const {
        return vertex < colours_.size() ? colours_[vertex] : Rgba8(255);
    }
    [[nodiscard]] uint32_t normalOf(const MeshChunk& chunk, size_t triangle, size_t corner) const {
        const uint32_t own = chunk.cornerNormals.empty() ? kUnknownNormal : chunk.cornerNormals[triangle][corner];
        const uint64_t vertex = chunk.triangles[triangle][corner];
        return own == kUnknownNormal && vertex < normals_.size() ? normals_[vertex] : own;
    }

    SoupMeasures& measures_;
    BuildSample& sample_;
    uint64_t maxVertices_;
    MaskCutter cutter_;
    bool cuts_;
    uint64_t triangles_ = 0, whole_ = 0;  ///< of the input: all, and those whose vertices are known
    uint64_t measured_ = 0;               ///< what is left of the latter
    std::vector<glm::dvec3> positions_;
    std::vector<Rgba8> colours_;     ///< of the first positions; white beyond
    std::vector<uint32_t> normals_;  ///< likewise; unknown beyond
    ExactSum area_, length_;
};

}  // namespace

uint64_t expectedTempBytes(uint64_t triangles, uint64_t soupBytes, uint64_t imageBytes, uint64_t memoryBytes,
                           bool mayCheckpoint) {
    const double plain = kPlainTempBytesPerTriangle * double(triangles);
    const bool isAmple = plain <= double(memoryBytes) / 2;
    double expected = isAmple ? plain : kTempBytesPerTriangle * double(triangles);
    if (soupBytes > 0) expected = std::min(expected, kTempBytesPerSoupByte * double(soupBytes));
    const uint64_t bytes = uint64_t(expected) + imageBytes;
    return bytes > memoryBytes || mayCheckpoint ? bytes : 0;
}

uint64_t expectedFileBytes(uint64_t triangles) { return uint64_t(kFileBytesPerTriangle * double(triangles)); }

namespace {

/// Returns the path, or the nearest folder above it that exists.
std::filesystem::path existingAt(const std::filesystem::path& path) {
    std::error_code failed;
    std::filesystem::path at = std::filesystem::absolute(path, failed);
    while (!at.empty() && !std::filesystem::exists(at, failed) && at != at.parent_path()) at = at.parent_path();
    return at;
}

bool areOnOneDisk(const std::filesystem::path& a, const std::filesystem::path& b) {
    struct stat ofA {
    }, ofB{};
    return stat(existingAt(a).c_str(), &ofA) == 0 && stat(existingAt(b).c_str(), &ofB) == 0 && ofA.st_dev == ofB.st_dev;
}

std::string folderOf(const std::filesystem::path& path) {
    const bool isFile = path.has_filename() && !std::filesystem::is_directory(path);
    return isFile ? std::filesystem::absolute(path).parent_path().string() : path.string();
}

}  // namespace

uint64_t freeBytesAt(const std::filesystem::path& path) {
    std::error_code failed;
    const auto space = std::filesystem::space(existingAt(path), failed);
    return failed ? std::numeric_limits<uint64_t>::max() : space.available;
}

Result<void> checkFreeSpace(std::span<const SpaceNeed> needs) {
    for (const SpaceNeed& need : needs) {
        uint64_t together = 0;
        for (const SpaceNeed& each : needs)
            if (areOnOneDisk(each.path, need.path)) together += each.bytes;
        const uint64_t free = freeBytesAt(need.path);
        if (together <= free) continue;
        // The two numbers are rounded apart, so that they never read the same.
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("about {} MB are needed in the folder {}{} and {} MB are free there; free "
                                            "some space or choose another {}",
                                            together / 1000000 + 1, folderOf(need.path),
                                            together > need.bytes ? " and elsewhere on its disk" : "", free / 1000000,
                                            need.folder)};
    }
    return {};
}

Result<void> checkBuildSpace(const SpaceNeed& temp, const std::filesystem::path& output, uint64_t outputBytes) {
    const std::array<SpaceNeed, 2> needs{temp, {output, outputBytes, "folder"}};
    auto checked = checkFreeSpace(needs);
    if (checked) return {};
    Error error = checked.error();
    error.file = output.string();
    return error;
}

Result<BuildEstimate> estimateBuild(const BuildOptions& options) {
    BuildEstimate estimate;
    const unsigned threads = options.threads > 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
    estimate.memoryCap = options.memoryBytes > 0 ? options.memoryBytes : defaultMemoryBytes();
    VCP_TRY_ASSIGN(auto plan, planMemory(estimate.memoryCap, threads));
    SoupMeasures& m = estimate.measures;
    m.boundsMin = glm::dvec3(std::numeric_limits<double>::infinity());
    m.boundsMax = -m.boundsMin;
    uint64_t measured = 0, imageBytes = 0, imageMemory = 0;
    MeshChunk chunk;
    BuildSample sample;
    const auto begins = std::chrono::steady_clock::now();
    VCP_TRY_ASSIGN(auto inputs, expandInputs(options.inputs));
    for (const auto& path : inputs) {
        VCP_TRY_ASSIGN(auto stream, openMesh(path, meshOptionsOf(options)));
        Measurer measurer(m, sample, plan.vertexBytes / (sizeof(glm::dvec3) + sizeof(Rgba8) + sizeof(uint32_t)),
                          options.masks ? plan.vertexBytes / 4 : 0);
        if (options.masks && std::ranges::any_of(stream->materials(), mayCut)) {
            const auto goesOn = [&] {
                return !options.progress ||
                       options.progress({.stage = "reading", .fraction = 0, .triangles = m.triangles});
            };
            VCP_TRY_ASSIGN(const double detail, maskDetailOf(path, options, goesOn));
            measurer.setMaskDetail(detail);
        }
        for (;;) {
            VCP_TRY_ASSIGN(auto more, stream->next(chunk));
            if (!more) break;
            measurer.add(chunk, stream->materials());
            const uint64_t triangles = m.triangles + measurer.triangles();
            if (options.progress && !options.progress({.stage = "reading", .fraction = 0, .triangles = triangles}))
                return Error::cancelled();
        }
        if (keepsImages(options)) {
            imageBytes += expectedImageBytes(stream->materials());
            imageMemory = std::max(imageMemory, expectedImageMemory(stream->materials(), plan.vertexBytes));
        }
        measured += measurer.measured();
        m.triangles += measurer.triangles();
        m.area += measurer.area();
        m.length += measurer.length();
    }
    if (m.triangles == 0)
        return Error{
            .code = ErrorCode::InvalidInput, .message = "has no triangles", .file = options.inputs.front().string()};
    estimate.isAreaComplete = measured == m.triangles;
    if (m.area == 0)
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "its triangles have no area",
                     .file = options.inputs.front().string()};
    m.area *= double(m.triangles) / double(measured);
    m.length *= double(m.triangles) / double(measured);
    const double reading = std::chrono::duration<double>(std::chrono::steady_clock::now() - begins).count();
    VCP_TRY_ASSIGN(estimate.frame, chooseFrame(options, m));
    estimate.warning = wideCellWarning(options, m);
    BuildOptions whole = options;
    if (options.errorIsRelative) whole.error *= glm::length(m.boundsMax - m.boundsMin);
    const ColourUse use = colourUseOf(options, m);
    VCP_TRY_ASSIGN(const auto figures, buildSample(whole, estimate.frame.cell, sample, use.vertices));
    if (!use.materials) imageBytes = imageMemory = 0;
    estimate.memoryBytes =
        std::min(estimate.memoryCap, fixedMemoryBytes(threads) + imageMemory +
                                         uint64_t(kFirstMemoryBytes + kMemoryBytesPerTriangle * double(m.triangles)));
    double bytesPerTriangle = figures.fileBytes;
    if (use.materials) bytesPerTriangle += kImageBytesPerTriangle;
    if (imageBytes > 0) bytesPerTriangle += kPlaceBytesPerTriangle;
    estimate.fileBytes = uint64_t(bytesPerTriangle * double(m.triangles)) + imageBytes;
    estimate.seconds = reading + figures.seconds * double(m.triangles) + expectedImageSeconds(imageBytes);
    // A checkpoint writes all that is held in memory.
    const bool mayCheckpoint = kSlower * estimate.seconds > options.checkpointSeconds;
    estimate.tempBytes = expectedTempBytes(m.triangles, 0, imageBytes, plan.tempBytes, mayCheckpoint);
    estimate.freeTempBytes = freeBytesAt(tempFolderOf(options));
    estimate.freeOutputBytes = freeBytesAt(options.output);
    return estimate;
}

}  // namespace vcp
