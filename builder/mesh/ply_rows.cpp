#include "builder/mesh/ply_rows.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "builder/stream/number_text.h"

namespace vcp {

bool PolygonCutter::add(std::optional<int64_t> number, std::vector<std::array<uint64_t, 3>>& triangles) {
    constexpr int64_t kAllOnes = 0xFFFFFFFF;
    if (!number) return false;
    const bool valid = *number >= 0 && uint64_t(*number) < vertexCount_;
    if (!valid && role_ == PlyRole::Strips && (*number == -1 || *number == kAllOnes)) {
        seen_ = 0;
        return true;
    }
    if (!valid) return false;

    const auto vertex = uint64_t(*number);
    const uint64_t before = seen_++;
    if (before == 0) {
        first_ = vertex;
    } else if (role_ == PlyRole::Faces) {
        if (before > 1) triangles.push_back({first_, last_, vertex});
    } else {
        const bool distinct = first_ != last_ && last_ != vertex && vertex != first_;
        if (before > 1 && distinct) {
            if (before % 2 == 0)
                triangles.push_back({first_, last_, vertex});
            else
                triangles.push_back({last_, first_, vertex});
        }
        if (before > 1) first_ = last_;
    }
    last_ = vertex;
    return true;
}

std::optional<int64_t> wholeNumber(double value) {
    constexpr double kExact = 9007199254740992.0;  // 2^53
    if (!(std::abs(value) <= kExact) || value != std::floor(value)) return std::nullopt;
    return int64_t(value);
}

uint8_t colourChannel(PlyType type, double value) {
    if (std::isnan(value)) return 0;
    if (type == PlyType::Float32 || type == PlyType::Float64) value = std::clamp(value, 0.0, 1.0) * 255.0 + 0.5;
    if (type == PlyType::Uint16) value /= 256.0;
    return uint8_t(std::clamp(value, 0.0, 255.0));
}

Error PlyRows::wrong(std::optional<uint64_t> byte, std::string message) const {
    const std::string& name = plan_.element->name;
    std::string row = plan_.role == PlyRole::Skip ? "element " + shown(name) : name;
    return source_.error(ErrorCode::InvalidInput, fmt::format("{} {}", row, row_), byte, std::move(message));
}

Error PlyRows::truncated() const {
    return wrong(source_.size(), fmt::format("the file ends before this row is complete; the header declares {} "
                                             "rows: the file is truncated or the count is wrong",
                                             plan_.element->count));
}

Error PlyRows::notFinite(uint64_t byte) const { return wrong(byte, "the position is not finite (NaN or infinite)"); }

Error PlyRows::badIndex(std::optional<int64_t> index, uint64_t byte) const {
    if (!index) return wrong(byte, "a vertex number is not a whole number");
    return wrong(byte, fmt::format("vertex number {} is out of range; the mesh has {} vertices, numbered from 0",
                                   *index, plan_.vertexCount));
}

Error PlyRows::badLength(std::optional<int64_t> length, uint64_t byte) const {
    if (!length || *length < 0) return wrong(byte, "the length of a list is not a whole number of 0 or more");
    return wrong(byte, fmt::format("a list of {} values does not fit into the rest of the file", *length));
}

}  // namespace vcp
