#include "octree/io/output_folder.h"

#include <fcntl.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <system_error>

#include <fmt/format.h>

#include "octree/io/durable_file.h"
#include "octree/io/output_file.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;

constexpr const char* kUnfinished = ".unfinished-";

Error io(const fs::path& file, const char* what, const std::error_code& failed) {
    return systemError(file, what, failed.value());
}

Result<void> checkReplaceable(const fs::path& folder, const FolderRules& rules) {
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
        if (!rules.overwrite) return refuse("is there already and not empty; " + rules.howToReplace);
        if (!rules.isOurs(name) || !entry.is_regular_file(failed))
            return refuse(fmt::format("holds {}, which is not of {}; choose another folder", name, rules.ofWhat));
        for (const fs::path& input : rules.inputs)
            if (isSameFile(entry.path(), input))
                return refuse(fmt::format("holds {}, which is read; choose another folder", name));
    }
    return {};
}

/// Whether a folder holds nothing but files of the names that are written, or parts of them.
bool holdsOnlyOurs(const fs::path& folder, const FolderRules& rules) {
    std::error_code failed;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, failed)) {
        std::string name = entry.path().filename().string();
        if (constexpr std::string_view partial = ".partial"; name.ends_with(partial))
            name.resize(name.size() - partial.size());
        if (!rules.isOurs(name) || !entry.is_regular_file(failed) || entry.is_symlink(failed)) return false;
    }
    return !failed;
}

/// Removes what was left of a folder by a process that is gone. Errors: Io (the process is there, and has it locked).
Result<void> removeLeft(const fs::path& left, int process, const fs::path& folder, const FolderRules& rules) {
    const FileDescriptor held(::open(left.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (!held.isOpen()) return {};
    const NameLock lock = lockName(held.number(), left);
    if (lock == NameLock::Held)
        return Error{
            .code = ErrorCode::Io,
            .message = fmt::format("process {} is writing this folder; wait for it, or choose another", process),
            .file = folder.string()};
    // A file system without locks has them all taken.
    const bool isGone = ::kill(process, 0) != 0 && errno == ESRCH;
    std::error_code ignored;
    if (lock == NameLock::Taken && isGone && holdsOnlyOurs(left, rules)) fs::remove_all(left, ignored);
    return {};
}

Result<void> removeLeftovers(const fs::path& folder, const FolderRules& rules) {
    const fs::path beside = folder.has_parent_path() ? folder.parent_path() : fs::path(".");
    const std::string start = folder.filename().string() + kUnfinished;
    std::error_code failed;
    for (const fs::directory_entry& entry : fs::directory_iterator(beside, failed)) {
        const std::string name = entry.path().filename().string();
        if (!name.starts_with(start)) continue;
        int process = 0;
        const char* const end = name.data() + name.size();
        const auto number = std::from_chars(name.data() + start.size(), end, process);
        if (number.ec == std::errc() && number.ptr == end && process > 0)
            VCP_TRY(removeLeft(entry.path(), process, folder, rules));
    }
    return {};
}

/// Gives a folder a name, and the folder that has it, if any, the first one's. Returns errno, or 0; then `replaced`
/// says whether there was one.
int exchangeNames(const fs::path& made, const fs::path& name, bool& replaced) {
    const auto rename = [&](unsigned flags) {
        return ::renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, name.c_str(), flags) == 0 ? 0 : errno;
    };
    const auto isUnknown = [](int failed) { return failed == EINVAL || failed == ENOSYS; };
    replaced = false;
    int failed = rename(RENAME_NOREPLACE);
    if (failed == 0) return 0;
    if (!isUnknown(failed)) {
        replaced = true;
        failed = rename(RENAME_EXCHANGE);
        if (!isUnknown(failed)) return failed;
    }
    // Such as on NFS, which knows neither: a folder takes the name of an empty one or of none, else that one steps
    // aside. Of a name that is there the first flag tells even where it is not known.
    replaced = false;
    if (::rename(made.c_str(), name.c_str()) == 0) return 0;
    if (errno != ENOTEMPTY && errno != EEXIST) return errno;
    replaced = true;
    const fs::path aside = fs::path(made) += "-replaced";
    if (::rename(name.c_str(), aside.c_str()) != 0) return errno;
    failed = ::rename(made.c_str(), name.c_str()) == 0 ? 0 : errno;
    static_cast<void>(::rename(aside.c_str(), failed == 0 ? made.c_str() : name.c_str()));
    return failed;
}

}  // namespace

Result<OutputFolder> OutputFolder::create(const fs::path& named, const FolderRules& rules) {
    OutputFolder made(named.has_filename() ? named : named.parent_path(), rules);
    const fs::path last = made.folder_.filename();
    if (last.empty() || last == "." || last == "..")
        return Error{.code = ErrorCode::Usage,
                     .message = "has no name of its own, under which a folder could be made; name one in it",
                     .file = named.string()};
    VCP_TRY(checkReplaceable(made.folder_, rules));
    VCP_TRY(removeLeftovers(made.folder_, rules));
    const fs::path unfinished = fs::path(made.folder_) += fmt::format("{}{}", kUnfinished, ::getpid());
    std::error_code failed;
    if (!fs::create_directory(unfinished, failed))
        return systemError(unfinished, "cannot be made", failed ? failed.value() : EEXIST);
    made.unfinished_ = unfinished;
    made.lock_ = FileDescriptor(::open(unfinished.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (made.lock_.isOpen()) static_cast<void>(lockName(made.lock_.number(), unfinished));
    return made;
}

OutputFolder::~OutputFolder() {
    std::error_code ignored;
    if (!unfinished_.empty()) fs::remove_all(unfinished_, ignored);
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : folder_(std::move(other.folder_)),
      unfinished_(std::exchange(other.unfinished_, {})),
      lock_(std::move(other.lock_)),
      rules_(std::move(other.rules_)) {}

Result<void> OutputFolder::commit() {
    VCP_TRY(checkReplaceable(folder_, rules_));
    VCP_TRY(syncFolder(unfinished_));
    bool replaced = false;
    if (const int failed = exchangeNames(unfinished_, folder_, replaced); failed != 0)
        return systemError(folder_, replaced ? "cannot be replaced" : "cannot be named", failed);
    if (!replaced) unfinished_.clear();
    return syncFolder(folder_.parent_path());
}

}  // namespace vcp
