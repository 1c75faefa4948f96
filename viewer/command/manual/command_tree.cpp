#include "viewer/command/manual/command_tree.h"

#include <algorithm>

namespace vcp {

namespace {

/// Returns the words of "MODE:{lit,clay}", where there are any.
std::vector<std::string> wordsOf(const std::string& type) {
    const size_t open = type.find('{'), close = type.find('}');
    if (open == std::string::npos || close == std::string::npos || close < open) return {};
    return CLI::detail::split(type.substr(open + 1, close - open - 1), ',');
}

ValueKind kindOf(const std::string& value) {
    const auto names = [&](const char* part) { return value.find(part) != std::string::npos; };
    if (names("DIR")) return ValueKind::Folder;
    if (names("FILE") || names("OUT") || names("PREFIX")) return ValueKind::File;
    return ValueKind::Text;
}

OptionEntry entryOf(const CLI::Option& option) {
    OptionEntry entry;
    for (const std::string& name : option.get_snames()) entry.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) entry.names.push_back("--" + name);
    entry.description = option.get_description();
    entry.isRequired = option.get_required();
    entry.mayRepeat = option.get_expected_max() >= CLI::detail::expected_max_vector_size;
    if (option.get_type_size() == 0) return entry;
    const std::string type = option.get_type_name();
    entry.value = type.substr(0, type.find(':'));
    entry.words = wordsOf(type);
    entry.kind = kindOf(entry.value);
    entry.usual = option.get_default_str();
    return entry;
}

OptionEntry argumentOf(const CLI::Option& option) {
    OptionEntry entry = entryOf(option);
    entry.value = option.get_name(true, false);
    entry.kind = entry.value == "CMD" ? ValueKind::Command : ValueKind::File;
    return entry;
}

CommandEntry entryOf(const CLI::App& app, const std::string& parent) {
    CommandEntry entry;
    entry.name = app.get_name();
    entry.path = parent.empty() ? entry.name : parent + " " + entry.name;
    entry.description = app.get_description();
    entry.footer = app.get_footer();
    for (const CLI::Option* option : app.get_options())
        if (option->get_positional() && !option->get_group().empty()) entry.arguments.push_back(argumentOf(*option));
    for (const std::string& group : groupsOf(app)) {
        if (group.empty()) continue;
        OptionGroup made{group, {}};
        for (const CLI::Option* option : app.get_options())
            if (option->nonpositional() && option->get_group() == group) made.options.push_back(entryOf(*option));
        if (!made.options.empty()) entry.groups.push_back(std::move(made));
    }
    for (const CLI::App* command : app.get_subcommands({}))
        if (!command->get_group().empty()) entry.commands.push_back(entryOf(*command, entry.path));
    return entry;
}

}  // namespace

std::vector<std::string> groupsOf(const CLI::App& app) {
    std::vector<std::string> groups = app.get_groups();
    if (const CLI::Option* help = app.get_help_ptr())
        std::ranges::stable_partition(groups, [&](const std::string& group) { return group != help->get_group(); });
    return groups;
}

CommandEntry commandTree(const CLI::App& app) { return entryOf(app, ""); }

std::vector<const CommandEntry*> allCommands(const CommandEntry& root) {
    std::vector<const CommandEntry*> all{&root};
    for (const CommandEntry& command : root.commands) {
        const auto below = allCommands(command);
        all.insert(all.end(), below.begin(), below.end());
    }
    return all;
}

std::string firstClause(const std::string& description) {
    size_t end = description.size();
    for (const char* mark : {": ", "; ", " [", ". ", "\n"}) end = std::min(end, description.find(mark));
    return description.substr(0, end);
}

}  // namespace vcp
