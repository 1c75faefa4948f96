#include "viewer/mesh_cache.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

#include "octree/regular_file.h"
#include "octree/vcp_file.h"

namespace vcp {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kExtension = ".vcp";

// Part of the key: raised when the same options come to build other bytes.
constexpr int kCacheGeneration = 1;

// Unfinished builds older than this have no builder any more.
constexpr auto kLeftoverAge = std::chrono::hours(24);

Error ioError(const fs::path& path, const std::string& what, std::error_code code) {
    return {ErrorCode::Io, what + ": " + code.message(), path.string()};
}

/// What a mesh is known by: path, size, time of last change.
Result<std::string> identity(const fs::path& mesh) {
    std::error_code failed;
    const fs::path absolute = fs::absolute(mesh, failed);
    if (failed) return ioError(mesh, "cannot be found", failed);
    if (fs::is_directory(absolute, failed)) return Error{ErrorCode::Io, "is a folder, not a mesh", mesh.string()};
    const uint64_t size = fs::file_size(absolute, failed);
    if (failed) return ioError(mesh, "cannot be opened", failed);
    const auto changed = fs::last_write_time(absolute, failed);
    if (failed) return ioError(mesh, "cannot be opened", failed);
    return fmt::format("{}\n{}\n{}\n", absolute.lexically_normal().string(), size,
                       static_cast<int64_t>(changed.time_since_epoch().count()));
}

bool isWhole(const fs::path& dataset) {
    std::error_code failed;
    if (!fs::is_regular_file(dataset, failed)) return false;
    const auto reader = openFile(dataset);
    return reader && readDataset(**reader);
}

struct CachedFile {
    fs::path path;
    uint64_t bytes;
    fs::file_time_type used;
};

std::vector<CachedFile> filesIn(const fs::path& folder) {
    std::vector<CachedFile> files;
    std::error_code failed;
    for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed)) {
        std::error_code gone;
        if (!it->is_regular_file(gone)) continue;
        CachedFile file{it->path(), it->file_size(gone), it->last_write_time(gone)};
        if (!gone) files.push_back(std::move(file));
    }
    return files;
}

/// "KEY.vcp": KEY is 16 hexadecimal digits. Other files in the folder are not ours to remove.
bool isDatasetName(const fs::path& path) {
    const std::string stem = path.stem().string();
    return path.extension() == kExtension && stem.size() == 16 &&
           stem.find_first_not_of("0123456789abcdef") == std::string::npos;
}

bool isLeftoverName(const fs::path& path) { return path.filename().string().find(".building.") != std::string::npos; }

}  // namespace

Result<fs::path> defaultCacheFolder() {
    const char* cache = std::getenv("XDG_CACHE_HOME");
    if (cache && fs::path(cache).is_absolute()) return fs::path(cache) / "vcp";
    const char* home = std::getenv("HOME");
    if (home && *home) return fs::path(home) / ".cache" / "vcp";
    return Error{ErrorCode::Io, "no folder for the cache: set XDG_CACHE_HOME or HOME, or build with `vcp build` first"};
}

bool looksLikeDataset(const fs::path& path) {
    std::array<char, 8> start{};
    const FileHeader header;
    // A pipe may be a mesh: what is read of it is gone.
    const auto file = openRegularStream(path);
    if (file && std::fread(start.data(), 1, start.size(), file->get()) == start.size() && std::equal(start.begin(), start.end(), header.magic)) return true;
    return path.extension() == kExtension;
}

Result<fs::path> MeshCache::pathFor(const BuildOptions& options) const {
    std::string key = fmt::format("{}\n{}\n{}\n{}\n{}\n{}\n", kCacheGeneration, kFileVersion, options.cell,
                                  options.error, options.errorIsRelative, static_cast<int>(options.colour));
    for (const fs::path& mesh : options.inputs) {
        auto id = identity(mesh);
        if (!id) return id.error();
        key += *id;
    }
    const uint64_t hash = hashBytes(std::as_bytes(std::span(key)));
    return folder_ / fmt::format("{:016x}{}", hash, kExtension);
}

Result<fs::path> MeshCache::dataset(BuildOptions options, const Builder& build) {
    auto path = pathFor(options);
    if (!path) return path;
    std::error_code failed;
    if (isWhole(*path)) {
        fs::last_write_time(*path, fs::file_time_type::clock::now(), failed);
        return path;
    }
    fs::create_directories(folder_, failed);
    if (failed) return ioError(folder_, "the cache folder cannot be made; set XDG_CACHE_HOME to one that can", failed);

    options.output = folder_ / fmt::format("{}.{}.building{}", path->stem().string(), getpid(), kExtension);
    if (const auto report = build(options); !report) return report.error();
    fs::rename(options.output, *path, failed);
    if (failed) return ioError(*path, "cannot be put into the cache", failed);
    trim(*path);
    return path;
}

void MeshCache::trim(const fs::path& keep) const {
    std::vector<CachedFile> files = filesIn(folder_);
    std::error_code ignored;
    const auto now = fs::file_time_type::clock::now();
    std::erase_if(files, [&](const CachedFile& file) {
        if (isLeftoverName(file.path) && now - file.used > kLeftoverAge) fs::remove(file.path, ignored);
        return !isDatasetName(file.path);
    });
    std::sort(files.begin(), files.end(), [](const CachedFile& a, const CachedFile& b) { return a.used < b.used; });
    uint64_t total = 0;
    for (const CachedFile& file : files) total += file.bytes;
    for (const CachedFile& file : files) {
        if (total <= limitBytes_) return;
        if (file.path == keep) continue;
        if (fs::remove(file.path, ignored)) total -= file.bytes;
    }
}

}  // namespace vcp
