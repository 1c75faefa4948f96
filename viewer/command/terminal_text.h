// Text on its way to a terminal. Names of files, keys of scenes and words of meshes are anyone's: shown as they are,
// they could move the cursor, rename the window or turn what stands beside them around.
#pragma once

#include <string>
#include <string_view>

namespace vcp {

/// The text with each character that is not simply shown spelled out by its bytes, as "\x1b": control characters (C0,
/// DEL and C1), those that turn the direction of writing or break lines, and bytes that are not UTF-8. Valid UTF-8, and
/// the same when escaped again.
std::string terminalText(std::string_view text);

/// The same, but line breaks stay.
std::string terminalLines(std::string_view text);

/// JSON whose strings hold such characters, as another that means the same: "\u001b". Precondition: valid JSON in
/// UTF-8.
std::string terminalJson(std::string_view json);

}  // namespace vcp
