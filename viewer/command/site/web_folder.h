// A folder that any static web server can show: the viewer for browsers, a page, and a scan.
#pragma once

#include <cstdint>
#include <filesystem>

#include "octree/io/result.h"

namespace vcp {

/// The name that the scan has in the folder: that of viewer/web/index.html.
inline constexpr const char* kScanInFolder = "scan.vcp";

/// Returns the folder of the viewer's files: `asked`, or where it is beside this program. Errors: Io, where there is
/// none or a file of it is missing.
Result<std::filesystem::path> findWebViewer(const std::filesystem::path& asked);

/// Makes `folder` of the viewer's files and the scan, which must be intact. It is there as a whole or not at all. With
/// `overwrite` it may replace a folder that holds nothing but what this wrote; its index.html is kept. Returns the
/// bytes in the folder. Errors: Io; Usage, where the folder may not be replaced.
Result<uint64_t> writeWebFolder(const std::filesystem::path& viewer, const std::filesystem::path& scan,
                                const std::filesystem::path& folder, bool overwrite);

}  // namespace vcp
