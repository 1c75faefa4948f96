// Where the bytes of a file come from.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "octree/io/result.h"

namespace vcp {

/// Where the bytes of a file come from: bounded reads at an offset. Implemented by streaming/ (file, HTTP,
/// faulty) and by tests. Any thread may call read.
class ByteReader {
public:
    virtual ~ByteReader() = default;
    virtual Result<void> read(uint64_t offset, std::span<std::byte> bytes) const = 0;
    [[nodiscard]] virtual uint64_t size() const = 0;
    [[nodiscard]] virtual const std::string& name() const = 0;
    /// Ends reads that are under way soon, with Cancelled, where they could take long. Later reads work.
    virtual void interrupt() const {}
    /// Reports that what read() gave for these bytes proved wrong: a copy of them is not used again.
    virtual void distrust(uint64_t offset, uint64_t bytes) const {
        static_cast<void>(offset), static_cast<void>(bytes);
    }
};

/// Opens a local file for bounded reads (pread); a pipe or device in its place is not waited for. Errors: Io.
Result<std::shared_ptr<ByteReader>> openFile(const std::filesystem::path& path);

/// What stands at `byte` of the file named `file` is wrong.
Error brokenBytes(const std::string& file, std::string element, uint64_t byte, std::string message);

/// Reads `bytes` in pieces, the first of at most kFirstPiece, each as large as all before it, so that a claim takes no
/// more memory than a few times what came. take(piece) -> Result<void>.
inline constexpr uint64_t kFirstPiece = 1 << 20;
inline constexpr uint64_t kLargestPiece = 16 << 20;
template <class Take>
Result<void> readInPieces(const ByteReader& reader, uint64_t offset, uint64_t bytes, Take&& take) {
    std::vector<std::byte> piece;
    for (uint64_t done = 0; done < bytes; done += piece.size()) {
        piece.resize(std::min({std::max(done, kFirstPiece), kLargestPiece, bytes - done}));
        VCP_TRY(reader.read(offset + done, piece));
        VCP_TRY(take(std::span<const std::byte>(piece)));
    }
    return {};
}

}  // namespace vcp
