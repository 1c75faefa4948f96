#include "builder/stream/side_file.h"

#include <fmt/format.h>
#include <sys/stat.h>

namespace vcp {

std::string fileStamp(const std::filesystem::path& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) return "absent";
    const auto &content = status.st_mtim, &change = status.st_ctim;
    return fmt::format("{} {}.{:09} {}.{:09}", status.st_size, content.tv_sec, content.tv_nsec, change.tv_sec,
                       change.tv_nsec);
}

}  // namespace vcp
