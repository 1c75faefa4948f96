// Files that an interruption leaves whole or absent: all bytes are written, names are made durable, and a name is
// held by one process at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "octree/io/result.h"

namespace vcp {

/// What to do about a full disk, where the caller knows nothing better.
inline constexpr const char* kWhenFull = "free some space or choose another folder";

/// Returns an Io error of `file` that says `what`, then the system's words for `code` (an errno), then `whenFull` where
/// the disk or the quota is full.
Error systemError(const std::filesystem::path& file, const char* what, int code, const char* whenFull = kWhenFull);

/// Writes all of `bytes` at `offset` of a descriptor, however often it is interrupted. Errors: Io, naming `file`.
Result<void> writeAll(int descriptor, uint64_t offset, std::span<const std::byte> bytes,
                      const std::filesystem::path& file, const char* whenFull = kWhenFull);

/// Writes all of `bytes` where the descriptor stands: for a file opened with O_APPEND, or a pipe.
Result<void> appendAll(int descriptor, std::span<const std::byte> bytes, const std::filesystem::path& file,
                       const char* whenFull = kWhenFull);

/// Makes durable what was created, renamed or removed in a folder; an empty path is the current one. On file systems
/// that cannot, nothing is done. Errors: Io, naming `folder`.
Result<void> syncFolder(const std::filesystem::path& folder);

enum class NameLock {
    Taken,  ///< held until the descriptor is closed; or the file system has no locks
    Held,   ///< another descriptor holds it, of this process or another
    Gone,   ///< the one who held it has removed or renamed it: `path` must be opened again
};

/// Locks what `descriptor` has open, a file or a folder, if it is still what `path` names.
NameLock lockName(int descriptor, const std::filesystem::path& path);

}  // namespace vcp
