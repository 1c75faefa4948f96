// The rooms of the house, and which may include which: the one table.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace vcp::house {

struct Room {
    std::string path;  ///< a folder; those inside it that are no rooms of their own belong to it
    /// Rooms above it in the table. "builder/" with its slash is all rooms of that folder.
    std::vector<std::string> mayInclude;
};

/// In reading order: arrows run upward in this table only, so there is no circle.
const std::vector<Room>& rooms();

/// The room that a file or folder is in; null where it is in none. A header on a different path, like <vector>, is in
/// none.
const Room* roomOf(std::string_view path);

/// Whether a file of `room` may include one of `other`.
bool mayInclude(const Room& room, const Room& other);

}  // namespace vcp::house
