// Opening what must be a file: a pipe would be waited for, perhaps for ever, and a device might do anything.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>

#include "octree/result.h"

namespace vcp {

/// Opens a regular file for reading, at once; its descriptor, which the caller closes. Errors: Io, also of a folder, a
/// pipe, a socket and a device.
Result<int> openRegular(const std::filesystem::path& path);

struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
};

/// The same as a stream of bytes.
Result<std::unique_ptr<std::FILE, FileCloser>> openRegularStream(const std::filesystem::path& path);

}  // namespace vcp
