// Where pages come from: a file, a server, a test.
#pragma once

#include <cstdint>
#include <memory>

#include "octree/vcp_file.h"

namespace vcp {

/// Delivers checked pages. Any thread may call, several at once.
class PageSource {
public:
    virtual ~PageSource() = default;
    /// Bytes of page `page` of the directory, verified, decompressed and parsed without complaint (readPage).
    /// Colour is empty where the dataset has none or it is not asked for.
    virtual Result<PageBytes> read(uint64_t page, bool withColour) const = 0;
};

/// Pages of a .vcp file behind any ByteReader (openFile for a local one).
class FilePageSource final : public PageSource {
public:
    FilePageSource(std::shared_ptr<const ByteReader> reader, std::shared_ptr<const Dataset> dataset)
        : reader_(std::move(reader)), dataset_(std::move(dataset)) {}

    Result<PageBytes> read(uint64_t page, bool withColour) const override {
        return readPage(*reader_, *dataset_, page, withColour);
    }

private:
    std::shared_ptr<const ByteReader> reader_;
    std::shared_ptr<const Dataset> dataset_;
};

}  // namespace vcp
