// Makes text safe for a terminal. Names of files, keys of scenes and words of meshes can be anything: shown as they
// are, they could move the cursor, rename the window or reverse the text beside them.
#pragma once

#include <string>
#include <string_view>

namespace vcp {

/// Returns the text with each character that cannot simply be shown spelled out by its bytes, as "\x1b": control
/// characters (C0, DEL and C1), those that turn the direction of writing or break lines, and bytes that are not UTF-8.
/// The result is valid UTF-8, and escaping it again changes nothing.
std::string terminalText(std::string_view text);

/// Does the same, but keeps line breaks.
std::string terminalLines(std::string_view text);

/// Returns JSON that means the same, with such characters in its strings written as "\u001b". Precondition: valid JSON
/// in UTF-8.
std::string terminalJson(std::string_view json);

}  // namespace vcp
