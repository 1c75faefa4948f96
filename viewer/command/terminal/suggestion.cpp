#include "viewer/command/terminal/suggestion.h"

#include <algorithm>
#include <array>

namespace vcp {

size_t editDistance(std::string_view a, std::string_view b) {
    // Rows of the table for the last two letters of `a`, and for this one.
    std::array<std::vector<size_t>, 3> rows;
    for (auto& row : rows) row.resize(b.size() + 1);
    for (size_t k = 0; k <= b.size(); ++k) rows[0][k] = k;
    for (size_t i = 1; i <= a.size(); ++i) {
        std::vector<size_t>& row = rows[i % 3];
        const std::vector<size_t>&above = rows[(i + 2) % 3], &before = rows[(i + 1) % 3];
        row[0] = i;
        for (size_t k = 1; k <= b.size(); ++k) {
            row[k] = std::min({above[k] + 1, row[k - 1] + 1, above[k - 1] + (a[i - 1] != b[k - 1])});
            if (i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1])
                row[k] = std::min(row[k], before[k - 2] + 1);
        }
    }
    return rows[a.size() % 3][b.size()];
}

std::optional<std::string> nearestName(std::string_view typed, const std::vector<std::string>& names) {
    const size_t most = std::max<size_t>(1, typed.size() / 3);
    std::optional<std::string> nearest;
    size_t least = most + 1;
    for (const std::string& name : names) {
        const size_t distance = editDistance(typed, name);
        if (distance >= least) continue;
        least = distance;
        nearest = name;
    }
    return nearest;
}

}  // namespace vcp
