#include "viewer/asset/picture_file.h"

#include <algorithm>
#include <cstdio>

#include "octree/io/regular_file.h"

namespace vcp {

Result<std::vector<std::byte>> readPictureFile(const std::filesystem::path& path) {
    VCP_TRY_ASSIGN(const auto file, openRegularStream(path));
    std::vector<std::byte> bytes;
    while (true) {
        const size_t had = bytes.size();
        bytes.resize(std::max<size_t>(2 * had, 1 << 16));
        const size_t got = std::fread(bytes.data() + had, 1, bytes.size() - had, file.get());
        bytes.resize(had + got);
        if (std::ferror(file.get())) return Error{.code = ErrorCode::Io, .message = "cannot be read"};
        if (bytes.size() > kMostPictureBytes)
            return Error{.code = ErrorCode::Limit, .message = "is larger than 512 MiB"};
        if (got == 0) return bytes;
    }
}

}  // namespace vcp
