// The images of a file as their pieces come and go.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "octree/image/image_pieces.h"
#include "octree/image/image_set.h"

namespace vcp {

/// One thread.
class ImageAssembly {
public:
    explicit ImageAssembly(std::shared_ptr<const ImagePieces> pieces)
        : pieces_(std::move(pieces)), set_(pieces_->tables()), has_(pieces_->count()) {}

    [[nodiscard]] const ImagePieces& pieces() const { return *pieces_; }
    /// What came and was not dropped.
    [[nodiscard]] const ImageSet& set() const { return set_; }
    /// Whether a piece was taken in and is still there.
    [[nodiscard]] bool has(uint64_t piece) const { return has_[piece]; }
    /// Takes in a piece as ImagePieces::readPiece gives it; nothing where it is there.
    void take(uint64_t piece, std::span<const uint32_t> texels);
    /// Forgets a piece; nothing where it is not there.
    void drop(uint64_t piece);

private:
    std::shared_ptr<const ImagePieces> pieces_;
    ImageSet set_;
    std::vector<bool> has_;
};

/// Reads all pieces of a file. Errors: those of ImagePieces.
Result<ImageSet> readAllImages(const ByteReader& reader, std::shared_ptr<const ImagePieces> pieces);
/// The same, and its tables before. Precondition: the place was checked.
Result<ImageSet> readAllImages(const ByteReader& reader, const ImagesPlace& place);

}  // namespace vcp
