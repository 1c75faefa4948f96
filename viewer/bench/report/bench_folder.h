// Where a benchmark keeps what it builds: in a folder of its own, so that no file of the same name is replaced.
#pragma once

#include <filesystem>

#include <fmt/format.h>
#include <unistd.h>

#include "octree/io/result.h"

namespace vcp {

/// A folder for what is built: `built` in the caller's, or, where that is empty, one removed with this object.
class BenchFolder {
public:
    explicit BenchFolder(const std::filesystem::path& wanted)
        : path_(wanted.empty() ? std::filesystem::temp_directory_path() / fmt::format("vcp-bench-{}", ::getpid())
                               : wanted / "built"),
          temporary_(wanted.empty()) {}
    ~BenchFolder() {
        std::error_code ignored;
        if (temporary_) std::filesystem::remove_all(path_, ignored);
    }
    BenchFolder(const BenchFolder&) = delete;
    BenchFolder& operator=(const BenchFolder&) = delete;

    /// Makes the folder. Errors: Io.
    [[nodiscard]] Result<void> make() const {
        std::error_code failed;
        std::filesystem::create_directories(path_, failed);
        if (failed)
            return Error{.code = ErrorCode::Io,
                         .message = "the folder cannot be made: " + failed.message(),
                         .file = path_.string()};
        return {};
    }
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
    bool temporary_;
};

}  // namespace vcp
