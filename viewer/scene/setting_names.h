// Messages of the rooms below name a setting by what it is, "the memory cap". Who shows one to a person adds how that
// person sets it: the command line its option, the widget its field.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace vcp {

struct SettingName {
    std::string_view thing;  ///< words of messages: "memory cap"
    std::string_view where;  ///< how it is set: "--memory"
};

/// Adds "(WHERE)" behind the first of each thing in `message`.
std::string withSettingNames(std::string message, std::span<const SettingName> names);

}  // namespace vcp
