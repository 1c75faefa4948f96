// What can be read of a dataset: a page, a block of its directory, or a piece of its images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

namespace vcp {

/// A block of the directory (octree/vcp_file.h) takes no bytes when it has been read, but its entries are known then.
struct Request {
    enum class Kind : uint8_t { Page, DirectoryBlock, ImagePiece };

    Kind kind = Kind::Page;
    uint64_t number =
        0;  ///< of the page or of the block in the directory, or of the piece (octree/image/image_pieces.h)

    Request() = default;
    /// A number alone is a page's.
    Request(uint64_t page) : number(page) {}
    static Request directoryBlock(uint64_t block) { return {Kind::DirectoryBlock, block}; }
    static Request imagePiece(uint64_t piece) { return {Kind::ImagePiece, piece}; }

    [[nodiscard]] bool isPage() const { return kind == Kind::Page; }
    /// What comes so many later.
    [[nodiscard]] Request after(uint64_t count) const {
        Request later = *this;
        later.number += count;
        return later;
    }
    bool operator==(const Request&) const = default;

private:
    Request(Kind what, uint64_t which) : kind(what), number(which) {}
};

struct RequestHash {
    size_t operator()(const Request& request) const {
        return std::hash<uint64_t>()(3 * request.number + uint64_t(request.kind));
    }
};

/// A request, and how urgent it is.
struct Wish {
    Request request;
    double priority = 0;  ///< larger first; of equals the order of the list

    bool operator==(const Wish&) const = default;
};

}  // namespace vcp
