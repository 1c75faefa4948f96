// Pages and pieces of images as FilePageSource gives them. A piece with JPEGs waits until the browser has decoded these
// (jpeg_tiles.h): until then its read is Cancelled, as that of a page whose bytes have not come.
#pragma once

#include <memory>
#include <string>

#include "streaming/page_source.h"

namespace vcp {

class TileSource final : public PageSource {
public:
    TileSource(std::shared_ptr<const ByteReader> reader, std::shared_ptr<const Dataset> dataset)
        : reader_(reader), file_(std::move(reader), std::move(dataset)) {}

    Result<PageBytes> read(Request request, bool withColour) const override;
    [[nodiscard]] uint64_t bytesToRead(Request request, bool withColour) const override {
        return file_.bytesToRead(request, withColour);
    }
    Result<std::shared_ptr<const ImagePieces>> images() const override { return file_.images(); }
    [[nodiscard]] std::string name() const override { return file_.name(); }

private:
    /// Goes through the JPEGs of a piece. Errors: Cancelled (some are still to be decoded), InvalidInput (one cannot
    /// be), Io.
    Result<void> awaitJpegs(const ImagePieces& images, const ImagePiece& piece) const;

    std::shared_ptr<const ByteReader> reader_;
    FilePageSource file_;
};

}  // namespace vcp
