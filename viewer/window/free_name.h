// Names for what the window writes into its working folder: each with the first number that is free.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace vcp {

inline constexpr int kMostExports = 10000;

/// Returns the first number from 1 on that is free; where there are too many, the last.
template <class IsTaken>
int freeNumber(IsTaken isTaken) {
    int number = 1;
    while (number < kMostExports && isTaken(number)) ++number;
    return number;
}

inline bool isThere(const std::filesystem::path& path) {
    std::error_code failed;
    return std::filesystem::exists(path, failed);
}

inline std::string workingFolder() {
    std::error_code failed;
    return std::filesystem::current_path(failed).string();
}

}  // namespace vcp
