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

#include <fmt/format.h>

#include "octree/io/durable_file.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;

constexpr const char* kPage = "index.html";
constexpr std::array<std::string_view, 13> kViewerFiles{
    kPage,       "vcp-viewer.js", "vcp-viewer.d.ts", "worker.js", "module.js",     "camera.js", "markup.js",
    "ranges.js", "caster.js",     "share.js",        "fzstd.js",  "fzstd.LICENSE", "vcp.wasm"};

Error io(const fs::path& file, const char* what, const std::error_code& failed) {
    return systemError(file, what, failed.value());
}

/// Removes a folder that was not finished.
class Unfinished {
public:
    explicit Unfinished(fs::path folder) : folder_(std::move(folder)) {}
    Unfinished(const Unfinished&) = delete;
    Unfinished& operator=(const Unfinished&) = delete;
    ~Unfinished() {
        std::error_code ignored;
        fs::remove_all(folder_, ignored);
    }
    [[nodiscard]] const fs::path& folder() const { return folder_; }

private:
    fs::path folder_;
};

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

/// Whether a folder may be replaced. Errors: Usage, with what stands in the way.
Result<void> checkReplaceable(const fs::path& folder, bool overwrite) {
    std::error_code failed;
    const fs::file_status there = fs::symlink_status(folder, failed);
    if (there.type() == fs::file_type::not_found) return {};
    const auto refuse = [&](std::string message) {
        return Error{.code = ErrorCode::Usage, .message = std::move(message), .file = folder.string()};
    };
    if (there.type() != fs::file_type::directory) return refuse("is there already, and no folder");
    fs::directory_iterator entries(folder, failed);
    if (failed) return io(folder, "cannot be read", failed);
    for (const fs::directory_entry& entry : entries) {
        const std::string name = entry.path().filename().string();
        if (!overwrite)
            return refuse("is there already and not empty; --overwrite replaces it, but for its index.html");
        const bool isOurs =
            name == kScanInFolder || std::find(kViewerFiles.begin(), kViewerFiles.end(), name) != kViewerFiles.end();
        if (!isOurs || !entry.is_regular_file(failed))
            return refuse(fmt::format("holds {}, which is not of a published scan; choose another folder", name));
    }
    return {};
}

/// Gives the finished folder its name; what had it before goes.
Result<void> putInPlace(const fs::path& made, const fs::path& folder) {
    if (::renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, folder.c_str(), RENAME_NOREPLACE) == 0) return {};
    // The name is taken: the two are exchanged, and the old one is removed with what was not finished.
    if (::renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, folder.c_str(), RENAME_EXCHANGE) == 0) return {};
    return systemError(folder, "cannot be replaced", errno);
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
    const fs::path folder = named.has_filename() ? named : named.parent_path();
    VCP_TRY(checkReplaceable(folder, overwrite));
    const Unfinished made(fs::path(folder) += fmt::format(".unfinished-{}", ::getpid()));
    std::error_code failed;
    if (!fs::create_directory(made.folder(), failed)) return io(made.folder(), "cannot be made", failed);
    uint64_t bytes = 0;
    for (const std::string_view name : kViewerFiles) {
        const bool isKept = name == kPage && fs::is_regular_file(folder / kPage, failed);
        VCP_TRY_ASSIGN(const uint64_t copied, copyInto((isKept ? folder : viewer) / name, made.folder() / name));
        bytes += copied;
    }
    VCP_TRY_ASSIGN(const uint64_t copied, copyInto(scan, made.folder() / kScanInFolder));
    VCP_TRY(syncFolder(made.folder()));
    VCP_TRY(putInPlace(made.folder(), folder));
    VCP_TRY(syncFolder(folder.parent_path()));
    return bytes + copied;
}

}  // namespace vcp
