// A file that a mesh names and that lies beside it: an MTL, an image, a buffer of a glTF. What was built from it is no
// longer up to date once its stamp differs.
#pragma once

#include <filesystem>
#include <string>

namespace vcp {

/// Size and times of a file's last change, of its content and of what the system notes of it (a copy may set the former
/// back), in nanoseconds; "absent" where it cannot be found.
std::string fileStamp(const std::filesystem::path& path);

struct SideFile {
    explicit SideFile(std::filesystem::path file) : path(std::move(file)), stamp(fileStamp(path)) {}

    std::filesystem::path path;
    std::string stamp;  ///< from before it was read; it may have been looked for in vain
};

}  // namespace vcp
