#include "viewer/command/manual/completions.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace vcp {

namespace {

/// Calls `each` for every option of a command.
template <class Each>
void forOptions(const CommandEntry& command, Each each) {
    for (const OptionGroup& group : command.groups)
        for (const OptionEntry& option : group.options) each(option);
}

std::string namesOf(const std::vector<CommandEntry>& commands) {
    std::string names;
    for (const CommandEntry& command : commands) names += (names.empty() ? "" : " ") + command.name;
    return names;
}

bool takesFiles(const CommandEntry& command) {
    return std::any_of(command.arguments.begin(), command.arguments.end(),
                       [](const OptionEntry& argument) { return argument.kind == ValueKind::File; });
}

/// Returns the commands below the root where the command takes the name of one.
std::string wordsAfter(const CommandEntry& root, const CommandEntry& command) {
    const bool takesCommand = !command.arguments.empty() && command.arguments.front().kind == ValueKind::Command;
    return namesOf(takesCommand ? root.commands : command.commands);
}

/// Quotes for all three shells: no description has an apostrophe of its own afterwards.
std::string quoted(std::string text) {
    size_t at = 0;
    while ((at = text.find('\'', at)) != std::string::npos) {
        text.replace(at, 1, "’");
        ++at;
    }
    return "'" + text + "'";
}

// ---- bash ----

constexpr const char* kBashBegin = R"(# bash completion for vcp, made by `vcp completions bash`.
_vcp() {
    local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} path=vcp words= files= i
    # The words are parted at "=".
    if [[ $current == = ]]; then
        current=
    elif [[ $before == = && $COMP_CWORD -gt 1 ]]; then
        before=${COMP_WORDS[COMP_CWORD - 2]}
    fi
    for ((i = 1; i < COMP_CWORD; ++i)); do
        case "$path ${COMP_WORDS[i]}" in
)";
constexpr const char* kBashAnswer = R"(    esac
    mapfile -t COMPREPLY < <(
        [[ -z $words ]] || compgen -W "$words" -- "$current"
        [[ -z $files ]] || compgen "$files" -- "$current"
    )
}
complete -o filenames -F _vcp vcp
)";

/// Returns the case of an option's value.
std::string bashValue(const CommandEntry& command, const OptionEntry& option) {
    std::string pattern;
    for (const std::string& name : option.names)
        pattern += fmt::format("{}\"{} {}\"", pattern.empty() ? "" : " | ", command.path, name);
    std::string answer;
    if (!option.words.empty()) answer = fmt::format("words=\"{}\" ", fmt::join(option.words, " "));
    if (option.kind == ValueKind::File) answer += "files=-f ";
    if (option.kind == ValueKind::Folder) answer += "files=-d ";
    return fmt::format("        {}) {};;\n", pattern, answer.empty() ? "" : answer);
}

/// Returns what may follow a command: its options, commands and files.
std::string bashCommand(const CommandEntry& root, const CommandEntry& command) {
    std::string options;
    forOptions(command,
               [&](const OptionEntry& option) { options += fmt::format(" {}", fmt::join(option.names, " ")); });
    const std::string after = wordsAfter(root, command);
    std::string text = fmt::format("        \"{}\")\n            if [[ $current == -* ]]; then\n", command.path);
    text += fmt::format("                words=\"{}\"\n", options.empty() ? "" : options.substr(1));
    text += "            else\n";
    text += after.empty() && !takesFiles(command) ? "                :\n" : "";
    text += after.empty() ? "" : fmt::format("                words=\"{}\"\n", after);
    text += takesFiles(command) ? "                files=-f\n" : "";
    return text + "            fi\n            ;;\n";
}

std::string bashScript(const CommandEntry& root) {
    const auto commands = allCommands(root);
    std::string paths, values, ends;
    for (const CommandEntry* command : commands) {
        if (command != &root) paths += fmt::format("{}\"{}\"", paths.empty() ? "" : " | ", command->path);
        forOptions(*command, [&](const OptionEntry& option) {
            if (option.kind != ValueKind::None) values += bashValue(*command, option);
        });
        ends += bashCommand(root, *command);
    }
    return kBashBegin + fmt::format("            {}) path+=\" ${{COMP_WORDS[i]}}\" ;;\n", paths) +
           "        esac\n    done\n    case \"$path $before\" in\n" + values + "        *)\n    case $path in\n" +
           ends + "    esac\n    ;;\n" + kBashAnswer;
}

// ---- zsh ----

/// Returns text within an argument of _arguments, where colons and brackets have a meaning.
std::string zshText(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == ':' || c == '[' || c == ']' || c == '\\') out += '\\';
        out += c;
    }
    return out;
}

std::string zshValue(const OptionEntry& option) {
    if (option.kind == ValueKind::None) return {};
    std::string action = option.kind == ValueKind::File     ? "_files"
                         : option.kind == ValueKind::Folder ? "_files -/"
                                                            : "";
    if (!option.words.empty()) action = fmt::format("({})", fmt::join(option.words, " "));
    return fmt::format(":{}:{}",
                       zshText(option.value.empty() || option.value.starts_with('[') ? "value" : option.value), action);
}

std::string zshFunctionName(const CommandEntry& command) {
    std::string name = "_" + command.path;
    std::replace(name.begin(), name.end(), ' ', '_');
    return name;
}

std::string zshOptions(const CommandEntry& command) {
    std::string text;
    forOptions(command, [&](const OptionEntry& option) {
        for (const std::string& name : option.names) {
            const std::string others = option.mayRepeat ? "*" : fmt::format("({})", fmt::join(option.names, " "));
            const std::string end = option.kind == ValueKind::None ? "" : name.starts_with("--") ? "=" : "+";
            text += fmt::format(" \\\n        {}",
                                quoted(fmt::format("{}{}{}[{}]{}", others, name, end,
                                                   zshText(firstClause(option.description)), zshValue(option))));
        }
    });
    return text;
}

/// Returns the function of a command: its options and files, or the commands below it.
std::string zshFunction(const CommandEntry& root, const CommandEntry& command) {
    std::string text = zshFunctionName(command) + "() {\n";
    const std::string after = wordsAfter(root, command);
    if (command.commands.empty()) {
        const std::string rest = after.empty() ? quoted("*:file:_files") : quoted("*:command:(" + after + ")");
        const bool takesMore = !after.empty() || takesFiles(command);
        return text + "    _arguments -S" + zshOptions(command) + (takesMore ? " \\\n        " + rest : "") + "\n}\n";
    }
    text += "    local -a commands=(\n";
    for (const CommandEntry& each : command.commands)
        text += "        " + quoted(each.name + ":" + zshText(firstClause(each.description))) + "\n";
    text += "    )\n    if (( CURRENT == 2 )); then\n        if [[ $PREFIX == -* ]]; then _arguments" +
            zshOptions(command) + "; else _describe command commands; fi\n        return\n    fi\n";
    text += "    local command=$words[2]\n    shift words\n    (( --CURRENT ))\n    case $command in\n";
    for (const CommandEntry& each : command.commands)
        text += fmt::format("        {}) {} ;;\n", each.name, zshFunctionName(each));
    return text + "    esac\n}\n";
}

std::string zshScript(const CommandEntry& root) {
    std::string text = "#compdef vcp\n# zsh completion for vcp, made by `vcp completions zsh`.\n";
    for (const CommandEntry* command : allCommands(root)) text += zshFunction(root, *command);
    return text + zshFunctionName(root) + " \"$@\"\n";
}

// ---- fish ----

constexpr const char* kFishBegin = R"(# fish completion for vcp, made by `vcp completions fish`.
function __vcp_is_at --description 'Whether what was typed so far ends in this command of vcp'
    set -l path vcp
    for word in (commandline -opc)[2..]
        contains -- "$path $word" $__vcp_commands; and set path "$path $word"
    end
    test "$path" = "$argv"
end
)";

std::string fishOption(const std::string& where, const OptionEntry& option) {
    std::string text = where;
    for (const std::string& name : option.names)
        text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    if (!option.words.empty())
        text += fmt::format(" -x -a '{}'", fmt::join(option.words, " "));
    else if (option.kind == ValueKind::File)
        text += " -r -F";
    else if (option.kind == ValueKind::Folder)
        text += " -x -a '(__fish_complete_directories)'";
    else if (option.kind != ValueKind::None)
        text += " -x";
    return text + " -d " + quoted(firstClause(option.description)) + "\n";
}

std::string fishScript(const CommandEntry& root) {
    const auto commands = allCommands(root);
    std::string text = kFishBegin + std::string("set -g __vcp_commands");
    for (const CommandEntry* command : commands) text += " '" + command->path + "'";
    text += "\ncomplete -c vcp -f\n";
    for (const CommandEntry* command : commands) {
        const std::string where = fmt::format("complete -c vcp -n '__vcp_is_at {}'", command->path);
        for (const CommandEntry& each : command->commands)
            text += fmt::format("{} -a {} -d {}\n", where, each.name, quoted(firstClause(each.description)));
        if (command->commands.empty() && !wordsAfter(root, *command).empty())
            text += fmt::format("{} -a '{}'\n", where, wordsAfter(root, *command));
        if (takesFiles(*command)) text += where + " -F\n";
        forOptions(*command, [&](const OptionEntry& option) { text += fishOption(where, option); });
    }
    return text;
}

}  // namespace

std::string completions(const CommandEntry& root, const std::string& shell) {
    if (shell == "zsh") return zshScript(root);
    return shell == "fish" ? fishScript(root) : bashScript(root);
}

}  // namespace vcp
