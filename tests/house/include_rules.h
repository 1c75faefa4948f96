// The arrows between the rooms (rooms.h), checked in sources and in CMake lists.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace vcp::house {

/// What breaks the rules in a source file of the room `room`: one line each, "line 3: why". `text` is C++ or GLSL.
std::vector<std::string> includeViolations(std::string_view room, std::string_view text);

/// What breaks the rules in a CMake file.
std::vector<std::string> cmakeViolations(std::string_view text);

/// A call of vcp_room() in a room's CMake file.
struct RoomTarget {
    std::string name;     ///< vcp_builder_mesh
    std::string library;  ///< that its objects go into; empty: it is one itself
    std::vector<std::string> links;
};
std::vector<RoomTarget> roomTargets(std::string_view cmakeText);

/// Links of the target of `room` that no arrow of its allows. `roomsOf`: the rooms that a target or library of ours
/// stands for, by its name.
std::vector<std::string> linkViolations(std::string_view room, const RoomTarget& target,
                                        const std::map<std::string, std::vector<std::string>>& roomsOf);

/// Files under `folder` that compile: headers, C++ and GLSL; sorted.
std::vector<std::filesystem::path> sourceFiles(const std::filesystem::path& folder);

std::string readText(const std::filesystem::path& file);

}  // namespace vcp::house
