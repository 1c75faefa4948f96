// Levels of images as their pieces come.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "octree/image/image_pieces.h"
#include "octree/image/image_set.h"

namespace vcp {

/// One thread.
class ImageAssembly {
public:
    explicit ImageAssembly(std::shared_ptr<const ImagePieces> pieces)
        : pieces_(std::move(pieces)), set_(pieces_->tables()) {}

    [[nodiscard]] const ImagePieces& pieces() const { return *pieces_; }
    /// The levels that are whole, as are all coarser ones of their images.
    [[nodiscard]] const ImageSet& set() const { return set_; }
    /// Whether a piece was taken in and is still there.
    [[nodiscard]] bool has(uint64_t piece) const;
    /// Takes in a piece as ImagePieces::readPiece gives it; nothing where it is there.
    void take(uint64_t piece, std::span<const uint32_t> texels);
    /// Forgets the levels of an image that are finer than `finest`.
    void drop(uint32_t image, uint32_t finest);

private:
    /// A level of which not all pieces have come, or a coarser one is missing.
    struct Begun {
        std::shared_ptr<uint32_t[]> texels;
        std::vector<bool> has;  // its pieces
        uint64_t missing = 0;
    };
    void copyTile(const ImageLevel& level, uint64_t tile, std::span<const uint32_t>& texels, uint32_t* to) const;
    void takeFirst(const ImagePiece& piece, std::span<const uint32_t> texels);
    void addWhole(uint32_t image);

    std::shared_ptr<const ImagePieces> pieces_;
    ImageSet set_;
    std::map<std::pair<uint32_t, uint32_t>, Begun> begun_;  // by image and level
};

}  // namespace vcp
