// The header of a PLY file (Turk 1994, "The PLY Polygon File Format"): elements, each with a count and
// properties that are scalars or lists. Both spellings of every type are known (char and int8, ...).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "builder/stream/byte_source.h"

namespace vcp {

enum class PlyType : uint8_t { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float32, Float64 };
enum class PlyEncoding : uint8_t { Ascii, LittleEndian, BigEndian };

constexpr size_t byteSize(PlyType type) {
    constexpr size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return kSizes[size_t(type)];
}

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::Float32;   ///< type of the scalar, or of the list's items
    std::optional<PlyType> countType;  ///< type of the list's length; absent for a scalar
    [[nodiscard]] bool isList() const { return countType.has_value(); }
};

struct PlyElement {
    std::string name;
    uint64_t count = 0;
    uint64_t headerByte = 0;  ///< where the header declares it
    std::vector<PlyProperty> properties;

    [[nodiscard]] bool hasLists() const;
    /// Returns the bytes of a binary row's scalars: the whole row when there are no lists.
    [[nodiscard]] uint64_t scalarBytes() const;
    /// Returns the fewest bytes that a row can take: empty lists, one digit a value.
    [[nodiscard]] uint64_t leastBytes(PlyEncoding encoding) const;
    [[nodiscard]] const PlyProperty* find(std::string_view property) const;
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::Ascii;
    std::vector<PlyElement> elements;  ///< in the order of the file

    [[nodiscard]] const PlyElement* find(std::string_view element) const;
};

/// Reads the header and leaves the source at the first byte of the body. Lines may end with LF, CRLF or CR.
/// Errors: InvalidInput (a line that is wrong, by number and byte), Limit (more than 1 MiB), Io.
Result<PlyHeader> readPlyHeader(ByteSource& source);

}  // namespace vcp
