#include "viewer/command/site/web_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "octree/io/durable_file.h"
#include "octree/io/output_folder.h"
#include "streaming/shard/shard_folder.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;

constexpr const char* kPage = "index.html";
constexpr std::array<std::string_view, 16> kViewerFiles{
    kPage,       "vcp-viewer.js", "vcp-viewer.d.ts", "worker.js", "module.js", "camera.js",
    "markup.js", "ranges.js",     "caster.js",       "choice.js", "fzstd.js",  "fzstd.LICENSE",
    "gpu.js",    "shaders.js",    "share.js",        "vcp.wasm"};

/// Whether a published folder holds a file of this name.
bool isPublishedName(std::string_view name) {
    return name == kScanInFolder || isShardName(name) ||
           std::find(kViewerFiles.begin(), kViewerFiles.end(), name) != kViewerFiles.end();
}

Error io(const fs::path& file, const char* what, const std::error_code& failed) {
    return systemError(file, what, failed.value());
}

Result<uint64_t> copyInto(const fs::path& from, const fs::path& to) {
    std::error_code failed;
    if (!fs::copy_file(from, to, failed)) return io(from, "cannot be copied", failed);
    // What a package installed may be write-protected; the page is there to be edited.
    fs::permissions(to, fs::perms::owner_write, fs::perm_options::add, failed);
    const int file = ::open(to.c_str(), O_RDONLY | O_CLOEXEC);
    const bool isSynced = file >= 0 && ::fsync(file) == 0;
    const int code = errno;
    if (file >= 0) ::close(file);
    if (!isSynced) return systemError(to, "cannot be written", code);
    const uint64_t bytes = fs::file_size(to, failed);
    if (failed) return io(to, "its size cannot be asked", failed);
    return bytes;
}

/// Copies a .vcp file into a folder, or a manifest, under the same name, with its shards. Returns their bytes.
Result<uint64_t> copyScan(const fs::path& scan, const fs::path& to) {
    VCP_TRY_ASSIGN(const auto reader, openDatasetFile(scan));
    VCP_TRY_ASSIGN(uint64_t bytes, copyInto(reader->name(), to / kScanInFolder));
    const auto* sharded = dynamic_cast<const ShardedReader*>(reader.get());
    const uint64_t shards = sharded != nullptr ? sharded->manifest().header().shards : 0;
    for (uint64_t number = 0; number < shards; ++number) {
        VCP_TRY_ASSIGN(const auto row, sharded->manifest().shard(number));
        const std::string name = shardName(row);
        VCP_TRY_ASSIGN(const uint64_t copied, copyInto(fs::path(reader->name()).parent_path() / name, to / name));
        bytes += copied;
    }
    return bytes;
}

}  // namespace

Result<fs::path> findWebViewer(const fs::path& asked) {
    std::error_code failed;
    const fs::path program = fs::read_symlink("/proc/self/exe", failed).parent_path();
    fs::path viewer = asked;
    if (viewer.empty()) {
        viewer = program / "web";
        if (!fs::exists(viewer / "vcp.wasm", failed)) viewer = program.parent_path() / "share" / "vcp" / "web";
    }
    for (const std::string_view name : kViewerFiles)
        if (!fs::is_regular_file(viewer / name, failed))
            return Error{.code = ErrorCode::Io,
                         .message = fmt::format("has no {}: the viewer for browsers is not there; build the target "
                                                "`web`, or name its folder with --viewer",
                                                name),
                         .file = viewer.string()};
    return viewer;
}

Result<uint64_t> writeWebFolder(const fs::path& viewer, const fs::path& scan, const fs::path& named, bool overwrite) {
    VCP_TRY_ASSIGN(auto made,
                   OutputFolder::create(named, {.isOurs = isPublishedName,
                                                .ofWhat = "a published scan",
                                                .overwrite = overwrite,
                                                .howToReplace = "--overwrite replaces it, but for its index.html"}));
    const fs::path& to = made.unfinished();
    std::error_code failed;
    uint64_t bytes = 0;
    for (const std::string_view name : kViewerFiles) {
        const bool isKept = name == kPage && fs::is_regular_file(made.folder() / kPage, failed);
        VCP_TRY_ASSIGN(const uint64_t copied, copyInto((isKept ? made.folder() : viewer) / name, to / name));
        bytes += copied;
    }
    VCP_TRY_ASSIGN(const uint64_t copied, copyScan(scan, to));
    VCP_TRY(made.commit());
    return bytes + copied;
}

}  // namespace vcp
