// Rows of JSON as CSV.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace vcp {

inline std::string csvCell(const nlohmann::ordered_json& value) {
    if (value.is_null()) return "";
    if (!value.is_string()) return value.dump();
    std::string text = "\"";
    for (const char c : value.get<std::string>()) text += c == '"' ? std::string("\"\"") : std::string(1, c);
    return text + "\"";
}

/// Makes a column for each field, in the order of the first row; all rows have the same fields.
inline std::string csvOf(const nlohmann::ordered_json& rows) {
    std::string text;
    if (rows.empty()) return text;
    const auto line = [&](const nlohmann::ordered_json& row, bool names) {
        for (const auto& [name, value] : row.items()) text += (names ? name : csvCell(value)) + ',';
        text.back() = '\n';
    };
    line(rows.front(), true);
    for (const auto& row : rows) line(row, false);
    return text;
}

}  // namespace vcp
