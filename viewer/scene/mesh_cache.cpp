#include "viewer/scene/mesh_cache.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

#include "builder/checkpoint.h"
#include "octree/dataset_reader.h"
#include "octree/io/content_hash.h"
#include "octree/io/output_file.h"
#include "octree/io/regular_file.h"
#include "streaming/shard/shard_manifest.h"
#include "viewer/scene/base_light.h"

namespace vcp {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kExtension = ".vcp";
constexpr std::string_view kListExtension = ".files";

// A part of the key: it is raised when the same options build other bytes.
constexpr int kCacheGeneration = 7;

// An unfinished build older than this is abandoned.
constexpr auto kLeftoverAge = std::chrono::hours(24);

Error ioError(const fs::path& path, const std::string& what, std::error_code code) {
    return {ErrorCode::Io, what + ": " + code.message(), path.string()};
}

std::string hashOf(const std::string& text) {
    return fmt::format("{:016x}", hashBytes(std::as_bytes(std::span(text))));
}

/// Returns what identifies a mesh: path, size, times of last change.
Result<std::string> identity(const fs::path& mesh) {
    std::error_code failed;
    const fs::path absolute = fs::canonical(mesh, failed);
    if (failed) return ioError(mesh, "cannot be opened", failed);
    if (fs::is_directory(absolute, failed))
        return Error{.code = ErrorCode::Io, .message = "is a folder, not a mesh", .file = mesh.string()};
    // A pipe would be waited for, and what comes through it has no identity.
    if (!fs::is_regular_file(absolute, failed))
        return Error{.code = ErrorCode::Io,
                     .message = "is not a regular file; build it first, with `vcp build`",
                     .file = mesh.string()};
    return fmt::format("{}\n{}\n", absolute.string(), fileStamp(absolute));
}

/// Returns a hash of what is known of a dataset before it is built.
Result<std::string> keyOf(const BuildOptions& options) {
    std::string text = fmt::format("{}\n{}\n", kCacheGeneration, settingsText(options));
    for (const fs::path& mesh : options.inputs) {
        VCP_TRY_ASSIGN(auto id, identity(mesh));
        text += id;
    }
    return hashOf(text);
}

/// Returns the name under which it is kept, from its key and the files that its meshes name.
std::string nameOf(const std::string& key, const std::vector<fs::path>& sideFiles) {
    if (sideFiles.empty()) return key;
    std::string text = key + '\n';
    for (const fs::path& file : sideFiles) text += fmt::format("{}\n{}\n", file.string(), fileStamp(file));
    return hashOf(text);
}

fs::path listOf(const fs::path& folder, const std::string& key) {
    return folder / fmt::format("{}{}", key, kListExtension);
}

/// Reads paths, each with a zero behind. Returns none where there is no list.
std::vector<fs::path> readList(const fs::path& path) {
    std::vector<fs::path> files;
    std::ifstream file(path, std::ios::binary);
    for (std::string name; std::getline(file, name, '\0');) files.emplace_back(name);
    return files;
}

/// Writes a list whole or not at all. Where it cannot be written, the mesh is built again next time.
void writeList(const fs::path& path, const std::vector<fs::path>& files) {
    std::error_code ignored;
    if (files.empty()) {
        fs::remove(path, ignored);
        return;
    }
    std::string text;
    for (const fs::path& each : files) text += each.string() + '\0';
    static_cast<void>(writeFile(path, OutputKind::Text, std::as_bytes(std::span(text)), {.overwrite = true}));
}

/// Checks that the inputs did not change while they were read. Errors: InvalidInput.
Result<void> checkUnchanged(const BuildOptions& options, const std::string& keyBefore, const BuildReport& report) {
    const auto changed = [](const fs::path& file) {
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "was changed while it was read; open it again once it is whole",
                     .file = file.string()};
    };
    VCP_TRY_ASSIGN(const auto key, keyOf(options));
    if (key != keyBefore) return changed(options.inputs.front());
    for (const SideFile& each : report.sideFiles)
        if (fileStamp(each.path) != each.stamp) return changed(each.path);
    return {};
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

/// Whether a name is 16 hexadecimal digits and an extension of ours. Other files in the folder must not be removed.
bool isOurName(const fs::path& path, std::string_view extension) {
    const std::string stem = path.stem().string();
    return path.extension() == extension && stem.size() == 16 &&
           stem.find_first_not_of("0123456789abcdef") == std::string::npos;
}

bool isLeftoverName(const fs::path& path) { return path.filename().string().find(".building.") != std::string::npos; }

}  // namespace

Result<fs::path> defaultCacheFolder() {
    const char* cache = std::getenv("XDG_CACHE_HOME");
    if (cache && fs::path(cache).is_absolute()) return fs::path(cache) / "vcp";
    const char* home = std::getenv("HOME");
    if (home && *home) return fs::path(home) / ".cache" / "vcp";
    return Error{.code = ErrorCode::Io,
                 .message = "no folder for the cache: set XDG_CACHE_HOME or HOME, or build with `vcp build` first"};
}

bool isFolderOfShards(const fs::path& folder) {
    std::error_code unknown;
    return fs::is_regular_file(folder / kManifestName, unknown);
}

bool looksLikeDataset(const fs::path& path) {
    if (isFolderOfShards(path)) return true;
    std::array<char, 8> start{};
    const FileHeader header;
    const ManifestHeader manifest;
    // A mesh may be a pipe, whose bytes are gone once they are read.
    const auto file = openRegularStream(path);
    if (file && std::fread(start.data(), 1, start.size(), file->get()) == start.size() &&
        (std::equal(start.begin(), start.end(), header.magic) ||
         std::equal(start.begin(), start.end(), manifest.magic)))
        return true;
    return path.extension() == kExtension || path.filename() == kManifestName;
}

std::vector<fs::path> MeshCache::sideFilesOf(const BuildOptions& options) const {
    const auto key = keyOf(options);
    return key ? readList(listOf(folder_, *key)) : std::vector<fs::path>();
}

Result<fs::path> MeshCache::pathFor(const BuildOptions& options) const {
    VCP_TRY_ASSIGN(const auto key, keyOf(options));
    return folder_ / fmt::format("{}{}", nameOf(key, readList(listOf(folder_, key))), kExtension);
}

Result<fs::path> MeshCache::dataset(BuildOptions options, const Builder& build) {
    VCP_TRY_ASSIGN(const auto key, keyOf(options));
    const fs::path list = listOf(folder_, key);
    fs::path path = folder_ / fmt::format("{}{}", nameOf(key, readList(list)), kExtension);
    std::error_code failed;
    if (isWhole(path)) {
        // The list comes last: a list used longer ago than every dataset belongs to none.
        for (const fs::path& used : {path, list}) fs::last_write_time(used, fs::file_time_type::clock::now(), failed);
        return path;
    }
    fs::create_directories(folder_, failed);
    if (failed) return ioError(folder_, "the cache folder cannot be made; set XDG_CACHE_HOME to one that can", failed);

    options.output = folder_ / fmt::format("{}.{}.building{}", key, getpid(), kExtension);
    VCP_TRY_ASSIGN(const auto report, build(options));
    if (const auto unchanged = checkUnchanged(options, key, report); !unchanged) {
        fs::remove(options.output, failed);
        return unchanged.error();
    }
    std::vector<fs::path> sideFiles;
    for (const SideFile& each : report.sideFiles)
        sideFiles.push_back(fs::absolute(each.path, failed).lexically_normal());
    path = folder_ / fmt::format("{}{}", nameOf(key, sideFiles), kExtension);
    fs::rename(options.output, path, failed);
    if (failed) return ioError(path, "cannot be put into the cache", failed);
    writeList(list, sideFiles);
    trim(path);
    return path;
}

void MeshCache::trim(const fs::path& keep) const {
    std::vector<CachedFile> files = filesIn(folder_);
    std::error_code ignored;
    const auto now = fs::file_time_type::clock::now();
    std::vector<CachedFile> lists;
    std::erase_if(files, [&](const CachedFile& file) {
        if (isLeftoverName(file.path) && now - file.used > kLeftoverAge) fs::remove(file.path, ignored);
        if (isOurName(file.path, kListExtension)) lists.push_back(file);
        return !isOurName(file.path, kExtension) && !isOurName(file.path, kBaseLightExtension);
    });
    std::sort(files.begin(), files.end(), [](const CachedFile& a, const CachedFile& b) { return a.used < b.used; });
    uint64_t total = 0;
    for (const CachedFile& file : files) total += file.bytes;
    auto oldest = fs::file_time_type::max();
    for (const CachedFile& file : files) {
        if (total > limitBytes_ && file.path != keep && fs::remove(file.path, ignored))
            total -= file.bytes;
        else
            oldest = std::min(oldest, file.used);
    }
    for (const CachedFile& list : lists)
        if (list.used < oldest) fs::remove(list.path, ignored);
}

}  // namespace vcp
