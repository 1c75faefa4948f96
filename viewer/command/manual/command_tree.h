// The command line as data. Manual pages and the completions of shells are made of it alone, so that they say what
// `--help` says.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace vcp {

/// What is typed for an option's value, or for an argument.
enum class ValueKind { None, Text, File, Folder, Command };

struct OptionEntry {
    std::vector<std::string> names;  ///< "-o", "--output"; none for an argument
    std::string value;               ///< "OUT.png"; of an argument its name
    std::string usual;               ///< the value where none is given; may be empty
    std::string description;
    ValueKind kind = ValueKind::None;
    std::vector<std::string> words;  ///< the values there are, where they can be counted
    bool isRequired = false;
    bool mayRepeat = false;
};

struct OptionGroup {
    std::string name;
    std::vector<OptionEntry> options;
};

struct CommandEntry {
    std::string path;  ///< "vcp meso build"
    std::string name;  ///< "build"
    std::string description;
    std::string footer;
    std::vector<OptionEntry> arguments;
    std::vector<OptionGroup> groups;
    std::vector<CommandEntry> commands;
};

/// Returns the groups of a command's options as they are read: in the order of their first options, that of help last.
std::vector<std::string> groupsOf(const CLI::App& app);

/// Reads the tree of a command line; hidden options and commands are left out.
CommandEntry commandTree(const CLI::App& app);

/// Returns the command and all below it, parents first.
std::vector<const CommandEntry*> allCommands(const CommandEntry& root);

/// Returns the beginning of a description: what fits beside a name in a list.
std::string firstClause(const std::string& description);

}  // namespace vcp
