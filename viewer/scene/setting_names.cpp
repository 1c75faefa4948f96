#include "viewer/scene/setting_names.h"

#include <fmt/format.h>

namespace vcp {

std::string withSettingNames(std::string message, std::span<const SettingName> names) {
    for (const SettingName& name : names)
        if (const size_t at = message.find(name.thing); at != std::string::npos)
            message.insert(at + name.thing.size(), fmt::format(" ({})", name.where));
    return message;
}

}  // namespace vcp
