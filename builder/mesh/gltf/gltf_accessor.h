// The buffers of a glTF file, and the values of its accessors read one after another through a bounded window.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "builder/mesh/gltf/gltf_document.h"
#include "builder/stream/random_bytes.h"
#include "builder/stream/side_file.h"

namespace vcp {

/// Buffers are opened when they are first used, and stay open. So are views that meshopt compressed: each is decoded as
/// a whole when it is first used, and kept in one Spool for all.
class GltfBuffers {
public:
    /// Where decoded views are put, and how much memory decoding one may take.
    struct Room {
        std::filesystem::path tempFolder;  ///< empty: the system's
        uint64_t decoderBytes = uint64_t{1} << 30;
        bool allowOutside = false;  ///< as in MeshOpenOptions
    };

    /// `document` must outlive this; the data of its data URIs are moved from it. `folder` holds external buffers
    /// (empty: there is none, as for standard input); `binary` is the second chunk of a GLB, or null.
    GltfBuffers(GltfDocument& document, std::string file, std::filesystem::path folder,
                std::unique_ptr<RandomBytes> binary, Room room);

    /// Reads bytes of a view; precondition: they lie in it. `element` is for errors: InvalidInput (a buffer names no
    /// file below the folder, or is shorter than declared; meshopt data are damaged), Limit (their memory), Io, each
    /// with the buffer's file.
    Result<void> read(uint32_t view, uint64_t offset, char* to, size_t count, const std::string& element);

    /// The glTF file's side files; those of buffers are added as they are opened.
    std::vector<SideFile> sideFiles;

private:
    Result<RandomBytes*> open(uint32_t buffer);
    Result<uint64_t> placeOfDecoded(uint32_t view);

    GltfDocument& document_;
    std::string file_;
    std::filesystem::path folder_;
    Room room_;
    std::vector<std::unique_ptr<RandomBytes>> open_;
    Spool decoded_;
    std::vector<std::optional<uint64_t>> places_;  // for each view, its place in it
};

class GltfAccessorReader {
public:
    /// Both must outlive this.
    GltfAccessorReader(const GltfDocument& document, GltfBuffers& buffers, uint32_t accessor);

    [[nodiscard]] uint64_t left() const { return accessor_.count - next_; }
    [[nodiscard]] uint32_t components() const { return accessor_.components; }

    /// Continues at a later element; precondition: `count` <= left().
    void skip(uint64_t count) { next_ += count; }

    /// Replaces `out` by the next values, component by component: at most `most` elements, at least one unless none
    /// are left. Integers are exact; normalized ones are scaled to 0..1 or -1..1. Errors: as GltfBuffers::read();
    /// InvalidInput where sparse indices are not in order.
    Result<void> read(size_t most, std::vector<double>& out);

private:
    Result<void> readDense(size_t count, std::vector<double>& out);
    Result<void> applySparse(size_t count, std::vector<double>& out);
    Result<void> nextSparseIndex();
    void decode(const char* bytes, uint64_t stride, size_t count, double* out) const;
    [[nodiscard]] Error sparseError(const std::string& message) const;

    const GltfDocument& document_;
    GltfBuffers& buffers_;
    GltfAccessor accessor_;
    std::string element_;
    std::vector<char> bytes_;
    uint64_t next_ = 0;

    std::vector<uint64_t> sparseIndices_;  // indices that were read ahead
    size_t sparseUsed_ = 0;                // how many of them are used
    uint64_t sparseRead_ = 0;              // sparse indices read in all
    std::optional<uint64_t> lastSparse_;
};

}  // namespace vcp
