// URIs in glTF files: data inside of the URI itself, and names of files beside the file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace vcp {

inline bool isDataUri(std::string_view uri) { return uri.starts_with("data:"); }

/// Decodes the data of "data:...;base64,...". Returns nothing when they are not base64.
std::optional<std::string> decodeDataUri(std::string_view uri);

/// Returns the file that a relative URI names (RFC 3986, percent-encoded UTF-8), below `folder`. Returns nothing when
/// it names a scheme, a root, a drive or a parent folder: nothing outside the folder is opened, unless `allowOutside`
/// says that a root and parent folders do.
std::optional<std::filesystem::path> fileBelow(const std::filesystem::path& folder, std::string_view uri,
                                               bool allowOutside = false);

/// Does the same for a name that is not encoded, with either slash (MTL).
std::optional<std::filesystem::path> nameBelow(const std::filesystem::path& folder, std::string name,
                                               bool allowOutside = false);

}  // namespace vcp
