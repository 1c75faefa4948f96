#include "builder/slab/page_surface.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include <glm/common.hpp>

#include "builder/slab/triangle_cutter.h"
#include "builder/spill/record_coder.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

void reserve(SurfaceCells& cells, size_t count) {
    cells.codes.reserve(count);
    cells.cells.reserve(count);
}

size_t coarserCells(const SurfaceCells& eighths) {
    size_t count = 0;
    for (size_t i = 0; i < eighths.size(); ++i) count += i == 0 || eighths.codes[i] >> 3 != eighths.codes[i - 1] >> 3;
    return count;
}

}  // namespace

SurfaceCells foldCells(const SurfaceCells& eighths) {
    SurfaceCells folded;
    reserve(folded, coarserCells(eighths));
    std::vector<uint32_t> octants;
    for (size_t i = 0; i < eighths.size();) {
        const uint32_t code = eighths.codes[i] >> 3;
        octants.clear();
        size_t end = i;
        for (; end < eighths.size() && eighths.codes[end] >> 3 == code; ++end)
            octants.push_back(eighths.codes[end] & 7u);
        folded.codes.push_back(code);
        folded.cells.push_back(foldEighths(std::span(eighths.cells).subspan(i, end - i), octants));
        i = end;
    }
    return folded;
}

namespace {

/// Cuts triangles, box by box where they make too many pieces at once.
class SurfaceCutter {
public:
    SurfaceCutter(const LatticeMesh& mesh, glm::i32vec3 origin, int depth, size_t mostPieces)
        : mesh_(mesh), origin_(origin), depth_(depth), mostPieces_(mostPieces) {}

    /// Appends the cells of a box, in Morton order.
    void run(std::span<const uint32_t> triangles, CutterBox box, SurfaceCells& cells) const {
        if (cutAll(triangles, box, cells)) return;
        for (int octant = 0; octant < 8; ++octant) run(triangles, box.child(octant), cells);
    }

private:
    /// Returns false, and appends nothing, where there are too many pieces.
    bool cutAll(std::span<const uint32_t> triangles, CutterBox box, SurfaceCells& cells) const {
        TriangleCutter cutter(mesh_, origin_, depth_, box);
        for (const uint32_t k : triangles) {
            cutter.cut(k);
            if (cutter.pieces() > mostPieces_ && box.log2Edge > 0) return false;
        }
        cutter.appendTo(cells);
        return true;
    }

    const LatticeMesh& mesh_;
    glm::i32vec3 origin_;
    int depth_;
    size_t mostPieces_;
};

}  // namespace

SurfaceCells surfaceOf(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                       uint32_t log2Cells, size_t mostPieces) {
    const glm::i32vec3 origin = glm::i32vec3(page) * (kLatticePerCell << log2Cells);
    const int depth = int(log2Cells) + 1;
    SurfaceCells halves;
    SurfaceCutter(mesh, origin, depth, mostPieces).run(triangles, {glm::ivec3(0), depth}, halves);
    return halves;
}

uint64_t halvesTouched(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                       uint32_t log2Cells) {
    constexpr int kHalf = kLatticePerCell / 2;
    const glm::i32vec3 origin = glm::i32vec3(page) * (kLatticePerCell << log2Cells);
    const int edge = 2 << log2Cells;
    std::vector<uint64_t> rows(size_t(edge) * size_t(edge));
    for (const uint32_t k : triangles) {
        const auto& [a, b, c] = mesh.triangles[k];
        const glm::i32vec3 p = mesh.positions[a], q = mesh.positions[b], r = mesh.positions[c];
        // Closed boxes touch the half cells on both sides of a wall that they lie in.
        const glm::i32vec3 low = glm::max((glm::min(p, glm::min(q, r)) - origin - 1) / kHalf, 0);
        const glm::i32vec3 high = glm::min((glm::max(p, glm::max(q, r)) - origin) / kHalf, edge - 1);
        if (high.x < low.x) continue;
        const uint64_t row = ~uint64_t{0} >> (63 - (high.x - low.x)) << low.x;
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y) rows[size_t(z * edge + y)] |= row;
    }
    uint64_t halves = 0;
    for (const uint64_t row : rows) halves += uint64_t(std::popcount(row));
    return halves;
}

PageFold::PageFold(uint32_t log2Cells, size_t halves) : log2Cells_(log2Cells) { reserve(above_.quarters, halves); }

void PageFold::add(const SurfaceCells& halves, uint32_t octant) {
    SurfaceCells& quarters = above_.quarters;
    for (const uint32_t code : halves.codes) quarters.codes.push_back(octant << 3 * (log2Cells_ + 1) | code);
    quarters.cells.insert(quarters.cells.end(), halves.cells.begin(), halves.cells.end());
}

PageSurface PageFold::take() {
    above_.halves = foldCells(above_.quarters);
    above_.cells = foldCells(above_.halves);
    return std::move(above_);
}

namespace {

/// So many cells are coded at a time.
constexpr size_t kBlockCells = 4096;

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

}  // namespace

size_t storedCells(uint64_t geometryBytes) { return geometryBytes / sizeof(StoredCell); }

StoredPage storedSurface(const SurfaceCells& cells, bool isCoded) {
    StoredPage stored;
    stored.geometryBytes = uint32_t(cells.size() * sizeof(StoredCell));
    std::vector<StoredCell> block;
    for (size_t first = 0; first < cells.size(); first += block.size()) {
        block.resize(std::min(kBlockCells, cells.size() - first));
        for (size_t i = 0; i < block.size(); ++i) {
            const CellSurface& c = cells.cells[first + i];
            block[i] = {cells.codes[first + i], c.lower, c.upper, c.first, c.last, c.area, c.moment, c.light, c.parts};
        }
        const auto bytes = std::as_bytes(std::span(block));
        const size_t at = stored.geometry.size(), begin = at + sizeof(uint32_t);
        stored.geometry.resize(begin);
        if (!isCoded || !codeRecords(bytes, sizeof(StoredCell), stored.geometry))
            stored.geometry.insert(stored.geometry.end(), bytes.begin(), bytes.end());
        const auto blockBytes = uint32_t(stored.geometry.size() - begin);
        std::memcpy(stored.geometry.data() + at, &blockBytes, sizeof blockBytes);
    }
    return stored;
}

namespace {

/// Takes the first block off `stored`, to `cells`. Returns false where it is not what was stored.
bool takeBlock(std::span<const std::byte>& stored, std::span<StoredCell> cells) {
    uint32_t blockBytes = 0;
    if (stored.size() < sizeof blockBytes) return false;
    std::memcpy(&blockBytes, stored.data(), sizeof blockBytes);
    stored = stored.subspan(sizeof blockBytes);
    if (stored.size() < blockBytes) return false;
    const std::span<const std::byte> block = stored.first(blockBytes);
    stored = stored.subspan(blockBytes);
    const auto bytes = std::as_writable_bytes(cells);
    if (block.size() != bytes.size()) return decodeRecords(block, sizeof(StoredCell), bytes);
    std::ranges::copy(block, bytes.begin());
    return true;
}

}  // namespace

std::optional<SurfaceCells> surfaceFrom(const StoredPage& stored) {
    std::span<const std::byte> left = stored.geometry;
    const size_t count = storedCells(stored.geometryBytes);
    SurfaceCells cells;
    reserve(cells, count);
    std::vector<StoredCell> block;
    while (cells.size() < count) {
        block.resize(std::min(kBlockCells, count - cells.size()));
        if (!takeBlock(left, block)) return std::nullopt;
        for (const StoredCell& s : block) {
            cells.codes.push_back(s.code);
            cells.cells.push_back({.lower = s.lower,
                                   .upper = s.upper,
                                   .first = s.first,
                                   .last = s.last,
                                   .area = s.area,
                                   .moment = s.moment,
                                   .light = s.light,
                                   .parts = s.parts});
            chooseAxis(cells.cells.back());
        }
    }
    if (!left.empty()) return std::nullopt;
    return cells;
}

}  // namespace vcp
