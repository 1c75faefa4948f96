// OutputClaim: what long work holds its output's name by, from its beginning, so that a second one learns at once that
// it is not alone, and of whom.
//
// OUT.lock stands beside the output as long as the claim does, is locked (lockName), and says which process made it. A
// process that was killed leaves the file, but not the lock: the next one takes both. What else has that name is not
// touched, and then nothing is claimed; nor is it on file systems without locks, where output_file.h still keeps files
// whole.
#pragma once

#include <filesystem>

#include "octree/io/file_descriptor.h"
#include "octree/io/result.h"

namespace vcp {

class OutputClaim {
public:
    /// Claims nothing.
    OutputClaim() = default;
    /// Claims a file, through links, until this is destroyed. What cannot be a new or replaced file is not claimed.
    /// Errors: Io (another process has claimed it, or another thread: it is named; the disk is full or fails).
    static Result<OutputClaim> take(const std::filesystem::path& output);
    ~OutputClaim();
    OutputClaim(OutputClaim&& other) noexcept;
    OutputClaim& operator=(OutputClaim&& other) noexcept;

private:
    std::filesystem::path name_;  ///< of the file; empty: nothing is claimed
    FileDescriptor file_;
};

}  // namespace vcp
