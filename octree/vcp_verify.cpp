#include "octree/vcp_verify.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "octree/image/image_tables.h"
#include "octree/page_reader.h"

namespace vcp {

namespace {

class FileVerification {
public:
    FileVerification(const ByteReader& reader, const Dataset& dataset)
        : reader_(reader), d_(dataset), end_(blockOffset(dataset.pages.blocks())) {}

    /// Checks what the header says of all pages together.
    [[nodiscard]] Result<void> sums() const {
        const FileHeader& h = d_.header;
        for (uint32_t l = 0; l < h.levels; ++l) {
            double error = 0;
            for (const uint64_t page : EntryRange(h.level[l].firstEntry, h.level[l].pages))
                error = std::max(error, double(d_.pages[page].certifiedError));
            if (error != h.level[l].certifiedError)
                return broken("header",
                              offsetof(FileHeader, level) + l * sizeof(LevelRow) + offsetof(LevelRow, certifiedError),
                              fmt::format("certified error of level {} is {:g}, of its pages {:g}", l,
                                          h.level[l].certifiedError, error));
        }
        FinestFigures finest;
        for (uint64_t page = 0; page < d_.pages.size(); ++page) finest.add(d_.pages[page]);
        if (finest.certifiedError != h.certifiedErrorMax)
            return broken("header", offsetof(FileHeader, certifiedErrorMax),
                          fmt::format("certified error is {:g}, of the pages without children {:g}",
                                      h.certifiedErrorMax, finest.certifiedError));
        if (finest.leaves != h.leaves)
            return broken("header", offsetof(FileHeader, leaves),
                          fmt::format("{} leaves, but the pages without children have {}", h.leaves, finest.leaves));
        if (finest.hardLeaves != h.hardLeaves)
            return broken(
                "header", offsetof(FileHeader, hardLeaves),
                fmt::format("{} hard leaves, but the pages without children have {}", h.hardLeaves, finest.hardLeaves));
        return bounds();
    }

    [[nodiscard]] Result<void> page(uint64_t index) {
        const PageEntry& e = d_.pages[index];
        VCP_TRY(gap(e.offset));
        if (auto page = readPage(reader_, d_, index, true); !page) return page.error();
        end_ = e.offset + e.storedBytes;
        if (e.colourBytes == 0) return {};
        VCP_TRY(gap(e.colourOffset));
        end_ = e.colourOffset + e.colourStoredBytes;
        return {};
    }

    /// Checks that the bytes up to `to` are zero.
    [[nodiscard]] Result<void> gap(uint64_t to) const {
        if (to < end_ || to - end_ > kBlockBytes) return broken("padding", end_, "unexpected bytes between pages");
        std::vector<std::byte> bytes(to - end_);
        VCP_TRY(reader_.read(end_, bytes));
        for (size_t i = 0; i < bytes.size(); ++i)
            if (bytes[i] != std::byte{0})
                return broken("padding", end_ + i, "is not zero: the file was changed or damaged");
        return {};
    }

    [[nodiscard]] uint64_t done() const { return end_; }
    /// What lies before `end` was checked elsewhere.
    void skipTo(uint64_t end) { end_ = end; }

private:
    [[nodiscard]] Error broken(std::string element, uint64_t byte, std::string message) const {
        return brokenBytes(reader_.name(), std::move(element), byte, std::move(message));
    }

    /// Checks that the mesh lies in the root page.
    [[nodiscard]] Result<void> bounds() const {
        const FileHeader& h = d_.header;
        const double edge = d_.edgeOf(d_.pages[0]);
        for (int i = 0; i < 3; ++i) {
            // The builder leaves a cell around the mesh; far from the origin a coordinate is rounded by more than that.
            const double slack = h.cell + 1e-12 * std::max(std::abs(h.boundsMin[i]), std::abs(h.boundsMax[i]));
            const uint64_t axis = 8 * uint64_t(i);
            if (h.boundsMin[i] < h.origin[i] - slack)
                return broken("header", offsetof(FileHeader, boundsMin) + axis,
                              "the bounds begin outside the root page");
            if (h.boundsMax[i] > h.origin[i] + edge + slack)
                return broken("header", offsetof(FileHeader, boundsMax) + axis, "the bounds end outside the root page");
        }
        return {};
    }

    const ByteReader& reader_;
    const Dataset& d_;
    uint64_t end_;  ///< end of what was checked
};

}  // namespace

Result<void> verifyFile(const ByteReader& reader, bool (*progress)(void*, uint64_t), void* user) {
    VCP_TRY_ASSIGN(const auto dataset, readDataset(reader));
    FileVerification verification(reader, dataset);
    VCP_TRY(verification.sums());
    for (uint64_t i = 0; i < dataset.pages.size(); ++i) {
        VCP_TRY(verification.page(i));
        if (progress != nullptr && !progress(user, verification.done())) return Error::cancelled(reader.name());
    }
    if (dataset.hasImages()) {
        const ImagesPlace& place = dataset.header.images;
        VCP_TRY(verification.gap(place.offset));
        VCP_TRY(
            verifyImages(reader, place, [&](uint64_t done) { return progress == nullptr || progress(user, done); }));
        verification.skipTo(place.offset + place.bytes);
    }
    return verification.gap(reader.size() - sizeof(CommitRecord));
}

}  // namespace vcp
