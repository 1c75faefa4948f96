#include "datasets_scripts/scan_mesh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "datasets_scripts/procedural_noise.h"

namespace vcp::scan {
namespace {

static_assert(std::endian::native == std::endian::little, "the PLY is written in the host's byte order");

// Surface of the statue in square metres, roughly; gives the mean edge of a triangle.
constexpr double kSurface = 13.0;
constexpr double kScannerNoise = 0.00025;
constexpr glm::dvec3 kUtmOrigin(448'262.25, 5'411'932.5, 312.0);

/// Columns [from, to) of a row of quads that a hole leaves out.
struct Gap {
    uint64_t from = 0, to = 0;
};

Gap gapOf(const Hole& hole, uint64_t row, uint64_t columns, uint64_t rows) {
    const double y = (double(row) + 0.5) / double(rows) - hole.v;
    const double inside = 1 - y * y / (hole.radiusV * hole.radiusV);
    if (inside <= 0) return {};
    const double half = hole.radiusU * std::sqrt(inside);
    const auto column = [&](double u) { return uint64_t(std::clamp(u, 0.0, 1.0) * double(columns)); };
    return {column(hole.u - half), column(hole.u + half)};
}

/// Calls visit(row, column) for each quad of a sheet that no hole leaves out.
template <class Visit>
void forEachQuad(const GridPart& grid, Visit&& visit) {
    const uint64_t columns = grid.columns - 1, rows = grid.rows - 1;
    std::vector<Gap> gaps;
    for (uint64_t row = 0; row < rows; ++row) {
        gaps.clear();
        for (const Hole& hole : grid.part.holes) gaps.push_back(gapOf(hole, row, columns, rows));
        for (uint64_t column = 0; column < columns; ++column) {
            const bool open = std::ranges::any_of(gaps, [&](Gap gap) { return column >= gap.from && column < gap.to; });
            if (!open) visit(row, column);
        }
    }
}

uint64_t sheetTriangles(const GridPart& grid) {
    uint64_t quads = (grid.columns - 1) * (grid.rows - 1);
    for (uint64_t row = 0; row + 1 < grid.rows; ++row)
        for (const Hole& hole : grid.part.holes) {
            const Gap gap = gapOf(hole, row, grid.columns - 1, grid.rows - 1);
            quads -= gap.to - gap.from;
        }
    return 2 * quads;
}

/// Makes the largest grid of the part's aspect with at most `budget` triangles.
void fitGrid(GridPart& grid, uint64_t budget) {
    const uint64_t quads = budget / 2;
    if (grid.part.topology == Topology::Strip) {
        grid.columns = budget + 2;
        grid.rows = 1;
        grid.vertices = budget + 2;
        grid.triangles = budget;
        return;
    }
    const bool sheet = grid.part.topology == Topology::Sheet;
    const uint64_t least = grid.part.topology == Topology::Torus ? 6 : 4;
    grid.columns = std::max(least, uint64_t(std::sqrt(double(quads) * grid.part.aspect)));
    grid.rows = std::max<uint64_t>(3, sheet ? quads / (grid.columns - 1) + 1 : quads / grid.columns);
    grid.vertices = grid.columns * grid.rows + (grid.part.topology == Topology::Capped ? 2 : 0);
    grid.triangles = sheet ? sheetTriangles(grid) : 2 * grid.columns * grid.rows;
}

/// Fixed-size records gathered into one buffer.
class Buffer {
public:
    explicit Buffer(const ScanMesh::Write& write) : write_(write) { bytes_.reserve(ScanMesh::kBufferBytes); }

    /// Returns room for `size` bytes, valid until the next call; null after an error.
    std::byte* claim(size_t size) {
        if (bytes_.size() + size > ScanMesh::kBufferBytes) flush();
        if (!result_) return nullptr;
        bytes_.resize(bytes_.size() + size);
        return bytes_.data() + bytes_.size() - size;
    }

    void flush() {
        if (result_ && !bytes_.empty()) result_ = write_(bytes_);
        bytes_.clear();
    }

    [[nodiscard]] const Result<void>& result() const { return result_; }

private:
    const ScanMesh::Write& write_;
    std::vector<std::byte> bytes_;
    Result<void> result_;
};

/// Returns where the scanner saw a vertex.
glm::dvec3 seenAt(const ScanOptions& options, double noise, const SurfacePoint& point, uint64_t number) {
    const uint64_t h = hash(hash(options.seed) ^ number);
    return point.position + noise * glm::dvec3(signedUnit(h), signedUnit(h, 21), signedUnit(h, 42));
}

class VertexWriter {
public:
    VertexWriter(const ScanOptions& options, double noise, Buffer& buffer)
        : options_(options), noise_(noise), buffer_(buffer) {}

    bool put(const SurfacePoint& point, uint64_t number) {
        const glm::dvec3 p = seenAt(options_, noise_, point, number);
        const size_t coordinates = options_.utm ? 24 : 12;
        std::byte* out = buffer_.claim(coordinates + (options_.colour ? 3 : 0));
        if (!out) return false;
        if (options_.utm) {
            const double values[3] = {kUtmOrigin.x + p.x, kUtmOrigin.y - p.z, kUtmOrigin.z + p.y};
            std::memcpy(out, values, sizeof values);
        } else {
            const float values[3] = {float(p.x), float(p.y), float(p.z)};
            std::memcpy(out, values, sizeof values);
        }
        if (options_.colour)
            for (int i = 0; i < 3; ++i)
                out[coordinates + size_t(i)] = std::byte(int(std::clamp(point.colour[i], 0.0, 1.0) * 255.0 + 0.5));
        return true;
    }

private:
    const ScanOptions& options_;
    double noise_;
    Buffer& buffer_;
};

/// Calls put(point, number) for each vertex, until it returns false. Returns whether it never did.
template <class Put>
bool forEachVertex(const GridPart& grid, Put&& putPoint) {
    uint64_t number = grid.firstVertex;
    const auto put = [&](double u, double v) { return putPoint(grid.part.shape(u, v), number++); };
    const auto columns = double(grid.columns), rows = double(grid.rows);
    switch (grid.part.topology) {
        case Topology::Capped:
            if (!put(0, 0)) return false;
            for (uint64_t row = 0; row < grid.rows; ++row)
                for (uint64_t column = 0; column < grid.columns; ++column)
                    if (!put(double(column) / columns, double(row + 1) / (rows + 1))) return false;
            return put(0, 1);
        case Topology::Torus:
            for (uint64_t row = 0; row < grid.rows; ++row)
                for (uint64_t column = 0; column < grid.columns; ++column)
                    if (!put(double(column) / columns, double(row) / rows)) return false;
            return true;
        case Topology::Sheet:
            for (uint64_t row = 0; row < grid.rows; ++row)
                for (uint64_t column = 0; column < grid.columns; ++column)
                    if (!put(double(column) / (columns - 1), double(row) / (rows - 1))) return false;
            return true;
        case Topology::Strip:
            for (uint64_t column = 0; column < grid.columns; ++column)
                if (!put(double(column) / (columns - 1), double(column % 2))) return false;
            return true;
    }
    return true;
}

/// A corner of a triangle: its vertex, numbered in the part, and where it is in the part's square. Where a part closes,
/// its last corners have the vertices of the first.
struct Corner {
    uint64_t vertex;
    double u, v;
};

/// Calls put(a, b, c) for each triangle, until it returns false. Returns whether it never did.
template <class Put>
bool forEachTriangle(const GridPart& grid, Put&& put) {
    bool going = true;
    const auto quad = [&](const Corner& a, const Corner& b, const Corner& c, const Corner& d) {
        going = put(a, b, c) && put(a, c, d);
    };
    const uint64_t columns = grid.columns, rows = grid.rows;
    const auto part = [](uint64_t i, uint64_t count) { return double(i) / double(count); };
    switch (grid.part.topology) {
        case Topology::Capped: {
            const auto at = [&](uint64_t row, uint64_t column) {
                return Corner{1 + row * columns + column % columns, part(column, columns), part(row + 1, rows + 1)};
            };
            const auto pole = [&](uint64_t vertex, uint64_t i, double v) {
                return Corner{vertex, (double(i) + 0.5) / double(columns), v};
            };
            for (uint64_t i = 0; i < columns && going; ++i) going = put(pole(0, i, 0), at(0, i + 1), at(0, i));
            for (uint64_t row = 0; row + 1 < rows; ++row)
                for (uint64_t i = 0; i < columns && going; ++i)
                    quad(at(row, i), at(row, i + 1), at(row + 1, i + 1), at(row + 1, i));
            for (uint64_t i = 0; i < columns && going; ++i)
                going = put(pole(1 + rows * columns, i, 1), at(rows - 1, i), at(rows - 1, i + 1));
            break;
        }
        case Topology::Torus: {
            const auto at = [&](uint64_t row, uint64_t column) {
                return Corner{row % rows * columns + column % columns, part(column, columns), part(row, rows)};
            };
            for (uint64_t row = 0; row < rows; ++row)
                for (uint64_t i = 0; i < columns && going; ++i)
                    quad(at(row, i), at(row, i + 1), at(row + 1, i + 1), at(row + 1, i));
            break;
        }
        case Topology::Sheet: {
            const auto at = [&](uint64_t row, uint64_t column) {
                return Corner{row * columns + column, part(column, columns - 1), part(row, rows - 1)};
            };
            forEachQuad(grid, [&](uint64_t row, uint64_t i) {
                if (going) quad(at(row, i), at(row, i + 1), at(row + 1, i + 1), at(row + 1, i));
            });
            break;
        }
        case Topology::Strip: {
            const auto at = [&](uint64_t i) { return Corner{i, part(i, columns - 1), double(i % 2)}; };
            for (uint64_t i = 0; i < grid.triangles && going; ++i)
                going = put(at(i), at(i + 1 + i % 2), at(i + 2 - i % 2));
            break;
        }
    }
    return going;
}

bool putTriangles(const GridPart& grid, Buffer& buffer) {
    return forEachTriangle(grid, [&](const Corner& a, const Corner& b, const Corner& c) {
        std::byte* out = buffer.claim(13);
        if (!out) return false;
        const uint32_t corners[3] = {uint32_t(grid.firstVertex + a.vertex), uint32_t(grid.firstVertex + b.vertex),
                                     uint32_t(grid.firstVertex + c.vertex)};
        out[0] = std::byte{3};
        std::memcpy(out + 1, corners, sizeof corners);
        return true;
    });
}

/// The square of a part in the picture: parts lie in rows, a hundredth apart.
struct Chart {
    double left, top, edge;

    Chart(size_t number, size_t parts) {
        const auto across = uint64_t(std::ceil(std::sqrt(double(parts))));
        const double cell = 1.0 / double(across);
        edge = 0.98 * cell;
        left = double(number % across) * cell + 0.01 * cell;
        top = double(number / across) * cell + 0.01 * cell;
    }
};

}  // namespace

double ScanMesh::edge() const { return std::sqrt(2 * kSurface / double(options_.triangles)); }

ScanMesh::ScanMesh(const ScanOptions& options) : options_(options) {
    uint64_t triangles = 0;
    double share = 0;
    for (Part& part : statue(options.seed, edge())) {
        GridPart grid;
        grid.part = std::move(part);
        // What earlier parts left over goes to the next part; the strip, which is last, takes the exact rest.
        share += grid.part.weight;
        const bool last = grid.part.topology == Topology::Strip;
        const auto wanted = last ? options.triangles : uint64_t(share * double(options.triangles));
        fitGrid(grid, wanted > triangles ? wanted - triangles : 0);
        grid.firstVertex = vertices_;
        grid.firstTriangle = triangles;
        vertices_ += grid.vertices;
        triangles += grid.triangles;
        parts_.push_back(std::move(grid));
    }
}

std::string ScanMesh::header() const {
    const std::string real = options_.utm ? "double" : "float";
    std::string text =
        "ply\nformat binary_little_endian 1.0\ncomment procedural statue, seed " + std::to_string(options_.seed) + "\n";
    text += "element vertex " + std::to_string(vertices_) + "\n";
    for (const char axis : {'x', 'y', 'z'}) text += "property " + real + " " + axis + "\n";
    if (options_.colour) text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    text += "element face " + std::to_string(options_.triangles) +
            "\nproperty list uchar uint vertex_indices\nend_header\n";
    return text;
}

uint64_t ScanMesh::fileBytes() const {
    return header().size() + vertices_ * ((options_.utm ? 24u : 12u) + (options_.colour ? 3u : 0u)) +
           options_.triangles * 13;
}

Result<void> ScanMesh::writePly(const Write& write) const {
    const std::string text = header();
    VCP_TRY(write(std::as_bytes(std::span(text))));
    Buffer buffer(write);
    VertexWriter vertices(options_, std::min(kScannerNoise, 0.12 * edge()), buffer);
    for (const GridPart& grid : parts_)
        if (!forEachVertex(grid, [&](const SurfacePoint& p, uint64_t i) { return vertices.put(p, i); }))
            return buffer.result();
    for (const GridPart& grid : parts_)
        if (!putTriangles(grid, buffer)) return buffer.result();
    buffer.flush();
    return buffer.result();
}

Result<void> ScanMesh::writeObj(const Write& write, const std::string& materials) const {
    Buffer buffer(write);
    char line[256];
    const auto put = [&](int size) {
        std::byte* out = buffer.claim(size_t(size));
        if (out) std::memcpy(out, line, size_t(size));
        return out != nullptr;
    };
    put(std::snprintf(line, sizeof line, "# procedural statue, seed %llu\nmtllib %.200s\nusemtl scan\n",
                      static_cast<unsigned long long>(options_.seed), materials.c_str()));
    const double noise = std::min(kScannerNoise, 0.12 * edge());
    const auto putVertex = [&](const SurfacePoint& point, uint64_t number) {
        const glm::dvec3 p = seenAt(options_, noise, point, number);
        return put(std::snprintf(line, sizeof line, "v %.6f %.6f %.6f\n", p.x, p.y, p.z));
    };
    for (const GridPart& grid : parts_)
        if (!forEachVertex(grid, putVertex)) return buffer.result();
    uint64_t places = 0;
    for (size_t i = 0; i < parts_.size(); ++i) {
        const Chart chart(i, parts_.size());
        const auto putPlace = [&](const Corner& corner) {
            // A picture's rows come from the top, and coordinates count from below; seen from outside, u runs to the
            // left.
            return put(std::snprintf(line, sizeof line, "vt %.8f %.8f\n", chart.left + chart.edge * (1 - corner.u),
                                     1 - (chart.top + chart.edge * corner.v)));
        };
        const auto putTriangle = [&](const Corner& a, const Corner& b, const Corner& c) {
            const auto number = [&](const Corner& corner) {
                return static_cast<unsigned long long>(parts_[i].firstVertex + corner.vertex + 1);
            };
            const auto place = static_cast<unsigned long long>(places);
            places += 3;
            return putPlace(a) && putPlace(b) && putPlace(c) &&
                   put(std::snprintf(line, sizeof line, "f %llu/%llu %llu/%llu %llu/%llu\n", number(a), place + 1,
                                     number(b), place + 2, number(c), place + 3));
        };
        if (!forEachTriangle(parts_[i], putTriangle)) return buffer.result();
    }
    buffer.flush();
    return buffer.result();
}

}  // namespace vcp::scan
