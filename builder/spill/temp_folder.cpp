#include "builder/spill/temp_folder.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <memory>
#include <string_view>

#include "octree/io/durable_file.h"

namespace vcp {

namespace {

Error refused(const std::filesystem::path& file, const char* why) {
    return {.code = ErrorCode::Io, .message = why, .file = file.string()};
}

/// Whether a build gives files this name: a word and perhaps a number before the suffix.
bool isOfABuild(std::string_view name) {
    if (name == kJournalName) return true;
    if (!name.ends_with(kTempSuffix)) return false;
    name.remove_suffix(std::string_view(kTempSuffix).size());
    name = name.substr(0, name.find_last_not_of("0123456789") + 1);
    constexpr std::string_view kWords[] = {
        "floats",     "doubles",      "vertices",  "waiting",     "level",        "normals",        "parts",
        "keptpages",  "keptentries",  "pages",     "entries",     "surfacepages", "surfaceentries", "textures",
        "imagepages", "imageentries", "tilepages", "tileentries", "embedded"};
    return std::find(std::begin(kWords), std::end(kWords), name) != std::end(kWords);
}

/// Lists what lies in a folder, at most `limit` names.
std::vector<std::string> namesIn(int folder, size_t limit = ~size_t{0}) {
    std::vector<std::string> names;
    const int again = ::openat(folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR* const list = again < 0 ? nullptr : ::fdopendir(again);
    if (!list) {
        if (again >= 0) ::close(again);
        return names;
    }
    for (const dirent* entry = nullptr; names.size() < limit && (entry = ::readdir(list));)
        if (const std::string_view name = entry->d_name; name != "." && name != "..") names.emplace_back(name);
    ::closedir(list);
    return names;
}

bool isRegular(int folder, const char* name) {
    struct stat status {};
    return ::fstatat(folder, name, &status, AT_SYMLINK_NOFOLLOW) == 0 && S_ISREG(status.st_mode);
}

}  // namespace

Error tempError(const std::filesystem::path& file, const char* what, int code) {
    return systemError(file, what, code, kWhenTempIsFull);
}

Error damagedTempFile(const std::filesystem::path& file, std::optional<uint64_t> byte) {
    return {.code = ErrorCode::InvalidInput,
            .message = "temporary data came back damaged; check the disk, then build again from the start",
            .file = file.string(),
            .byte = byte};
}

TempFolder::~TempFolder() {
    if (folder_ >= 0) ::close(folder_);
}

bool TempFolder::exists() const {
    struct stat status {};
    return ::lstat(path_.c_str(), &status) == 0;
}

Result<void> TempFolder::take() {
    const std::scoped_lock guard(mutex_);
    if (folder_ >= 0) return {};
    if (use_ == FolderUse::Read) {
        folder_ = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        return folder_ >= 0 ? Result<void>() : systemError(path_, "cannot be opened", errno);
    }
    for (;;) {
        Result<void> done = make();
        const Result<bool> held = done ? hold() : done.error();
        // Gone: a build that ended has removed the folder.
        if (held && !*held) continue;
        done = held ? mark() : held.error();
        if (done) return {};
        if (folder_ >= 0) ::close(folder_);
        folder_ = -1;
        unmake();
        return done;
    }
}

/// Makes the missing folders: the folder and those that it lies in.
Result<void> TempFolder::make() {
    std::vector<std::filesystem::path> missing;
    struct stat status {};
    for (std::filesystem::path at = path_; !at.empty() && ::stat(at.c_str(), &status) != 0 && errno == ENOENT;
         at = at.parent_path()) {
        if (at.has_filename()) missing.push_back(at);
        if (at == at.parent_path()) break;
    }
    for (; !missing.empty(); missing.pop_back()) {
        if (::mkdir(missing.back().c_str(), 0777) == 0)
            made_.push_back(missing.back());
        else if (errno != EEXIST)
            return tempError(path_, "cannot make the temporary folder", errno);
    }
    return {};
}

/// Opens and locks the folder; returns false where it is gone.
Result<bool> TempFolder::hold() {
    folder_ = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (folder_ < 0) {
        const int code = errno;
        if (code == ENOENT && !exists()) return false;
        if ((code == ELOOP || code == ENOTDIR) && exists())
            return refused(path_,
                           "a build keeps its temporary files in a folder of this name, but it is a link or a file; "
                           "move it away, or choose another temporary folder");
        return tempError(path_, "cannot make the temporary folder", code);
    }
    const NameLock lock = lockName(folder_, path_);
    if (lock == NameLock::Held) made_.clear();  // the folders that were made belong to that build now
    if (lock == NameLock::Held)
        return refused(path_, "another build of this output is running; wait for it or choose another output");
    if (lock == NameLock::Taken) return true;
    ::close(folder_);
    folder_ = -1;
    return false;
}

/// Makes sure that the held folder has the mark.
Result<void> TempFolder::mark() const {
    if (isRegular(folder_, kTempMark)) return {};
    if (!namesIn(folder_, 1).empty())
        return refused(
            path_,
            "is not known to be a build's, since it has no file vcp-build, so nothing in it is touched; "
            "delete it if it is of an earlier version, else move it away or choose another temporary folder");
    VCP_TRY_ASSIGN(const auto file, create(kTempMark));
    ::close(file);
    Result<void> durable = sync();
    if (durable) durable = syncFolder(path_.parent_path());
    if (!durable) unlink(kTempMark);
    return durable;
}

/// Removes the folders that were made, if they are empty.
void TempFolder::unmake() {
    while (!made_.empty() && ::rmdir(made_.back().c_str()) == 0) made_.pop_back();
    made_.clear();
}

Result<int> TempFolder::create(const std::string& name) const {
    const int file = ::openat(folder_, name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (file >= 0) return file;
    if (errno == EEXIST)
        return refused(path_ / name,
                       "a build makes this file itself, but something of its name is there; move it away");
    return tempError(path_ / name, "cannot be created", errno);
}

Result<int> TempFolder::open(const std::string& name) const {
    // O_NONBLOCK keeps the open from waiting for a named pipe.
    const int access = use_ == FolderUse::Read ? O_RDONLY : O_RDWR;
    const int file = ::openat(folder_, name.c_str(), access | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    const int code = errno;
    if (file < 0 && code == ENOENT) return -1;
    constexpr const char* kForeign = "is not a file that a build made; move it away, and build again from the start";
    if (file < 0)
        return code == ELOOP || code == EISDIR || code == ENXIO ? refused(path_ / name, kForeign)
                                                                : tempError(path_ / name, "cannot be opened", code);
    struct stat status {};
    if (::fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_nlink == 1) return file;
    ::close(file);
    return refused(path_ / name, kForeign);
}

void TempFolder::unlink(const std::string& name) const { ::unlinkat(folder_, name.c_str(), 0); }

Result<void> TempFolder::sync() const { return syncFolder(path_); }

void TempFolder::clear(const std::vector<std::string>& kept) const {
    if (folder_ < 0 || use_ == FolderUse::Read) return;
    const auto isKept = [&](const std::string& name) {
        return std::find(kept.begin(), kept.end(), name) != kept.end();
    };
    // The journal goes first: it must not outlive what it describes.
    if (!isKept(kJournalName) && isRegular(folder_, kJournalName)) unlink(kJournalName);
    for (const std::string& name : namesIn(folder_))
        if (isOfABuild(name) && !isKept(name) && isRegular(folder_, name.c_str())) unlink(name);
}

void TempFolder::remove() {
    if (use_ == FolderUse::Read) return;
    clear();
    const std::scoped_lock guard(mutex_);
    if (folder_ < 0) return;
    // The mark stays where other files stay: the folder is still a build's.
    if (namesIn(folder_, 2) == std::vector<std::string>{kTempMark}) {
        unlink(kTempMark);
        if (!std::count(made_.begin(), made_.end(), path_)) made_.push_back(path_);
    }
    unmake();
    ::close(folder_);
    folder_ = -1;
}

}  // namespace vcp
