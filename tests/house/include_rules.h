// The arrows between the folders, as a table and a check.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace vcp::house {

/// What breaks the rules in a source file of `folder`: one line each, "line 3: why". `text` is C++ or GLSL.
std::vector<std::string> includeViolations(std::string_view folder, std::string_view text);

/// What breaks the rules in a CMake file.
std::vector<std::string> cmakeViolations(std::string_view text);

/// The folders that the rules know, in reading order.
std::vector<std::string> folders();

/// Files under `folder` that compile: headers, C++ and GLSL; sorted.
std::vector<std::filesystem::path> sourceFiles(const std::filesystem::path& folder);

std::string readText(const std::filesystem::path& file);

}  // namespace vcp::house
