// Opens what must be a regular file: a pipe could block for ever, and a device might do anything.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>

#include "octree/io/file_descriptor.h"
#include "octree/io/result.h"

namespace vcp {

/// Opens a regular file for reading without waiting; returns its descriptor. Errors: Io, also
/// where it is a folder, a pipe, a socket or a device.
Result<FileDescriptor> openRegular(const std::filesystem::path& path);

struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
};

/// Opens a regular file in the same way, as a stream of bytes.
Result<std::unique_ptr<std::FILE, FileCloser>> openRegularStream(const std::filesystem::path& path);

}  // namespace vcp
