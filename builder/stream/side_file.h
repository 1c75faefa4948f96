// A file that a mesh names and that lies beside it: an MTL, an image, a buffer of a glTF. Once its stamp differs, what
// was built from it is out of date.
#pragma once

#include <filesystem>
#include <string>

namespace vcp {

/// Returns a file's size and the times of its last change, of its content and of what the system notes of it (a copy
/// may set the former back), in nanoseconds; "absent" where it cannot be found.
std::string fileStamp(const std::filesystem::path& path);

struct SideFile {
    explicit SideFile(std::filesystem::path file) : path(std::move(file)), stamp(fileStamp(path)) {}
    SideFile(std::filesystem::path file, std::string noted) : path(std::move(file)), stamp(std::move(noted)) {}

    std::filesystem::path path;
    std::string stamp;  ///< stamp from before it was read; the file may not have been found
};

}  // namespace vcp
