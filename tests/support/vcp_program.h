// The program vcp, started and waited for, with what it said.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <sys/types.h>

#include "tests/support/test_folder.h"

namespace vcp {

struct Ran {
    int status = -1;  ///< 1000 + the signal that ended it
    std::string out, err;

    [[nodiscard]] size_t errLines() const { return size_t(std::count(err.begin(), err.end(), '\n')); }
};

/// Its output goes to the files "stdout" and "stderr" of `folder`, its cache to "cache"; it finds no display. One at a
/// time.
class VcpProgram {
public:
    explicit VcpProgram(const TestFolder& folder) : folder_(folder) {}

    /// `out`: another file, or a path. `smallFiles`: writes beyond 8 KiB of a file fail, as on a full disk.
    [[nodiscard]] pid_t start(const std::vector<std::string>& arguments, const std::string& out = "stdout",
                              bool smallFiles = false) const;
    [[nodiscard]] Ran wait(pid_t child) const;
    [[nodiscard]] Ran run(const std::vector<std::string>& arguments) const { return wait(start(arguments)); }
    /// Words with spaces between.
    [[nodiscard]] Ran runWords(const std::string& words) const;

private:
    const TestFolder& folder_;
};

}  // namespace vcp
