#include "builder/slab/surface_below.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <span>

#include "builder/spill/record_coder.h"

namespace vcp {

PageFold::PageFold(uint32_t log2Cells, size_t halves, size_t slabCount) : log2Cells_(log2Cells) {
    quarters.codes.reserve(halves);
    quarters.cells.reserve(halves);
    slabs.reserve(slabCount);
}

void PageFold::add(const SurfaceBelow& below, uint32_t octant) {
    const uint32_t first = octant << 3 * (log2Cells_ + 1);
    for (const uint32_t code : below.halves.codes) quarters.codes.push_back(first | code);
    quarters.cells.insert(quarters.cells.end(), below.halves.cells.begin(), below.halves.cells.end());
    for (const CellSlab& slab : below.slabs) {
        slabs.push_back(slab);
        slabs.back().at |= first;
    }
}

namespace {

/// So many records are coded at a time.
constexpr size_t kBlockRecords = 4096;

/// A cell on temporary files: all of CellSurface but the axis.
struct StoredCell {
    uint32_t code = 0;
    glm::vec3 lower{0}, upper{0};
    float first = 0, last = 0, area = 0;
    std::array<float, 6> moment{};
    glm::vec4 light{0};
    uint32_t parts = 0;
};
static_assert(sizeof(StoredCell) == 84 && sizeof(CellSurface) == sizeof(StoredCell) - sizeof(uint32_t) + 12);

StoredCell storedCell(uint32_t code, const CellSurface& c) {
    return {code, c.lower, c.upper, c.first, c.last, c.area, c.moment, c.light, c.parts};
}

/// Appends `count` records, `recordAt(i)` each, in blocks.
template <class Record, class RecordAt>
void storeRecords(size_t count, const RecordAt& recordAt, bool isCoded, std::vector<std::byte>& stored) {
    std::vector<Record> block;
    for (size_t first = 0; first < count; first += block.size()) {
        block.resize(std::min(kBlockRecords, count - first));
        for (size_t i = 0; i < block.size(); ++i) block[i] = recordAt(first + i);
        const auto bytes = std::as_bytes(std::span(block));
        const size_t at = stored.size(), begin = at + sizeof(uint32_t);
        stored.resize(begin);
        if (!isCoded || !codeRecords(bytes, sizeof(Record), stored))
            stored.insert(stored.end(), bytes.begin(), bytes.end());
        const auto blockBytes = uint32_t(stored.size() - begin);
        std::memcpy(stored.data() + at, &blockBytes, sizeof blockBytes);
    }
}

/// Takes the first block off `stored`, to `records`. Returns false where it is not what was stored.
template <class Record>
bool takeBlock(std::span<const std::byte>& stored, std::span<Record> records) {
    uint32_t blockBytes = 0;
    if (stored.size() < sizeof blockBytes) return false;
    std::memcpy(&blockBytes, stored.data(), sizeof blockBytes);
    stored = stored.subspan(sizeof blockBytes);
    if (stored.size() < blockBytes) return false;
    const std::span<const std::byte> block = stored.first(blockBytes);
    stored = stored.subspan(blockBytes);
    const auto bytes = std::as_writable_bytes(records);
    if (block.size() != bytes.size()) return decodeRecords(block, sizeof(Record), bytes);
    std::ranges::copy(block, bytes.begin());
    return true;
}

/// Calls take(record) for `count` records. Returns false where they are not what was stored.
template <class Record, class Take>
bool takeRecords(std::span<const std::byte> stored, size_t count, const Take& take) {
    std::vector<Record> block;
    for (size_t taken = 0; taken < count; taken += block.size()) {
        block.resize(std::min(kBlockRecords, count - taken));
        if (!takeBlock(stored, std::span(block))) return false;
        for (const Record& record : block) take(record);
    }
    return stored.empty();
}

}  // namespace

size_t storedCells(uint64_t geometryBytes) { return geometryBytes / sizeof(StoredCell); }

StoredPage storedSurface(const SurfaceBelow& surface, bool isCoded) {
    const SurfaceCells& halves = surface.halves;
    StoredPage stored;
    stored.geometryBytes = uint32_t(halves.size() * sizeof(StoredCell));
    stored.colourBytes = uint32_t(surface.slabs.size() * sizeof(CellSlab));
    storeRecords<StoredCell>(
        halves.size(), [&](size_t i) { return storedCell(halves.codes[i], halves.cells[i]); }, isCoded,
        stored.geometry);
    storeRecords<CellSlab>(
        surface.slabs.size(), [&](size_t i) { return surface.slabs[i]; }, isCoded, stored.colour);
    return stored;
}

std::optional<SurfaceBelow> surfaceFrom(const StoredPage& stored) {
    const size_t count = storedCells(stored.geometryBytes);
    SurfaceBelow surface;
    surface.halves.codes.reserve(count);
    surface.halves.cells.reserve(count);
    surface.slabs.reserve(storedSlabs(stored.colourBytes));
    const auto takeCell = [&](const StoredCell& s) {
        surface.halves.codes.push_back(s.code);
        surface.halves.cells.push_back({.lower = s.lower,
                                        .upper = s.upper,
                                        .first = s.first,
                                        .last = s.last,
                                        .area = s.area,
                                        .moment = s.moment,
                                        .light = s.light,
                                        .parts = s.parts});
        chooseAxis(surface.halves.cells.back());
    };
    const auto takeSlab = [&](const CellSlab& slab) { surface.slabs.push_back(slab); };
    if (!takeRecords<StoredCell>(stored.geometry, count, takeCell)) return std::nullopt;
    if (!takeRecords<CellSlab>(stored.colour, storedSlabs(stored.colourBytes), takeSlab)) return std::nullopt;
    return surface;
}

}  // namespace vcp
