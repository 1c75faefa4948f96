#include "builder/build_sample.h"

#include <unistd.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>
#include <xxhash.h>
#include <glm/common.hpp>

#include "builder/ingest.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

/// The first triangles fill so many cubes, unless these would be smaller than half a page: then cut surfaces weigh.
constexpr size_t kCubes = 128;
constexpr double kMostCubeEdges = 256, kLeastCubeEdges = 32;

/// A folder that is removed with all that it holds.
class OwnFolder {
public:
    OwnFolder() {
        std::error_code failed;
        std::string name = (std::filesystem::temp_directory_path(failed) / "vcp_sample_XXXXXX").string();
        if (::mkdtemp(name.data()) != nullptr) path_ = name;
    }
    ~OwnFolder() {
        std::error_code ignored;
        if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
    }
    OwnFolder(const OwnFolder&) = delete;
    OwnFolder& operator=(const OwnFolder&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

template <class Value>
void put(std::string& bytes, const Value& value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof raw);
}

/// Returns the direction of a packed normal; 0: unknown.
glm::vec3 directionOf(uint32_t normal) {
    return normal == kUnknownNormal ? glm::vec3(0) : glm::vec3(f64::decodeNormal(normal));
}

/// Writes a PLY file in which each triangle has vertices of its own.
Result<void> writePly(const std::filesystem::path& path, const std::vector<BuildSample::Triangle>& triangles,
                      bool hasColour) {
    const bool hasNormals = std::ranges::any_of(triangles, [](const BuildSample::Triangle& t) {
        return std::ranges::any_of(t.normal, [](uint32_t n) { return n != kUnknownNormal; });
    });
    std::string bytes = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty "
        "double z\n{}{}element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        3 * triangles.size(),
        hasColour ? "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n" : "",
        hasNormals ? "property float nx\nproperty float ny\nproperty float nz\n" : "", triangles.size());
    for (const BuildSample::Triangle& t : triangles)
        for (int i = 0; i < 3; ++i) {
            put(bytes, t.corner[i]);
            if (hasColour) put(bytes, t.colour[i]);
            if (hasNormals) put(bytes, directionOf(t.normal[i]));
        }
    for (uint32_t i = 0; i < triangles.size(); ++i) {
        put(bytes, uint8_t{3});
        for (uint32_t k = 0; k < 3; ++k) put(bytes, 3 * i + k);
    }
    std::ofstream file(path, std::ios::binary);
    if (!file.write(bytes.data(), std::streamsize(bytes.size())).flush())
        return Error{.code = ErrorCode::Io,
                     .message = "a sample of the mesh cannot be written here; free some space or set TMPDIR",
                     .file = path.parent_path().string()};
    return {};
}

}  // namespace

uint64_t BuildSample::hashOfCube(const Triangle& t) const {
    const glm::dvec3 middle = (t.corner[0] + t.corner[1] + t.corner[2]) / 3.0;
    const int64_t cube[3] = {int64_t(std::floor(middle.x / cube_)), int64_t(std::floor(middle.y / cube_)),
                             int64_t(std::floor(middle.z / cube_))};
    return XXH3_64bits(cube, sizeof cube);
}

bool BuildSample::isChosen(const Triangle& t) const {
    return cube_ <= 0 || halved_ == 0 || hashOfCube(t) >> (64 - halved_) == 0;
}

void BuildSample::add(const Triangle& triangle) {
    if (!isChosen(triangle)) return;
    triangles_.push_back(triangle);
    if (triangles_.size() > most_) thinOut();
}

void BuildSample::chooseCube() {
    double length = 0;
    for (const Triangle& t : triangles_) length += longestEdge(t.corner[0], t.corner[1], t.corner[2]);
    const double edge = length / double(triangles_.size());
    for (cube_ = kMostCubeEdges * edge; cube_ > kLeastCubeEdges * edge; cube_ /= 2) {
        std::unordered_set<uint64_t> cubes;
        for (const Triangle& t : triangles_) cubes.insert(hashOfCube(t));
        if (cubes.size() >= kCubes) return;
    }
}

void BuildSample::thinOut() {
    if (cube_ <= 0) chooseCube();
    const std::vector<Triangle> before = triangles_;
    for (unsigned halved = halved_ + 1; halved < 40; ++halved) {
        const unsigned was = std::exchange(halved_, halved);
        triangles_.clear();
        std::ranges::copy_if(before, std::back_inserter(triangles_), [&](const Triangle& t) { return isChosen(t); });
        if (triangles_.empty()) {
            // All are of one cube: it stays, and others may come as often as before.
            halved_ = was;
            triangles_.assign(before.begin(), before.begin() + ptrdiff_t(before.size() / 2));
            return;
        }
        if (triangles_.size() <= most_ * 3 / 4) return;
    }
}

Result<SampleFigures> buildSample(const BuildOptions& options, double cell, const BuildSample& sample, bool hasColour) {
    const OwnFolder folder;
    if (folder.path().empty())
        return Error{.code = ErrorCode::Io, .message = "no folder can be made among the temporary files; set TMPDIR"};
    const std::filesystem::path mesh = folder.path() / "sample.ply";
    VCP_TRY(writePly(mesh, sample.triangles(), hasColour));
    BuildOptions each = options;
    each.inputs = {mesh};
    each.format.clear();
    each.output = folder.path() / "sample.vcp";
    each.temp.clear();
    each.resume = false;
    each.sample.reset();
    each.cell = cell;
    each.errorIsRelative = false;
    each.checkpointSeconds = 1e9;
    std::optional<double> begins;
    bool isCancelled = false;
    each.progress = [&](const BuildProgress& now) {
        if (!begins && now.stage != "reading") begins = now.seconds;
        // The whole is still being read.
        isCancelled = options.progress && !options.progress({.stage = "building a sample", .fraction = 0});
        return !isCancelled;
    };
    VCP_TRY_ASSIGN(const auto report, buildOctree(each));
    const auto count = double(report.triangles);
    return SampleFigures{double(report.fileBytes) / count, (report.seconds - begins.value_or(0)) / count};
}

}  // namespace vcp
