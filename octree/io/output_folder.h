// OutputFolder: a folder of files that appears under its name whole, and never at the cost of something else.
//
// The files go into a new folder beside it, OUT.unfinished-PID, which is locked; commit() gives that the name. What a
// process that was killed left of that kind goes, where all in it has names that are written. A folder that is there
// already is replaced only where it is empty, or where that is asked for and every file in it has one of the names that
// are written, and none is a file that is read. Then the two are exchanged, and the old one goes.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "octree/io/file_descriptor.h"
#include "octree/io/result.h"

namespace vcp {

struct FolderRules {
    std::function<bool(std::string_view)> isOurs;  ///< whether such a folder may hold a file of this name
    std::string ofWhat;                            ///< "a published scan": for errors
    bool overwrite = false;
    std::string howToReplace;                        ///< "--overwrite replaces it": for errors
    std::vector<std::filesystem::path> inputs = {};  ///< files that the caller reads
};

/// An output folder while it is written. Without commit() nothing is left and nothing is replaced.
class OutputFolder {
public:
    /// Errors: Usage, with what stands in the way; Io (also where another process is writing it, which is named).
    static Result<OutputFolder> create(const std::filesystem::path& named, const FolderRules& rules);
    ~OutputFolder();
    OutputFolder(OutputFolder&& other) noexcept;
    OutputFolder& operator=(OutputFolder&&) = delete;

    /// The folder that files are written to.
    [[nodiscard]] const std::filesystem::path& unfinished() const { return unfinished_; }
    /// The name that it will have.
    [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
    /// Checks once more what is there now, and renames durably. Errors: as create.
    Result<void> commit();

private:
    OutputFolder(std::filesystem::path folder, FolderRules rules)
        : folder_(std::move(folder)), rules_(std::move(rules)) {}

    std::filesystem::path folder_, unfinished_;
    FileDescriptor lock_;  ///< of the unfinished folder
    FolderRules rules_;
};

}  // namespace vcp
