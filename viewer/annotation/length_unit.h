// Units of length: what one unit of the world is, and lengths as text.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace vcp {

/// What one unit of the world is.
struct LengthUnit {
    std::string_view name;
    double millimetres = 0;
    int dxf = 0;  ///< $INSUNITS

    bool operator==(const LengthUnit&) const = default;
};

/// Returns the unit "um", "mm", "cm", "m", "km", "in" or "ft", or none; "µm" is "um", too.
std::optional<LengthUnit> unitNamed(std::string_view name);

/// How a length is written: its number is multiplied with `factor`, and the unit's name follows.
struct WrittenUnit {
    double factor = 1;
    std::string_view name;  ///< empty: the unit is not known
};
/// Returns the unit that a length is written in: the world's own; but where its number would be 10000 or more, or less
/// than 0.01, and the unit is metric, µm, mm, m or km.
WrittenUnit writtenUnit(double length, const std::optional<LengthUnit>& unit);

/// Returns up to 4 significant digits and the unit, where it is known: "0.01234", "25 mm", "1.2 m".
std::string lengthText(double length, const std::optional<LengthUnit>& unit);

}  // namespace vcp
