#include "octree/io/output_folder.h"

#include <fcntl.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <system_error>

#include <fmt/format.h>

#include "octree/io/durable_file.h"
#include "octree/io/output_file.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;

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

}  // namespace

Result<OutputFolder> OutputFolder::create(const fs::path& named, const FolderRules& rules) {
    OutputFolder made(named.has_filename() ? named : named.parent_path(), rules);
    VCP_TRY(checkReplaceable(made.folder_, rules));
    const fs::path unfinished = fs::path(made.folder_) += fmt::format(".unfinished-{}", ::getpid());
    std::error_code failed;
    if (!fs::create_directory(unfinished, failed))
        return systemError(unfinished, "cannot be made", failed ? failed.value() : EEXIST);
    made.unfinished_ = unfinished;
    return made;
}

OutputFolder::~OutputFolder() {
    std::error_code ignored;
    if (!unfinished_.empty()) fs::remove_all(unfinished_, ignored);
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : folder_(std::move(other.folder_)),
      unfinished_(std::exchange(other.unfinished_, {})),
      rules_(std::move(other.rules_)) {}

Result<void> OutputFolder::commit() {
    VCP_TRY(checkReplaceable(folder_, rules_));
    VCP_TRY(syncFolder(unfinished_));
    const char *made = unfinished_.c_str(), *name = folder_.c_str();
    if (::renameat2(AT_FDCWD, made, AT_FDCWD, name, RENAME_NOREPLACE) == 0)
        unfinished_.clear();
    else if (::renameat2(AT_FDCWD, made, AT_FDCWD, name, RENAME_EXCHANGE) != 0)
        return systemError(folder_, "cannot be replaced", errno);
    return syncFolder(folder_.parent_path());
}

}  // namespace vcp
